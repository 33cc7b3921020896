r"""A loop is closed: the drift of poses and scale, spread over the essential graph.

::

    loop l ............ current c         X_k = S_world_k, scale 1 before the closing
      o   S_l_c          o                edges of before:  Z_ij = X_i^-1 X_j
      |                  |                the loop:         Z_lc = S_l_c, with the scale that has drifted
      o--o--o--o--o--o---o                start: the group of c goes where the loop says,
         essential graph                  X_k' = X_l S_l_c X_c^-1 X_k;  all others stay;  l is held

The graph is solved over Sim(3), with the identity as information of every edge.  Each keyframe ends with a
scale s_k: how long its old unit is in the world.  A camera has no scale, so the pose becomes (R_k, t_k)
without it; the points, which were measured in the keyframe's old unit, take it with them:

.. math:: X' = S_{world,r}\, T_{r,world}\, X, \qquad r \text{ the keyframe the point belongs to.}
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.posegraph import GraphSolution, Options, PoseGraph, solve_graph
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, tangent_size
from vslam_ref.geometry import se3, sim3
from vslam_ref.systems.orbslam.essential_graph import EssentialEdges


class Loop(NamedTuple):
    """What closes a loop.

    Attributes
    ----------
    loop, current : int
        The keyframe of the earlier visit, and the one that recognised it.
    S_loop_current : ndarray, shape (4, 4)
        From the frame of ``current`` to that of ``loop``; translation in the unit of ``loop``.
    group : ndarray of int, shape (g,)
        Keyframes around ``current`` that start where the loop puts them, ``current`` among them.
    pairs : ndarray of int, shape (L, 2)
        More pairs that the loop has joined: one of the group, then one of the other side.
    """

    loop: int
    current: int
    S_loop_current: Array
    group: IntArray
    pairs: IntArray = np.zeros((0, 2), dtype=np.int64)


class Correction(NamedTuple):
    """Keyframes after the closing.

    Attributes
    ----------
    S_world_kf : ndarray, shape (K, 4, 4)
        With the scale of each: from the keyframe's old unit into the world.
    T_kf_world : ndarray, shape (K, 4, 4)
        Poses of the cameras; translations in the unit of the map.
    solution : GraphSolution
        The descent's own record.
    """

    S_world_kf: Array
    T_kf_world: Array
    solution: GraphSolution


def close_loop(
    T_kf_world: ArrayLike,
    edges: EssentialEdges,
    loop: Loop,
    *,
    space: Space = "sim3",
    options: Options | None = None,
) -> Correction:
    """Spread the error of a loop over the essential graph.

    Implements A§3.1's loop closing by :eq:`eq-graph-chi2`, over Sim(3).

    Parameters
    ----------
    T_kf_world : array_like, shape (K, 4, 4)
        Poses before the closing; translations in the unit of the map.
    edges : EssentialEdges
        Of before the closing.
    loop : Loop
    space : {"sim3", "se3"}
        In ``"se3"`` the scale of the loop is dropped: to see what it is good for.
    options : Options, optional
        Of the descent.

    Returns
    -------
    Correction
        Where the descent was not possible, the start; ``solution.reason`` tells.

    Raises
    ------
    ValueError
        If the shapes do not fit, or a keyframe is joined to the loop by no edge.
    """
    group, T = GROUPS[space], np.asarray(T_kf_world, dtype=np.float64)
    X = se3.inverse(T)
    S_l_c = np.asarray(loop.S_loop_current, dtype=np.float64)
    if space == "se3":
        S_l_c = se3.from_rt(sim3.rotation(S_l_c), sim3.translation(S_l_c))
    start = X.copy()
    members = np.union1d(loop.group, [loop.current]).astype(np.int64)
    start[members] = X[loop.loop] @ S_l_c @ T[loop.current] @ X[members]  # eq-loop-start
    pairs = np.concatenate([[[loop.current, loop.loop]], loop.pairs]).astype(np.int64)
    old = group.between(X[edges.tail], X[edges.head])
    new = group.between(start[pairs[:, 0]], X[pairs[:, 1]])
    d = tangent_size(space)
    graph = PoseGraph(
        space,
        start,
        np.concatenate([edges.tail, pairs[:, 0]]),
        np.concatenate([edges.head, pairs[:, 1]]),
        np.concatenate([old, new]),
        np.broadcast_to(np.eye(d), (len(old) + len(new), d, d)),
        np.arange(len(X)) == loop.loop,
    )
    solution = solve_graph(graph, options=options)
    S = solution.graph.T_world
    cameras = se3.from_rt(sim3.rotation(S), sim3.translation(S))
    return Correction(S, se3.inverse(cameras), solution)


def move_points(
    X_world: ArrayLike, reference: ArrayLike, T_kf_world: ArrayLike, S_world_kf: ArrayLike
) -> Array:
    """Points after a closing, each moved with the keyframe that it belongs to.

    Implements A§3.1's closing, for the points: X' = S_world_r T_r_world X.

    Parameters
    ----------
    X_world : array_like, shape (N, 3)
        Points before.
    reference : array_like of int, shape (N,)
        Keyframe of each.
    T_kf_world : array_like, shape (K, 4, 4)
        Poses before the closing.
    S_world_kf : array_like, shape (K, 4, 4)
        Of :func:`close_loop`, from each keyframe's old unit.

    Returns
    -------
    ndarray, shape (N, 3)
        In the unit of the map after.

    Examples
    --------
    >>> doubled = np.diag([2.0, 2.0, 2.0, 1.0])[None]
    >>> move_points([[0.0, 0, 3]], [0], np.eye(4)[None], doubled).tolist()
    [[0.0, 0.0, 6.0]]
    """
    X, r = np.asarray(X_world, dtype=np.float64), np.asarray(reference, dtype=np.int64)
    move = sim3.compose(S_world_kf, T_kf_world)
    return np.asarray(sim3.act(move[r], X))  # eq-loop-points
