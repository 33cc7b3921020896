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
    things: Mapping[str, Callable[[], object]], repeats: int = 9, least_seconds: float = 0.02
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
    """
    loops = {name: _loops(call, least_seconds) for name, call in things.items()}
    seconds = {name: [] for name in things}  # type: dict[str, list[float]]
    for _ in range(repeats):
        for name, call in things.items():
            seconds[name].append(_measure(call, loops[name]))
    first = np.array(seconds[next(iter(things))])
    medians = {name: float(np.median(values)) for name, values in seconds.items()}
    ratios = {name: float(np.median(np.array(values) / first)) for name, values in seconds.items()}
    return Paired(medians, ratios)


def _loops(call: Callable[[], object], least_seconds: float) -> int:
    call()  # compile, fill caches
    return max(1, int(np.ceil(least_seconds / max(_measure(call, 1), 1e-9))))


def _measure(call: Callable[[], object], loops: int) -> float:
    start = time.perf_counter()
    for _ in range(loops):
        call()
    return (time.perf_counter() - start) / loops
