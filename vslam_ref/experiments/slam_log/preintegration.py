"""Odometry between sightings summed into one relative pose with its covariance.

A batch solution keeps one pose per sighting time.  Between two of them lie many odometry steps, each
with independent noises in ds and dalpha.  A noise in step i moves the end of the interval by::

    d(x, y) = (cos theta_i, sin theta_i) e_ds + S (p_end - p_i) e_dalpha,     d theta = e_dalpha

with S the quarter turn.  Sums of these squares over an interval are differences of running sums, so
all intervals are done at once.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.geometry import se2, so2
from vslam_ref.systems.slam_log.timeline import Timeline

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


class RelativePoses(NamedTuple):
    """Relative poses (K - 1, 3) between K nodes and covariances (K - 1, 3, 3), in each start's frame."""

    mean: Array
    cov: Array


def dead_reckoning(increments: Array) -> Array:
    """Poses (K + 1, 3) from increments (K, 2); each moves along the middle heading. theta is not wrapped."""
    theta = np.concatenate([[0.0], np.cumsum(increments[:, 1])])
    middle = theta[:-1] + increments[:, 1] / 2
    step = increments[:, :1] * np.stack([np.cos(middle), np.sin(middle)], -1)
    return np.column_stack([np.vstack([np.zeros(2), np.cumsum(step, 0)]), theta])


def preintegrate(line: Timeline, nodes: IntArray) -> RelativePoses:
    """Relative poses between consecutive ``nodes`` (cut indices, increasing)."""
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
    mean = np.column_stack([so2.act(-start[:, 2], (end - start)[:, :2]), so2.wrap(end[:, 2] - start[:, 2])])
    return RelativePoses(mean, R @ world @ R.swapaxes(1, 2))


def compose_chain(relative: Array, start: Array) -> Array:
    """Poses (K, 3) from a start and K - 1 relative poses."""
    poses = [np.asarray(start, dtype=np.float64)]
    for step in relative:
        poses.append(se2.compose(poses[-1], step))
    return np.array(poses)
