"""Pictures that are missing, damaged or bare, odd times, and words that cannot be meant."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
import small_world

from vslam_ref.experiments.visual_slam import overlay, running


def pictures(folder: Path, images: list[np.ndarray]) -> Path:
    """Write pictures in the plain layout, with the camera of the small world."""
    (folder / "images").mkdir(parents=True)
    for k, image in enumerate(images):
        cv2.imwrite(str(folder / "images" / f"{k:06d}.png"), image)
    (folder / "calib.txt").write_text(small_world.CALIB)
    return folder


def test_bad_pictures_and_odd_times_cost_no_more_than_themselves(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """After the start: 9 missing, 10 half-written, 11 of another size, 12 blank, 13 black, 14 the same as 8;
    two equal stamps, and one that falls.
    """
    folder = small_world.write(tmp_path / "boards", 18, truth=False)
    images = folder / "images"
    (images / "000009.png").unlink()
    whole = (images / "000010.png").read_bytes()
    (images / "000010.png").write_bytes(whole[: len(whole) // 2])
    cv2.imwrite(str(images / "000011.png"), np.zeros((120, 160), np.uint8))
    for k, grey in ((12, 128), (13, 0)):
        cv2.imwrite(str(images / f"{k:06d}.png"), np.full((240, 320), grey, np.uint8))
    (images / "000014.png").write_bytes((images / "000008.png").read_bytes())
    times = 0.1 * np.arange(18)
    times[5], times[16] = times[4], 1.45
    (folder / "times.txt").write_text("".join(f"{t!r}\n" for t in times.tolist()))
    assert run(folder, "--out", tmp_path / "out", "--json", tmp_path / "n.json") == 0
    n = json.loads((tmp_path / "n.json").read_text())
    assert n["started_at"][1] < 9
    assert (n["frames"], n["unusable"]) == (18, 3)
    assert n["lost"] in (2, 3)  # 12 and 13, and 14 at most
    assert n["tracked"] == 18 - n["unusable"] - n["lost"]
    assert n["ate_rmse"] is n["ate_percent"] is n["ate_live_rmse"] is n["scale_drift"] is None
    rows = np.loadtxt(tmp_path / "out" / "trajectory.txt")
    assert len(rows) == n["tracked"]
    assert (np.diff(rows[:, 0]) >= 0).all()
    assert rows[-1, 0] == pytest.approx(1.7)  # found again
    told = " ".join(n["notes"])
    for words in ("missing: number 9", "damaged: number 10", "wrong size: number 11", "blank: number 12, 13"):
        assert words in told
    assert "equal to the one before" in told
    assert "note: 1 time(s) earlier than the one before" in capsys.readouterr().out


def test_bad_pictures_at_the_beginning_and_wrong_order_do_not_hinder_the_start(
    run: Callable[..., int], tmp_path: Path
) -> None:
    """0 is empty, 1 half-written, 2 black, 3 of another size, 4 blank; 8 comes twice; 14, 15 are swapped."""
    folder = small_world.write(tmp_path / "boards", 20)
    images = folder / "images"
    (images / "000000.png").write_bytes(b"")
    whole = (images / "000001.png").read_bytes()
    (images / "000001.png").write_bytes(whole[: len(whole) // 2])
    for k, shape, grey in ((2, (240, 320), 0), (3, (120, 160), 80), (4, (240, 320), 128)):
        cv2.imwrite(str(images / f"{k:06d}.png"), np.full(shape, grey, np.uint8))
    (images / "000009.png").write_bytes((images / "000008.png").read_bytes())
    swapped = [(images / f"{k:06d}.png").read_bytes() for k in (15, 14)]
    for k, content in zip((14, 15), swapped, strict=True):
        (images / f"{k:06d}.png").write_bytes(content)
    words = ["--video", "none", "--json", tmp_path / "n.json"]
    assert run(folder, "--out", tmp_path / "out", *words) == 0
    n = json.loads((tmp_path / "n.json").read_text())
    assert (n["frames"], n["unusable"], n["lost"]) == (20, 3, 0)
    assert n["started_at"][0] == 5
    assert n["tracked"] == 15
    # the true path has 9 at its own place, and 14 and 15 in order: the steps are 0.04
    assert n["ate_rmse"] < 0.03


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        (np.full((240, 320), 90, np.uint8), "0 corners in a picture: need 80"),
        (small_world.picture(0), "the corners have moved 0.00 px: need 8"),
    ],
    ids=["bare", "still"],
)
def test_no_start_is_told_with_its_reason(
    run: Callable[..., int],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    image: np.ndarray,
    reason: str,
) -> None:
    folder = pictures(tmp_path / "still", [image] * 5)
    assert run(folder, "--out", tmp_path / "out", "--json", tmp_path / "n.json") == 0
    n = json.loads((tmp_path / "n.json").read_text())
    assert n["started_at"] is None
    assert n["tracked"] == n["lost"] == n["keyframes"] == n["points"] == 0
    assert n["no_start"].startswith(reason)
    assert n["fps"] is None
    assert f"note: no start: {reason}" in capsys.readouterr().out
    assert reason in (tmp_path / "out" / "report.html").read_text()
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"result.json", "report.html", "course.png", "stages.png", "overlay.webm"}


@pytest.mark.parametrize(("number", "films"), [(2, 3), (4, 5)], ids=["third", "last"])
def test_an_interrupt_while_the_film_is_drawn_saves_all_but_the_rest_of_it(
    run: Callable[..., int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, films: int
) -> None:
    real = overlay.picture

    def drawn(run: running.Run, frame: running.Frame, *more: object) -> np.ndarray:
        if frame.number == number:
            signal.raise_signal(signal.SIGINT)
        return real(run, frame, *more)

    monkeypatch.setattr(overlay, "picture", drawn)
    folder = pictures(tmp_path / "still", [small_world.picture(0)] * 5)
    assert run(folder, "--out", tmp_path / "out", "--json", tmp_path / "n.json") == 130
    n = json.loads((tmp_path / "n.json").read_text())
    assert (n["frames"], n["interrupted"]) == (5, True)
    assert ("the film was interrupted after 3 of 5 pictures" in n["notes"]) == (films == 3)
    film = cv2.VideoCapture(str(tmp_path / "out" / "overlay.webm"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == films


def test_one_picture_and_none_that_can_be_read(run: Callable[..., int], tmp_path: Path) -> None:
    folder = pictures(tmp_path / "one", [small_world.picture(0)] * 2)
    words = ["--out", tmp_path / "out", "--video", "none", "--json", tmp_path / "n.json"]
    assert run(folder, *words, "--to", 1) == 0
    assert json.loads((tmp_path / "n.json").read_text())["no_start"] == "one picture is no start"
    (folder / "images" / "000001.png").write_bytes(b"")
    assert run(folder, *words, "--from", 1) == 0
    assert json.loads((tmp_path / "n.json").read_text())["no_start"] == "no picture could be looked at"


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["nowhere"], "no folder, video, scene or data set 'nowhere'"),
        (["BARE"], "give --camera FILE"),
        (["FOLDER", "--camera", "LARGE"], "give the camera of this resolution"),
        (["FOLDER", "--camera", "no.yaml"], "no.yaml"),
        (["FOLDER", "--from", "99"], "no picture; it has pictures 0 to 1"),
        (["FOLDER", "--every", "0"], "expected a whole number, 1 or more"),
        (["FOLDER", "--times", "t.txt", "--rate", "3"], "not allowed with"),
        (["FOLDER", "--rate", "0"], "need pictures a second, more than 0"),
        (["FOLDER", "--truth", "no.txt"], "no.txt"),
        (["FOLDER", "--set", "tracker.fine_point=3"], "did you mean 'tracker.fine_points'"),
        (["FOLDER", "--set", "preset=ptam2008"], "unknown preset 'ptam2008' (did you mean 'ptam2007'?)"),
        (["FOLDER", "--set", "camera.most_shift=far"], "expected a finite number"),
        (["FOLDER", "--start", "0"], "'0': expected two numbers of pictures, the first one smaller, as 4,12"),
        (["FOLDER", "--start", "1,0"], "'1,0': expected two numbers of pictures"),
        (["FOLDER", "--start", "1,1"], "'1,1': expected two numbers of pictures"),
        (["FOLDER", "--start", "a,1"], "'a,1': expected two numbers of pictures"),
        (["FOLDER", "--start", "0,7"], "--start 0,7: picture 7 is not in this run; it has 0 to 1"),
        (
            ["FOLDER", "--start", "0,1", "--from", "1"],
            "--start 0,1: picture 0 is not in this run; it has 1 to 1",
        ),
        (["FOLDER", "--refine-camera=yes"], "ignored explicit argument 'yes'"),
        (["FOLDER", "--video", "huge"], "invalid choice: 'huge'"),
        (["FOLDER", "--robot", "1"], "unrecognized arguments"),
        (["FOLDER", "--json", "no/such/folder/n.json"], "does not exist: make it first"),
    ],
)
def test_bad_words_are_one_line_and_leave_nothing(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], what: str
) -> None:
    folder = pictures(tmp_path / "f", [small_world.picture(0)] * 2)
    bare = pictures(tmp_path / "b", [small_world.picture(0)])
    (bare / "calib.txt").unlink()
    (tmp_path / "large.txt").write_text("600 600 400 300 800 600\n")
    places = {"FOLDER": folder, "BARE": bare, "LARGE": tmp_path / "large.txt"}
    assert run(*(places.get(word, word) for word in words), "--out", tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert what in error
    assert error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b", "f", "large.txt"]


def test_other_things_are_not_written_over(
    run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = pictures(tmp_path / "f", [small_world.picture(0)] * 2)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("all of it")
    assert run(folder, "--out", tmp_path / "out") == 2
    assert "holds other things" in capsys.readouterr().err
    assert run(folder) == 2
    assert "--out" in capsys.readouterr().err
