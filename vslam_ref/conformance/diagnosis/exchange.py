"""Other code for one of the library's functions, for the time of one question, and bounds for what it may do.

The code of a function is exchanged, then put back; what the library remembered from it is forgotten.  Nothing
else may run meanwhile.
"""

from __future__ import annotations

import functools
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

ROOMS = tuple(
    f"vslam_ref.{room}"
    for room in (
        *("geometry", "estimation", "filters", "features", "grids", "metrics", "systems"),
        "conformance.adapters.itself",
    )
)
MOST_LINES = 100_000
"""Lines of the library that changed code may run for one answer."""
MOST_MEMORY = 2**30
"""Bytes that changed code may take."""


@contextmanager
def exchanged(function: FunctionType, code: CodeType) -> Iterator[None]:
    """Let a function run other code, and forget what was remembered from it."""
    before = function.__code__
    function.__code__ = code
    try:
        forget()
        yield
    finally:
        function.__code__ = before
        forget()


@contextmanager
def bounded() -> Iterator[list[int]]:
    """Keep changed code from running for ever, or into all memory: it fails instead, as wrong code may."""
    before = sys.gettrace()
    left = [MOST_LINES]

    def count(frame: Any, event: str, _: Any) -> Any:
        if not str(frame.f_globals.get("__name__", "")).startswith(ROOMS):
            return None
        left[0] -= 1
        if left[0] < 0:
            raise RuntimeError("the changed code does not end")
        return count

    sys.settrace(count)
    try:
        with _memory():
            yield left
    finally:
        sys.settrace(before)


@contextmanager
def _memory() -> Iterator[None]:
    """At most :data:`MOST_MEMORY` more than now, where the system can tell and limit it."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError, ValueError):
        yield
        return
    wanted = pages * resource.getpagesize() + MOST_MEMORY
    if 0 <= soft < wanted:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def forget() -> None:
    """Forget what functions of the numeric rooms remembered."""
    for remembered in _remembering():
        remembered.cache_clear()


@functools.cache
def _remembering() -> list[Any]:
    """Functions of the numeric rooms that remember their results."""
    kind = type(_remembering)
    return [x for x in gc.get_objects() if type(x) is kind and x.__module__.startswith(ROOMS)]
