"""Paired timing: two or more things in turn, so that a ratio holds when the machine's speed drifts."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np


class Paired(NamedTuple):
    """Median seconds per call of each thing, and its median paired ratio to the first."""

    seconds: dict[str, float]
    ratio: dict[str, float]


def paired(
    things: Mapping[str, Callable[[], object]],
    repeats: int = 9,
    least_seconds: float = 0.02,
    clock: Callable[[], float] = time.perf_counter,
) -> Paired:
    """Time the things in turn, ``repeats`` times; each measurement lasts at least ``least_seconds``.

    Parameters
    ----------
    things : mapping of str to callable
        The first is the one the others are compared with: ratio = other / first.
    repeats : int
        Paired measurements.
    least_seconds : float
        A quick call is repeated within one measurement until it lasts this long.
    clock : callable
        Seconds; ``time.thread_time`` leaves out what else the machine does.
    """
    loops = {}
    for name, call in things.items():
        call()  # compile, fill caches
        loops[name] = max(1, int(np.ceil(least_seconds / max(_measure(call, 1, clock), 1e-9))))
    rows = [[_measure(call, loops[name], clock) for name, call in things.items()] for _ in range(repeats)]
    seconds = np.array(rows)  # (repeats, things)
    medians, ratios = np.median(seconds, 0).tolist(), np.median(seconds / seconds[:, :1], 0).tolist()
    return Paired(dict(zip(things, medians, strict=True)), dict(zip(things, ratios, strict=True)))


def _measure(call: Callable[[], object], loops: int, clock: Callable[[], float]) -> float:
    start = clock()
    for _ in range(loops):
        call()
    return (clock() - start) / loops
