"""Results are written whole or not at all; equal runs give equal bytes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy_experiment import TOY, Rows, figure

from vslam_ref.experiments.framework import Claim, RunContext
from vslam_ref.experiments.framework.reproduce import reproduce
from vslam_ref.experiments.framework.writer import FILES, write_npz
from vslam_ref.support import files
from vslam_ref.support.errors import InputError
from vslam_ref.support.json_text import plain, to_json

scalars = (
    st.none() | st.booleans() | st.integers() | st.text() | st.floats(allow_nan=False, allow_infinity=False)
)
documents = st.recursive(scalars, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner))


def make(out: Path, experiment=TOY, **options) -> Path:
    [outcome] = reproduce([(experiment, experiment.configure(**options))], RunContext(), out)
    return outcome.folder


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def killed_pid() -> int:
    """Return the id of a process that has ended."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    return ended.pid


@given(documents)
def test_json_reads_back_what_was_written(document):
    assert json.loads(to_json(document)) == document


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_written_to_full_precision(number):
    for value in (number, np.float64(number), np.array([number])):
        assert json.loads(to_json([value]))[0] in (number, [number])


def test_numbers_that_are_not_finite_become_null():
    values = {
        "nan": float("nan"),
        "list": [float("inf"), np.float64("-inf")],
        "array": np.array([[np.nan, 1.0]]),
    }
    assert plain(values) == {"nan": None, "list": [None, None], "array": [[None, 1.0]]}


def test_what_has_no_place_in_json_is_refused():
    with pytest.raises(TypeError, match="complex cannot be written"):
        to_json({"z": 1j})


def test_the_folder_holds_the_four_files_and_the_index_shows_them(tmp_path):
    folder = make(tmp_path)
    assert names(folder) == set(FILES)
    assert names(tmp_path) == {"toy", "index.html"}
    content = json.loads((folder / "result.json").read_text())
    assert [content[key] for key in ("experiment", "seed", "runs")] == ["toy", 3, 6]
    assert content["config"]["box.side"] == 3.0
    assert content["series"]["nees"]["nothing"] == [None]
    assert [c["verdict"] for c in content["claims"]] == ["not testable", "reproduced"]
    assert [c["sentence"] for c in content["claims"]] == [
        "Nothing was asked: not testable.", "The mean is 1.00, and 1 is meant: reproduced.",
    ]  # fmt: skip
    assert content["quick"] is content["claims"][1]["quick"] is content["claims"][1]["small_sample"] is False
    assert content["arrays"] == {"nees/ekf/low": "numbers near 1; (runs, times); shape (24, 5)"}
    assert content["seconds"] > 0
    assert content["versions"]["backend"] in ("numpy", "numba")
    assert {"vslam_ref", "git_commit", "python", "numpy", "scipy", "numba", "platform"} <= set(
        content["versions"]
    )
    with np.load(folder / "runs.npz") as arrays:
        nees = arrays["nees/ekf/low"]
    assert nees.shape == (24, 5)
    assert content["series"]["nees"]["ekf/low"] == nees.mean(0).tolist()


def test_a_quick_run_says_so_and_marks_verdicts_on_small_samples(tmp_path):
    [outcome] = reproduce([(TOY, TOY.configure(quick=True))], RunContext(), tmp_path, quick=True)
    content = json.loads((outcome.folder / "result.json").read_text())
    assert content["quick"] is True
    always, near = content["claims"]
    assert [near[k] for k in ("quick", "small_sample", "runs", "least_runs")] == [True, True, 2, 5]
    assert [always[k] for k in ("quick", "small_sample")] == [True, False]
    page = (tmp_path / "index.html").read_text()
    assert "Quick run" in page
    assert "small sample: 2 runs, the rule asks for 5" in page


def test_experiments_that_simulate_the_same_share_their_runs(tmp_path, monkeypatch):
    log = tmp_path / "log"
    monkeypatch.setenv("TOY_LOG", str(log))
    twin = replace(TOY, id="toy-twin")
    config = TOY.configure()
    work = [(TOY, config), (twin, config), (TOY, TOY.configure(seed=9))]
    list(reproduce(work, RunContext(), tmp_path / "out"))
    assert len(log.read_text().split()) == 2 * 6  # six batches, run for the first and for the third


def test_an_array_that_nobody_describes_is_refused(tmp_path):
    with pytest.raises(ValueError, match="must say what these arrays are: nees/ekf/low"):
        make(tmp_path, replace(TOY, about={}))


def test_the_same_run_gives_the_same_bytes_whatever_the_clock_says(tmp_path, monkeypatch):
    first = make(tmp_path / "a")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")
    monkeypatch.setattr(time, "time", lambda: 2.0e9)
    second = make(tmp_path / "b")
    for name in ("figure.svg", "figure.png", "runs.npz"):
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
    texts = [(folder / "result.json").read_text() for folder in (first, second)]
    without_seconds = [[line for line in text.split("\n") if '"seconds"' not in line] for text in texts]
    assert without_seconds[0] == without_seconds[1]


def test_another_seed_gives_other_numbers(tmp_path):
    first, second = make(tmp_path / "a"), make(tmp_path / "b", seed=4)
    assert (first / "runs.npz").read_bytes() != (second / "runs.npz").read_bytes()


def test_arrays_of_objects_are_refused(tmp_path):
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        write_npz(tmp_path / "x.npz", {"a": np.array([{}])})


@pytest.mark.parametrize("part", ["simulate", "claims", "figure"])
def test_a_run_that_fails_leaves_the_previous_result_whole(tmp_path, part):
    folder = make(tmp_path)
    before = {name: (folder / name).read_bytes() for name in FILES}

    def fail(*_) -> Rows:
        raise RuntimeError("no")

    with pytest.raises(RuntimeError, match="no"):
        make(tmp_path, replace(TOY, **{part: fail}))
    assert names(tmp_path) == {"toy", "index.html"}
    assert {name: (folder / name).read_bytes() for name in FILES} == before


def test_a_figure_that_cannot_be_written_leaves_the_previous_result_whole(tmp_path):
    folder = make(tmp_path)
    before = {name: (folder / name).read_bytes() for name in FILES}

    class Broken:
        def savefig(self, path, **_):
            Path(path).write_text("half a")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make(tmp_path, replace(TOY, figure=lambda result: Broken()), seed=9)
    assert names(tmp_path) == {"toy", "index.html"}
    assert {name: (folder / name).read_bytes() for name in FILES} == before


def test_a_rename_that_fails_puts_the_previous_result_back(tmp_path, monkeypatch):
    folder = make(tmp_path)
    before = {name: (folder / name).read_bytes() for name in FILES}
    rename = Path.rename

    def refuse(self, target):
        if ".tmp-" in self.name:
            raise PermissionError(13, "Permission denied")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(PermissionError):
        make(tmp_path, seed=9)
    assert names(tmp_path) == {"toy", "index.html"}
    assert {name: (folder / name).read_bytes() for name in FILES} == before


def test_a_new_result_replaces_the_old_one(tmp_path):
    make(tmp_path)
    content = json.loads((make(tmp_path, seed=9) / "result.json").read_text())
    assert content["seed"] == 9
    assert names(tmp_path) == {"toy", "index.html"}


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path):
    left = tmp_path / f".toy.tmp-{files._host()}-{killed_pid()}-0123abcd"
    left.mkdir()
    (left / "figure.svg").write_text("half")
    make(tmp_path)
    assert names(tmp_path) == {"toy", "index.html"}


def test_a_result_that_a_killed_run_had_moved_aside_is_put_back(tmp_path):
    folder = make(tmp_path)
    folder.rename(tmp_path / f".toy.old-{files._host()}-{killed_pid()}-0123abcd")
    files.clean(tmp_path)
    assert names(tmp_path) == {"toy", "index.html"}
    assert names(folder) == set(FILES)


def test_temporaries_of_a_living_process_and_foreign_files_are_left_alone(tmp_path):
    mine = tmp_path / f".toy.tmp-{files._host()}-{os.getpid()}-0123abcd"
    fresh_elsewhere = tmp_path / ".toy.tmp-anotherhost-1-0123abcd"
    old_elsewhere = tmp_path / ".toy.tmp-anotherhost-1-89abcdef"
    foreign = tmp_path / ".git"
    for path in (mine, fresh_elsewhere, old_elsewhere, foreign):
        path.mkdir()
    os.utime(old_elsewhere, (0, 0))
    files.clean(tmp_path)
    assert names(tmp_path) == {mine.name, fresh_elsewhere.name, ".git"}


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL is POSIX")
def test_a_process_killed_while_writing_leaves_no_half_result(tmp_path):
    folder = make(tmp_path)
    before = (folder / "result.json").read_bytes()
    code = (
        "import os, sys, toy_experiment as toy\n"
        "from dataclasses import replace\n"
        "from pathlib import Path\n"
        "from vslam_ref.experiments.framework import RunContext\n"
        "from vslam_ref.experiments.framework.reproduce import reproduce\n"
        "class Deadly:\n"
        "    def savefig(self, path, **_):\n"
        "        Path(path).write_text('half')\n"
        "        os.kill(os.getpid(), 9)\n"
        "work = [(replace(toy.TOY, figure=lambda r: Deadly()), toy.ToyConfig(seed=9))]\n"
        "list(reproduce(work, RunContext(), Path(sys.argv[1])))\n"
    )
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], env={**os.environ, "PYTHONPATH": path})
    assert done.returncode == -9
    assert (folder / "result.json").read_bytes() == before
    assert len(names(tmp_path)) == 3  # the temporary is still there
    make(tmp_path)
    assert names(tmp_path) == {"toy", "index.html"}


@pytest.mark.parametrize("inside", ["", "deeper"])
def test_an_output_folder_that_is_a_file_is_refused(tmp_path, inside):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        files.require_folder(tmp_path / "file" / inside)


def test_claims_with_one_name_are_refused_before_anything_is_written(tmp_path):
    twice = Claim("a", "s", "t", "r", {}, None, None, None, "reproduced")
    with pytest.raises(ValueError, match="two claims"):
        make(tmp_path, replace(TOY, claims=lambda study: [twice, twice]))
    assert names(tmp_path) == set()


def test_figures_are_vectors_with_stable_ids(tmp_path):
    from vslam_ref.plot.saving import save_figure

    save_figure(figure(TOY.run(TOY.default())), tmp_path, "toy")
    text = (tmp_path / "figure.svg").read_text()
    assert "<svg" in text
    assert "<dc:date>" not in text
