"""``vslam-ref sample``: the same bytes for a seed, no user's file lost, and commands find what is true."""

from __future__ import annotations

import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from vslam_ref.cli import main
from vslam_ref.commands import sample as command
from vslam_ref.commands.samples import KINDS
from vslam_ref.datasets import carmen, grid_files, mrclam, noise
from vslam_ref.datasets.bundle_files import read_bal, read_bundle, read_colmap
from vslam_ref.datasets.calibration_files import read_opencv
from vslam_ref.datasets.sequences import open_sequence
from vslam_ref.estimation.bundle import bundle_adjust
from vslam_ref.estimation.bundle.covariance import covariance
from vslam_ref.grids.log_odds import OCCUPIED
from vslam_ref.systems.slam_log.timeline import control_increments
from vslam_ref.worlds import rendered
from vslam_ref.worlds.bundles import nearest_of_family
from vslam_ref.worlds.floor_plan.crowd import nearest_on_segments
from vslam_ref.worlds.floor_plan.robot import drive


def contents(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def truth(samples: Path, kind: str) -> dict:
    return json.loads((samples / kind / "truth.json").read_text())


# --- the folder


def test_every_kind_has_a_maker_a_readme_and_its_truth(samples: Path) -> None:
    assert list(command.MAKERS) == list(KINDS)
    listed = json.loads((samples / "sample.json").read_text())["samples"]
    assert list(listed) == list(KINDS)
    there = contents(samples)
    for kind, told in listed.items():
        assert {f"{kind}/{name}": size for name, size in told["files"].items()} == {
            name: len(data) for name, data in there.items() if name.startswith(f"{kind}/")
        }
        text = (samples / kind / "README.txt").read_text()
        assert "format:" in text
        assert "true:" in text
        assert all(line in text for line in told["commands"])
        assert told["truth"] == truth(samples, kind)


def test_the_same_seed_gives_the_same_bytes_alone_or_with_others(samples: Path, tmp_path: Path) -> None:
    kinds = ["trajectory", "robot", "boards", "bal"]
    assert main(["sample", *kinds, "--out", str(tmp_path / "elsewhere")]) == 0
    again, before = contents(tmp_path / "elsewhere"), contents(samples)
    for name, data in again.items():
        assert name == "sample.json" or data == before[name], name
    assert main(["sample", "robot", "--seed", "2", "--out", str(tmp_path / "elsewhere")]) == 0
    other = contents(tmp_path / "elsewhere")
    assert other["robot/Robot1_Odometry.dat"] != before["robot/Robot1_Odometry.dat"]
    assert other["bal/problem.txt"] == before["bal/problem.txt"]  # was not asked for, and stays


def test_json_tells_seed_files_and_truth(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, target = tmp_path / "s", tmp_path / "numbers.json"
    assert main(["sample", "trajectory", "--seed", "3", "--out", str(out), "--json", str(target)]) == 0
    numbers = json.loads(target.read_text())
    assert numbers["seed"] == 3
    told = numbers["samples"]["trajectory"]
    assert told["truth"]["ate_rmse"] == 0.05
    assert told["bytes"] == sum(told["files"].values())
    assert f"{told['bytes']}" in capsys.readouterr().out


def test_a_folder_with_anything_else_is_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("ten years of work")
    words = ["sample", "trajectory", "--out", str(mine)]
    assert main(words) == 2
    assert "holds other things" in capsys.readouterr().err
    (mine / "thesis.tex").rename(tmp_path / "thesis.tex")
    assert main(words) == 0
    (tmp_path / "thesis.tex").rename(mine / "trajectory" / "thesis.tex")
    before = contents(mine)
    assert main(words) == 2
    assert "holds trajectory/thesis.tex, which is no sample" in capsys.readouterr().err
    assert contents(mine) == before
    (mine / "trajectory" / "thesis.tex").unlink()
    (mine / "sample.json").write_text("[]")
    assert main(words) == 2
    assert "sample.json is not the list of samples" in capsys.readouterr().err
    assert main(["sample", "trajectory", "--out", str(mine / "sample.json")]) == 2
    assert "is a file" in capsys.readouterr().err
    assert main(["sample", "robots", "--out", str(mine)]) == 2


def test_a_maker_that_fails_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(command.MAKERS, "trajectory", "trajectory:nothing")
    with pytest.raises(AttributeError):
        main(["sample", "adapter", "trajectory", "--out", str(tmp_path / "s")])
    assert list(tmp_path.iterdir()) == []


# --- what the commands find


def run_json(tmp_path: Path, *words: object) -> dict:
    target = tmp_path / "numbers.json"
    assert main([*map(str, words), "--json", str(target)]) == 0
    return json.loads(target.read_text())


def test_run_beats_dead_reckoning(samples: Path, tmp_path: Path) -> None:
    """Wheels alone, with the true gains, against filters and batch, all placed at the true start."""
    found = run_json(tmp_path, "run", "iekf-slam", samples / "robot")
    log = mrclam.read_log(samples / "robot", 1)
    true = mrclam.read_truth(samples / "robot", 1, log)
    wheels = drive(true.T_world_vehicle[0], control_increments(log, noise.calibration("mrclam")))
    rmse = np.sqrt(np.mean(np.sum((wheels - true.T_world_vehicle)[:, :2] ** 2, axis=1)))
    assert found["landmarks"] == truth(samples, "robot")["landmarks"]
    for name in ("ekf", "iekf", "ekf-anchored"):
        assert found["filters"][name]["rmse_position_unaligned_m"] < rmse / 3, name
    assert found["batch"]["rmse_position_unaligned_m"] < rmse / 3
    assert found["sightings"] == truth(samples, "robot")["sightings"]


@pytest.mark.parametrize(("kind", "file"), [("bal", "problem.txt"), ("colmap", "model")])
def test_ba_reaches_the_truth_within_its_noise(samples: Path, tmp_path: Path, kind: str, file: str) -> None:
    """The cost has its chi-square law, and the points miss the truth as their covariance says; 5 deviations.

    For errors d of covariance C, |d|^2 has the mean tr C and the variance 2 tr C^2.
    """
    out, told = tmp_path / file, truth(samples, kind)
    found = run_json(tmp_path, "ba", samples / kind / file, "--out", out)
    assert abs(found["final_cost"] - told["final_cost_mean"]) < 5 * told["final_cost_sd"]
    exact = (read_bal if kind == "bal" else read_colmap)(samples / kind / file.replace("problem", "truth"))
    if kind == "colmap":
        exact = read_colmap(samples / kind / "truth")
    start = read_bundle(samples / kind / file).problem
    result = bundle_adjust(read_bundle(out).problem)
    C = covariance(result, points=range(told["points"]), gauge="free", sigma=told["sigma_px"]).matrix
    assert C is not None
    _, points = nearest_of_family(result.problem.scene, exact.problem.scene)
    allowed = np.trace(C) + 5 * np.sqrt(2 * np.trace(C @ C))
    assert np.sum(points**2) < allowed
    _, before = nearest_of_family(start.scene, exact.problem.scene)
    assert np.sum(before**2) > 10 * allowed


@pytest.mark.parametrize("model", ["radtan", "fov"])
def test_calibrate_finds_the_camera(samples: Path, tmp_path: Path, model: str) -> None:
    """5 standard deviations, from residuals; pictures are drawn with 3 x 3 samples a pixel, which place an
    edge to 1 / (3 sqrt(12)) = 0.1 px.
    """
    folder = samples / "boards" / model
    words = ["--board", "9x6", "--square", "0.025", "--model", model]
    found = run_json(tmp_path, "calibrate", folder, *words, "--out", tmp_path / "camera.yaml")
    true = read_opencv(folder / "camera.yaml")
    assert found["used"] == found["images"] == 10
    assert found["image_size"] == list(true.size or ())
    assert found["rms_px"] < np.sqrt(2) * 0.1
    wanted = truth(samples, "boards")[model]["parameters"]
    assert wanted == dict(zip(true.camera.names(), true.camera.params.tolist(), strict=True))
    for name, value in wanted.items():
        assert abs(found["parameters"][name] - value) < 5 * found["std"][name], name
    assert found["std"]["fx"] < 0.003 * wanted["fx"]  # five of it tell the two cameras apart


def test_evaluate_finds_the_injected_error(samples: Path, tmp_path: Path) -> None:
    """Exact but for rounding: some hundred operations on numbers of 4 m, against 0.05 m."""
    estimate, true = (samples / "trajectory" / f"{name}.txt" for name in ("estimate", "groundtruth"))
    found = run_json(tmp_path, "evaluate", estimate, true)
    told = truth(samples, "trajectory")
    assert found["pairs"] == told["pairs"]
    assert found["ate_rmse"] == pytest.approx(told["ate_rmse"], rel=1e-11)
    assert run_json(tmp_path, "evaluate", estimate, true, "--align", "none")["ate_rmse"] > 0.5


def test_grid_maps_the_walls_and_not_the_people(samples: Path, tmp_path: Path) -> None:
    """Walls on which beams ended are occupied in S; what is occupied is a wall, a door or a moved box."""
    found = run_json(tmp_path, "grid", samples / "laser" / "office.log", "--out", tmp_path / "out",
                     "--set", "video_frames=0")  # fmt: skip
    told = truth(samples, "laser")
    assert found["scans"] == told["scans"]
    assert found["beams_no_return"] == pytest.approx(0.01 * found["beams"], rel=0.25)  # 450: 5 sd are 24 %
    assert found["dynamic_objects"] > 0
    log = carmen.read(samples / "laser" / "office.log")
    walls = np.loadtxt(samples / "laser" / "walls.csv", delimiter=",", skiprows=1)
    grid = grid_files.read_ros_map(tmp_path / "out" / "static.yaml").grid
    angle = log.poses[:, 2:] + log.scanner.angles
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ends = (log.poses[:, None, :2] + log.ranges[..., None] * way)[log.ranges < 8.0]
    on_wall = ends[nearest_on_segments(ends, walls)[1].min(axis=-1) < 0.03]  # 2 sigma
    cells, hits = np.unique(grid.lattice.cells_from_world(on_wall), axis=0, return_counts=True)
    often = cells[hits >= 20]
    assert len(often) > 400
    assert (grid.states[tuple(often.T)] == OCCUPIED).mean() > 0.9  # the others: seen at a grazing angle
    occupied = grid.lattice.world_from_cells(np.argwhere(grid.states == OCCUPIED))
    off = nearest_on_segments(occupied, walls)[1].min(axis=-1)
    assert (off < 0.08).mean() > 0.85  # half a cell's diagonal; the others are doors and moved boxes


def test_verify_passes_the_adapter_and_names_its_mistake(
    samples: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = samples / "adapter"
    program = f"python '{folder / 'my_slam_adapter.py'}'"
    topics = ["--topic", "so3", "--topic", "se3", "--topic", "camera"]
    declared = ["--convention", str(folder / "convention.json")]
    assert main(["verify", "--program", program, *topics, *declared]) == 0
    assert " passed" in capsys.readouterr().out
    assert main(["verify", "--program", f"{program} --wrong", *topics, *declared]) == 1
    shown, told = capsys.readouterr().out, truth(samples, "adapter")
    place = told["where"].removesuffix("0.1")  # below the limit, by the largest angle of a case
    assert re.search(rf"^so3.left_jacobian: only where {place}0\.\d+: {told['mistake']}", shown, re.MULTILINE)
    assert main(["verify", "--program", program, "--topic", "se3"]) == 1
    assert "se3.exp" in capsys.readouterr().out


def test_the_film_is_what_its_camera_sees(samples: Path) -> None:
    """Points of picture 0 are projected, by the files' camera and poses, to where OpenCV finds them."""
    sequence = open_sequence(samples / "video")
    told = truth(samples, "video")
    assert (len(sequence), sequence.size, sequence.notes) == (told["pictures"], (320, 240), ())
    assert sequence.camera is not None
    assert sequence.camera.params.tolist() == told["camera"]
    assert sequence.truth is not None
    way = np.linalg.norm(np.diff(sequence.truth.t_world_body, axis=0), axis=1).sum()
    assert way == pytest.approx(told["path_m"], rel=1e-12)
    assert 0.15 < way < 0.6
    scene = rendered.scene(told["scene"], told["scene_seed"], size=(320, 240), frames=len(sequence))
    np.testing.assert_array_equal(sequence.image(3).grey, scene.frame(3))
    R, t = sequence.truth.R_world_body, sequence.truth.t_world_body
    uv = cv2.goodFeaturesToTrack(sequence.image(0).grey, 80, 0.05, 10).reshape(-1, 2)
    X = scene.surface(0, uv)
    seen = sequence.camera.project((X - t[10]) @ R[10]).uv
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        sequence.image(0).grey,
        sequence.image(10).grey,
        uv[:, None].copy(),
        None,
        winSize=(15, 15),
        maxLevel=2,
    )
    off = np.linalg.norm(found[:, 0] - seen, axis=1)[status.ravel() == 1]
    assert len(off) > 40
    assert np.median(off) < 0.3  # pixels; the points move by some 10


def test_the_film_as_a_video(samples: Path) -> None:
    """The same pictures: JPEG changes grey values by a few levels; times are whole milliseconds."""
    folder = open_sequence(samples / "video")
    film = open_sequence(samples / "video" / "film.avi", camera=samples / "video" / "calib.txt")
    assert (film.layout, len(film), film.camera) == ("video", len(folder), folder.camera)
    np.testing.assert_allclose(film.times, folder.times, atol=1e-3)
    for k in (0, 40):
        a, b = folder.image(k).grey, film.image(k).grey
        assert a is not None
        assert b is not None
        assert np.abs(a.astype(int) - b).mean() < 4
