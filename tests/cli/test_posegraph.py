"""``vslam-ref posegraph``: keys, starts, losses, files, and one clear line for bad input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vslam_ref.cli import main
from vslam_ref.commands import posegraph
from vslam_ref.datasets.pose_graph_files import PoseGraphFile, read_pose_graph, write_pose_graph
from vslam_ref.estimation.posegraph import odometry_start, solve_graph
from vslam_ref.estimation.posegraph.switching import NAMES
from vslam_ref.worlds.rounds import Rounds, make_rounds

KEYS = {
    *("vertices", "edges", "initial_chi2", "final_chi2", "iterations", "seconds", "backend", "reason"),
    *("rejected", "notes"),
}


@pytest.fixture(scope="module")
def made() -> Rounds:
    return make_rounds("se2", np.random.default_rng(0), rounds=3, per_round=16, false_loops=4)


@pytest.fixture
def file(made: Rounds, tmp_path: Path) -> Path:
    path = tmp_path / "rounds.g2o"
    write_pose_graph(path, PoseGraphFile(made.graph))
    return path


def run(*words: object) -> dict[str, Any]:
    """The numbers of a run that ends well."""
    target = Path(str(words[0])).parent / "numbers.json"
    assert main(["posegraph", *map(str, words), "--json", str(target)]) == 0
    found: dict[str, Any] = json.loads(target.read_text())
    return found


def without_poses(path: Path) -> Path:
    """The file without its VERTEX lines."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("VERTEX")]
    bare = path.with_name("bare.g2o")
    bare.write_text("\n".join(lines) + "\n")
    return bare


def test_numbers_and_files(made: Rounds, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, plot = file.with_name("solved.g2o"), file.with_name("rounds.svg")
    numbers = run(file, "--loss", "switchable", "--out", out, "--plot", plot)
    assert set(numbers) >= KEYS
    assert (numbers["vertices"], numbers["edges"]) == made.graph.sizes
    ends = np.stack([made.graph.tail, made.graph.head], 1)[made.false].tolist()
    assert all(pair in numbers["rejected_edges"] for pair in ends)
    assert numbers["rejected"] == len(numbers["rejected_edges"]) <= 6
    assert numbers["notes"] == []
    printed = capsys.readouterr().out
    assert f"{numbers['final_chi2']:.9g}" in printed
    assert plot.read_bytes().startswith(b"<?xml")
    # the result, read again, is where it ended, and has no false edge any more
    again = run(out)
    assert again["edges"] == numbers["edges"] - numbers["rejected"]
    assert again["initial_chi2"] == pytest.approx(numbers["final_chi2"], rel=1e-9)
    assert again["final_chi2"] == pytest.approx(numbers["final_chi2"], rel=1e-9)


@pytest.mark.parametrize("start", ["file", "odometry", "chordal"])
def test_every_start_ends_at_the_same_chi2(start: str, made: Rounds, file: Path) -> None:
    clean = file.with_name("clean.g2o")
    write_pose_graph(clean, PoseGraphFile(made.graph.only(~made.false)))
    numbers, best = run(clean, "--start", start), solve_graph(made.graph.only(~made.false)).chi2
    assert numbers["start"] == start
    assert numbers["final_chi2"] == pytest.approx(best, rel=1e-8)


def test_the_start_of_a_file_without_poses_is_its_odometry_and_told(made: Rounds, file: Path) -> None:
    bare = without_poses(file)
    numbers = run(bare)
    assert numbers["start"] == "odometry"
    assert "the file has no poses" in numbers["notes"][0]
    graph = read_pose_graph(bare).graph
    begun = solve_graph(graph.at(odometry_start(graph))).initial_chi2
    assert numbers["initial_chi2"] == pytest.approx(begun, rel=1e-12)
    assert run(bare, "--start", "chordal")["notes"] == []


@pytest.mark.parametrize("loss", posegraph.LOSSES)
def test_every_loss_runs_on_both_kinds_of_edges(loss: str, file: Path) -> None:
    for which in ("loops", "all"):
        numbers = run(file, "--loss", loss, "--loss-on", which, "--set", "max_iterations=20")
        assert np.isfinite(numbers["final_chi2"])
        assert (numbers["rejected"] > 0) == (loss in ("geman-mcclure", "switchable", "dcs", "max-mixture"))


def test_the_command_names_the_losses_of_the_library() -> None:
    assert posegraph.LOSSES == NAMES


def test_conventions_and_settings_reach_the_solver(made: Rounds, file: Path) -> None:
    log, g2o = run(file), run(file, "--convention", "g2o")
    wanted = solve_graph(made.graph, convention="g2o").chi2
    assert g2o["final_chi2"] == pytest.approx(wanted, rel=1e-9)
    assert abs(log["final_chi2"] / g2o["final_chi2"] - 1.0) > 1e-6
    short = run(file, "--set", "max_iterations=1")
    assert (short["iterations"], short["reason"]) == (1, "max_iterations")
    strict, wide = (run(file, "--loss", "dcs", "--set", f"constant={c}")["rejected"] for c in (0.5, 6.0))
    assert strict > wide


@pytest.mark.parametrize("suffix", [".g2o", ".graph", ".txt"])
def test_every_format_is_written(suffix: str, file: Path) -> None:
    out = file.with_name(f"out{suffix}")
    numbers = run(file, "--out", out)
    assert run(out)["initial_chi2"] == pytest.approx(numbers["final_chi2"], rel=1e-9)


def test_parts_are_solved_or_refused(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = file.read_text()
    more = "\n".join(f"EDGE_SE2 {i} {i + 1} 1 0 0 1 0 0 1 0 1" for i in (900, 901))
    poses = "\n".join(f"VERTEX_SE2 {i} {i - 900} 0 0" for i in (900, 901, 902))
    file.write_text(f"{text}{poses}\n{more}\n")
    numbers = run(file)
    assert "2 parts that no edge joins" in numbers["notes"][0]
    assert main(["posegraph", str(file), "--parts", "refuse"]) == 2
    assert "2 parts that no edge joins; expected one" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--start", "file"], "bare.g2o:1: vertex 0 has no VERTEX line; expected a pose for every vertex"),
        (["--set", "damping=-1"], "damping=-1"),
        (["--set", "speed=1"], "speed"),
        (["--out", "a.xyz"], "the name must end in .g2o or .graph or .txt"),
        (["--plot", "a.pdf"], "the name must end in .png or .svg"),
        (["--loss", "tukey"], "invalid choice: 'tukey'"),
    ],
)
def test_bad_options_are_one_line(
    words: list[str], said: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["posegraph", str(without_poses(file)), *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_bad_files_are_one_line_and_nothing_is_written(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = file.with_name("numbers.json")
    for text, said in (
        ("EDGE_SE2 0 0 1 0 0 1 0 0 1 0 1\n", ":1: edge from vertex 0 to itself"),
        ("FIX 0\nVERTEX_SE2 0 0 0 0\n", "1 vertices and no edge"),
        (
            "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nFIX 0 1\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n",
            "has no vertex that may move: nothing was solved, nothing written",
        ),
    ):
        file.write_text(text)
        assert main(["posegraph", str(file), "--json", str(target)]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1
        assert not target.exists()


def test_a_similarity_is_written_as_g2o_only(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "keyframes.g2o"
    write_pose_graph(path, PoseGraphFile(make_rounds("sim3", np.random.default_rng(1), rounds=2).graph))
    assert main(["posegraph", str(path), "--out", str(tmp_path / "a.txt")]) == 2
    assert "can be written as .g2o only" in capsys.readouterr().err
    assert run(path, "--start", "chordal", "--out", tmp_path / "b.g2o")["reason"] in ("cost", "gradient")
