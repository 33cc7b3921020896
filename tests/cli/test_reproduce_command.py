"""``vslam-ref reproduce``: what it checks before it works, what it prints, how it ends."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from vslam_ref import _kernels, cli
from vslam_ref.experiments import registry
from vslam_ref.experiments.framework import Claim, progress, register, scheduler, unregister

pytestmark = pytest.mark.usefixtures("toy", "kernels_ready")


@pytest.fixture
def kernels_ready(monkeypatch):
    """No line about kernels that are compiled now: what is printed is compared word for word."""
    monkeypatch.setattr(progress, "_compiled", ["numba"])


def reproduce(*arguments: str) -> int:
    return cli.main(["reproduce", *arguments])


@pytest.fixture
def failing(toy):
    """The toy with a setting under which its claim fails."""
    failing = replace(toy, id="toy-fails", defaults={"scale": 9.0})
    register(failing)
    yield failing
    unregister(failing.id)


@pytest.fixture
def never(toy, monkeypatch):
    """Makes any run of the toy an error: bad input must be found before."""

    def simulate(config, point, seeds):
        raise AssertionError("work began")

    monkeypatch.setitem(registry._registered, "toy", replace(toy, simulate=simulate))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give the ids of experiments or --all, one of the two"),
        (["toy", "--all"], "give the ids of experiments or --all, one of the two"),
        (["tyo"], "unknown experiment 'tyo' (did you mean 'toy'?); known: "),
        (["toy", "--set", "scal=2"], "toy: unknown setting 'scal' (did you mean 'scale'?); known: runs, "),
        (["toy", "--set", "scale"], "toy: setting 'scale': expected key=value"),
        (["toy", "--set", "runs=many"], "toy: setting runs=many: expected a whole number"),
        (["toy", "--set", "scale=-1"], "toy: scale=-1.0: scale -1.0 must be positive"),
        (["toy", "--runs", "0"], "argument --runs: '0': expected a whole number, 2 or more"),
        (["toy", "--runs", "1"], "expected a whole number, 2 or more"),
        (["toy", "--runs", "x"], "expected a whole number, 2 or more"),
        (["toy", "--seed", "-1"], "argument --seed: '-1': expected a whole number, 0 or more"),
        (["toy", "--jobs", "0"], "argument --jobs: '0': expected a whole number, 1 or more"),
        (["toy", "--scheduler", "slurm"], "argument --scheduler: invalid choice: 'slurm'"),
        (["toy", "--scheduler", "dask"], "--dask-address tcp://host:8786"),
        (["toy", "--dask-address", "tcp://h:1"], "without --scheduler dask"),
        (["toy", "--json", "missing/x.json"], "folder 'missing' of file 'missing/x.json' does not exist"),
        (["toy", "--json", "."], "'.' is a folder: give the name of a file"),
        (["toy", "--out", "a-file"], "output folder 'a-file' is a file: give a folder"),
        (["toy", "--out", "a-file/out"], "output folder 'a-file/out': a part of that path is a file"),
    ],
)
def test_bad_input_is_one_line_and_status_2_before_any_work(
    arguments, message, never, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a-file").write_text("")
    assert reproduce(*arguments) == 2
    shown = capsys.readouterr()
    lines = shown.err.strip().split("\n")
    assert len(lines) == 1
    assert lines[0].startswith("vslam-ref: error: ")
    assert message in lines[0]
    assert shown.out == ""
    assert [p.name for p in tmp_path.iterdir() if p.name != "a-file"] == []


def test_a_cluster_that_cannot_be_reached_is_told_before_any_work(never, tmp_path, monkeypatch, capsys):
    pytest.importorskip("distributed")
    monkeypatch.setattr(scheduler, "DASK_TIMEOUT", 1.0)
    arguments = ["toy", "--out", str(tmp_path), "--scheduler", "dask", "--dask-address"]
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        assert reproduce(*arguments, address) == 2
        [line] = capsys.readouterr().err.strip().split("\n")
        assert line.startswith(f"vslam-ref: error: no Dask workers at '{address}'")


def test_it_prints_a_line_per_claim_the_failed_ones_first_and_where_the_files_are(tmp_path, capsys):
    assert reproduce("toy", "--out", str(tmp_path), "--jobs", "1", "--set", "scale=9") == 0
    shown = capsys.readouterr()
    first, failed, found, untested, nothing, files, summary = shown.out.strip().split("\n")
    assert first == f"backend {_kernels.backend()}"
    assert found.strip() == "The mean is 8.97, and 1 is meant: not reproduced."
    assert nothing.strip() == "Nothing was asked: not testable."
    assert failed.split(maxsplit=4) == [
        "not", "reproduced", "toy/near-1", "share", "1.000  the mean is near 1"
    ]  # fmt: skip
    assert untested.startswith("not testable    toy/always  share  -")
    assert files.endswith(f"files in {tmp_path / 'toy'}")
    assert summary == (
        f"2 claims: 0 reproduced, 1 not reproduced, 1 not testable; open {tmp_path / 'index.html'}"
    )
    assert shown.err == "[1/1] toy: A toy <script>alert(1)</script>\n"


def test_json_holds_what_was_printed(tmp_path):
    target = tmp_path / "numbers.json"
    assert (
        reproduce("toy", "--out", str(tmp_path / "out"), "--json", str(target), "--quick", "--seed", "5") == 0
    )
    content = json.loads(target.read_text())
    [experiment] = content["experiments"]
    result = json.loads((tmp_path / "out" / "toy" / "result.json").read_text())
    assert (experiment["seed"], experiment["runs"]) == (5, 2)
    for key in ("experiment", "seed", "runs", "seconds", "claims"):
        assert experiment[key] == result[key]


def test_a_quick_run_says_so_and_marks_small_samples(tmp_path, capsys):
    target = tmp_path / "numbers.json"
    arguments = ["toy", "--out", str(tmp_path / "out"), "--jobs", "1", "--quick", "--json", str(target)]
    assert reproduce(*arguments) == 0
    lines = capsys.readouterr().out.split("\n")
    assert "quick run" in lines[0]
    assert "small sample: 2 runs, the rule asks for 5" in [line.strip() for line in lines]
    assert json.loads(target.read_text())["experiments"][0]["quick"] is True
    assert reproduce(*arguments[:-3]) == 0
    shown = capsys.readouterr().out
    assert "quick run" not in shown
    assert "small sample" not in shown


def test_verdicts_change_the_status_only_with_strict(failing, tmp_path):
    out = ["--out", str(tmp_path), "--jobs", "1"]
    assert reproduce("toy-fails", *out) == 0
    assert reproduce("toy-fails", *out, "--strict") == 1
    assert reproduce("toy", *out, "--strict") == 0  # "not testable" is no failure
    assert reproduce("toy", "toy-fails", *out, "--strict") == 1
    assert (tmp_path / "toy-fails" / "figure.svg").is_file()


@pytest.mark.parametrize("options", [["--jobs", "1"], ["--jobs", "2"], ["--jobs", "2", "--set", "seed=3"]])
def test_series_are_the_same_bytes_for_any_number_of_jobs(options, toy, tmp_path):
    def series(folder: str, *options: str) -> tuple[str, bytes]:
        assert reproduce("toy", "--out", str(tmp_path / folder), *options) == 0
        written = tmp_path / folder / "toy"
        text = (written / "result.json").read_text()
        return text[text.index('"series"') : text.index('"seconds"')], (written / "runs.npz").read_bytes()

    assert series("a", *options) == series("b", "--jobs", "1")


def test_quick_runs_seed_and_set_reach_the_experiment(tmp_path):
    arguments = [
        "toy",
        "--quick",
        "--runs",
        "4",
        "--seed",
        "8",
        "--set",
        "box.side=2.5",
        "--set",
        "box.side=4",
    ]
    assert reproduce(*arguments, "--out", str(tmp_path), "--jobs", "1") == 0
    config = json.loads((tmp_path / "toy" / "result.json").read_text())["config"]
    assert [config[k] for k in ("runs", "population", "seed", "box.side")] == [4, 16, 8, 4.0]


def test_all_runs_every_experiment_once_and_skips_options_that_one_does_not_have(
    toy, failing, tmp_path, monkeypatch
):
    monkeypatch.setattr(registry, "_modules", dict)
    assert reproduce("--all", "--quick", "--out", str(tmp_path), "--jobs", "1", "--runs", "3") == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["index.html", "toy", "toy-fails"]


def test_an_id_given_twice_runs_once(tmp_path, capsys):
    assert reproduce("toy", "toy", "--out", str(tmp_path), "--jobs", "1") == 0
    assert capsys.readouterr().out.count("files in") == 1


def test_a_run_that_breaks_is_not_hidden_and_leaves_no_json(toy, tmp_path, monkeypatch):
    def fail(result) -> list[Claim]:
        raise RuntimeError("a bug")

    monkeypatch.setitem(registry._registered, "toy", replace(toy, claims=fail))
    with pytest.raises(RuntimeError, match="a bug"):
        reproduce("toy", "--out", str(tmp_path / "out"), "--json", str(tmp_path / "x.json"), "--jobs", "1")
    shown = [p.name for p in tmp_path.iterdir() if not p.name.startswith(".")]  # finished batches stay
    assert shown == ["out"]
    assert list((tmp_path / "out").iterdir()) == []
