"""The similarity of two keyframes, one match after another: Horn's quaternion, votes, Gauss-Newton.

::

    for every triple of matches:
        centre both triangles; N = the 4 x 4 matrix of Horn; its eigenvector of the largest value is q
        s = sum q_k . R p_k / sum |p_k|^2;  t = mean Y - s R mean X
        cost = sum over all matches of min(|r_b|^2, c^2) + min(|r_a|^2, c^2)
    keep the cheapest; keep the matches with both errors below c
    errors of a match: r_b, r_a, and the log-ratio of both distances from b over its spread
    S <- Exp(delta) S with J'W J delta = -J'W r, W Huber's weights, until delta is nothing

The fast form decomposes instead (Umeyama), and damps.  A test asserts that both agree.
"""

from __future__ import annotations

import math

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.similarity.matches import PointMatches
from vslam_ref.geometry import quaternion, sim3, so3


def horn(X: Array, Y: Array) -> Array:
    """Similarity S (4, 4) with the smallest sum of |s R X_k + t - Y_k|^2, for points (n, 3) in any unit.

    Implements :eq:`eq-umeyama` by Horn's quaternion: q' N q is the correlation of the turned points.
    """
    p, q = X - X.mean(0), Y - Y.mean(0)
    M = p.T @ q
    z = np.array([M[1, 2] - M[2, 1], M[2, 0] - M[0, 2], M[0, 1] - M[1, 0]])
    N = np.zeros((4, 4))
    N[0, 0], N[0, 1:], N[1:, 0] = np.trace(M), z, z
    N[1:, 1:] = M + M.T - np.trace(M) * np.eye(3)
    R = quaternion.matrix(np.linalg.eigh(N)[1][:, -1])
    s = float(np.sum(q * (p @ R.T)) / np.sum(p * p))
    return sim3.from_srt(s, R, Y.mean(0) - s * R @ X.mean(0))


def errors(S: Array, m: PointMatches, j: int) -> tuple[Array, Array] | None:
    """Both errors (2,) of match j in sigmas, and nothing if a point has no image.

    Implements the two reprojections with which A§3.1 closes a loop.
    """
    there, back = (
        m.camera.project(sim3.act(S, m.X_a[j])),
        m.camera.project(sim3.act(sim3.inverse(S), m.X_b[j])),
    )
    if not (there.valid and back.valid):
        return None
    return (there.uv - m.uv_b[j]) / m.sigma_b[j], (back.uv - m.uv_a[j]) / m.sigma_a[j]


def cost(S: Array, m: PointMatches, c2: float) -> float:
    """Truncated cost of a similarity (4, 4): a number in sigma^2 per error."""
    total = 0.0
    for j in range(len(m)):
        at = errors(S, m, j)
        both = [math.inf] * 2 if at is None else [float(r @ r) for r in at]
        total += min(both[0], c2) + min(both[1], c2)  # eq-msac
    return total / (2 * len(m))


def agrees(S: Array, m: PointMatches, c2: float, j: int) -> bool:
    """Whether both squared errors of match j are at most c2 sigma^2, for a similarity (4, 4)."""
    at = errors(S, m, j)
    return at is not None and all(float(r @ r) <= c2 for r in at)


def spread(S: Array, m: PointMatches, members: list[int]) -> float:
    """Standard deviation of the log-ratios of distances for a similarity (4, 4): a ratio, 0.01 at least.

    Implements :eq:`eq-mad`.
    """
    d = [math.log(float(np.linalg.norm(sim3.act(S, m.X_a[j])) / np.linalg.norm(m.X_b[j]))) for j in members]
    middle = sorted(abs(one - float(np.median(d))) for one in d)
    return max(float(np.median(middle)) / 0.6744897501960817, 0.01)


def gauss_newton(S: Array, m: PointMatches, members: list[int], c: float, steps: int = 200) -> Array:
    """Similarity (4, 4) with the smallest sum of Huber's loss of all errors of some matches, in sigmas.

    Implements :eq:`eq-squares` and :eq:`eq-reweighted`.
    """
    sigma_d = spread(S, m, members)
    for _ in range(steps):
        H, g = np.zeros((7, 7)), np.zeros(7)
        back = sim3.inverse(S)
        for j in members:
            at = errors(S, m, j)
            if at is None:
                continue
            Y, X_b = sim3.act(S, m.X_a[j]), m.X_b[j]
            h_b = m.camera.project_with_jacobians(Y).J_point / m.sigma_b[j]
            h_a = m.camera.project_with_jacobians(sim3.act(back, X_b)).J_point / m.sigma_a[j]
            d = math.log(float(np.linalg.norm(Y) / np.linalg.norm(X_b))) / sigma_d
            J = np.vstack(
                [
                    h_b @ np.column_stack([np.eye(3), -so3.hat(Y), Y]),
                    -h_a @ back[:3, :3] @ np.column_stack([np.eye(3), -so3.hat(X_b), X_b]),
                    np.array([*(Y / (Y @ Y)), 0.0, 0.0, 0.0, 1.0]) / sigma_d,
                ]
            )
            r = np.array([*at[0], *at[1], d])
            w = np.array([min(1.0, c / max(abs(one), 1e-300)) for one in r])  # eq-reweighted
            H += J.T @ (w[:, None] * J)
            g += J.T @ (w * r)
        delta = np.linalg.solve(H, -g)
        S = sim3.compose(sim3.exp(delta), S)
        if np.abs(delta).max() < 1e-13:
            break
    return S


def similarity(m: PointMatches, triples: IntArray, c2: float, c: float) -> tuple[Array, Array, list[int]]:
    """Best sample S (4, 4), the refined one, and the matches that agree with the sample, by number.

    Parameters
    ----------
    m : PointMatches
    triples : ndarray of int, shape (draws, 3)
        Samples, none of them degenerate.
    c2 : float
        Limit of a squared error, sigma^2.
    c : float
        Huber's constant, sigmas.
    """
    tried = [horn(m.X_a[rows], m.X_b[rows]) for rows in triples]
    S = min(tried, key=lambda one: cost(one, m, c2))
    members = [j for j in range(len(m)) if agrees(S, m, c2, j)]
    return S, gauss_newton(S, m, members, c), members
