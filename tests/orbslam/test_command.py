"""``vslam-ref run orbslam``: its numbers and files, and a scene that allows no start."""

from __future__ import annotations

import json
from argparse import Namespace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("cv2", reason="pictures and films need OpenCV")

import cv2

from vslam_ref import cli
from vslam_ref.commands import run_visual
from vslam_ref.datasets import trajectories
from vslam_ref.datasets.vocabulary_files import write_text
from vslam_ref.experiments.visual_slam.kinds import ORBSLAM
from vslam_ref.features.vocabulary import train
from vslam_ref.support.errors import InputError
from vslam_ref.systems.orbslam.loops import LoopCloser

QUICK = ["--set", "features.features=600", "--set", "features.octaves=4"]


def test_a_run_leaves_paths_map_and_numbers(tmp_path: Path) -> None:
    out, numbers = tmp_path / "out", tmp_path / "n.json"
    words = [
        "run",
        "orbslam",
        "desk",
        "--to",
        "90",
        "--every",
        "5",
        "--out",
        str(out),
        "--json",
        str(numbers),
    ]
    assert cli.main([*words, *QUICK, "--video", "none"]) == 0
    told = json.loads(numbers.read_text())
    assert told["system"] == "orbslam"
    assert told["tracked"] == told["frames"] == 18
    assert (told["loops"], told["loops_rejected"], told["essential_edges"]) == (0, 0, 0)
    assert told["culled_keyframes"] >= 0
    assert told["settings"]["features.octaves"] == {"value": 4, "default": 8}
    assert told["ate_percent"] < 2.0  # half a pixel in some hundred points of a path of half a metre
    assert {path.name for path in out.iterdir()} == {
        *("result.json", "report.html", "trajectory.txt", "trajectory_live.txt", "keyframes.txt", "map.ply"),
        *("map.png", "course.png", "stages.png"),
    }
    keyframes = trajectories.read(out / "keyframes.txt").trajectory
    assert len(keyframes) == told["keyframes"]
    whole = trajectories.read(out / "trajectory.txt").trajectory
    rows = np.searchsorted(whole.times, keyframes.times)
    np.testing.assert_allclose(whole.t_world_body[rows], keyframes.t_world_body, atol=1e-12)
    assert "ORB-SLAM on desk" in (out / "report.html").read_text()


def test_why_loops_were_rejected_is_told_in_a_line() -> None:
    system = SimpleNamespace(close_loops=LoopCloser(lambda m, kf: [], np.random.default_rng(0)))
    assert ORBSLAM.notes(system) == []
    system.close_loops.rejected.update(["few matches", "few inliers", "few matches"])
    assert ORBSLAM.notes(system) == [
        "3 keyframes that looked like an earlier place closed no loop: few matches 2, few inliers 1"
    ]
    assert ORBSLAM.notes(SimpleNamespace(close_loops=None)) == []


def test_a_bare_scene_ends_without_a_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "bare"
    folder.mkdir()
    for k in range(4):
        cv2.imwrite(str(folder / f"{k:03d}.png"), np.full((120, 160), 90 + k, np.uint8))
    (folder / "calib.txt").write_text("120 120 79.5 59.5 160 120\n")
    out, numbers = tmp_path / "out", tmp_path / "n.json"
    words = ["run", "orbslam", str(folder), "--camera", str(folder / "calib.txt"), "--rate", "10"]
    assert cli.main([*words, "--out", str(out), "--json", str(numbers), "--video", "none"]) == 0
    told = json.loads(numbers.read_text())
    assert told["no_start"]
    assert told["tracked"] == told["keyframes"] == 0
    assert "note: no start:" in capsys.readouterr().out
    assert not (out / "trajectory.txt").exists()


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 no archive", b"10 6 0 0\n0 1 2\n"])
def test_a_bad_vocabulary_is_one_line(
    content: bytes | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given, out = tmp_path / "words.txt", tmp_path / "out"
    if content is not None:
        given.write_bytes(content)
    assert cli.main(["run", "orbslam", "desk", "--vocabulary", str(given), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(given) in said
    assert not out.exists()


def test_a_vocabulary_in_the_folder_that_is_replaced_is_refused(tmp_path: Path) -> None:
    given = tmp_path / "words.npz"
    given.touch()
    options = Namespace(
        out=str(tmp_path), source="desk", camera=None, truth=None, times=None, vocabulary=str(given)
    )
    with pytest.raises(InputError, match=r"--vocabulary .* is replaced"):
        run_visual.keep_inputs(options)


def test_the_vocabulary_that_is_given_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []

    def follow(sequence: object, settings: object, interrupted: object, **given: Any) -> None:
        asked.append(given["vocabulary"].words)
        raise InputError("seen enough")

    monkeypatch.setattr(run_visual, "follow", follow)
    rng = np.random.default_rng(0)
    few = train([rng.integers(0, 256, (50, 32), np.uint8) for _ in range(2)], rng, branching=3, levels=2)
    write_text(tmp_path / "words.txt", few)
    given = ["--vocabulary", str(tmp_path / "words.txt")]
    assert cli.main(["run", "orbslam", "desk", "--out", str(tmp_path / "out"), *given]) == 2
    assert asked == [few.words]


def test_a_setting_that_means_nothing_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", "orbslam", "desk", "--out", str(tmp_path / "out"), "--set", "tracker.local_map=near"]
    assert cli.main(words) == 2
    assert "need whole or covisible" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
