"""Chapter 13 in plain NumPy, and its known mistakes on demand: rows of a Jacobian for normal equations."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import plain_motions as motions

Array = Any

LOG = {"se2": motions.se2_log, "se3": motions.se3_log, "sim3": motions.sim3_log}
ADJOINT = {"se2": motions.se2_adjoint, "se3": motions.se3_adjoint, "sim3": motions.sim3_adjoint}
SLOPE = {
    "se2": motions.se2_left_jacobian,
    "se3": motions.se3_left_jacobian,
    "sim3": motions.sim3_left_jacobian,
}


def edge(
    X_i: Array, X_j: Array, Z: Array, convention: str = "log", wrong: str | None = None, *, space: str
) -> dict[str, Array]:
    own = (motions.plane, motions.read_plane) if space == "se2" else (np.asarray, np.asarray)
    i, j, z = (own[0](x) for x in (X_i, X_j, Z))
    M = np.linalg.inv(i) @ j
    D = {"z-not-inverted": z @ M, "edge-reversed": np.linalg.solve(z, np.linalg.inv(M))}.get(
        wrong or "", np.linalg.solve(z, M)
    )
    if (wrong == "other-convention") != (convention == "g2o"):
        e, J = g2o(D, space, wrong)
        e[2] += _turns(X_i, X_j, Z, D) if wrong == "angle-not-wrapped" else 0.0
    else:
        x = own[1](D)
        if wrong == "angle-not-wrapped":
            x = x + [0, 0, _turns(X_i, X_j, Z, D)]
        e = LOG[space](x)
        J = np.linalg.inv(SLOPE[space](e if wrong == "right-for-left" else -e))
    if wrong == "jacobian-forgotten":
        J = np.eye(len(J))
    J_i = -J @ ADJOINT[space](own[1](M if wrong == "adjoint-of-the-inverse" else np.linalg.inv(M)))
    if wrong == "left-steps":
        J_i, J = (A @ np.linalg.inv(ADJOINT[space](own[1](T))) for A, T in ((J_i, i), (J, j)))
    return {"e": e, "J_i": J_i, "J_j": J}


def _turns(X_i: Array, X_j: Array, Z: Array, D: Array) -> float:
    return float(X_j[2] - X_i[2] - Z[2] - np.arctan2(D[1, 0], D[0, 0]))


def g2o(D: Array, space: str, wrong: str | None) -> tuple[Array, Array]:
    if space == "se2":
        J = np.eye(3)
        J[:2, :2] = D[:2, :2]
        return np.array([D[0, 2], D[1, 2], np.arctan2(D[1, 0], D[0, 0])]), J
    q = motions.quaternion_from_rotation(D[:3, :3])
    q = q if q[0] >= 0 else -q
    w, v = q[0], q[1:]
    change = 0.5 * np.vstack([-v, w * np.eye(3) + motions.skew(v)])  # of q, when multiplied by (1, delta / 2)
    some = slice(0, 3) if wrong == "quaternion-order" else slice(1, 4)
    factor = 2.0 if wrong == "whole-angle" else 1.0
    J = np.zeros((6, 6))
    J[:3, :3], J[3:, 3:] = D[:3, :3], factor * change[some]
    return np.concatenate([D[:3, 3], factor * q[some]]), J


def step(
    X: Array,
    tail: Array,
    head: Array,
    Z: Array,
    information: Array,
    convention: str,
    wrong: str | None = None,
) -> dict[str, Any]:
    rows, errors, chi2 = [], [], 0.0
    for i, j, z, given in zip(tail.astype(int), head.astype(int), Z, information, strict=True):
        found = edge(X[i], X[j], z, convention, space="se2")
        W = {
            "information-ignored": np.eye(3),
            "information-inverted": np.linalg.inv(given),
            "upper-triangle": np.triu(given),
            "blocks-swapped": given[[1, 2, 0]][:, [1, 2, 0]],
        }.get(wrong or "", given)
        J = np.zeros((3, 3 * len(X)))
        J[:, 3 * i : 3 * i + 3], J[:, 3 * j : 3 * j + 3] = found["J_i"], found["J_j"]
        rows.append((J, W))
        errors.append(found["e"])
        chi2 += found["e"] @ W @ found["e"]
    H = sum(J.T @ W @ J for J, W in rows)
    g = sum(J.T @ W @ e for (J, W), e in zip(rows, errors, strict=True))
    if wrong == "first-not-held":
        delta = -np.linalg.pinv(H, rcond=1e-10) @ g
    else:
        delta = np.append(np.zeros(3), np.linalg.solve(H[3:, 3:], -g[3:]))
    delta = (-delta if wrong == "uphill" else delta).reshape(-1, 3)
    return {"step": delta, "chi2": chi2 / 2 if wrong == "chi2-halved" else chi2}


def chordal_start(
    tail: Array, head: Array, Z: Array, kappa: Array, tau: Array, wrong: str | None = None
) -> Array:
    tail, head = tail.astype(int), head.astype(int)
    n, m = max(tail.max(), head.max()) + 1, len(tail)
    a, b = np.eye(n)[tail], np.eye(n)[head]
    if wrong == "weights-ignored":
        kappa, tau = np.ones(m), np.ones(m)
    R = Z[:, :3, :3] if wrong == "factors-exchanged" else np.swapaxes(Z[:, :3, :3], 1, 2)
    A = np.einsum("mn,mrc->mrnc", a, R) - np.einsum("mn,rc->mrnc", b, np.eye(3))
    A = (np.sqrt(kappa)[:, None, None, None] * A).reshape(3 * m, 3 * n)
    M = np.linalg.lstsq(A[:, 3:], -A[:, :3], rcond=None)[0].reshape(-1, 3, 3)
    M = M if wrong == "factors-exchanged" else np.swapaxes(M, 1, 2)
    if wrong != "not-projected":
        U, _, Vt = np.linalg.svd(M)
        M = U @ Vt
    R_world = np.concatenate([np.eye(3)[None], M])
    t = Z[:, :3, 3] if wrong == "steps-not-turned" else np.einsum("mij,mj->mi", R_world[tail], Z[:, :3, 3])
    root = np.sqrt(tau)[:, None]
    moved = np.linalg.lstsq((root * (a - b))[:, 1:], -root * t, rcond=None)[0]
    T = np.tile(np.eye(4), (n, 1, 1))
    T[:, :3, :3], T[1:, :3, 3] = R_world, moved
    return T


PROGRAM = {
    "posegraph.se2_edge": partial(edge, space="se2"),
    "posegraph.se3_edge": partial(edge, space="se3"),
    "posegraph.sim3_edge": partial(edge, space="sim3"),
    "posegraph.step": step,
    "posegraph.chordal_start": chordal_start,
}
