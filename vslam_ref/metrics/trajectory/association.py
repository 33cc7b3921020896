"""Which estimated pose belongs to which true one: by time.

Two recorders have two clocks and two rates.  Each pose of the trajectory with fewer poses (of the estimate,
if they have equally many) chooses the pose of the other that is nearest in time, and drops out if that one
is more than ``max_difference`` away.  If several choose the same pose, the nearest keeps it and the others
drop out.  So every pose is used once at most, and the pairs are in the order of time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray

MAX_DIFFERENCE = 0.01
"""Seconds.  Half the interval of 50 Hz; a hand-held camera at 0.5 m/s moves 5 mm in it."""


class Pairs(NamedTuple):
    """Numbers of the poses that belong together.

    Attributes
    ----------
    estimate, truth : ndarray of int, shape (M,)
        Numbers of poses, no unit; both rise strictly.
    """

    estimate: IntArray
    truth: IntArray


def associate(
    times_estimate: ArrayLike, times_truth: ArrayLike, max_difference: float = MAX_DIFFERENCE
) -> Pairs:
    """Pair poses that are nearest in time.

    Parameters
    ----------
    times_estimate, times_truth : array_like, shapes (N,), (K,)
        Seconds, of one clock, not falling.
    max_difference : float
        Seconds; a pair this far apart still counts.

    Returns
    -------
    Pairs
        Possibly none.

    Raises
    ------
    ValueError
        If times are missing, fall or are not finite, or ``max_difference`` is negative.

    Notes
    -----
    Where two poses are equally near, the earlier is chosen.  In seconds since 1970 a double has steps of
    2.4e-7 s: a limit is not met more sharply than that.

    Examples
    --------
    >>> associate([0.0, 1.0, 2.0], [0.004, 0.98, 2.003, 2.001])
    Traceback (most recent call last):
        ...
    ValueError: times_truth must not fall: 2.001 at 3 after 2.003
    >>> associate([0.0, 1.0, 2.0], [0.004, 0.98, 2.001, 2.003])
    Pairs(estimate=array([0, 2]), truth=array([0, 2]))
    """
    a = _times(times_estimate, "times_estimate")
    b = _times(times_truth, "times_truth")
    if not max_difference >= 0:
        raise ValueError(f"max_difference is {max_difference:g} s: need 0 or more")
    if len(a) <= len(b):
        return Pairs(*_choose(a, b, max_difference))
    j, i = _choose(b, a, max_difference)
    return Pairs(i, j)


def _times(times: ArrayLike, name: str) -> Array:
    t = np.asarray(times, dtype=np.float64)
    if t.ndim != 1 or len(t) == 0 or not np.isfinite(t).all():
        raise ValueError(f"{name} {t.shape}: need (N,), N >= 1, finite seconds")
    falls = np.flatnonzero(np.diff(t) < 0)
    if len(falls):
        at = int(falls[0]) + 1
        raise ValueError(f"{name} must not fall: {t[at]} at {at} after {t[at - 1]}")
    return t


def _choose(few: Array, many: Array, max_difference: float) -> tuple[IntArray, IntArray]:
    """Each of ``few`` (N,) chooses among ``many`` (K,); shapes of the answer (M,), (M,)."""
    after = np.searchsorted(many, few)  # the first that is not earlier
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, len(many) - 1)
    # of several equal times the first stands for all
    before = np.searchsorted(many, many[before])
    chosen = np.where(np.abs(many[before] - few) <= np.abs(many[after] - few), before, after)
    distance = np.abs(many[chosen] - few)
    # by choice, then by distance: the first of each choice keeps it
    order = np.lexsort((distance, chosen))
    order = order[distance[order] <= max_difference]
    _, first = np.unique(chosen[order], return_index=True)
    kept = np.sort(order[first]).astype(np.int64)
    return kept, chosen[kept].astype(np.int64)
