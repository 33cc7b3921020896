"""``vslam-ref render``: film and truth, read back; what is refused; nothing half-written."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref import cli
from vslam_ref.commands import render
from vslam_ref.datasets.sequences import open_sequence
from vslam_ref.worlds.rendered import hall

NAMES = "number,time,x,y,theta,tx,ty,tz,qx,qy,qz,qw"


def test_film_and_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """VP8 loses detail: the film's pictures are those of the source to a few grey levels in the mean."""
    film, truth, numbers = (tmp_path / name for name in ("hall.webm", "hall.csv", "hall.json"))
    arguments = ["render", "hall", "--out", str(film), "--truth", str(truth), "--json", str(numbers)]
    assert cli.main([*arguments, "--frames", "5", "--seed", "3"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["hall.csv", "hall.json", "hall.webm"]
    said, written = capsys.readouterr().out, json.loads(numbers.read_text())
    assert f"film: {film}" in said
    assert (written["frames"], written["seed"], written["camera"]) == (5, 3, "right")
    assert written["landmarks_shown_least"] >= 40

    reader, source = cv2.VideoCapture(str(film)), open_sequence("hall:3")
    for k in range(5):
        there, picture = reader.read()
        assert there
        assert picture.shape == (480, 640, 3)
        assert np.abs(picture[..., 0].astype(float) - source.image(k).grey).mean() < 6
    assert not reader.read()[0]

    assert truth.read_text().splitlines()[0] == NAMES
    rows = np.loadtxt(truth, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(rows[:, 0], np.arange(5))
    np.testing.assert_array_equal(rows[:, 1], np.arange(5) / 30)
    np.testing.assert_array_equal(rows[:, 2:5], hall.vehicle_at(np.arange(5) / 30))
    np.testing.assert_allclose(rows[:, 5:7], rows[:, 2:4], atol=1e-12)
    axes = Rotation.from_quat(rows[:, 8:]).as_matrix()  # x y z w
    np.testing.assert_allclose(axes[:, :, 2], np.tile([0, -1.0, 0], (5, 1)), atol=1e-12)  # looks outwards
    np.testing.assert_allclose(axes[:, :, 1], np.tile([0, 0, -1.0], (5, 1)), atol=1e-12)  # image down


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["desk", "--out", "a.webm"], "invalid choice: 'desk'"),
        (["hall", "--out", "a.avi"], "'a.avi': the name must end in .webm"),
        (["hall", "--out", "a.webm", "--truth", "a.txt"], "'a.txt': the name must end in .csv"),
        (["hall", "--out", "no/a.webm"], "does not exist: make it first"),
        (["hall", "--out", "a.webm", "--frames", "2388"], "2388 pictures of hall: need 1 to 2387"),
        (["hall", "--out", "a.webm", "--frames", "0"], "expected a whole number, 1 or more"),
        (["hall", "--out", "a.webm", "--noise", "-1"], "'-1': expected a number from 0 to 100"),
        (["hall", "--out", "a.webm", "--noise", "nan"], "'nan': expected a number from 0 to 100"),
        (["hall", "--out", "a.webm", "--blur", "0.1"], "'0.1': expected a number from 0 to 0.03333"),
        (["hall", "--out", "a.webm", "--light", "1"], "'1': expected a number from 0 to 0.9"),
        (["hall", "--out", "a.webm", "--passers-by", "100"], "100 passers-by in hall: need 0 to 99"),
        (["hall", "--out", "a.webm", "--covered", "3,2"], "'3,2': expected FROM,TO in seconds"),
        (["hall", "--out", "a.webm", "--covered", "3"], "'3': expected FROM,TO in seconds"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert cli.main(["render", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_an_interrupt_leaves_what_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    film, truth = tmp_path / "hall.webm", tmp_path / "hall.csv"
    film.write_bytes(b"before")

    def interrupted(world: object, add: object) -> list[int]:
        add(np.zeros((480, 640, 3), np.uint8))  # type: ignore[operator]
        raise KeyboardInterrupt

    monkeypatch.setattr(render, "filmed", interrupted)
    assert cli.main(["render", "hall", "--out", str(film), "--truth", str(truth), "--frames", "3"]) == 130
    assert film.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [film]
    assert "no file is half-written" in capsys.readouterr().err
