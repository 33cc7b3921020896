r"""A robot that goes round the same block again and again, as a pose graph with its truth.

::

      ______________
     /    ____      \        k: a pose every 2 pi / per_round; in the plane, or climbing a ramp in space
    |    |    |      |       odometry: from each pose to the next
    |    |____|   k--|--k'   loop: from a pose to the one that stood at this place a round before
     \______________/        false loop: between two places, with what a true loop measured elsewhere

An edge measures Z = X_i^-1 X_j Exp(eta) with eta ~ N(0, Omega^-1): at the true poses its error is -eta
itself, Gaussian in all coordinates, so the chi² of the solved graph has the law of chi-square with
d (edges - nodes + 1) degrees of freedom, as far as the graph is linear.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.posegraph import PoseGraph, odometry_start
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, tangent_size
from vslam_ref.geometry import se3, sim3, so3

RADIUS = 10.0
RAMP = 1.5
"""Metres that the robot climbs in a round, in space."""
SIGMA_M, SIGMA_RAD, SIGMA_LOG = 0.05, 0.01, 0.01
"""Standard deviations of an edge: of each coordinate of translation, rotation, and of the log-scale."""
SEEN = 0.4
"""Share of the poses that recognise their place of the round before."""


class Rounds(NamedTuple):
    """A graph at its odometry, the poses ``true (n, ...)``, and which edges ``false (m,)`` are."""

    graph: PoseGraph
    true: Array
    false: BoolArray


def make_rounds(
    space: Space,
    rng: np.random.Generator,
    *,
    rounds: int = 4,
    per_round: int = 40,
    false_loops: int = 0,
    noise: float = 1.0,
) -> Rounds:
    """Make a graph.

    Parameters
    ----------
    space : {"se2", "se3", "sim3"}
    rng : Generator
    rounds, per_round : int
        Rounds, at least 2, and poses in each, at least 8.
    false_loops : int
        Edges between two places that copy the measurement of a true loop.
    noise : float
        Factor on all standard deviations; the information tells the true ones.

    Returns
    -------
    Rounds

    Examples
    --------
    >>> made = make_rounds("se3", np.random.default_rng(0), rounds=2, per_round=20, false_loops=3)
    >>> made.graph.sizes[0], int(made.false.sum())
    (40, 3)
    """
    group, d, n = GROUPS[space], tangent_size(space), rounds * per_round
    true = true_poses(space, n, per_round)
    again = np.arange(per_round, n)
    again = again[rng.uniform(size=len(again)) < SEEN]
    tail = np.concatenate([np.arange(n - 1), again - per_round]).astype(np.int64)
    head = np.concatenate([np.arange(1, n), again]).astype(np.int64)
    sigma = noise * np.array({3: [SIGMA_M] * 2 + [SIGMA_RAD]}.get(d, [SIGMA_M] * 3 + [SIGMA_RAD] * 3))
    sigma = np.append(sigma, noise * SIGMA_LOG) if d == 7 else sigma
    eta = sigma * rng.standard_normal((len(tail), d))
    measured = group.compose(group.between(true[tail], true[head]), group.exp(eta))
    i, j, copied = _false(false_loops, n, per_round, np.arange(n - 1, len(tail)), rng)
    tail, head = np.concatenate([tail, i]), np.concatenate([head, j])
    measured = np.concatenate([measured, measured[copied]])
    information = np.broadcast_to(np.diag(sigma**-2.0), (len(tail), d, d))
    start = np.broadcast_to(group.identity(), true.shape).copy()
    start[0] = true[0]
    graph = PoseGraph(space, start, tail, head, measured, information)
    return Rounds(graph.at(odometry_start(graph)), true, np.arange(len(tail)) >= len(tail) - len(i))


def true_poses(space: Space, n: int, per_round: int) -> Array:
    """Poses on a circle, looking ahead: in the plane, or on a ramp that leans inwards."""
    angle = 2.0 * np.pi * np.arange(n) / per_round
    x, y = RADIUS * np.cos(angle), RADIUS * np.sin(angle)
    if space == "se2":
        ahead = np.arctan2(np.cos(angle), -np.sin(angle))
        return np.stack([x, y, ahead], -1)
    t = np.stack([x, y, RAMP * angle / (2.0 * np.pi)], -1)
    turn = so3.exp((angle + np.pi / 2)[:, None] * np.array([0.0, 0.0, 1.0]))
    lean = so3.exp(np.array([0.2, -0.1, 0.0]))
    if space == "se3":
        return se3.from_rt(turn @ lean, t)
    return sim3.from_srt(np.exp(0.2 * np.sin(angle)), turn @ lean, t)


def _false(
    count: int, n: int, per_round: int, loops: IntArray, rng: np.random.Generator
) -> tuple[IntArray, IntArray, IntArray]:
    """Ends of false loops, and the true loop that each copies."""
    i = np.zeros(count, dtype=np.int64)
    j = np.zeros(count, dtype=np.int64)
    for k in range(count):
        while True:
            i[k], j[k] = rng.integers(n, size=2)
            # a place at least an eighth of a round away: the copied measurement is wrong by metres
            apart = (int(j[k]) - int(i[k])) % per_round
            if min(apart, per_round - apart) >= per_round // 8 and abs(int(i[k]) - int(j[k])) > 1:
                break
    return i, j, rng.choice(loops, count) if count else np.zeros(0, dtype=np.int64)
