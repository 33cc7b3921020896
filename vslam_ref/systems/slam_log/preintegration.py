"""Odometry between sightings summed into one relative pose with its covariance.

A batch solution keeps one pose per sighting time.  Between two of them lie many odometry steps, each
with independent noises in ds and dalpha.  A noise in step i moves the end of the interval by::

    d(x, y) = (cos theta_i, sin theta_i) e_ds + S (p_end - p_i) e_dalpha,     d theta = e_dalpha

with S the quarter turn.  Sums of these squares over an interval are differences of running sums, so
all intervals are done at once.  Poses are in metres and radians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se2, so2
from vslam_ref.systems.slam_log.timeline import Timeline


class RelativePoses(NamedTuple):
    """Relative poses, ``mean (K - 1, 3)`` with ``cov (K - 1, 3, 3)``, of K nodes, in each start's frame."""

    mean: Array
    cov: Array


def dead_reckoning(increments: Array) -> Array:
    """Poses from increments; each moves along its middle heading.

    Parameters
    ----------
    increments : ndarray, shape (K, 2)
        ds (m) and dalpha (rad).

    Returns
    -------
    ndarray, shape (K + 1, 3)
        In the frame of the start; theta is not wrapped.
    """
    theta = np.concatenate([[0.0], np.cumsum(increments[:, 1])])
    middle = theta[:-1] + increments[:, 1] / 2
    step = increments[:, :1] * np.stack([np.cos(middle), np.sin(middle)], -1)
    return np.column_stack([np.vstack([np.zeros(2), np.cumsum(step, 0)]), theta])


def preintegrate(line: Timeline, nodes: IntArray) -> RelativePoses:
    """Relative poses between consecutive nodes, with covariances.

    Parameters
    ----------
    line : Timeline
    nodes : ndarray of int, shape (K,)
        Cut indices, increasing.

    Returns
    -------
    RelativePoses
        Metres and radians, each in the frame of its start.
    """
    path = dead_reckoning(line.increments)
    var_s, var_a = line.cov[:, 0, 0], line.cov[:, 1, 1]
    c, s = np.cos(path[:-1, 2]), np.sin(path[:-1, 2])
    x, y = path[1:, 0], path[1:, 1]  # a turn happens at the end of its step
    terms = [var_s * c * c, var_s * c * s, var_s * s * s]
    terms += [var_a, var_a * x, var_a * y, var_a * x * x, var_a * x * y, var_a * y * y]
    sums = np.vstack([np.zeros(9), np.cumsum(np.stack(terms, -1), 0)])[nodes]
    cc, cs, ss, a, ax, ay, axx, axy, ayy = np.diff(sums, axis=0).T
    X, Y = path[nodes[1:], :2].T
    # sums of (X - x_i)^2 var_i and the like, by expanding the square
    lever_x, lever_y = X * a - ax, Y * a - ay
    xx = X * X * a - 2 * X * ax + axx
    xy = X * Y * a - X * ay - Y * ax + axy
    yy = Y * Y * a - 2 * Y * ay + ayy
    world = np.array(
        [[cc + yy, cs - xy, -lever_y], [cs - xy, ss + xx, lever_x], [-lever_y, lever_x, a]]
    ).transpose(2, 0, 1)
    start, end = path[nodes[:-1]], path[nodes[1:]]
    R = np.zeros((len(start), 3, 3))
    R[:, :2, :2], R[:, 2, 2] = so2.exp(-start[:, 2]), 1.0
    place = so2.rotate(-start[:, 2], (end - start)[:, :2])
    mean = np.column_stack([place, so2.wrap(end[:, 2] - start[:, 2])])
    return RelativePoses(mean, R @ world @ R.swapaxes(1, 2))


def poses_between(line: Timeline, nodes: Array) -> Array:
    """Poses (R, 3) at the records of ``line``, given those at its sightings, ``nodes`` (K, 3).

    Between two nodes odometry is trusted but for what it misses at the end: the heading it misses is
    spread evenly over the time between, and the place that is then still missed is spread likewise.
    """
    at, end = line.sighting_at, len(line.times) - 1
    path = dead_reckoning(line.increments)
    span = np.maximum(np.diff(line.times[at]), 1e-9)
    missed = so2.wrap(np.diff(nodes[:, 2]) - np.diff(path[at, 2])) * (np.diff(line.times[at]) > 0)
    rate = np.concatenate([[0.0], missed / span, [0.0]])
    step_rate = rate[np.searchsorted(at, np.arange(end), side="right")]
    turned = line.increments + np.stack([np.zeros(end), step_rate * np.diff(line.times)], -1)
    path = dead_reckoning(turned)
    ends = se2.compose(nodes[:-1], se2.between(path[at[:-1]], path[at[1:]]))
    left = np.vstack([nodes[1:, :2] - ends[:, :2], np.zeros(2)])
    k = np.clip(np.searchsorted(at, line.record_at, side="right") - 1, 0, len(at) - 1)
    poses = se2.compose(nodes[k], se2.between(path[at[k]], path[line.record_at]))
    since = np.maximum(line.times[line.record_at] - line.times[at[k]], 0.0)
    poses[:, :2] += left[k] * (since / np.append(span, 1.0)[k])[:, None]
    return poses
