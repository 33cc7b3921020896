"""Any number of workers, anywhere, gives the same bytes in the same order with one inner thread."""

from __future__ import annotations

import io
import os
import re
import socket
import sys
import time
from collections.abc import Iterator

import numpy as np
import pytest
from toy_experiment import TOY, ToyConfig, worker_threads

from vslam_ref import _kernels
from vslam_ref.experiments.framework import RunContext, progress, run_batches, scheduler
from vslam_ref.support.errors import InputError
from vslam_ref.support.json_text import to_json


@pytest.fixture(scope="module")
def cluster() -> Iterator[str]:
    """A Dask cluster of two processes on this machine; gives its address."""
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    two = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), 2)
    with (
        dask.config.set({"distributed.nanny.pre-spawn-environ": two}),  # not Dask's own 1: we must limit it
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=2, processes=True, dashboard_address=None
        ) as local,
    ):
        yield local.scheduler_address


def written(context: RunContext) -> tuple[str, bytes]:
    study = TOY.run(ToyConfig(), context)
    return to_json(TOY.series(study)), study.data.nees.tobytes()


def test_two_processes_give_the_bytes_of_one():
    assert written(RunContext(jobs=2)) == written(RunContext(jobs=1))


def test_a_dask_cluster_gives_the_bytes_of_one_process(cluster):
    context = RunContext(scheduler="dask", dask_address=cluster)
    assert written(context) == written(RunContext(jobs=1))


def test_results_keep_the_order_of_their_batches(cluster):
    batches = list(range(23))
    expected = [str(b) for b in batches]
    assert run_batches(str, batches) == expected
    assert run_batches(str, batches, jobs=2) == expected
    assert run_batches(str, batches, scheduler="dask", dask_address=cluster) == expected


def test_workers_are_other_processes_with_one_inner_thread(cluster):
    for where in ({"jobs": 2}, {"scheduler": "dask", "dask_address": cluster}):
        seen = run_batches(worker_threads, range(6), **where)
        assert os.getpid() not in {pid for pid, _, _ in seen}
        assert {threads for _, threads, _ in seen} == {1}


def test_one_job_stays_here_with_one_inner_thread_and_restores_the_rest():
    np.ones((4, 4)) @ np.ones((4, 4))
    before = worker_threads(0)
    assert run_batches(worker_threads, [0]) == [(os.getpid(), 1, before[2])]
    assert worker_threads(0) == before


def test_workers_use_the_backend_of_the_caller(cluster):
    with _kernels.use_backend("numpy"):
        for where in ({"jobs": 1}, {"jobs": 2}, {"scheduler": "dask", "dask_address": cluster}):
            assert {name for _, _, name in run_batches(worker_threads, range(40), **where)} == {"numpy"}


def test_no_batches_give_no_results():
    assert run_batches(str, [], jobs=2) == []


def test_an_exception_in_a_batch_reaches_the_caller():
    for jobs in (1, 2):
        with pytest.raises(ValueError, match="invalid literal"):
            run_batches(int, ["1", "x"], jobs=jobs)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scheduler": "slurm"}, "unknown scheduler 'slurm': expected local or dask"),
        ({"scheduler": "dask"}, "needs the address of a running cluster: --dask-address tcp"),
        ({"dask_address": "tcp://h:1"}, "without --scheduler dask"),
        ({"jobs": 0}, "jobs 0: expected 1 or more"),
    ],
)
def test_options_that_cannot_work_are_refused_before_any_work(options, message):
    def never(_: int) -> int:
        raise AssertionError("work began")

    with pytest.raises(InputError, match=message):
        run_batches(never, [1], **options)


def test_an_address_where_nobody_listens_is_told_in_one_line(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(scheduler, "DASK_TIMEOUT", 1.0)
    with socket.socket() as free:  # bound but not listening: connections are refused
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        with pytest.raises(InputError, match="no Dask workers at 'tcp://") as caught:
            run_batches(str, [1], scheduler="dask", dask_address=address)
    assert "\n" not in str(caught.value)


def test_a_cluster_without_our_code_is_refused_instead_of_waited_for(cluster, monkeypatch):
    message = r"No module named 'not_there'; install vslam_ref \S+ on scheduler and workers"
    with pytest.raises(InputError, match=message), scheduler.dask_client(cluster, "not_there"):
        raise AssertionError("work began")
    monkeypatch.setattr(scheduler, "__version__", "99.0")
    with pytest.raises(InputError, match=r"has vslam_ref \S+; install 99.0"):
        run_batches(str, [1], scheduler="dask", dask_address=cluster)


def test_missing_dask_names_the_extra_to_install(monkeypatch):
    monkeypatch.setattr(scheduler.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'vslam-ref\[cluster\]'"):
        run_batches(str, [1], scheduler="dask", dask_address="tcp://127.0.0.1:8786")


def test_progress_is_silent_where_stderr_is_no_terminal(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "_compiled", ["numba"])
    run_batches(str, range(3), progress=True, label="work")
    assert stream.getvalue() == ""


def test_progress_shows_on_a_terminal(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    run_batches(str, range(3), progress=True, label="work")
    assert "work" in stream.getvalue()


def test_without_a_terminal_a_line_now_and_then_says_how_many_runs_are_done(monkeypatch):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    clock = iter(range(0, 1000, 9))  # nine seconds from look to look
    monkeypatch.setattr(progress.time, "perf_counter", lambda: float(next(clock)))
    RunContext(progress=True).map(str, range(12), "work", sizes=[50] * 12, already=100)
    first, *lines = stream.getvalue().strip().split("\n")
    assert first == "work: 100 of 700 runs were done before"
    assert all(re.fullmatch(r"work: \d+ of 700 runs, \d+ s", line) for line in lines)
    seconds = [int(line.split()[-2]) for line in lines]
    assert lines
    assert min(np.diff([0, *seconds])) >= 20


@pytest.mark.parametrize(("takes", "lines"), [(0.0, 0), (0.5, 2)])
def test_a_long_compilation_is_announced_and_timed(monkeypatch, takes, lines):
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "WAIT", 0.2)
    monkeypatch.setattr(progress, "_compiled", [])
    monkeypatch.setattr(_kernels, "backend", lambda: "numba")
    monkeypatch.setattr(_kernels, "warm", lambda *_: time.sleep(takes))
    progress.compile_once()
    progress.compile_once()  # once in a process
    shown = stream.getvalue().strip().splitlines()
    assert len(shown) == lines
    if lines:
        assert shown[0].startswith("preparing the Numba kernels: they are compiled once")
        assert shown[1].startswith("kernels ready after")
