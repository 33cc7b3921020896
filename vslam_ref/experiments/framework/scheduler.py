"""The same work on one core, on many, or on a Dask cluster, with the same bytes in the same order.

Batches are made by the caller and do not depend on the number of workers.  Each batch is computed
with one inner thread and with the backend of the calling process, so that a result is a function of
its batch alone.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from vslam_ref import __version__
from vslam_ref.experiments.framework.progress import Progress, compile_once
from vslam_ref.experiments.framework.worker import _current_backend, _one_thread, _Task
from vslam_ref.support.errors import InputError

T = TypeVar("T")
R = TypeVar("R")

SCHEDULERS = ("local", "dask")
DASK_TIMEOUT = 10.0
"""Seconds to wait for a Dask scheduler, and for its first worker, before giving up."""


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@dataclass(frozen=True)
class RunContext:
    """How to run, as opposed to what: none of it may change a number of the result.

    Parameters
    ----------
    jobs : int
        Worker processes; 1 stays in this process.
    scheduler : {"local", "dask"}
        Where batches go.
    dask_address : str or None
        ``tcp://host:port`` of a running Dask scheduler, for ``scheduler="dask"``.
    progress : bool
        Show on stderr how many runs are done.
    """

    jobs: int = 1
    scheduler: str = "local"
    dask_address: str | None = None
    progress: bool = False

    def map(
        self,
        function: Callable[[T], R],
        batches: Sequence[T],
        label: str = "",
        *,
        sizes: Sequence[int] | None = None,
        already: int = 0,
        finished: Callable[[int, R], None] | None = None,
    ) -> list[R]:
        """Return ``[function(b) for b in batches]``, computed where this context says.

        Parameters
        ----------
        function : callable
            A function at the top level of a module, so that workers can import it.
        batches : sequence
            Its arguments; whatever randomness it needs comes with them.
        label : str
            What the progress says.
        sizes : sequence of int, optional
            Runs in each batch; 1 unless given.
        already : int
            Runs that were done before.
        finished : callable, optional
            Called with the number and the result of each batch, in order, as soon as it is there.

        Raises
        ------
        InputError
            If the scheduler is unknown or cannot be reached, or ``jobs`` is less than 1.
        """
        check_scheduler(self.scheduler, self.dask_address, self.jobs)
        sizes = [1] * len(batches) if sizes is None else sizes
        results: list[R] = []
        with (
            Progress(label, already + sum(sizes), already, self.progress) as progress,
            self._results(function, batches) as arriving,
        ):
            for number, result in enumerate(arriving):
                if finished is not None:
                    finished(number, result)
                results.append(result)
                progress.add(sizes[number])
        return results

    @contextmanager
    def _results(self, function: Callable[[T], R], batches: Sequence[T]) -> Iterator[Iterable[R]]:
        """Yield the results as they come, in the order of the batches."""
        jobs = min(self.jobs, max(len(batches), 1))
        if self.scheduler == "local" and jobs <= 1:
            if self.progress and batches:
                compile_once()
            with _one_thread():
                yield (function(batch) for batch in batches)
            return
        if self.progress and self.scheduler == "local":
            compile_once()
        with _joblib_backend(self.scheduler, self.dask_address, jobs, function.__module__):
            import joblib

            caller = os.getpid() if self.scheduler == "local" else None
            task = _Task(function, _current_backend(), caller)
            arriving = joblib.Parallel(return_as="generator")(
                joblib.delayed(task)(batch) for batch in batches
            )
            try:
                yield arriving
            finally:
                with warnings.catch_warnings():  # of the tasks that an interrupt cancels
                    warnings.simplefilter("ignore", UserWarning)
                    arriving.close()


def run_batches(function: Callable[[T], R], batches: Sequence[T], **how: Any) -> list[R]:
    """Return ``[function(batch) for batch in batches]``; ``how`` is a :class:`RunContext`'s."""
    label = how.pop("label", "")
    return RunContext(**how).map(function, batches, label)


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
    log.setLevel(logging.CRITICAL)  # a refused connection is reported once, by the error below
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
