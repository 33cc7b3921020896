"""The same work on one core, on many, or on a Dask cluster, with the same bytes in the same order.

Batches are made by the caller and do not depend on the number of workers.  Each batch is computed
with one inner thread and with the backend of the calling process, so that a result is a function of
its batch alone.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from vslam_ref import __version__
from vslam_ref.support.errors import InputError

T = TypeVar("T")
R = TypeVar("R")

SCHEDULERS = ("local", "dask")
DASK_TIMEOUT = 10.0
"""Seconds to wait for a Dask scheduler, and for its first worker, before giving up."""

_chosen_for_good: list[Any] = []


def run_batches(
    function: Callable[[T], R],
    batches: Sequence[T],
    jobs: int = 1,
    scheduler: str = "local",
    dask_address: str | None = None,
    progress: bool = False,
    label: str = "",
) -> list[R]:
    """Return ``[function(batch) for batch in batches]``.

    Parameters
    ----------
    function : callable
        A function at the top level of a module, so that workers can import it.
    batches : sequence
        Its arguments; whatever randomness it needs comes with them.
    jobs : int
        Worker processes (local scheduler); 1 computes in this process.
    scheduler : {"local", "dask"}
        joblib's processes, or a Dask cluster that is already running.
    dask_address : str or None
        ``tcp://host:port`` of the Dask scheduler.
    progress : bool
        Progress bar on stderr, silent where that is no terminal.
    label : str
        What the bar says.

    Raises
    ------
    InputError
        If the scheduler is unknown or cannot be reached, or ``jobs`` is less than 1.
    """
    check_scheduler(scheduler, dask_address, jobs)
    if scheduler == "local" and min(jobs, len(batches)) <= 1:
        with _one_thread():
            return list(_bar((function(batch) for batch in batches), len(batches), progress, label))
    with _joblib_backend(scheduler, dask_address, min(jobs, max(len(batches), 1)), function.__module__):
        import joblib

        task = _Task(function, _current_backend())
        results = joblib.Parallel(return_as="generator")(joblib.delayed(task)(batch) for batch in batches)
        return list(_bar(results, len(batches), progress, label))


def check_scheduler(scheduler: str, dask_address: str | None, jobs: int = 1) -> None:
    """Raise ``InputError`` if this combination of options can never run."""
    if jobs < 1:
        raise InputError(f"jobs {jobs}: expected 1 or more worker processes")
    if scheduler not in SCHEDULERS:
        raise InputError(f"unknown scheduler {scheduler!r}: expected {' or '.join(SCHEDULERS)}")
    if scheduler == "local" and dask_address is not None:
        raise InputError(f"Dask address {dask_address!r} without --scheduler dask: give both or neither")
    if scheduler == "dask":
        if dask_address is None:
            raise InputError(
                "scheduler dask needs the address of a running cluster: --dask-address tcp://host:8786"
            )
        if importlib.util.find_spec("distributed") is None:
            raise InputError("scheduler dask: dask is not installed; pip install 'vslam-ref[cluster]'")


@contextmanager
def dask_client(address: str, module: str = "vslam_ref") -> Iterator[Any]:
    """Connect to a running Dask cluster for the length of a block.

    Raises
    ------
    InputError
        If nobody answers at ``address``, no worker arrives in time, or ``module`` and this version of
        the package are not installed there.
    """
    import logging

    distributed: Any = importlib.import_module("distributed")
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL)  # a refused connection is told once, by the error below
    try:
        try:
            client = distributed.Client(address, timeout=DASK_TIMEOUT, set_as_default=False)
            client.wait_for_workers(1, timeout=DASK_TIMEOUT)
        except (OSError, ValueError, TimeoutError) as error:
            reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            raise InputError(
                f"no Dask workers at {address!r} ({reason}); start 'dask scheduler' and 'dask worker' there, "
                "or give the address the scheduler printed, tcp://host:port"
            ) from None
        with client:
            _check_cluster(client, address, module)
            yield client
    finally:
        log.setLevel(level)


def _check_cluster(client: Any, address: str, module: str) -> None:
    """Refuse a cluster without our code: its scheduler would drop the work and we would wait for ever."""
    code = f"__import__({module!r}) and __import__('vslam_ref').__version__"
    try:
        there = {client.run_on_scheduler(eval, code), *client.run(eval, code).values()}
    except ImportError as error:
        raise InputError(
            f"Dask cluster at {address!r}: {error}; install vslam_ref {__version__} on scheduler and workers"
        ) from None
    if there != {__version__}:
        raise InputError(
            f"Dask cluster at {address!r} has vslam_ref {', '.join(sorted(there))}; "
            f"install {__version__} on its scheduler and workers"
        )


@contextmanager
def _joblib_backend(scheduler: str, address: str | None, jobs: int, module: str) -> Iterator[None]:
    import joblib

    if scheduler == "dask":
        with (
            dask_client(str(address), module) as client,
            joblib.parallel_config(backend="dask", client=client),
        ):
            yield
        return
    with joblib.parallel_config(backend="loky", n_jobs=jobs, inner_max_num_threads=1):
        try:
            yield
        except KeyboardInterrupt:
            from joblib.externals.loky import get_reusable_executor

            get_reusable_executor().shutdown(wait=False, kill_workers=True)
            raise


@dataclass(frozen=True)
class _Task(Generic[T, R]):
    """A function that carries the caller's backend into a worker."""

    function: Callable[[T], R]
    backend: str

    def __call__(self, batch: T) -> R:
        _one_thread_for_good()
        _backend_for_good(self.backend)
        return self.function(batch)


def _one_thread_for_good() -> None:
    """Hold a worker process to one inner thread; not undone, as its tasks may run side by side."""
    from threadpoolctl import threadpool_limits

    threadpool_limits(1)
    if "numba" in sys.modules:
        sys.modules["numba"].set_num_threads(1)
    else:
        os.environ["NUMBA_NUM_THREADS"] = "1"


def _backend_for_good(name: str) -> None:
    """Choose the backend of a worker process.

    It is not restored after a task: tasks that run side by side in the threads of one Dask worker
    would undo each other's choice.
    """
    from vslam_ref import _kernels

    if _kernels.backend() != name:
        choice = _kernels.use_backend(name)
        choice.__enter__()
        _chosen_for_good.append(choice)  # were it collected, it would restore the old backend


def _current_backend() -> str:
    from vslam_ref import _kernels

    return _kernels.backend()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Hold the linear algebra (and Numba, if it is loaded) to one thread inside a block."""
    from threadpoolctl import threadpool_limits

    numba = sys.modules.get("numba")
    before = numba.get_num_threads() if numba else 1
    with threadpool_limits(1):
        if numba:
            numba.set_num_threads(1)
        try:
            yield
        finally:
            if numba:
                numba.set_num_threads(before)


def _bar(items: Iterable[R], total: int, progress: bool, label: str) -> Iterable[R]:
    if not progress:
        return items
    from tqdm import tqdm

    # disable=None: silent where stderr is no terminal
    bar: Iterable[R] = tqdm(
        items, total=total, desc=label or None, disable=None, leave=False, file=sys.stderr
    )
    return bar
