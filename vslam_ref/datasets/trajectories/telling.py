"""Sentences about what is odd in a trajectory's file and harmless."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.trajectories.names import UNIT_NAMES

FOUR_DECIMALS = {"quaternion": 1e-4, "matrix": 2e-4}
"""How far four decimals move a quaternion's length, and the entries of R^T R, from those of a rotation."""


def count(number: int, what: str) -> str:
    """A number and its noun.

    Examples
    --------
    >>> count(1, "line"), count(2, "line")
    ('1 line', '2 lines')
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


def unit(found: str, usual: str) -> list[str]:
    """Times in another unit than that of the format."""
    if found == usual:
        return []
    return [
        f"the times are {UNIT_NAMES[found]} since 1970, not {UNIT_NAMES[usual]}, by their size: read as such"
    ]


def lost(lines: Sequence[int], total: int) -> list[str]:
    """Lines without a pose."""
    if not lines:
        return []
    which = f"nan, or a rotation of zeros; first: line {lines[0]}"
    return [f"{count(len(lines), 'line')} of {total} without a pose ({which}): lost frames, left out"]


def falling(times: Array, lines: IntArray) -> list[str]:
    """Times that go back from a line to the next."""
    step = np.diff(times)
    at = np.flatnonzero(step < 0)
    if not len(at):
        return []
    where = f"first: line {lines[at[0] + 1]}, by at most {-step.min():.6g} s"
    return [f"the time goes back {_times(len(at))} ({where}): the poses are put in the order of time"]


def doubled(lines: IntArray, total: int) -> list[str]:
    """Poses with the time of an earlier line."""
    if not len(lines):
        return []
    what = (
        f"{count(len(lines), 'pose')} of {total} with the time of an earlier line (first: line {lines.min()})"
    )
    digits = "; were the times written with too few digits?" if 2 * len(lines) > total else ""
    return [f"{what}: the first pose of each time is used{digits}"]


def lengths(unit_error: float) -> list[str]:
    """Quaternions that four decimals do not explain."""
    if unit_error <= FOUR_DECIMALS["quaternion"]:
        return []
    return [f"quaternion lengths are up to {unit_error:.1e} off 1, as with three decimals: normalised"]


def matrices(unit_error: float) -> list[str]:
    """Matrices that four decimals do not explain."""
    if unit_error <= FOUR_DECIMALS["matrix"]:
        return []
    return [f"R^T R is up to {unit_error:.1e} off the identity, as with three decimals: used as it is"]


def passed_over(columns: int, first: int, names: tuple[str, ...]) -> str:
    """Columns that are not read, where no header says what they are."""
    what, order = f"{columns} columns without names", ", ".join(names)
    if first == 0:
        return f"{what}: the first 8 are read as {order}, the others are not read"
    return f"{what}: the first is taken for the number of the pose, the next 8 are read as {order}"


def _times(number: int) -> str:
    return "once" if number == 1 else f"{number} times"
