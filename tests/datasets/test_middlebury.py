"""Exact cameras of the Middlebury sets: every number in its place, and a line for every damaged file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import catalogue, middlebury
from vslam_ref.datasets.text import FormatError

FOLDER = catalogue.find("middlebury_temple")
needs_data = pytest.mark.skipif(FOLDER is None, reason="middlebury_temple is not in VSLAM_REF_DATA")

K = "1500 0 300 0 1510 250 0 0 1"
TEXT = f"2\na.png {K} 1 0 0 0 1 0 0 0 1 0.1 0.2 0.3\nb.png {K} 0 -1 0 1 0 0 0 0 1 -1 2 -3\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "toy_par.txt"
    path.write_text(TEXT)
    return path


def test_every_number_is_in_its_place(path: Path) -> None:
    found = middlebury.read_cameras(path)
    assert [p.name for p in found.pictures] == ["a.png", "b.png"]
    assert found.pictures[0].parent == path.parent
    assert found.cameras[0].params.tolist() == [1500.0, 1510.0, 300.0, 250.0]
    X = np.array([0.5, -0.2, 4.0])  # K [R t] X, by hand: R X + t = (-0.8, 2.5, 1)
    uv = found.cameras[1].pixel_from_world(found.T_cam_world[1], X).uv
    np.testing.assert_allclose(uv, [1500 * -0.8 + 300, 1510 * 2.5 + 250], rtol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("2\na", "3\na", 1, "says '3' pictures, 2 lines follow"),
        ("2\na", "two\na", 1, "says 'two' pictures"),
        ("0.1 0.2 0.3", "0.1 0.2", 2, "21 columns; expected 22"),
        ("0.1 0.2 0.3", "0.1 0.2 nan", 2, "t3 is 'nan'; expected a finite number"),
        ("0.1 0.2 0.3", "0.1 0.2 x", 2, "t3 is 'x'; expected a number"),
        ("a.png", "../a.png", 2, "expected a file name without a folder"),
        ("b.png", "a.png", 3, "a.png comes twice"),
        ("1500 0 300", "1500 2 300", 2, "K is not"),
        ("1500 0 300", "-1500 0 300", 2, "focal lengths -1500, 1510; must be more than 0"),
        ("0 -1 0 1 0 0 0 0 1", "0 1 0 1 0 0 0 0 1", 3, "R is not a rotation: .*determinant -1"),
        ("0 -1 0 1 0 0 0 0 1", "0 -2 0 1 0 0 0 0 1", 3, "R is not a rotation: R R.T is off by 3"),
        ("0 -1 0 1 0 0 0 0 1", "0 -1e300 0 1 0 0 0 0 1e300", 3, "R is not a rotation"),
    ],
)
def test_a_damaged_file_is_told_with_its_line(path: Path, old: str, new: str, line: int, words: str) -> None:
    assert old in TEXT
    path.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(FormatError, match=words) as told:
        middlebury.read_cameras(path)
    assert told.value.line == line
    assert str(told.value).startswith(f"{path}:{line}: ")
    assert "\n" not in str(told.value)


def test_files_that_are_none(path: Path) -> None:
    with pytest.raises(FormatError, match="no such file"):
        middlebury.read_cameras(path.with_name("other.txt"))
    path.write_text("")
    with pytest.raises(FormatError, match="empty"):
        middlebury.read_cameras(path)
    path.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(FormatError, match="not a text file"):
        middlebury.read_cameras(path)
    path.write_text("0\n")
    assert middlebury.read_cameras(path).T_cam_world.shape == (0, 4, 4)


def test_hundreds_of_mutations_give_an_answer_or_one_line(path: Path) -> None:
    rng = np.random.default_rng(0)
    data = TEXT.encode()
    lines = 0
    for _ in range(300):
        bad = bytearray(data)
        for _ in range(rng.integers(1, 4)):
            at = int(rng.integers(len(bad)))
            bad[at : at + int(rng.integers(0, 3))] = bytes(
                rng.integers(0, 256, int(rng.integers(0, 3)), dtype=np.uint8)
            )
        path.write_bytes(bytes(bad))
        try:
            middlebury.read_cameras(path)
        except FormatError as told:
            lines = str(told).count("\n")
        assert lines == 0


@needs_data
def test_the_temples_cameras_stand_on_a_ring() -> None:
    assert FOLDER is not None
    found = middlebury.read_cameras(FOLDER / "templeSR_par.txt")
    assert len(found.pictures) == 16
    assert all(p.is_file() for p in found.pictures)
    assert found.cameras[0].params.tolist() == [1520.4, 1525.9, 302.32, 246.87]
    R, t = found.T_cam_world[:, :3, :3], found.T_cam_world[:, :3, 3]
    centres = -np.einsum("nji,nj->ni", R, t)
    # the data's note bounds the temple; every camera has its middle in the picture, at arm's length
    middle = (np.array([-0.073568, 0.021728, -0.012445]) + [0.028855, 0.181892, 0.062736]) / 2
    assert np.ptp(np.linalg.norm(centres - middle, axis=1)) < 0.1
    for camera, T in zip(found.cameras, found.T_cam_world, strict=True):
        seen = camera.pixel_from_world(T, middle)
        assert seen.valid
        assert (np.abs(seen.uv - [320, 240]) < [60, 60]).all()
