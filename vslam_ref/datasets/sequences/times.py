"""When pictures were taken: from a file, by a rate, and what is odd about the stamps."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import read_columns

RATE = 30.0
"""Pictures a second where nothing says how many."""
LONGEST = 1e12
"""Seconds; a stamp must be smaller in size."""


def read_times(path: Path) -> Array:
    """Read one time a line, seconds, shape (N,).  They may be equal or fall: that is told by :func:`odd`.

    Raises
    ------
    FormatError
        On a line that is not one finite number below ``LONGEST``, or no line at all.
    """
    table = read_columns(path, ("time",))
    times = table.values[:, 0]
    table.require(
        np.abs(times) < LONGEST, lambda k: f"time is {times[k]:g} s; expected less than {LONGEST:g}"
    )
    return np.array(times)


def by_rate(count: int, rate: float | None) -> tuple[Array, str]:
    """Times k / rate of ``count`` pictures, seconds, and the sentence that tells it.

    Examples
    --------
    >>> by_rate(3, None)[1]
    'no times: picture k, from 0, is at k/30 s'
    """
    hertz = RATE if rate is None else rate
    why = "no times" if rate is None else "times by the rate that was given"
    return np.arange(count) / hertz, f"{why}: picture k, from 0, is at k/{hertz:g} s"


def odd(times: Array) -> list[str]:
    """Sentences about equal stamps and stamps that fall.

    Examples
    --------
    >>> odd(np.array([0.0, 0.1, 0.1, 0.2]))
    ['1 time(s) equal to the one before, first at picture 2']
    """
    step = np.diff(times)
    found = []
    for which, what in ((step == 0, "equal to"), (step < 0, "earlier than")):
        if which.any():
            first = int(np.argmax(which)) + 1
            found.append(f"{which.sum()} time(s) {what} the one before, first at picture {first}")
    return found
