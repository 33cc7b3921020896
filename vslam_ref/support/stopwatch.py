"""Seconds by stage: what a program's time went into, without a word in the algorithms' arguments.

::

    with Stopwatch() as watch:          outside: starts it, for this thread only
        with stage("fine"):             deep inside: does nothing where no stopwatch runs
            ...
            with stage("pose"):         stops "fine" while it lasts
                ...
    watch.seconds                       {"rest": ..., "fine": ..., "pose": ...}

Every moment counts once, so the stages add up to the whole.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar, Token

REST = "rest"
"""What no stage was named for."""


class Stopwatch:
    """Adds up seconds by the names of stages while it is entered.

    Parameters
    ----------
    clock : callable
        Seconds; by default the CPU time of the thread, which leaves out what else the machine does.

    Examples
    --------
    >>> ticks = iter(range(9))
    >>> with Stopwatch(lambda: next(ticks)) as watch, stage("outer"), stage("inner"):
    ...     pass
    >>> watch.seconds
    {'rest': 2, 'outer': 2, 'inner': 1}
    """

    def __init__(self, clock: Callable[[], float] = time.thread_time) -> None:
        self.seconds: dict[str, float] = {}
        self._clock = clock
        self._now = REST
        self._since = 0.0
        self._token: Token[Stopwatch | None] | None = None

    def __enter__(self) -> Stopwatch:
        self._token = _running.set(self)
        self._now, self._since = REST, self._clock()
        return self

    def __exit__(self, *error: object) -> None:
        self.change(REST)
        assert self._token is not None
        _running.reset(self._token)

    def change(self, name: str) -> str:
        """Count for another stage from now on; return the one that ends."""
        now, before = self._clock(), self._now
        self.seconds[before] = self.seconds.get(before, 0) + now - self._since
        self._now, self._since = name, now
        return before


_running: ContextVar[Stopwatch | None] = ContextVar("stopwatch", default=None)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Name what a block does, for the stopwatch that runs in this thread, if one does."""
    watch = _running.get()
    if watch is None:
        yield
        return
    before = watch.change(name)
    try:
        yield
    finally:
        watch.change(before)
