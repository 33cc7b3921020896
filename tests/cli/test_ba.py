"""``vslam-ref ba``: keys, files, and one clear line for bad input."""

from __future__ import annotations

import bz2
import json
from pathlib import Path

import numpy as np
import pytest

from vslam_ref.cli import main
from vslam_ref.datasets.bundle_files import read_bundle

KEYS = {
    *("cameras", "points", "observations", "initial_cost", "final_cost", "iterations"),
    *("seconds", "cpu_seconds", "backend", "reason", "rmse_px"),
}


def bal_text(rng: np.random.Generator, *, behind: bool = False) -> str:
    """Three cameras on a line, twelve points; projected by BAL's own definition, then moved."""
    rows, X = [], rng.uniform(-1, 1, (12, 3)) - [0, 0, 5]
    centres = np.array([[-0.5, 0, 0], [0, 0.1, 0], [0.5, 0, 0.1]])
    for i, centre in enumerate(centres):
        for j, point in enumerate(X):
            P = point - centre
            p = -P[:2] / P[2]
            u, v = 500 * (1 - 0.1 * p @ p) * p + rng.normal(0, 0.3, 2)
            rows.append(f"{i} {j} {u:.6f} {v:.6f}")
    cameras = [f"0 0 0 {' '.join(map(str, -c))} 500 -0.1 0" for c in centres]
    moved = X + rng.normal(0, 0.05, X.shape)
    if behind:
        moved[:, 2] = 5.0
    points = [" ".join(map(str, x)) for x in moved]
    return "\n".join([f"3 12 {len(rows)}", *rows, *cameras, *points]) + "\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "small.txt.bz2"
    path.write_bytes(bz2.compress(bal_text(np.random.default_rng(0)).encode()))
    return path


@pytest.mark.parametrize("backend", ["auto", "numpy"])
def test_numbers_and_files(
    backend: str, file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, ply, told = tmp_path / "adjusted.txt", tmp_path / "scene.ply", tmp_path / "numbers.json"
    wanted = [
        "--json",
        str(told),
        "--ply",
        str(ply),
        "--out",
        str(out),
        "--backend",
        backend,
        "--free",
        "none",
    ]
    assert main(["ba", str(file), *wanted]) == 0
    numbers = json.loads(told.read_text())
    assert set(numbers) >= KEYS
    assert (numbers["cameras"], numbers["points"], numbers["observations"]) == (3, 12, 36)
    assert numbers["final_cost"] < 0.05 * numbers["initial_cost"]
    assert numbers["iterations"] >= 2
    assert numbers["reason"] in ("cost", "gradient")
    printed = capsys.readouterr().out
    assert f"{numbers['final_cost']:.6f}" in printed
    assert printed.count("\n") > numbers["iterations"]
    assert ply.read_bytes().startswith(b"ply\n")
    # the result, read again, is where it ended
    again = tmp_path / "again.json"
    assert main(["ba", str(out), "--json", str(again), "--set", "max_iterations=0"]) == 0
    assert json.loads(again.read_text())["initial_cost"] == pytest.approx(numbers["final_cost"], rel=1e-9)


def test_options_reach_the_solver(file: Path, tmp_path: Path) -> None:
    """Tukey with a scale, no intrinsics, a fixed gauge; the held view stays where it was."""
    told, out = tmp_path / "a.json", tmp_path / "out.txt"
    words = ["--loss", "tukey", "--scale", "2.0", "--free", "none", "--gauge", "fixed"]
    assert main(["ba", str(file), *words, "--json", str(told), "--out", str(out)]) == 0
    numbers = json.loads(told.read_text())
    assert numbers["sigma"] == 2.0
    before, after = read_bundle(file).problem.scene, read_bundle(out).problem.scene
    assert np.abs(after.T_cam_world[0] - before.T_cam_world[0]).max() < 1e-14
    assert np.abs(after.T_cam_world[1] - before.T_cam_world[1]).max() > 1e-6
    assert (after.intrinsics == before.intrinsics).all()


BAD = [
    (["--loss", "tukey", "--scale", "-1"], "--scale '-1'"),
    (["--scale", "3"], "least squares has no scale"),
    (["--free", "g"], "intrinsic 'g'"),
    (["--set", "nope=3"], "unknown setting 'nope'"),
    (["--set", "damping=-1"], "damping"),
    (["--out", "missing_folder/x.txt"], "missing_folder"),
    (["--loss", "tukey", "--scale", "1e-6"], "no error that is small"),
]


@pytest.mark.parametrize(("words", "told"), BAD)
def test_bad_options(words: list[str], told: str, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ba", str(file), *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_nothing_is_written_where_nothing_can_be_adjusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "behind.txt"
    path.write_text(bal_text(np.random.default_rng(1), behind=True))
    out, told = tmp_path / "out.txt", tmp_path / "numbers.json"
    assert main(["ba", str(path), "--out", str(out), "--json", str(told)]) == 2
    assert "behind its camera" in capsys.readouterr().err
    assert not out.exists()
    assert not told.exists()


def test_damaged_file_names_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "cut.txt"
    text = bal_text(np.random.default_rng(1)).splitlines()
    text[4] = "0 3 nan 1.0"
    path.write_text("\n".join(text))
    assert main(["ba", str(path)]) == 2
    assert f"{path}:5:" in capsys.readouterr().err


def test_weak_problems_are_named(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A point seen once is told before the table of steps."""
    lines = bz2.decompress(file.read_bytes()).decode().splitlines()
    kept = [line for line in lines[1:37] if not line.startswith(("1 4 ", "2 4 "))]
    path = tmp_path / "weak.txt"
    path.write_text("\n".join([f"3 12 {len(kept)}", *kept, *lines[37:]]))
    assert main(["ba", str(path)]) == 0
    assert "points seen once, whose depth is not measured: 1 (first: 4)" in capsys.readouterr().out
