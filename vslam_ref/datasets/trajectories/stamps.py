"""Times as programs write them: seconds, milli-, micro- or nanoseconds, told apart by date and rate.

=============  =======================  ===============================
unit           a time of the year 2014  steps of a camera of 20 Hz
=============  =======================  ===============================
seconds        1403636580.05            0.05
milliseconds   1403636580050            50
microseconds   1403636580050000         50 000
nanoseconds    1403636580050000000      50 000 000
=============  =======================  ===============================

Clocks that count from 1970 say their unit themselves: in one unit only is the date of this age.  Times that
begin at zero do not; they are taken in the unit of the format, and only another trajectory shows that this
is wrong.
"""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.text import FormatError, number
from vslam_ref.datasets.trajectories.formats import seconds
from vslam_ref.datasets.trajectories.names import UNITS

EARLIEST, LATEST = 631_152_000.0, 4_102_444_800.0
"""Seconds since 1970: of the years 1990 and 2100."""
LONGEST_STEP = 600.0
"""Seconds; in the right unit half the steps of a trajectory are shorter."""
MOST = 9 * 10**18
"""Nanoseconds, a little less than 64 bits hold."""


class Stamps(NamedTuple):
    """Seconds (N,), whole nanoseconds (N,) where the file has them or can be read so, and the file's unit."""

    times: Array
    nanoseconds: IntArray | None
    unit: str


def unit_of(values: Array, usual: str) -> str:
    """Unit of times (N,) that the file gives as they are: the usual one, unless only another makes a date.

    Examples
    --------
    >>> unit_of(np.array([1403636580050.0, 1403636580100.0]), "s")
    'ms'
    >>> unit_of(np.array([0.0, 5e7, 1e8]), "s")  # begins at zero: nothing is known
    's'
    """
    steps = np.diff(np.unique(values))
    step, middle = float(np.median(steps)) if len(steps) else 0.0, float(np.median(values))

    def plausible(unit: str) -> bool:
        scale = 10.0 ** -UNITS[unit]
        return EARLIEST <= middle * scale <= LATEST and step * scale <= LONGEST_STEP

    return usual if plausible(usual) else next((unit for unit in UNITS if plausible(unit)), usual)


def read_stamps(path: Path, lines: list[int], words: list[list[str]], usual: str, stated: bool) -> Stamps:
    """Times of lines from the word, or the words for seconds and nanoseconds, of each.

    Parameters
    ----------
    usual : str
        Unit of the format.
    stated : bool
        Whether a header says so; else the dates may show another.

    Raises
    ------
    FormatError
        At a time that is no finite number, or beyond the year 2255.
    """
    if len(words[0]) == 2:
        return _of_two(path, lines, words)
    flat = [row[0] for row in words]
    values = np.array([number(path, line, word, "time") for line, word in zip(lines, flat, strict=True)])
    unit = usual if stated else unit_of(values, usual)
    if unit == "s":
        return Stamps(values, None, unit)
    shift = 9 - UNITS[unit]
    ns = [_whole(path, line, word, value, shift, unit)
          for line, word, value in zip(lines, flat, values.tolist(), strict=True)]  # fmt: skip
    exact = np.array(ns, dtype=np.int64)
    return Stamps(seconds(exact), exact, unit)


def is_whole(word: str) -> bool:
    """Whether a number of a file is whole: ``1403636580050000000``, also with ``.000000``, ``5e8``."""
    try:
        value = float(word)
    except ValueError:
        return False
    return abs(value) < 1e30 and Decimal(word) == Decimal(word).to_integral_value()


def _whole(path: Path, line: int, word: str, value: float, shift: int, unit: str) -> int:
    """Whole nanoseconds of a word; those of a file in nanoseconds must be whole."""
    if abs(value) * 10.0**shift >= MOST or (unit == "ns" and not is_whole(word)):
        what = "whole nanoseconds below 9e18" if unit == "ns" else "a time before the year 2255"
        raise FormatError(path, line, f"time [{unit}] is {word!r}; expected {what}")
    return round(Decimal(word).scaleb(shift))


def _of_two(path: Path, lines: list[int], words: list[list[str]]) -> Stamps:
    """Times of two columns, whole seconds and nanoseconds."""
    ns = []
    for line, (a, b) in zip(lines, words, strict=True):
        whole, rest = number(path, line, a, "seconds"), number(path, line, b, "nanoseconds")
        if not (abs(whole) < 9e9 and 0 <= rest < 1e9):
            raise FormatError(
                path, line, f"time is {a} s and {b} ns; expected less than 9e9 s, and 0 to 1e9 ns"
            )
        ns.append(_whole(path, line, a, whole, 9, "ns") + _whole(path, line, b, rest, 0, "ns"))
    exact = np.array(ns, dtype=np.int64)
    return Stamps(seconds(exact), exact, "s")
