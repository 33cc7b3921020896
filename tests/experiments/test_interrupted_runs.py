"""A run that is killed goes on where it stopped, and ends with the bytes of one that was not."""

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
from toy_experiment import TOY, Rows

from vslam_ref.experiments.framework import RunContext, kept
from vslam_ref.experiments.framework.reproduce import reproduce

CODE = """
import sys, toy_experiment as toy
from pathlib import Path
from vslam_ref.experiments.framework import RunContext
from vslam_ref.experiments.framework.reproduce import reproduce
list(reproduce([(toy.TOY, toy.TOY.configure())], RunContext(jobs=int(sys.argv[2])), Path(sys.argv[1])))
"""


def start(out: Path, jobs: int, **more: str) -> subprocess.Popen:
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    environment = {**os.environ, "PYTHONPATH": path, **more}
    return subprocess.Popen([sys.executable, "-c", CODE, str(out), str(jobs)], env=environment)


def hidden(out: Path) -> list[Path]:
    return sorted(out.parent.glob(f".{out.name}.toy-unfinished-*"))


def workers_of(log: Path) -> list[int]:
    return [int(path.name.rpartition("-")[2]) for path in log.parent.glob(f"{log.name}-by-*")]


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
        status = Path(f"/proc/{pid}/stat")
        return not status.is_file() or status.read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


def content(folder: Path) -> tuple[bytes, dict]:
    result = json.loads((folder / "result.json").read_text())
    return (folder / "runs.npz").read_bytes(), {k: v for k, v in result.items() if k != "seconds"}


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL is POSIX")
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_killed_run_goes_on_and_ends_with_the_same_bytes(tmp_path, jobs):
    out, log = tmp_path / "out", tmp_path / "log"
    running = start(out, jobs, TOY_LOG=str(log), TOY_SLEEP="0.5")
    deadline = time.monotonic() + 60
    while not (hidden(out) and len(list(hidden(out)[0].glob("*.npz"))) >= 2):
        assert time.monotonic() < deadline
        assert running.poll() is None
        time.sleep(0.02)
    running.kill()
    running.wait()
    assert list(out.iterdir()) == []  # whole or not at all
    [folder] = hidden(out)
    assert json.loads((folder / "about.json").read_text())["experiment"] == "toy"
    finished = len(list(folder.glob("*.npz")))
    deadline = time.monotonic() + 30
    while workers := [pid for pid in workers_of(log) if alive(pid)]:
        assert time.monotonic() < deadline, f"workers {workers} outlive the program that started them"
        time.sleep(0.1)
    log.unlink()
    assert start(out, jobs, TOY_LOG=str(log)).wait() == 0
    assert len(log.read_text().split()) == 6 - finished  # batches that were finished are not run again
    assert hidden(out) == []
    list(reproduce([(TOY, TOY.configure())], RunContext(), tmp_path / "whole"))
    assert content(out / "toy") == content(tmp_path / "whole" / "toy")
    assert (out / "toy" / "figure.svg").read_bytes() == (
        tmp_path / "whole" / "toy" / "figure.svg"
    ).read_bytes()


def interrupted(out: Path, **options) -> Path:
    """Stop a run in this process after its third batch; return the hidden folder."""
    calls = []

    def stops(config, point, seeds) -> Rows:
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return TOY.simulate(config, point, seeds)

    with pytest.raises(KeyboardInterrupt):
        list(reproduce([(replace(TOY, simulate=stops), TOY.configure(**options))], RunContext(), out))
    [folder] = hidden(out)
    return folder


def runs_made(out: Path, monkeypatch, **options) -> int:
    """Run to the end; return how many batches were computed."""
    log = out.parent / "log"
    monkeypatch.setenv("TOY_LOG", str(log))
    list(reproduce([(TOY, TOY.configure(**options))], RunContext(), out))
    return len(log.read_text().split())


def test_what_was_finished_is_used_again(tmp_path, monkeypatch):
    interrupted(tmp_path / "out")
    assert runs_made(tmp_path / "out", monkeypatch) == 3


@pytest.mark.parametrize("options", [{"seed": 4}, {"overrides": ["scale=2"]}, {"quick": True}])
def test_another_config_takes_none_of_it(tmp_path, monkeypatch, options):
    folder = interrupted(tmp_path / "out")
    assert runs_made(tmp_path / "out", monkeypatch, **options) == (2 if "quick" in options else 6)
    assert hidden(tmp_path / "out") == [folder]  # it still waits for its own config


def test_changed_sources_take_none_of_it(tmp_path, monkeypatch):
    interrupted(tmp_path / "out")
    monkeypatch.setattr(kept, "sources_digest", lambda: "another")
    assert runs_made(tmp_path / "out", monkeypatch) == 6


def test_a_batch_that_is_not_whole_is_run_again(tmp_path, monkeypatch):
    folder = interrupted(tmp_path / "out")
    first = folder / "000000.npz"
    first.write_bytes(first.read_bytes()[:100])
    (folder / "000001.npz").write_bytes(b"")
    assert runs_made(tmp_path / "out", monkeypatch) == 5


def test_batches_hold_plain_arrays_that_need_no_pickle(tmp_path):
    folder = interrupted(tmp_path / "out")
    names = {path.suffix for path in folder.iterdir()}
    assert names == {".npz", ".json"}
    with np.load(folder / "000002.npz", allow_pickle=False) as found:
        assert {name: found[name].shape for name in found.files} == {"nees": (4, 5)}


def test_old_batches_of_another_config_are_removed(tmp_path, monkeypatch):
    folder = interrupted(tmp_path / "out")
    long_ago = time.time() - 86400 * (kept.DAYS + 1)
    os.utime(folder, (long_ago, long_ago))
    runs_made(tmp_path / "out", monkeypatch, seed=4)
    assert hidden(tmp_path / "out") == []


def test_where_nothing_can_be_kept_the_run_goes_on(tmp_path, monkeypatch):
    def refuse(self, *_, **__):
        raise PermissionError(13, "Permission denied")

    store = kept.kept_beside(tmp_path / "out", "toy", {}, "numpy")
    monkeypatch.setattr(Path, "mkdir", refuse)
    study = TOY.run(TOY.configure(), RunContext(), store)
    assert study.data.nees.shape == (24, 5)
    assert hidden(tmp_path / "out") == []


def test_what_two_experiments_share_is_kept_until_both_are_written(tmp_path):
    def fails(study):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    work = [(TOY, TOY.configure()), (replace(TOY, id="toy-twin", figure=fails), TOY.configure())]
    with pytest.raises(KeyboardInterrupt):
        list(reproduce(work, RunContext(), out))
    assert (out / "toy" / "result.json").is_file()
    assert len(hidden(out)) == 1
    list(reproduce(work[:1], RunContext(), out))
    assert hidden(out) == []
