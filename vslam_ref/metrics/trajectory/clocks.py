r"""How two clocks would meet: in which unit, and with which offset, two trajectories are of the same time.

::

    estimate           |--x--x--x--x--|                           7200.0 ... 7206.0
    truth     |--o--o--o--o--o--o--o--o--o--|                     0.0 ... 9.0
                       <----- offset -----

Candidates are units that are a thousand apart, whole half hours (zones), first on first, last on last, and
the offset at which the speeds of the two are most alike.  Each is judged by what it is for: how many poses
find a partner, and how well the paths then agree in shape (aligned by a similarity, as a camera alone has no
scale).  Without motion nothing speaks for one offset or another, and the first in this list is named.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.metrics.trajectory.association import Pairs, associate
from vslam_ref.metrics.trajectory.ate import LEAST_PAIRS, absolute_error
from vslam_ref.metrics.trajectory.poses import Trajectory

FACTORS = (1.0, 1e-3, 1e-6, 1e-9, 1e3, 1e6, 1e9)
"""Seconds of the truth's unit in one of the estimate's."""
UNIT_NAMES = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
ZONE = 1800.0
"""Seconds: clocks of two zones are whole half hours apart."""
LARGEST_ZONE = 26 * 3600.0
SHARE = 0.3
"""Share of the poses of the shorter trajectory that must find a partner."""
MISFIT = 0.2
"""Largest error of the shape, as a share of the spread of the true positions."""
AS_GOOD = 0.02
"""Misfits this small do not tell one candidate from another."""
GRID = 3000
"""Points of time at which speeds are compared."""
ALIKE = 0.5
"""Least correlation of speeds."""


class Meeting(NamedTuple):
    """How times of the estimate become times of the truth: ``factor * time + offset``.

    Attributes
    ----------
    factor : float
        Of ``FACTORS``; 1 where the units are the same.
    offset : float
        Seconds.
    pairs : int
        Poses that then find a partner.
    poses : int
        Poses of the estimate with different times.
    misfit : float
        Root mean square error of the aligned shape, divided by that of the truth about its mean; no unit.
    """

    factor: float
    offset: float
    pairs: int
    poses: int
    misfit: float


def meeting(estimate: Trajectory, truth: Trajectory, max_difference: float) -> Meeting | None:
    """Find the unit and the offset with which two trajectories are of the same time.

    Parameters
    ----------
    estimate, truth : Trajectory
        With times.
    max_difference : float
        Between the two poses of a pair, at most; seconds.

    Returns
    -------
    Meeting or None
        None where no candidate pairs enough poses, or none gives the estimate the shape of the truth.

    Examples
    --------
    >>> times, path = np.arange(20.0), np.random.default_rng(0).normal(size=(20, 3))
    >>> truth = Trajectory(times, path, np.broadcast_to(np.eye(3), (20, 3, 3)))
    >>> meeting(truth.later(3600.0), truth, 0.01)[:4]
    (1.0, -3600.0, 20, 20)
    """
    a, b = _distinct(estimate), _distinct(truth)
    if min(len(a), len(b)) < LEAST_PAIRS:
        return None
    least = max(LEAST_PAIRS, int(np.ceil(SHARE * min(len(a), len(b)))))
    found = []
    for factor in FACTORS:
        # in seconds, both: the one whose numbers are the larger by the factor is divided
        mine = a if factor == 1 else _scaled(a, min(factor, 1.0))
        theirs = b if factor <= 1 else _scaled(b, 1 / factor)
        if not _spans_alike(mine, theirs):
            continue
        for offset in _offsets(mine, theirs):
            pairs = associate(_times(mine) + offset, _times(theirs), max_difference)
            if len(pairs.truth) >= least:
                misfit = shape_misfit(mine, theirs, pairs)
                found.append(Meeting(factor, offset, len(pairs.truth), len(a), misfit))
    good = min((one.misfit for one in found), default=np.inf)
    if good > MISFIT:
        return None
    return next(one for one in found if one.misfit <= max(2 * good, AS_GOOD))


def shape_misfit(estimate: Trajectory, truth: Trajectory, pairs: Pairs) -> float:
    """Error of an estimate's shape: of the aligned positions, as a share of the true positions' spread.

    Parameters
    ----------
    estimate, truth : Trajectory
    pairs : Pairs
        Three or more.

    Returns
    -------
    float
        No unit; 0 where one of them stands still, as nothing then speaks against it.
    """
    true = truth.take(pairs.truth)
    try:
        error = absolute_error(estimate.take(pairs.estimate), true, "sim3").stats.rmse
    except ValueError:
        return 0.0
    return error / float(np.sqrt(true.t_world_body.var(axis=0).sum()))


def _times(path: Trajectory) -> Array:
    assert path.times is not None
    return path.times


def _distinct(path: Trajectory) -> Trajectory:
    return path.take(np.unique(_times(path), return_index=True)[1])


def _scaled(path: Trajectory, factor: float) -> Trajectory:
    return Trajectory(_times(path) * factor, path.t_world_body, path.R_world_body)


def _spans_alike(a: Trajectory, b: Trajectory) -> bool:
    """Whether the lengths in time allow that one is of a part of the other: not a hundredth of it."""
    mine, theirs = (float(_times(path)[-1] - _times(path)[0]) for path in (a, b))
    return max(mine, theirs) <= 50 * min(mine, theirs)


def _offsets(a: Trajectory, b: Trajectory) -> Iterator[float]:
    """Candidates, the plainest first; each also moved so that the times of most poses are the same."""
    mine, theirs = _times(a), _times(b)
    low, high = theirs[0] - mine[-1], theirs[-1] - mine[0]
    low, high = max(low, -LARGEST_ZONE), min(high, LARGEST_ZONE)
    zones = (np.arange(np.ceil(low / ZONE), np.floor(high / ZONE) + 1) * ZONE).tolist()
    plain = sorted(zones, key=abs)
    lag = speed_lag(a, b)
    plain += [] if lag is None else [lag]
    plain += [float(theirs[0] - mine[0]), float(theirs[-1] - mine[-1])]
    for offset in plain:
        if offset in zones:
            yield offset
        shift = nearest(theirs, mine + offset) - (mine + offset)
        yield round(offset + float(np.median(shift)), 6)


def nearest(among: Array, times: Array) -> Array:
    """Return the nearest of some times to each of others.

    Parameters
    ----------
    among : ndarray, shape (K,)
        In seconds, rising.
    times : ndarray, shape (N,)

    Returns
    -------
    ndarray, shape (N,)

    Examples
    --------
    >>> nearest(np.array([0.0, 1.0]), np.array([-3.0, 0.4, 0.6])).tolist()
    [0.0, 0.0, 1.0]
    """
    after = np.minimum(np.searchsorted(among, times), len(among) - 1)
    before = np.maximum(after - 1, 0)
    near: Array = np.where(times - among[before] <= np.abs(among[after] - times), among[before], among[after])
    return near


def speed_lag(estimate: Trajectory, truth: Trajectory) -> float | None:
    """Offset at which the speeds of two trajectories are most alike.

    Parameters
    ----------
    estimate, truth : Trajectory
        With times, two or more.

    Returns
    -------
    float or None
        The seconds to add to the estimate's times; None where the correlation stays below ``ALIKE``.

    Notes
    -----
    A speed is the same in every frame of the world, and correlation does not see a scale.  At least half of
    the shorter trajectory lies within the longer.
    """
    steps = [float(np.median(np.diff(_times(path)))) for path in (estimate, truth)]
    spans = [float(np.ptp(_times(path))) for path in (estimate, truth)]
    dt = max(*steps, max(spans) / GRID)
    x, y = (_speeds(path, dt) for path in (estimate, truth))
    if min(len(x), len(y)) < 8:
        return None
    r, n = _correlations(x, y)
    r[~np.isfinite(r) | (n < min(len(x), len(y)) / 2)] = -1
    at = int(np.argmax(r))
    if r[at] < ALIKE:
        return None
    lag = at - (len(x) - 1)
    return float(_times(truth)[0] - _times(estimate)[0] + lag * dt)


def _correlations(x: Array, y: Array) -> tuple[Array, Array]:
    """Correlation of ``x`` with ``y`` moved by each lag, and how many numbers overlap there."""
    ones_x, ones_y = np.ones_like(x), np.ones_like(y)

    def total(u: Array, v: Array) -> Array:
        return np.correlate(v, u, "full")

    n, sum_x, sum_y = total(ones_x, ones_y), total(x, ones_y), total(ones_x, y)
    spread_x = n * total(x * x, ones_y) - sum_x**2
    spread_y = n * total(ones_x, y * y) - sum_y**2
    with np.errstate(invalid="ignore", divide="ignore"):
        return (n * total(x, y) - sum_x * sum_y) / np.sqrt(np.maximum(spread_x * spread_y, 0)), n


def _speeds(path: Trajectory, dt: float) -> Array:
    """Distance moved in each step of a regular grid of times."""
    times = _times(path)
    grid = np.arange(times[0], times[-1] + dt / 2, dt)
    at = np.stack([np.interp(grid, times, axis) for axis in path.t_world_body.T], axis=1)
    return np.asarray(np.linalg.norm(np.diff(at, axis=0), axis=1))
