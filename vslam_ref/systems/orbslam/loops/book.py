"""A loop closed, as the chapter tells it: sets of pairs, full matrices, one keyframe after another.

::

    E = {(k, parent k)} + loops + {(i, j): shared_ij >= theta_min}
    for every pair of E:  Z_ij = X_i^-1 X_j           as it was before
    for the new pair:     Z_cl = S_l_c^-1             as the loop says
    group of c:           X_k <- X_l S_l_c X_c^-1 X_k
    minimise the sum of |Log(Z_ij^-1 X_i^-1 X_j)|^2 over Sim(3), X_l held
    camera k:             (R_k, t_k), its scale s_k put away
    point p of k:         X_p <- X_k (X_k of before)^-1 X_p

The fast form keeps arrays and sparse blocks.  A test asserts that both agree.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.posegraph import PoseGraph
from vslam_ref.estimation.posegraph.book import pose_graph
from vslam_ref.geometry import se3, sim3


def pairs_of(
    shared: Array, parent: list[int], loops: list[tuple[int, int]], theta_min: int
) -> list[tuple[int, int]]:
    """Pairs of the essential graph, (i, j) with i < j, from common points ``shared (K, K)``, counts."""
    K = len(parent)
    tree = {(min(k, p), max(k, p)) for k, p in enumerate(parent) if p >= 0}
    joined = {(min(i, j), max(i, j)) for i, j in loops}
    strong = {(i, j) for i in range(K) for j in range(i + 1, K) if shared[i, j] >= theta_min}
    return sorted(tree | joined | strong)  # eq-essential-graph


def closed(
    T_kf_world: Array,
    pairs: list[tuple[int, int]],
    loop: tuple[int, int, Array],
    group: list[int],
    X_world: Array,
    home: list[int],
) -> tuple[Array, Array]:
    """Cameras T_kf_world (K, 4, 4) and points (N, 3), in metres, after a loop is closed.

    Implements A§3.1's loop closing by :eq:`eq-graph-chi2`.

    Parameters
    ----------
    T_kf_world : ndarray, shape (K, 4, 4)
        Cameras before.
    pairs : list of pairs of int
        Of the essential graph.
    loop : tuple
        Keyframes l and c, and S_l_c (4, 4).
    group : list of int
        Keyframes that go with c, c among them.
    X_world : ndarray, shape (N, 3)
        Points before.
    home : list of int
        Keyframe of each point.
    """
    at, c, S_l_c = loop
    before = [np.linalg.inv(T) for T in T_kf_world]
    X = [
        before[at] @ S_l_c @ T_kf_world[c] @ before[k] if k in group else before[k]
        for k in range(len(before))
    ]
    Z = [sim3.between(before[i], before[j]) for i, j in pairs] + [np.linalg.inv(S_l_c)]
    ends = np.array([*pairs, (c, at)])
    one = np.array([np.eye(7)] * len(Z))
    held = np.arange(len(X)) == at
    graph = PoseGraph("sim3", np.array(X), ends[:, 0], ends[:, 1], np.array(Z), one, held)
    S = pose_graph(graph, iterations=100).X
    cameras = np.array([se3.inverse(se3.from_rt(sim3.rotation(X_k), X_k[:3, 3])) for X_k in S])
    points = [(S[k] @ T_kf_world[k] @ np.append(p, 1.0))[:3] for p, k in zip(X_world, home, strict=True)]
    return cameras, np.array(points)
