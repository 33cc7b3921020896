"""``vslam-ref run ptam``: what a run leaves, and that it is right."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import small_world

from vslam_ref import _kernels
from vslam_ref.datasets import trajectories
from vslam_ref.experiments.visual_slam import running
from vslam_ref.metrics.trajectory import evaluate
from vslam_ref.systems.ptam import STAGES

KEYS = {
    *("frames", "started_at", "tracked", "lost", "relocalised", "keyframes", "points", "seconds", "fps"),
    *("ate_rmse", "ate_percent", "ate_live_rmse", "scale_drift", "stage_ms", "backend", "versions", "notes"),
}
FILES = {
    *("result.json", "report.html", "trajectory.txt", "trajectory_live.txt", "keyframes.txt", "map.ply"),
    *("overlay.webm", "map.png", "course.png", "stages.png"),
}


def test_a_run_leaves_every_file_and_number(ran: Any) -> None:
    assert {path.name for path in ran.out.iterdir()} == FILES
    n = ran.numbers
    assert set(n) >= KEYS
    assert n["frames"] == 12
    assert (n["tracked"], n["lost"], n["relocalised"], n["unusable"]) == (12, 0, 0, 0)
    assert n["started_at"][0] == 0
    assert n["backend"] == _kernels.backend()
    assert n["settings"] == {
        "start.trails": {"value": 300, "default": 800},
        "tracker.fine_points": {"value": 300, "default": 1000},
        "mapper.new_points": {"value": 120, "default": 400},
    }
    assert n["no_start"] is None
    assert set(n["picture_ms"]) >= {"tracking", "tracking_and_keyframe"}
    assert set(n["stage_ms"]) >= {"prepare", "start", "coarse", "fine", "pose"}
    assert set(n["stage_ms"]) <= set(STAGES)


def test_the_path_is_the_true_one_up_to_a_similarity(ran: Any) -> None:
    """The path is 0.5 long and the scene 2 to 5 away.  With an error of 0.4 px (the floor of sigma), 260 px
    of focal length and 100 points or more, a position at depth 3 is off by some 3 * 0.4 / 260 / 10 = 0.0005;
    six of it are allowed.
    """
    assert ran.numbers["ate_rmse"] < 0.003
    assert ran.numbers["ate_percent"] == pytest.approx(100 * ran.numbers["ate_rmse"] / length(12), rel=1e-3)
    assert ran.numbers["scale_drift"] == pytest.approx(1.0, abs=0.15)


def length(count: int) -> float:
    path = np.array([small_world.place(k) for k in range(count)])
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def test_the_files_say_what_the_numbers_say(ran: Any) -> None:
    """``vslam-ref evaluate`` on the files gives the same errors: no digit is lost."""
    truth = trajectories.read(ran.source / "groundtruth_tum.txt").trajectory
    for name, key in (("trajectory", "ate_rmse"), ("trajectory_live", "ate_live_rmse")):
        path = trajectories.read(ran.out / f"{name}.txt").trajectory
        assert evaluate(path, truth, "sim3").absolute.stats.rmse == pytest.approx(ran.numbers[key], rel=1e-9)
    whole = trajectories.read(ran.out / "trajectory.txt").trajectory
    np.testing.assert_allclose(whole.times, 0.1 * np.arange(12))
    np.testing.assert_allclose(whole.t_world_body[0], 0.0, atol=1e-12)  # the world is the first camera
    keyframes = trajectories.read(ran.out / "keyframes.txt").trajectory
    assert len(keyframes) == ran.numbers["keyframes"]
    rows = np.searchsorted(whole.times, keyframes.times)
    np.testing.assert_allclose(whole.t_world_body[rows], keyframes.t_world_body, atol=1e-12)


def test_the_map_has_its_points_and_cameras(ran: Any) -> None:
    head = (ran.out / "map.ply").read_bytes().split(b"end_header")[0].decode()
    points, cameras = ran.numbers["points"], ran.numbers["keyframes"]
    assert f"element vertex {points + 5 * cameras}" in head
    assert f"element edge {8 * cameras}" in head


def test_the_film_has_every_picture_and_the_page_shows_it(ran: Any) -> None:
    film = cv2.VideoCapture(str(ran.out / "overlay.webm"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == 12
    assert int(film.get(cv2.CAP_PROP_FRAME_WIDTH)) == 320
    page = (ran.out / "report.html").read_text()
    assert "http" not in page
    assert "<script" not in page
    assert '<video src="overlay.webm" controls' in page
    assert page.count("data:image/png;base64,") == 3
    assert "tracker.fine_points" in page
    assert "cost of a point" in page
    assert "points lie on it" in page


@pytest.mark.skipif(os.name != "posix", reason="the environment of a child is handed over as it is")
def test_another_process_writes_the_same_bytes(ran: Any, tmp_path: Path) -> None:
    words = ["run", "ptam", str(ran.source), "--out", str(tmp_path / "out"), "--video", "none", *ran.words]
    done = subprocess.run([sys.executable, "-m", "vslam_ref", *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for name in ("trajectory.txt", "trajectory_live.txt", "keyframes.txt", "map.ply"):
        assert (tmp_path / "out" / name).read_bytes() == (ran.out / name).read_bytes(), name
    assert not (tmp_path / "out" / "overlay.webm").exists()
    assert "pictures with a pose" in done.stdout
    assert "tracking:" not in done.stderr  # no progress where there is no terminal


def test_the_start_can_be_chosen(ran: Any, run: Callable[..., int], tmp_path: Path) -> None:
    words = ["--video", "none", "--start", "2,9", "--json", tmp_path / "n.json"]
    assert run(ran.source, "--out", tmp_path / "out", *words) == 0
    n = json.loads((tmp_path / "n.json").read_text())
    assert n["started_at"] == [2, 9]
    assert n["tracked"] == 10
    assert n["ate_rmse"] < 0.003


def test_a_chosen_start_that_cannot_be_is_told(
    ran: Any, run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(ran.source, "--out", tmp_path / "out", "--start", "2,3") == 0
    told = "no start: pictures 2 and 3 make no start: the rays of a point differ by"
    assert f"note: {told}" in capsys.readouterr().out
    assert "pictures 2 and 3 make no start" in (tmp_path / "out" / "report.html").read_text()


@pytest.fixture
def in_the_foreground() -> Iterator[None]:
    """Ctrl-C as at a terminal: what a shell starts in the background ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("in_the_foreground")
def test_an_interrupt_saves_the_run_so_far(
    ran: Any,
    run: Callable[..., int],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Ctrl-C while picture 7 is looked at: 8 pictures are there, with the live path of the whole run."""
    real = running._one

    def one(done: running.Run, image: Any) -> running.Frame:
        if image.number == 7:
            signal.raise_signal(signal.SIGINT)
        return real(done, image)

    monkeypatch.setattr(running, "_one", one)
    words = ["--out", tmp_path / "out", "--video", "none"]
    assert run(ran.source, *words) == 130
    said = capsys.readouterr()
    assert "interrupted; saving the run so far" in said.err
    assert "interrupted after 8 of 12 pictures" in said.out
    part = (tmp_path / "out" / "trajectory_live.txt").read_text().splitlines()
    assert part == (ran.out / "trajectory_live.txt").read_text().splitlines()[: len(part)]
    assert len((tmp_path / "out" / "trajectory.txt").read_text().splitlines()) == 1 + 8
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_mapping_beside_tracking_leaves_the_same_kinds_of_things(
    ran: Any, run: Callable[..., int], tmp_path: Path
) -> None:
    assert run(ran.source, "--out", tmp_path / "out", "--concurrent", "--json", tmp_path / "n.json") == 0
    n = json.loads((tmp_path / "n.json").read_text())
    assert {path.name for path in (tmp_path / "out").iterdir()} == FILES
    assert (n["tracked"], n["lost"], n["concurrent"]) == (12, 0, True)
    assert ran.numbers["concurrent"] is False
    assert n["ate_rmse"] < 0.003
    assert not [t for t in threading.enumerate() if t.name == "mapper"]


@pytest.mark.parametrize("interrupts", [1, 2])
def test_an_interrupt_ends_the_mapper_too(
    ran: Any,
    run: Callable[..., int],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    interrupts: int,
) -> None:
    """Once: the run so far is saved.  Twice: nothing is left, and no thread either."""
    real = running._one

    def one(done: running.Run, image: Any) -> running.Frame:
        frame = real(done, image)
        if image.number == 9:
            for _ in range(interrupts):
                signal.raise_signal(signal.SIGINT)
        return frame

    monkeypatch.setattr(running, "_one", one)
    words = ["--out", tmp_path / "out", "--video", "none", "--concurrent"]
    assert run(ran.source, *words) == 130
    assert (tmp_path / "out" / "trajectory.txt").exists() == (interrupts == 1)
    assert [path.name for path in tmp_path.iterdir()] == ["out"] * (interrupts == 1)
    assert not [t for t in threading.enumerate() if t.name == "mapper"]


def test_an_exception_while_pictures_come_ends_the_mapper(
    ran: Any, run: Callable[..., int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = running._one

    def one(done: running.Run, image: Any) -> running.Frame:
        if image.number == 10:
            raise ZeroDivisionError
        return real(done, image)

    monkeypatch.setattr(running, "_one", one)
    with pytest.raises(ZeroDivisionError):
        run(ran.source, "--out", tmp_path / "out", "--video", "none", "--concurrent")
    assert list(tmp_path.iterdir()) == []
    assert not [t for t in threading.enumerate() if t.name == "mapper"]


@pytest.mark.usefixtures("in_the_foreground")
def test_a_second_interrupt_ends_at_once_and_leaves_nothing(
    ran: Any, run: Callable[..., int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def one(done: running.Run, image: Any) -> running.Frame:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        raise AssertionError

    monkeypatch.setattr(running, "_one", one)
    assert run(ran.source, "--out", tmp_path / "out") == 130
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("option", ["--camera", "--truth", "--times"])
def test_what_a_run_reads_is_never_replaced(
    option: str, ran: Any, run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file inside the output folder would be gone after the run."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "result.json").write_text("{}")
    own = out / "own.txt"
    own.write_text("x")
    assert run(ran.source, "--out", out, option, own) == 2
    assert f"{option} {own} lies in --out {out}, which is replaced" in capsys.readouterr().err
    assert own.read_text() == "x"


@pytest.mark.parametrize("word", ["tracker.coarse_points=0", "mapper.tries=-5", "mapper.near=-1"])
def test_settings_that_mean_nothing_are_refused(
    word: str, ran: Any, run: Callable[..., int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(ran.source, "--out", tmp_path / "out", "--set", word) == 2
    assert f"{word}: need" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
