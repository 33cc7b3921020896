"""A process that computes batches: one inner thread, one backend, an end with its caller."""

from __future__ import annotations

import functools
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

T = TypeVar("T")
R = TypeVar("R")

_chosen_for_good: list[Any] = []


@dataclass(frozen=True)
class _Task(Generic[T, R]):
    """A function that carries the caller's backend into a worker, which ends when ``caller`` does."""

    function: Callable[[T], R]
    backend: str
    caller: int | None

    def __call__(self, batch: T) -> R:
        if self.caller is not None:
            _end_with(self.caller)
        _one_thread_for_good()
        _backend_for_good(self.backend)
        return self.function(batch)


@functools.cache
def _end_with(caller: int) -> None:
    """End this worker process when its caller is gone, as after ``kill -9``; else it would wait for ever."""
    if os.getppid() != caller:
        return  # not its child (Windows, or another way to start workers): it cannot be watched like this

    def watch() -> None:
        while os.getppid() == caller:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


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
