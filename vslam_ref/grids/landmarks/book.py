"""Landmarks among moving things, in full matrices: one corner, one landmark, one scan point at a time.

This is the third map of A's section 4.4 as one would write it on a blackboard.  It is slow, and shares no
code with the fast modules of this room; tests assert that both give the same numbers.  The state is
x = (pose; landmarks) = (x, y, theta, x_1, y_1, x_2, y_2, ...) with one covariance P.

::

    corner  = where two fitted lines of a scan cross                          X, cov_X
    static  = S has a corner near X                                           then X may become a landmark
    which   = the one landmark j with (z - h_j)^T S_j^-1 (z - h_j) <= 9.21    none: new; two: nobody knows
    x, P    = Kalman update with z - h_j                                      first way to find oneself
    p*      = pose from which the scan ends on what is static                 second way, then an update, too
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from vslam_ref.arrays import Array
from vslam_ref.geometry import so2

NONE, AMBIGUOUS = -1, -2
SMOOTH, WINDOW = 0.8, 2.0  # of a corner of S: sigma of its gradients, and of the cells that take part


class Corner(NamedTuple):
    """Place (2,), metres, its covariance (2, 2); direction between the arms, their opening, rad; its kind."""

    xy: Array
    cov: Array
    bisector: float = 0.0
    opening: float = 0.0
    convex: bool = False


def corner(runs: tuple[Array, Array], sigma: float, floor: float) -> Corner:
    """Corner of two straight runs of points (n, 2), with the standard deviation of a range, in metres."""
    lines = []
    for points in runs:
        c = points.mean(axis=0)
        (S_xx, S_xy), (_, S_yy) = (points - c).T @ (points - c)
        phi = 0.5 * math.atan2(2 * S_xy, S_xx - S_yy)
        t, n = np.array([math.cos(phi), math.sin(phi)]), np.array([-math.sin(phi), math.cos(phi)])
        s = (points - c) @ t
        var_offset, var_phi = sigma**2 / len(points), sigma**2 / (s @ s)  # eq-line-variances
        lines.append((c, t, n, var_offset, var_phi))
    N_inv = np.linalg.inv(np.array([n for _, _, n, _, _ in lines]))
    X = N_inv @ [n @ c for c, _, n, _, _ in lines]  # eq-corner-crossing
    D = np.diag([v_o + (t @ (X - c)) ** 2 * v_phi for c, t, _, v_o, v_phi in lines])
    return Corner(X, N_inv @ D @ N_inv.T + floor**2 * np.eye(2))  # eq-corner-cov


def gaussian(offset: Array, sigma: float) -> Array:
    """Weights of a window at offset (n,), up to four sigma; they add up to 1 over whole numbers."""
    reach = np.arange(-int(4 * sigma + 0.5), int(4 * sigma + 0.5) + 1)
    w = np.exp(-0.5 * (offset / sigma) ** 2) / np.exp(-0.5 * (reach / sigma) ** 2).sum()
    return np.where(np.abs(offset) <= reach[-1], w, 0.0)


def corner_of_map(P_S: Array, row: int, column: int) -> tuple[Array, float]:
    """Corner (x, y) of S near a cell, in cells from the middle of the first one, and its strength."""
    i, j = (np.arange(float(n)) for n in P_S.shape)
    q = np.maximum(2 * P_S - 1, 0)
    q = gaussian(i[:, None] - i, SMOOTH) @ q @ gaussian(j[:, None] - j, SMOOTH)
    g_y, g_x = list[Array](np.gradient(q))
    w: Array = np.outer(gaussian(i - row, WINDOW), gaussian(j - column, WINDOW))
    M, Mx = np.zeros((2, 2)), np.zeros(2)
    for r, c in np.argwhere(w > 0):
        g = np.array([g_x[r, c], g_y[r, c]])
        M += w[r, c] * np.outer(g, g)
        Mx += w[r, c] * np.outer(g, g) @ [c, r]
    return np.linalg.inv(M) @ Mx, math.sqrt(np.linalg.eigvalsh(M)[0])  # eq-foerstner


def static_share(P_S: Array, side: float, xy: Array, arm: float) -> float:
    """Share of an arm of a corner xy (2,), up to 0.3 m, along which S, P_S (rows, columns), is decided."""
    way = np.array([math.cos(arm), math.sin(arm)])
    places = [xy + s * way for s in np.arange(side, 0.3 + 1e-9, side / 2)]
    cells = [(math.floor(y / side), math.floor(x / side)) for x, y in places]
    return float(np.mean([P_S[i - 1 : i + 2, j - 1 : j + 2].max() > 0.9 for i, j in cells]))


def observe(x: Array, j: int) -> tuple[Array, Array]:
    """Landmark j as seen from the pose, h = R(theta)^T (m_j - p), and its Jacobian H (2, 3 + 2n)."""
    R, m = so2.exp(x[2]), slice(3 + 2 * j, 5 + 2 * j)
    h = R.T @ (x[m] - x[:2])  # eq-b21
    H = np.zeros((2, len(x)))
    H[:, :2], H[:, 2], H[:, m] = -R.T, [h[1], -h[0]], R.T  # eq-jacobians-measurement
    return h, H


def associate(x: Array, P: Array, corners: list[Corner], marks: list[Corner]) -> list[int]:
    """Landmark of each corner of a scan, or NONE, or AMBIGUOUS; ``marks`` say how landmarks look.

    State ``x (D,)``, covariance ``P (D, D)``; metres and radians.
    """
    inside = np.zeros((len(corners), len(marks)), dtype=bool)
    for i, z in enumerate(corners):
        for j, mark in enumerate(marks):
            h, H = observe(x, j)
            S = H @ P @ H.T + z.cov  # eq-gate-cov
            d2 = (z.xy - h) @ np.linalg.inv(S) @ (z.xy - h)
            turn = abs(so2.wrap(x[2] + z.bisector - mark.bisector))
            alike = turn <= 0.45 and abs(z.opening - mark.opening) <= 0.35 and z.convex == mark.convex
            inside[i, j] = alike and d2 <= -2 * math.log(0.01)  # eq-gate
    which = []
    for claims in inside:
        j = int(np.argmax(claims))
        alone = claims.sum() == 1 and inside[:, j].sum() == 1
        which.append(NONE if not claims.any() else j if alone else AMBIGUOUS)
    return which


def update(x: Array, P: Array, H: Array, innovation: Array, cov: Array) -> tuple[Array, Array]:
    """Kalman update of x (D,), P (D, D) by an innovation (k,) with cov (k, k) and Jacobian H (k, D)."""
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + cov)  # eq-gain
    x = x + K @ innovation
    x[2] = so2.wrap(x[2])
    return x, (np.eye(len(x)) - K @ H) @ P


def localise(x: Array, P: Array, corners: list[Corner], which: list[int]) -> tuple[Array, Array]:
    """Update x (D,), P (D, D) with the corners that belong to a landmark, linearised at one x."""
    seen = [(z, *observe(x, j)) for z, j in zip(corners, which, strict=True) if j >= 0]
    if not seen:
        return x, P
    H = np.concatenate([H for _, _, H in seen])
    innovation = np.concatenate([z.xy - h for z, h, _ in seen])
    return update(x, P, H, innovation, block_diag(*(z.cov for z, _, _ in seen)))


class Floor:
    """Distance to the nearest static cell, between the cells' middles bilinear."""

    def __init__(self, static: Array, side: float, most: float) -> None:
        middles = np.argwhere(static)
        self.side, self.d = side, np.empty(static.shape)
        for at in np.ndindex(static.shape):
            self.d[at] = min(most, side * min(math.dist(at, m) for m in middles))

    def at(self, xy: Array) -> tuple[float, Array]:
        """Distance at a point inside, and its slope (2,)."""
        u, v = xy / self.side - 0.5
        j, i = math.floor(u), math.floor(v)
        (d00, d01), (d10, d11) = self.d[i : i + 2, j : j + 2]
        u, v = u - j, v - i
        value = (1 - v) * ((1 - u) * d00 + u * d01) + v * ((1 - u) * d10 + u * d11)
        slope = (1 - v) * (d01 - d00) + v * (d11 - d10), (1 - u) * (d10 - d00) + u * (d11 - d01)
        return value, np.array(slope) / self.side


def match(
    p_bar: Array, P_bar: Array, points: Array, floor: Floor, sigma: float, cut: float
) -> tuple[Array, Array]:
    """Most probable pose of a scan of points (n, 2), and the information A (3, 3) of the scan alone.

    Prediction ``p_bar (3,)``, ``P_bar (3, 3)``; metres and radians.
    """

    def cost(p: Array) -> float:
        off = p - p_bar
        rho = [cut**2 / 6 * (1 - max(1 - (residual(p, x, floor)[0] / cut) ** 2, 0) ** 3) for x in points]
        return float(sum(rho) / sigma**2 + 0.5 * off @ np.linalg.inv(P_bar) @ off)  # eq-field-map

    p, A = p_bar, np.zeros((3, 3))
    for _ in range(20):
        A, g = np.zeros((3, 3)), np.linalg.inv(P_bar) @ (p - p_bar)
        for r, J in (residual(p, x, floor) for x in points):
            w = max(1 - (r / cut) ** 2, 0) ** 2 / sigma**2
            A, g = A + w * np.outer(J, J), g + w * r * J
        step = -np.linalg.solve(A + np.linalg.inv(P_bar), g)
        step = next((s * step for s in (1, 0.5, 0.25, 0.125) if cost(p + s * step) < cost(p)), 0 * step)
        if np.abs(step).max() < 1e-4:
            break
        p = p + step
    return p, A


def residual(p: Array, x: Array, floor: Floor) -> tuple[float, Array]:
    """Distance of a scan's point x (2,) from what is static, and its Jacobian (3,) in the pose p (3,)."""
    lever = so2.exp(p[2]) @ x
    r, D = floor.at(lever + p[:2])
    return r, np.array([D[0], D[1], D[1] * lever[0] - D[0] * lever[1]])  # eq-field-residual


def use_match(x: Array, P: Array, p: Array, A: Array) -> tuple[Array, Array]:
    """Update x (D,), P (D, D) with a match p (3,), A (3, 3), in the directions that the scan determines."""
    values, V = np.linalg.eigh(A)
    known = values > 1e-6 * values.max()
    v, off = V[:, known].T, p - x[:3]
    H = np.concatenate([v, np.zeros((len(v), len(x) - 3))], axis=1)
    innovation = v @ off + v @ np.linalg.solve(P[:3, :3], off) / values[known]  # eq-match-measurement
    return update(x, P, H, innovation, np.diag(1 / values[known]))
