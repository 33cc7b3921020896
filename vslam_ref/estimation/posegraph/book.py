"""Pose graph optimisation as the chapter derives it: full matrices, the text's letters, one loop.

::

    for every edge (i, j, Z, Omega):
        D = Z^-1 X_i^-1 X_j           what is left between what the poses say and what was measured
        e = Log(D)                    the same as a tangent vector
        B = J_r^-1(e)                 how e changes when X_j moves, X_j Exp(delta_j)
        A = -B Ad((X_i^-1 X_j)^-1)    and when X_i does
        add A' Omega A, A' Omega B, ... to H, A' Omega e, B' Omega e to g
    hold the first pose               else the whole graph may float
    solve (H + lambda diag H) delta = -g
    X_k <- X_k Exp(delta_k)

The matrix has d n rows, most of it zero; the fast form never writes down the zeros.  A test asserts that both
take the same steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.posegraph.graph import PoseGraph
from vslam_ref.estimation.posegraph.spaces import GROUPS, tangent_size


class BookGraph(NamedTuple):
    """Poses ``X (n, ...)`` where it ended, and chi² (no unit) at the start and after every step tried."""

    X: Array
    chi2: list[float]


class DenseNormal(NamedTuple):
    """Normal matrix ``H (dn, dn)``, gradient ``g (dn,)``, and chi² of the graph at some poses."""

    H: Array
    g: Array
    chi2: float


def dense_normal(graph: PoseGraph, X: Array, weight: Callable[[float], float] = lambda c: 1.0) -> DenseNormal:
    """Add up the normal equations edge by edge.

    Implements :eq:`eq-graph-normal`.

    Parameters
    ----------
    graph : PoseGraph
    X : ndarray, shape (n, 3) or (n, 4, 4)
        Poses.
    weight : callable
        Weight of an edge from its chi², 1 for least squares.

    Returns
    -------
    DenseNormal
    """
    group, d = GROUPS[graph.space], tangent_size(graph.space)
    H, g, chi2 = np.zeros((d * len(X), d * len(X))), np.zeros(d * len(X)), 0.0
    for i, j, Z, Omega in zip(graph.tail, graph.head, graph.measured, graph.information, strict=True):
        M = group.between(X[i], X[j])
        e = group.log(group.between(Z, M))  # eq-edge-error
        B = group.left_jacobian_inverse(-e)  # eq-edge-jacobians
        A = -B @ group.adjoint(group.inverse(M))
        c = float(e @ Omega @ e)
        w, at_i, at_j = weight(c), slice(d * i, d * i + d), slice(d * j, d * j + d)
        H[at_i, at_i] += w * A.T @ Omega @ A
        H[at_j, at_j] += w * B.T @ Omega @ B
        H[at_i, at_j] += w * A.T @ Omega @ B
        H[at_j, at_i] += w * B.T @ Omega @ A
        g[at_i] += w * A.T @ Omega @ e
        g[at_j] += w * B.T @ Omega @ e
        chi2 += c
    return DenseNormal(H, g, chi2)


def dense_step(graph: PoseGraph, X: Array, lam: float = 0.0) -> Array:
    """One damped step of poses X (n, ...), (n, d) in metres and radians; zero for fixed ones."""
    d = tangent_size(graph.space)
    H, g, _ = dense_normal(graph, X)
    free = np.repeat(~graph.fixed, d)
    delta = np.zeros(len(g))
    damped = H + lam * np.diag(np.diag(H))
    delta[free] = np.linalg.solve(damped[np.ix_(free, free)], -g[free])
    return delta.reshape(-1, d)


def pose_graph(graph: PoseGraph, iterations: int = 20, lam: float = 1e-4) -> BookGraph:
    """Minimise chi² = sum e' Omega e by Levenberg-Marquardt.

    Implements :eq:`eq-graph-chi2`.

    Parameters
    ----------
    graph : PoseGraph
        With poses to start from.
    iterations : int
        Steps to try.
    lam : float
        First damping; 0 is Gauss-Newton.

    Returns
    -------
    BookGraph
    """
    group, X = GROUPS[graph.space], graph.T_world
    chi2 = [dense_normal(graph, X).chi2]
    for _ in range(iterations):
        X_new = group.compose(X, group.exp(dense_step(graph, X, lam)))
        tried = dense_normal(graph, X_new).chi2
        if tried < chi2[-1]:
            X, lam = X_new, lam / 3.0
        else:
            lam, tried = lam * 2.0, chi2[-1]
        chi2.append(tried)
        if chi2[-2] - tried < 1e-15 * tried:
            break
    return BookGraph(X, chi2)
