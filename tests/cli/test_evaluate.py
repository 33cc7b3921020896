"""``vslam-ref evaluate`` prints and writes the numbers, draws both paths, and tells bad input in one line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vslam_ref import _kernels, cli
from vslam_ref.commands import evaluate as command
from vslam_ref.datasets import catalogue, trajectories
from vslam_ref.geometry import so3
from vslam_ref.metrics.trajectory import MAX_DIFFERENCE, MODES, Trajectory, evaluate
from vslam_ref.plot import saving, style
from vslam_ref.plot.trajectory import top_view, trajectory_figure

KEYS = [
    "pairs", "ate_rmse", "ate_mean", "ate_median", "ate_max", "rpe_trans_rmse", "rpe_rot_rmse_deg", "scale",
]  # fmt: skip


def path_and_estimate() -> tuple[Trajectory, Trajectory]:
    """A circle of 1 m, and the same at half the size, in another frame, with noise."""
    rng = np.random.default_rng(0)
    a = np.linspace(0, 6, 60)
    c, s, o = np.cos(a), np.sin(a), 0 * a
    R = np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, o + 1]]), -1, 0)
    t = np.stack([c, s, 0.1 * a], 1)
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    estimate = 0.5 * (t + 0.01 * rng.normal(size=t.shape)) @ turn.T + [3, 4, 5]
    return Trajectory(a, t, R), Trajectory(a + 0.002, estimate, turn @ R)


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Estimate in EuRoC's format, truth in TUM's."""
    truth, estimate = path_and_estimate()
    trajectories.write(tmp_path / "estimate.csv", estimate, "euroc")
    trajectories.write(tmp_path / "truth.txt", truth, "tum")
    return tmp_path / "estimate.csv", tmp_path / "truth.txt"


def run(*words: object) -> int:
    return cli.main(["evaluate", *map(str, words)])


@pytest.mark.parametrize("mode", MODES)
def test_printed_written_and_computed_numbers_are_the_same(
    files: tuple[Path, Path], mode: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "numbers.json"
    assert run(*files, "--align", mode, "--json", target) == 0
    numbers = json.loads(target.read_text())
    assert numbers.pop("versions")["backend"] == _kernels.backend()
    assert numbers.pop("notes") == []
    assert list(numbers) == KEYS
    estimate, truth = (trajectories.read(f).trajectory for f in files)
    assert numbers == evaluate(estimate, truth, mode).numbers()
    shown = capsys.readouterr().out
    for key, words, _ in command.ROWS:
        value = str(numbers[key]) if key == "pairs" else f"{numbers[key]:.6f}"
        assert re.search(rf"^{re.escape(words)} +{re.escape(value)}\b", shown, re.MULTILINE), key


def test_se3_is_what_is_done_when_nothing_is_said(files: tuple[Path, Path], tmp_path: Path) -> None:
    for name, more in (("a.json", []), ("b.json", ["--align", "se3"])):
        assert run(*files, *more, "--json", tmp_path / name) == 0
    assert (tmp_path / "a.json").read_text() == (tmp_path / "b.json").read_text()


def test_the_choices_are_those_of_the_library() -> None:
    assert command.ALIGNMENTS == MODES
    assert command.FORMATS == trajectories.FORMATS
    assert tuple(f".{name}" for name in saving.FORMATS) == command.PLOTS
    assert command.MAX_DIFFERENCE == MAX_DIFFERENCE
    assert [key for key, _, _ in command.ROWS] == KEYS


@pytest.mark.parametrize("name", ["plot.svg", "plot.png"])
def test_a_plot_is_written_whole_and_the_same_every_time(
    files: tuple[Path, Path], tmp_path: Path, name: str
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    contents = []
    for _ in range(2):
        assert run(*files, "--align", "sim3", "--plot", out / name) == 0
        contents.append((out / name).read_bytes())
    assert contents[0] == contents[1]
    assert contents[0].startswith(b"<?xml" if name.endswith("svg") else b"\x89PNG")
    assert [p.name for p in out.iterdir()] == [name]


def test_the_figure_shows_the_numbers_it_is_given() -> None:
    truth, estimate = path_and_estimate()
    found = evaluate(estimate, truth, "sim3")
    aligned = found.absolute.aligned.t_world_body
    figure = trajectory_figure(
        aligned, truth.t_world_body, found.absolute.errors, truth.times, "t", "aligned"
    )
    view, error = figure.axes
    assert (view.get_xlabel(), view.get_ylabel()) == ("x [m]", "y [m]")
    assert (error.get_xlabel(), error.get_ylabel()) == ("time [s]", "position error [m]")
    lines = {str(line.get_label()): line for line in (*view.lines, *error.lines)}
    np.testing.assert_array_equal(np.stack(lines["truth"].get_data(), 1), truth.t_world_body[:, :2])
    np.testing.assert_array_equal(np.stack(lines["estimate (aligned)"].get_data(), 1), aligned[:, :2])
    np.testing.assert_array_equal(lines["position error"].get_ydata(), found.absolute.errors)
    assert f"RMSE {found.absolute.stats.rmse:.4g} m" in lines
    # told apart without colour, too
    assert lines["truth"].get_linestyle() != lines["estimate (aligned)"].get_linestyle()
    assert {lines["truth"].get_color(), lines["estimate (aligned)"].get_color()} == {style.BLACK, style.BLUE}


def test_no_line_is_drawn_across_a_gap_and_poses_are_counted_without_times() -> None:
    truth, _ = path_and_estimate()
    assert truth.times is not None
    times = truth.times + np.where(np.arange(60) >= 30, 50.0, 0.0)
    t, errors = truth.t_world_body, np.ones(60)
    view, error = trajectory_figure(t, t, errors, times, "t", "a").axes
    for line in (view.lines[0], error.lines[0]):
        assert np.flatnonzero(np.isnan(np.asarray(line.get_ydata(), float))).tolist() == [30]
    error = trajectory_figure(t, t, errors, None, "t", "a").axes[1]
    assert error.get_xlabel() == "pose"
    np.testing.assert_array_equal(error.lines[0].get_xdata(), np.arange(60))


def test_the_view_is_along_the_axis_of_least_motion() -> None:
    rng = np.random.default_rng(1)
    for axis, shown in ((0, (1, 2)), (1, (0, 2)), (2, (0, 1))):
        path = rng.normal(size=(50, 3))
        path[:, axis] *= 0.01
        assert top_view(path) == shown


def test_files_without_times_are_compared_line_by_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth, estimate = path_and_estimate()
    for name, path in (("e.txt", estimate), ("t.txt", truth)):
        trajectories.write(tmp_path / name, path, "kitti")
    assert run(tmp_path / "e.txt", tmp_path / "t.txt", "--format", "kitti", "--plot", tmp_path / "p.svg") == 0
    assert re.search(r"^pairs of poses +60$", capsys.readouterr().out, re.MULTILINE)


def test_what_a_reader_of_the_numbers_should_know_is_noted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [f"{k / 8} {k} {2 * k} {-k} 0 0 0 0.9995" for k in range(2000)]
    rows[700] = rows[699]
    path = tmp_path / "line.txt"
    path.write_text("\n".join(rows))
    assert run(path, path) == 0
    notes = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note: ")]
    assert any("1 pose of 2000 with the time of an earlier line (first: line 701)" in note for note in notes)
    assert any("quaternion lengths are up to 5.0e-04 off 1" in note for note in notes)
    assert any("one of many: the points lie on one line" in note for note in notes)


def test_of_equal_times_only_the_first_is_paired(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """25 poses of one stamp, as a phone's clip has them: 24 of them are far off, and do not count."""
    true = [f"{k / 30!r} {k} {k * k} 0 0 0 0 1" for k in range(40)]
    found = [*true[:2], *(f"{1 / 30!r} 99 99 99 0 0 0 1" for _ in range(24)), *true[2:]]
    (tmp_path / "t.txt").write_text("\n".join(true))
    (tmp_path / "e.txt").write_text("\n".join(found))
    for names in (("e.txt", "t.txt"), ("t.txt", "e.txt")):
        assert run(*(tmp_path / name for name in names), "--align", "none") == 0
        out = capsys.readouterr().out
        assert re.search(r"^pairs of poses +40$", out, re.MULTILINE)
        assert re.search(r"^ATE, largest +0\.000000", out, re.MULTILINE)
        assert (
            "24 poses of 64 with the time of an earlier line (first: line 3): the first pose of each" in out
        )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["E"], "required: TRUTH"),
        (["E", "T", "--align", "SE3"], "invalid choice: 'SE3'"),
        (["E", "none.txt"], r"none\.txt: no such file"),
        (["E", "."], r"Is a directory|Permission denied"),
        (["E", "T", "--format", "kitti"], r"estimate\.csv:2: 8 columns; expected 12"),
        (["E", "T", "--plot", "p.pdf"], r"p\.pdf.*must end in \.png or \.svg"),
        (["E", "T", "--plot", "gone/p.svg"], "folder .*gone.* does not exist: make it first"),
        (["E", "T", "--json", "gone/x.json"], "folder .*gone.* does not exist: make it first"),
        (["E", "T", "--json", "late.txt/x.json"], "folder 'late.txt' of file .* is a file: give a folder"),
        (["E", "late.txt"], "0 pairs of poses within 0.01 s: need 3; estimate 0.002 to 6.002 s, truth 1000"),
        (["E", "few.txt"], "2 pairs of poses within"),
        (["E", "kitti.txt"], "the truth has no times and the other has"),
        (["E", "still.txt", "--align", "sim3"], "no scale can be found: the points of the target lie"),
        (["E", "bad.txt"], r"bad\.txt:3: tx is '1e999'; expected a finite number"),
        (["E", "T", "--max-difference", "-1"], "'-1': expected seconds, 0 or more"),
        (["E", "T", "--offset", "nan"], "'nan': expected seconds"),
        (["kitti.txt", "kitti.txt", "--offset", "1"], "poses without times cannot be moved by 1 s"),
    ],
)
def test_bad_input_is_one_line_status_2_and_nothing_written(
    files: tuple[Path, Path],
    words: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    truth, _ = path_and_estimate()
    assert truth.times is not None
    t, R = truth.t_world_body, truth.R_world_body
    trajectories.write(tmp_path / "late.txt", Trajectory(truth.times + 1000, t, R), "tum")
    trajectories.write(tmp_path / "few.txt", truth.take(np.array([3, 4])), "tum")
    trajectories.write(tmp_path / "kitti.txt", truth, "kitti")
    trajectories.write(tmp_path / "still.txt", Trajectory(truth.times, 0 * t, R), "tum")
    (tmp_path / "bad.txt").write_text("# t\n0 0 0 0 0 0 0 1\n1 1e999 0 0 0 0 0 1\n")
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    places = {"E": files[0].name, "T": files[1].name}
    more = [] if "--json" in words or "--plot" in words else ["--json", "x.json", "--plot", "x.svg"]
    assert run(*(places.get(word, word) for word in words), *more) == 2
    out, error = capsys.readouterr()
    assert re.search(message, error), error
    assert error.count("\n") == 1
    assert out == ""
    assert sorted(tmp_path.iterdir()) == before


def moving(n: int = 60) -> Trajectory:
    """A body that moves and turns about all axes."""
    a = np.linspace(0, 6, n)
    t = np.stack([np.cos(a), np.sin(2 * a), 0.3 * a], axis=1)
    R = so3.exp(np.stack([np.sin(a), 0.7 * a, np.cos(1.3 * a)], axis=1))
    return Trajectory(1.4e9 + a, t, R)


def answer(capsys: pytest.CaptureFixture[str], target: Path, *words: object) -> dict[str, Any]:
    """The numbers that were written; their notes are those that were printed."""
    assert run(*words, "--json", target) == 0
    numbers: dict[str, Any] = json.loads(target.read_text())
    shown = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note: ")]
    assert shown == [f"note: {note}" for note in numbers["notes"]]
    return numbers


def test_offset_and_limit_are_those_of_the_options(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The offset is added to the estimate's times; what is left over within the limit is paired."""
    truth = moving()
    trajectories.write(tmp_path / "t.txt", truth, "tum")
    trajectories.write(tmp_path / "e.txt", truth.later(-2.5 + 0.03), "tum")
    names, target = (tmp_path / "e.txt", tmp_path / "t.txt"), tmp_path / "n.json"
    right = answer(capsys, target, *names, "--offset", "2.5", "--max-difference", "0.04")
    assert (right["pairs"], right["notes"]) == (60, [])
    assert right["ate_rmse"] < 1e-12
    wrong = answer(capsys, target, *names, "--offset", "-2.5", "--max-difference", "0.04")  # the other way
    assert wrong["pairs"] == 11  # 5 of 6 s are left out
    assert "49 of 60 poses of the estimate (82 %) have no true pose within 0.04 s" in wrong["notes"][0]
    assert "with --offset 2.47, 60 of 60 poses" in wrong["notes"][1]
    assert run(*names, "--offset", "2.5") == 2
    assert "with --offset 2.47, 60 of 60 poses" in capsys.readouterr().err
    assert answer(capsys, target, *names, "--offset", "2.47")["pairs"] == 60
    # of a limit above the step of the truth the nearest still counts
    assert answer(capsys, target, *names, "--offset", "2.5", "--max-difference", "0.5")["ate_rmse"] < 1e-12


def test_oddities_of_both_files_are_told_with_their_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = trajectories.to_text(moving(), "tum").splitlines()
    lost = [*lines[:20], " ".join([lines[20].split()[0], *["nan"] * 7]), *lines[21:]]
    (tmp_path / "e.txt").write_text("\n".join(lost))
    (tmp_path / "t.txt").write_text("\n".join([*lines[:30], lines[31], lines[30], *lines[32:]]))
    numbers = answer(capsys, tmp_path / "n.json", tmp_path / "e.txt", tmp_path / "t.txt")
    assert numbers["pairs"] == 59
    assert [note.partition(": ")[0] for note in numbers["notes"]] == [
        str(tmp_path / n) for n in ("e.txt", "t.txt")
    ]
    assert "1 line of 60 without a pose" in numbers["notes"][0]
    assert "the time goes back once (first: line 32" in numbers["notes"][1]


def test_lost_lines_of_matrices_do_not_move_the_pairs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """KITTI's lines are pairs: a line that is lost in one file takes that line of the other with it."""
    lines = trajectories.to_text(moving(), "kitti").splitlines()
    nothing = " ".join(["nan"] * 12)
    (tmp_path / "e.txt").write_text("\n".join([*lines[:7], nothing, *lines[8:]]))
    (tmp_path / "t.txt").write_text("\n".join([*lines[:40], nothing, nothing, *lines[42:]]))
    numbers = answer(capsys, tmp_path / "n.json", tmp_path / "e.txt", tmp_path / "t.txt")
    assert numbers["pairs"] == 57
    assert numbers["ate_max"] < 1e-12


def with_w_first(path: Path, target: Path) -> Path:
    rows = [line.split() for line in path.read_text().splitlines() if not line.startswith("#")]
    target.write_text("\n".join(" ".join([*w[:4], w[7], *w[4:7]]) for w in rows))
    return target


def test_quaternions_with_w_first_are_named_and_the_remedy_works(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither the ATE nor the lengths show it; the note names the file, and the line that mends it."""
    truth, target = moving(), tmp_path / "n.json"
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # the two have different worlds
    estimate = Trajectory(truth.times, truth.t_world_body @ turn.T, turn @ truth.R_world_body)
    right = (tmp_path / "e.txt", tmp_path / "t.txt")
    for path, name in ((estimate, right[0]), (truth, right[1])):
        trajectories.write(name, path, "tum")
    wrong = [with_w_first(name, tmp_path / f"wrong_{name.name}") for name in right]
    good = answer(capsys, target, *right)
    assert good["notes"] == []
    for names, guilty in (
        ((wrong[0], right[1]), wrong[:1]),
        ((right[0], wrong[1]), wrong[1:]),
        (wrong, wrong),
    ):
        numbers = answer(capsys, target, *names)
        assert numbers["ate_rmse"] == good["ate_rmse"]
        assert [note.partition(": ")[0] for note in numbers["notes"]] == [str(name) for name in guilty]
        assert all("read with w last, and w seems to be first" in note for note in numbers["notes"])
    (line,) = set(re.findall("'(# time .*?)'", " ".join(numbers["notes"])))
    for name in wrong:
        name.write_text(f"{line}\n{name.read_text()}")
    assert answer(capsys, target, *wrong) == good


def test_quaternions_with_w_last_in_a_table_of_nanoseconds_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """EuRoC's order is assumed without names; a table in the other order has the other note."""
    path = moving()
    trajectories.write(tmp_path / "t.txt", path, "tum")
    trajectories.write(tmp_path / "e.csv", path, "euroc")
    rows = [line.split(",") for line in (tmp_path / "e.csv").read_text().splitlines()[1:]]
    (tmp_path / "e.csv").write_text("\n".join(",".join([*w[:4], *w[5:], w[4]]) for w in rows))
    (note,) = answer(capsys, tmp_path / "n.json", tmp_path / "e.csv", tmp_path / "t.txt")["notes"]
    assert "read with w first, and w seems to be last" in note
    assert "'# time tx ty tz qx qy qz qw'" in note


@pytest.mark.skipif(catalogue.find("trajectories") is None, reason="trajectories is not in VSLAM_REF_DATA")
def test_a_published_number_comes_out_of_the_command(tmp_path: Path) -> None:
    folder, target = catalogue.require("trajectories"), tmp_path / "numbers.json"
    names = [folder / "fr2_desk_ORB_kf_mono.txt", folder / "fr2_desk_groundtruth.txt"]
    assert run(*names, "--align", "sim3", "--json", target, "--plot", tmp_path / "p.png") == 0
    numbers = json.loads(target.read_text())
    assert numbers["pairs"] == 118
    assert round(numbers["scale"], 6) == 2.228022
    assert round(numbers["ate_rmse"], 6) == 0.007729
