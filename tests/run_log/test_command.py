"""``vslam-ref run``: its files, its JSON, and one line for bad input."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy.sparse", reason="the batch solution")

from vslam_ref import cli
from vslam_ref.systems.slam_log import KEYS, RobotCalibration

NOISE = [
    f"calibration.{key}={value}"
    for key, value in {
        "distance_gain": 1, "turn_gain": 1, "drift": 0, "sighting_delay": 0, "sensor_ahead": 0,
        "bearing_offset": 0, "range_offset": 0, "range_cosine": 0, "sigma_distance": 0.02, "sigma_turn": 0.02,
        "sigma_drift": 0.02, "sigma_range": 0.05, "sigma_bearing": 0.02,
    }.items()
]  # fmt: skip
SET = [word for setting in NOISE for word in ("--set", setting)]


@pytest.fixture
def folder(make_world: Callable[..., object], calibration: RobotCalibration) -> Path:
    """Return the folder of a simulated noisy log of 30 s."""
    return make_world("set", calibration, 1, seconds=30.0).folder  # type: ignore[attr-defined]


def run(*words: object) -> int:
    return cli.main(["run", *map(str, words)])


def test_a_run_writes_its_numbers_files_and_page(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, target = tmp_path / "out", tmp_path / "numbers.json"
    assert run("iekf-slam", folder, "--out", out, "--json", target, *SET) == 0
    content = json.loads(target.read_text())
    assert list(content["filters"]) == ["ekf", "iekf", "ekf-anchored"]
    assert {key: content[key] for key in KEYS} == content["filters"]["iekf"]
    assert content["landmarks"] == 6
    assert content["rmse_position_m"] < 0.2
    assert content["batch"]["nees_mean"] is None
    assert content["config"]["calibration.sigma_range"] == 0.05
    assert json.loads((out / "result.json").read_text()) == content
    names = {path.name for path in out.iterdir()}
    filters = ["ekf", "iekf", "ekf-anchored", "batch"]
    assert names == {
        *("result.json", "report.html", "map.svg", "map.png", "errors.svg", "errors.png"),
        *(f"trajectory_{f}.csv" for f in filters),
        *(f"map_{f}.csv" for f in filters),
    }
    printed = capsys.readouterr().out
    assert f"{content['rmse_position_m']:.4g}" in printed
    assert f"{content['rmse_position_m']:.4g}" in (out / "report.html").read_text()
    assert "http" not in (out / "report.html").read_text()
    rows = np.genfromtxt(out / "trajectory_ekf.csv", delimiter=",", names=True)
    np.testing.assert_allclose(np.diff(rows["time_s"]), 0.1, atol=1e-6)
    assert rows["x_m"][0] == 0.0


def test_a_log_without_truth_gets_null(folder: Path, tmp_path: Path) -> None:
    (folder / "Robot1_Groundtruth.dat").unlink()
    target = tmp_path / "numbers.json"
    assert run("ekf-slam", folder, "--json", target, "--no-batch", "--out", tmp_path / "o", *SET) == 0
    content = json.loads(target.read_text())
    assert content["landmarks"] == 6
    assert content["rejected"] >= 0
    for key in set(KEYS) - {"landmarks", "rejected"}:
        assert content[key] is None, key
    assert content["truth"] is None
    assert not (tmp_path / "o" / "errors.svg").exists()


def test_the_same_log_gives_the_same_numbers(folder: Path, tmp_path: Path) -> None:
    texts = []
    for name in ("a.json", "b.json"):
        assert run("ekf-slam", folder, "--no-batch", "--json", tmp_path / name, *SET) == 0
        content = json.loads((tmp_path / name).read_text())
        del content["seconds"]
        texts.append(content)
    assert texts[0] == texts[1]


def test_an_earlier_result_is_replaced_and_anything_else_is_left_alone(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    for _ in range(2):
        assert run("ekf-slam", folder, "--no-batch", "--out", out, *SET) == 0
    other = tmp_path / "precious"
    other.mkdir()
    (other / "thesis.txt").write_text("all of it")
    assert run("ekf-slam", folder, "--no-batch", "--out", other, *SET) == 2
    assert "holds other things" in capsys.readouterr().err
    assert [path.name for path in other.iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ekf-slam", "FOLDER", "--robot", "4"], r"no odometry of robot 4; robots here: 1"),
        (["ekf-slam", "mrclamm"], r"unknown data set 'mrclamm' \(did you mean 'mrclam'\?\)"),
        (["ekf-slam", "TMP"], r"holds neither RobotN_Odometry.dat nor"),
        (["ukf-slam", "FOLDER"], r"invalid choice: 'ukf-slam'"),
        (["ekf-slam", "FOLDER", "--set", "run.gat=3"], r"run\.gat"),
        (["ekf-slam", "FOLDER", "--set", "calibration.sigma_range=-1"], r"sigma_range=-1"),
        (["ekf-slam", "FOLDER", "--json", "MISSING"], r"does not exist: make it first"),
    ],
)
def test_bad_words_are_told_in_one_line(
    folder: Path, tmp_path: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty").mkdir()
    places = {
        "FOLDER": str(folder),
        "TMP": str(tmp_path / "empty"),
        "MISSING": str(tmp_path / "no" / "x.json"),
    }
    assert run(*(places.get(word, word) for word in words)) == 2
    error = capsys.readouterr().err
    assert re.search(message, error)
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "line", "new"),
    [
        ("Robot1_Odometry.dat", 50, "1002.4 0.5"),
        ("Robot1_Odometry.dat", 50, "1002.4 0.5 nan"),
        ("Robot1_Odometry.dat", 50, "1.0 0.5 0.3"),
        ("Robot1_Measurement.dat", 20, "1029.0 99.5 2.0 0.1"),
        ("Robot1_Groundtruth.dat", 50, "1002.4 0.5 0.3 0.3 0.3"),
    ],
)
def test_a_damaged_file_is_told_with_its_line(
    folder: Path, name: str, line: int, new: str, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (folder / name).read_text().splitlines()
    lines[line - 1] = new
    (folder / name).write_text("\n".join(lines))
    assert run("ekf-slam", folder, "--no-batch") == 2
    error = capsys.readouterr().err
    # a time that jumps ahead shows at the line after it
    assert re.search(rf"{name}:(?:{line}|{line + 1}): ", error)
    assert error.count("\n") == 1


def test_an_empty_file_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "Robot1_Measurement.dat").write_text("")
    assert run("ekf-slam", folder) == 2
    assert "Robot1_Measurement.dat: no data; expected lines of time, barcode" in capsys.readouterr().err
