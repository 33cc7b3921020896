"""Bundler and libmv: what a file means, and every malformation."""

from __future__ import annotations

import struct
from pathlib import Path

import bundle_samples as samples
import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import BundleFile, detect, read_bundle, read_bundler, read_libmv
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry.cameras import Radtan

BUNDLER = samples.bundler_text()
LIBMV = samples.libmv_bytes()
FOLDER = catalogue.find("bal_libmv")
EPS = float(np.finfo(float).eps)


def written(tmp_path: Path, data: str | bytes, name: str = "problem") -> Path:
    path = tmp_path / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


def message(path: Path, caught: pytest.ExceptionInfo[FormatError], line: int | None = None) -> str:
    told = str(caught.value)
    assert told.startswith(f"{path}:{line}: " if line else f"{path}: "), told
    assert "\n" not in told
    return told


# --- Bundler ---------------------------------------------------------------------------------------


def by_pair(file: BundleFile, r: np.ndarray) -> dict[tuple[int, int], list[float]]:
    seen = file.problem.seen
    return {
        (i, j): row for i, j, row in zip(seen.view.tolist(), seen.point.tolist(), r.tolist(), strict=True)
    }


def test_bundlers_problem_has_the_residuals_of_its_formula(tmp_path: Path) -> None:
    file = read_bundler(written(tmp_path, BUNDLER))
    found = by_pair(file, samples.residuals(file))
    assert set(found) == set(samples.PAIRS)
    for pair, noise in zip(samples.PAIRS, samples.NOISE, strict=True):
        # nearest rotation and projection: some tens of roundings of 1e2 pixels
        np.testing.assert_allclose(found[pair], noise * [-1, 1], rtol=0, atol=1e2 * 100 * EPS)
    assert (file.problem.scene.T_cam_world[:, 2, 3] > 0).all()


def test_a_camera_that_bundler_could_not_place_is_left_out_and_named(tmp_path: Path) -> None:
    file = read_bundler(written(tmp_path, BUNDLER))
    assert file.problem.sizes == (3, 5, 11)
    assert file.view_ids.tolist() == [0, 2, 3]
    assert file.notes == ("1 camera without a focal length left out, with 0 sights: 1",)
    assert file.colours is not None
    assert file.colours.tolist() == [list(colour) for colour in samples.COLOURS]
    words = BUNDLER.splitlines()[24].split()  # point 0: three sights of camera, key, u, v
    assert words[5] == "2"
    words[5] = "1"
    also = read_bundler(written(tmp_path, bundler_with(25, " ".join(words))))
    assert also.problem.sizes == (3, 5, 10)
    assert "with 1 sights: 1" in also.notes[0]


def test_names_come_from_the_list_file(tmp_path: Path) -> None:
    names = written(tmp_path, "./a.jpg 0 500\n./b.jpg\n./c.jpg 0 510.5\n./d.jpg\n", "list.txt")
    file = read_bundler(written(tmp_path, BUNDLER), names)
    assert file.view_names == ("./a.jpg", "./c.jpg", "./d.jpg")
    with pytest.raises(FormatError, match=r"list\.txt:2: 2 images; expected 4"):
        read_bundler(written(tmp_path, BUNDLER), written(tmp_path, "a\nb\n", "list.txt"))


ROWS = BUNDLER.splitlines()


def bundler_with(line: int, words: str) -> str:
    return "\n".join([*ROWS[: line - 1], words, *ROWS[line:]]) + "\n"


@pytest.mark.parametrize(
    ("data", "line", "words"),
    [
        ("", None, "the file is empty"),
        ("# Bundle file v0.2\n1 1\n", 1, "expected '# Bundle file v0.3'"),
        ("# Bundle file v0.3", 1, "no counts"),
        ("# Bundle file v0.3\n1\n", 2, "no counts"),
        (bundler_with(2, "0 5"), 2, "0 cameras; expected at least one"),
        (bundler_with(2, "-4 5"), 2, "a count is -4"),
        (bundler_with(2, "4.5 5"), 2, "a count is 4.5"),
        (bundler_with(2, "4 1000000000000"), 2, "need at least"),
        (bundler_with(2, "4 6"), len(ROWS), "the file ends inside point 5 of 6"),
        (bundler_with(2, "4 4"), len(ROWS) - 2, "numbers go on after the last of 4 points"),
        ("\n".join(ROWS[:12]) + "\n", 12, "the file ends after 32 numbers; expected 4 cameras of 15"),
        (BUNDLER + "5\n", len(ROWS) + 1, "numbers go on"),
        (bundler_with(3, "-5 0 0"), 3, "focal length is -5; expected 0 (not placed) or more"),
        (bundler_with(4, "2 0 0"), 4, "R of camera 0 is not a rotation"),
        (bundler_with(4, "nan 0 0"), 4, "'nan' is not a number"),
        (bundler_with(23, "0.1 0.2 1e16"), 23, "a number is 1e+16"),
        (bundler_with(24, "255 0 256"), 24, "colour is 256; expected a whole number from 0 to 255"),
        (bundler_with(24, "255 0.5 0"), 24, "colour is 0.5"),
        (bundler_with(25, "-1 0 10 0.1 0.2"), 25, "point 0 is seen -1 times"),
        (bundler_with(25, "1.5 0 10 0.1 0.2"), 25, "point 0 is seen 1.5 times"),
        (
            bundler_with(25, "1 4 10 0.1 0.2"),
            25,
            "camera of a sight is 4; expected a whole number from 0",
        ),
        (bundler_with(25, "1 0 -1 0.1 0.2"), 25, "key of a sight is -1"),
    ],
)
def test_a_wrong_bundler_file_is_told_in_one_line(
    tmp_path: Path, data: str, line: int | None, words: str
) -> None:
    path = written(tmp_path, data)
    with pytest.raises(FormatError) as caught:
        read_bundler(path)
    assert words in message(path, caught, line)


def test_no_camera_at_all_is_an_error(tmp_path: Path) -> None:
    zero = ["0 0 0"] * 5
    path = written(tmp_path, "\n".join(["# Bundle file v0.3", "1 1", *zero, "1 2 3", "0 0 0", "0"]))
    with pytest.raises(FormatError, match="none of the 1 cameras has a focal length"):
        read_bundler(path)


# --- libmv -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["<", ">"])
def test_libmvs_problem_has_the_residuals_of_its_formula(tmp_path: Path, order: str) -> None:
    """All of k1, k2, k3, p1, p2 count here: p1 and p2 exchanged move a point by up to 0.6 pixels."""
    file = read_libmv(written(tmp_path, samples.libmv_bytes(order)))
    r = samples.residuals(file)
    # numbers of 24 bits: a pixel of 800 is rounded to 3e-5, and so are pose and point before they are
    # magnified by f: 800 * 6e-8 * some
    np.testing.assert_allclose(r, samples.libmv_residuals(), rtol=0, atol=8e-4)
    assert file.problem.sizes == (3, 5, 11)
    assert file.view_ids.tolist() == list(samples.IMAGES)
    assert file.point_ids.tolist() == list(samples.TRACKS)
    assert file.problem.free.intrinsics.shape == (9, 0)
    assert file.problem.lens_of_view.tolist() == [0, 0, 0]
    assert file.notes == ()


def test_tangential_coefficients_exchanged_would_be_seen(tmp_path: Path) -> None:
    file = read_libmv(written(tmp_path, LIBMV))
    wrong = file.problem.scene.intrinsics.copy()
    names = Radtan.names()
    p1, p2 = names.index("p1"), names.index("p2")
    wrong[:, [p1, p2]] = wrong[:, [p2, p1]]
    scene = type(file.problem.scene)(file.problem.scene.T_cam_world, file.problem.scene.X_world, wrong)
    assert np.abs(samples.residuals(file.at(scene)) - samples.libmv_residuals()).max() > 0.1


def test_normalised_markers_are_seen_by_a_camera_of_focal_length_one(tmp_path: Path) -> None:
    file = read_libmv(written(tmp_path, samples.libmv_bytes(space=b"N")))
    assert file.problem.scene.intrinsics.tolist() == [[1.0, 1.0] + 7 * [0.0]]
    np.testing.assert_allclose(samples.residuals(file), samples.libmv_residuals(b"N"), rtol=0, atol=1e-6)
    assert file.notes == ()
    data = samples.libmv_bytes(space=b"N")
    data = data[:2] + struct.pack("<8f", *samples.LIBMV_LENS) + data[34:]
    other = read_libmv(written(tmp_path, data))
    assert other.problem.scene.intrinsics.tolist() == file.problem.scene.intrinsics.tolist()
    assert "markers are normalised" in other.notes[0]


def test_a_file_without_points_or_markers_is_read(tmp_path: Path) -> None:
    file = read_libmv(written(tmp_path, LIBMV[:POINTS_AT] + bytes(8)))
    assert file.problem.sizes == (3, 0, 0)


def test_markers_of_unknown_images_and_tracks_are_left_out_and_counted(tmp_path: Path) -> None:
    at = len(LIBMV) - 16 * len(samples.PAIRS)
    data = bytearray(LIBMV)
    struct.pack_into("<i", data, at, 77)
    struct.pack_into("<i", data, at + 16 + 4, 78)
    file = read_libmv(written(tmp_path, bytes(data)))
    assert file.problem.sizes == (3, 5, 9)
    assert file.notes == ("2 markers of images or tracks that are not in the file were left out",)


@pytest.mark.skipif(FOLDER is None, reason="bal_libmv is not in VSLAM_REF_DATA")
def test_the_real_problem_has_the_stored_cost() -> None:
    assert FOLDER is not None
    file = read_bundle(FOLDER / "problem_01.bin")
    assert file.problem.sizes == (333, 26, 5421)
    r = samples.residuals(file)
    assert samples.cost(r) == pytest.approx(4607.594, abs=1e-3)  # published with three decimals
    assert np.sqrt((r * r).sum() / len(r)) == pytest.approx(1.3038, abs=5e-5)
    assert file.problem.scene.intrinsics[0, 0] == pytest.approx(6313.19, abs=5e-3)


CAMERAS_AT, POINTS_AT = 34, 34 + 4 + 3 * 52
MARKERS_AT = POINTS_AT + 4 + 5 * 16


def libmv_with(at: int, kind: str, value: float) -> bytes:
    data = bytearray(LIBMV)
    struct.pack_into("<" + kind, data, at, value)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "the file is empty"),
        (b"v", "begins with b'v'; expected 'v' or 'V', then 'P' or 'N'"),
        (b"xP" + LIBMV[2:], "begins with b'xP'"),
        (b"vQ" + LIBMV[2:], "begins with b'vQ'"),
        (b"VP" + LIBMV[2:], ""),
        (LIBMV[:30], "the intrinsics need at least 34 bytes; the file has 30"),
        (LIBMV[:36], "the number of cameras need at least 38 bytes"),
        (LIBMV[:-1], f"11 markers (byte {MARKERS_AT}) need at least {len(LIBMV)} bytes"),
        (LIBMV + b"\0", f"1 bytes after the last marker; expected the end of the file at byte {len(LIBMV)}"),
        (libmv_with(CAMERAS_AT, "i", -1), "-1 cameras (byte 34); expected 0 or more"),
        (libmv_with(CAMERAS_AT, "i", 2**31 - 1), "2147483647 cameras (byte 34) need at least"),
        (LIBMV[:CAMERAS_AT] + bytes(4) + LIBMV[POINTS_AT:], "0 cameras; expected at least one"),
        (libmv_with(POINTS_AT, "i", 2**30), "1073741824 points"),
        (libmv_with(MARKERS_AT, "i", -5), "-5 markers"),
        (libmv_with(2, "f", 0.0), "focal length is 0; expected more than 0 pixels"),
        (libmv_with(6, "f", float("nan")), "intrinsics has the number nan"),
        (libmv_with(CAMERAS_AT + 8, "f", float("inf")), "R of camera 0 has the number inf"),
        (libmv_with(CAMERAS_AT + 8, "f", 3.0), "R of camera 0 is not a rotation"),
        (libmv_with(POINTS_AT + 8, "f", 1e20), "X of point 0 has the number 1e+20"),
        (libmv_with(MARKERS_AT + 4 + 8, "f", float("nan")), "uv of marker 0 has the number nan"),
        (libmv_with(CAMERAS_AT + 4 + 52, "i", 7), "camera 1 has image number 7 again"),
        (libmv_with(POINTS_AT + 4 + 16, "i", 12), "point 1 has track number 12 again"),
    ],
)
def test_a_wrong_libmv_file_is_told_in_one_line(tmp_path: Path, data: bytes, words: str) -> None:
    path = written(tmp_path, data)
    with pytest.raises(FormatError) as caught:
        read_libmv(path)
    assert words in message(path, caught)


# --- which format it is ----------------------------------------------------------------------------


def test_the_format_is_told_from_the_content(tmp_path: Path) -> None:
    cases = {"bal": samples.bal_text(), "bundler": BUNDLER, "libmv": LIBMV}
    for format, data in cases.items():
        path = written(tmp_path, data, format)
        assert detect(path) == format
        assert read_bundle(path).format == format
    folder = samples.write_colmap_texts(tmp_path / "model", samples.colmap_texts())
    assert detect(folder) == "colmap"
    assert read_bundle(folder).format == "colmap"


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a", b"", "begins with 'nothing'; expected BAL"),
        ("a", b"\x89PNG\r\n", "begins with"),
        ("a", b"vX", "begins with 'vX'"),
        ("a.bz2", b"BZh91AY&SY", "damaged"),
        ("a.gz", b"1 1 1", "damaged"),
    ],
)
def test_what_is_no_bundle_file_is_told_what_would_be(
    tmp_path: Path, name: str, data: bytes, words: str
) -> None:
    path = written(tmp_path, data, name)
    with pytest.raises(FormatError) as caught:
        read_bundle(path)
    assert words in message(path, caught)


def test_a_name_that_is_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such file or folder"):
        read_bundle(tmp_path / "none")


def test_a_point_seen_twice_is_counted_and_the_first_kept(tmp_path: Path) -> None:
    def told(who: str) -> str:
        return f"1 observation of a point that {who} sees twice left out: the first one is kept"

    # point 4 is the last: it was seen by two cameras, now twice by the first
    file = read_bundler(written(tmp_path, bundler_with(25, "2 0 1 0.1 0.2 0 2 0.3 0.4")))
    assert told("a camera") in file.notes
    assert [0.1, -0.2] in file.problem.seen.uv.tolist()
    assert [0.3, -0.4] not in file.problem.seen.uv.tolist()
    (tmp_path / "twice.bin").write_bytes(libmv_with(MARKERS_AT + 4 + 20, "i", 12))
    libmv = read_libmv(tmp_path / "twice.bin")
    assert libmv.notes == (told("an image"),)
    assert libmv.problem.sizes == (3, 5, 10)
