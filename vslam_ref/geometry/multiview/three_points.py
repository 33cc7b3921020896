r"""P3P: every camera that sees three known points along three given bearings.

**Distances first.**  Let d_i be the distance of point i, along the unit bearing b_i.  The triangle's sides
are known, so with :math:`c_{ij} = b_i^T b_j` and :math:`a_{ij} = \lVert X_i - X_j \rVert^2`

.. math:: d_i^2 + d_j^2 - 2 c_{ij} d_i d_j = d^T M_{ij}\, d = a_{ij}, \qquad (ij) = (12), (13), (23) .

Multiply crosswise, and the right sides are gone:

.. math:: d^T D_1 d = d^T D_2 d = 0, \quad D_1 = a_{23} M_{12} - a_{12} M_{23},\;
          D_2 = a_{23} M_{13} - a_{13} M_{23} .

Up to its length, d is a common point of two conics: at most four.

**Conics to lines.**  Every conic of the pencil :math:`\cos\alpha\, D_1 + \sin\alpha\, D_2` passes through the
same four points.  Take its best conditioned member A and the one a right angle further, B.  Where
:math:`\det(B - \lambda A) = 0`, lambda an eigenvalue of :math:`A^{-1} B`, the conic falls apart into two
lines.  A cubic has a real root, so there always is such a member; and if any real point exists, one member
consists of *real* lines.  Its eigenvalues are :math:`\sigma_1 > 0 > \sigma_3` and 0, and the lines

.. math:: \ell = \sqrt{\sigma_1}\, v_1 \pm \sqrt{-\sigma_3}\, v_3 .

**Lines to points.**  A line meets A in two points, by a quadratic equation.  Two lines, four points.  The
length of d follows from the sum of the three equations, and two or three Newton steps on the equations
themselves restore the last digits.

**Distances to pose.**  The points in the camera's frame are d_i b_i; the motion that brings three points to
three points is that of two frames set up in the two triangles.

*When is it hopeless?*  Three points on one line leave a turn about it; two points in one direction leave a
motion along it.  Where the centre lies on the cylinder that stands upright on the circle through the points
(the *danger cylinder*), two solutions coincide and the Newton matrix is singular: they are found to about
half of the digits, and ``sharpness`` says so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, as_array, times, transpose
from vslam_ref.geometry import se3

PAIRS = ((0, 1), (0, 2), (1, 2))
ROUNDING = 1e-10
"""Share of a discriminant, or of an equation, that counts as rounding: what is left of a double root."""
THIN = 1e-10
"""Sine of an angle, of the triangle or between two bearings, below which the problem is degenerate."""
NEWTON = 4


class ThreePointPoses(NamedTuple):
    """Up to four poses of each of N problems; places that are not ``valid`` hold the identity.

    Attributes
    ----------
    T_cam_world : ndarray, shape (N, 4, 4, 4)
        Problem, solution, matrix.
    valid : ndarray of bool, shape (N, 4)
    sharpness : ndarray, shape (N, 4)
        Smallest singular value of the equations' Jacobian in the logarithms of the distances, its rows
        brought to length 1; near 0 on the danger cylinder.
    reason : tuple of str
        Empty, or why a problem has no answer.
    """

    T_cam_world: Array
    valid: NDArray[np.bool_]
    sharpness: Array
    reason: tuple[str, ...]


def p3p(bearings: ArrayLike, X_world: ArrayLike) -> ThreePointPoses:
    """All poses from which three points are seen along three bearings.

    Implements :eq:`eq-p3p-distances`.

    Parameters
    ----------
    bearings : array_like, shape (N, 3, 3)
        Three unit vectors of each problem, in the camera's frame.
    X_world : array_like, shape (N, 3, 3)
        The points they belong to.

    Returns
    -------
    ThreePointPoses

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or a bearing has not length 1.

    Notes
    -----
    Cosines of small angles lose digits: where all three bearings lie within beta radians, an error of some
    1e-16 / beta^2 enters.  Of random problems within 0.01 none is lost, within 0.001 about 2 %.

    Examples
    --------
    >>> X = np.array([[0.0, 0.0, 4.0], [1.0, 0.0, 5.0], [0.0, 2.0, 6.0]])
    >>> found = p3p([X / np.linalg.norm(X, axis=1, keepdims=True)], [X])  # the identity is an answer
    >>> bool(np.isclose(found.T_cam_world[found.valid], np.eye(4), atol=1e-12).all(axis=(1, 2)).any())
    True
    """
    b, X = as_array("bearings", bearings, 3, 3), as_array("X_world", X_world, 3, 3)
    if b.ndim != 3 or b.shape != X.shape:
        raise ValueError(f"bearings {b.shape} and X_world {X.shape}: need (N, 3, 3) twice")
    if not (np.isfinite(b).all() and np.isfinite(X).all()):
        raise ValueError("bearings and points must be finite")
    if not (np.abs(np.linalg.norm(b, axis=-1) - 1.0) < 1e-6).all():
        raise ValueError("bearings must be unit vectors")
    reasons = _degenerate(b, X)
    fine = np.array([not r for r in reasons], dtype=bool)
    T = se3.identity((len(b), 4))
    valid, sharp = np.zeros((len(b), 4), dtype=bool), np.zeros((len(b), 4))
    if fine.any():
        d, good, sharpness = _distances(b[fine], X[fine])
        T[fine] = np.where(good[..., None, None], _poses(d, good, b[fine], X[fine]), np.eye(4))
        valid[fine], sharp[fine] = good, sharpness
    reasons = [r or ("" if v.any() else "no real solution") for r, v in zip(reasons, valid, strict=True)]
    return ThreePointPoses(T, valid, sharp, tuple(reasons))


def _degenerate(b: Array, X: Array) -> list[str]:
    """Why a problem is hopeless, or nothing."""
    e, f = X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    sides = np.stack([np.linalg.norm(X[:, i] - X[:, j], axis=1) for i, j in PAIRS], 1)
    rounding = 8 * np.finfo(np.float64).eps * np.abs(X).max(axis=(1, 2))
    same = sides.min(axis=1) <= rounding
    area = np.linalg.norm(np.cross(e, f), axis=1)
    line = area <= np.maximum(THIN * sides.max(axis=1) ** 2, rounding * sides.max(axis=1))
    one = np.min([np.linalg.norm(np.cross(b[:, i], b[:, j]), axis=1) for i, j in PAIRS], axis=0) <= THIN
    names = ("two points are the same", "the points lie on one line", "two bearings are the same")
    open_by = np.stack([same, line, one], 1)
    return [names[int(np.argmax(row))] if row.any() else "" for row in open_by]


def conics(b: Array, X: Array) -> tuple[Array, Array]:
    """D_1 and D_2, (N, 3, 3), of bearings and points (N, 3, 3): d^T D d = 0 for the distances d.

    Implements :eq:`eq-p3p-conics`, with squared sides in units of their sum.
    """
    M, a = _matrices(b), _squared_sides(X)
    a = (a / a.sum(axis=1, keepdims=True))[..., None, None]
    return a[:, 2] * M[:, 0] - a[:, 0] * M[:, 2], a[:, 2] * M[:, 1] - a[:, 1] * M[:, 2]


def lines_of_the_pencil(D1: Array, D2: Array) -> tuple[Array, NDArray[np.bool_], Array]:
    """Two lines (N, 2, 3) through the common points of two conics, whether real (N,), and a third conic.

    Implements :eq:`eq-p3p-lines`.  The third conic (N, 3, 3) is the member that the lines are best met with.
    """
    A, B = _best_member(D1, D2)
    lines, real = _lines(A, B)
    return lines, real, A


def _squared_sides(X: Array) -> Array:
    """a_12, a_13, a_23, shape (N, 3)."""
    return np.stack([np.sum((X[:, i] - X[:, j]) ** 2, axis=-1) for i, j in PAIRS], 1)


def _matrices(b: Array) -> Array:
    """M_12, M_13, M_23, shape (N, 3, 3, 3)."""
    M = np.zeros((len(b), 3, 3, 3))
    for k, (i, j) in enumerate(PAIRS):
        M[:, k, i, i] = M[:, k, j, j] = 1.0
        M[:, k, i, j] = M[:, k, j, i] = -np.sum(b[:, i] * b[:, j], axis=-1)
    return M


def _distances(b: Array, X: Array) -> tuple[Array, NDArray[np.bool_], Array]:
    """Distances (N, 4, 3), which of them are solutions, and their sharpness (N, 4)."""
    M = _matrices(b)
    a = _squared_sides(X)
    size = a.sum(axis=1, keepdims=True)
    a = a / size
    lines, real, A = lines_of_the_pencil(*conics(b, X))
    rays, meets = _meet(lines, A)  # (N, 4, 3), (N, 4)
    rays *= np.where(rays.sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    total = np.einsum("nkij,nsi,nsj->ns", M, rays, rays)  # sum of the three equations
    good = meets & real[:, None] & (total > 0)
    d = rays / np.sqrt(np.where(good, total, 1.0))[..., None]
    d, left, sharp = _newton(d, M, a)
    good &= (left <= ROUNDING) & (d > 0).all(axis=-1)
    return d * np.sqrt(size)[:, None], good, np.where(good, sharp, 0.0)


def _best_member(D1: Array, D2: Array) -> tuple[Array, Array]:
    """Of the pencil the member with the largest determinant among eight, and the one a right angle on."""
    alpha = np.pi / 8 * np.arange(8) + 0.1
    c, s = np.cos(alpha)[:, None, None], np.sin(alpha)[:, None, None]
    D1, D2 = D1[:, None], D2[:, None]
    members = c * D1 + s * D2
    best = np.argmax(np.abs(np.linalg.det(members)), axis=1)
    at = np.arange(len(members))
    return members[at, best], (c * D2 - s * D1)[at, best]


def _lines(A: Array, B: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Two lines (N, 2, 3) that together hold all common points of the conics, and whether they are real."""
    singular = np.linalg.det(A) == 0.0
    values = np.linalg.eigvals(np.linalg.solve(np.where(singular[:, None, None], np.eye(3), A), B))
    members = B[:, None] - values.real[..., None, None] * A[:, None]
    sigma, v = np.linalg.eigh(members)  # rising
    size = np.abs(sigma).max(axis=-1)
    # real lines: one eigenvalue on each side of a zero in the middle; the clearest of the three members
    middle = np.abs(sigma[..., 1])
    clear = np.minimum(sigma[..., 2], -sigma[..., 0]) - middle
    real = np.abs(values.imag) <= 1e-6 * np.abs(values).max(axis=-1, keepdims=True)
    clear = np.where(real, clear / size, -np.inf)
    best = np.argmax(clear, axis=1)
    at = np.arange(len(A))
    sigma, v = sigma[at, best], v[at, best]
    plus = np.sqrt(np.maximum(sigma[:, 2], 0.0))[:, None] * v[:, :, 2]
    minus = np.sqrt(np.maximum(-sigma[:, 0], 0.0))[:, None] * v[:, :, 0]
    return np.stack([plus + minus, plus - minus], 1), clear[at, best] > -ROUNDING


def _meet(lines: Array, A: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Four points (N, 4, 3) of two lines on a conic, and whether they are real (N, 4)."""
    length = np.linalg.norm(lines, axis=-1, keepdims=True)
    line = lines / np.where(length > 0, length, 1.0)
    least = np.eye(3)[np.argmin(np.abs(line), axis=-1)]
    p = np.cross(line, least)
    p /= np.linalg.norm(p, axis=-1, keepdims=True)
    q = np.cross(line, p)
    pp, pq, qq = (np.einsum("nli,nij,nlj->nl", x, A, y) for x, y in ((p, p), (p, q), (q, q)))
    # pp x^2 + 2 pq x y + qq y^2 = 0, homogeneous, without cancellation
    under = pq**2 - pp * qq
    scale = pq**2 + np.abs(pp * qq)
    real = under >= -ROUNDING * scale
    h = -(pq + np.where(pq >= 0, 1.0, -1.0) * np.sqrt(np.maximum(under, 0.0)))
    first = h[..., None] * p + pp[..., None] * q
    second = qq[..., None] * p + h[..., None] * q
    points = np.concatenate([first, second], 1)
    size = np.linalg.norm(points, axis=-1, keepdims=True)
    return points / np.where(size > 0, size, 1.0), np.concatenate([real, real], 1) & (size[..., 0] > 0)


def _newton(d: Array, M: Array, a: Array) -> tuple[Array, Array, Array]:
    """Newton steps on the three equations; largest error left and sharpness of the last matrix."""
    for _ in range(NEWTON):
        Md = np.einsum("nkij,nsj->nski", M, d)
        error = np.einsum("nski,nsi->nsk", Md, d) - a[:, None]
        J = 2.0 * Md  # (N, S, 3 equations, 3 distances)
        step = np.einsum("nsij,nsj->nsi", np.linalg.pinv(J, rcond=1e-9), error)
        new = d - step
        after = np.abs(np.einsum("nkij,nsi,nsj->nsk", M, new, new) - a[:, None]).max(axis=-1)
        d = np.where((after <= np.abs(error).max(axis=-1))[..., None], new, d)
    Md = np.einsum("nkij,nsj->nski", M, d)
    left = np.abs(np.einsum("nski,nsi->nsk", Md, d) - a[:, None]).max(axis=-1)
    scaled = Md * d[..., None, :]  # by relative changes of the distances
    scaled /= np.maximum(np.linalg.norm(scaled, axis=-1, keepdims=True), 1e-300)
    return d, left, np.linalg.svd(scaled, compute_uv=False)[..., -1]


def _poses(d: Array, good: NDArray[np.bool_], b: Array, X: Array) -> Array:
    """Motions (N, 4, 4, 4) that bring the world's triangle onto the camera's."""
    safe = np.where(good[..., None], d, np.array([1.0, 1.0, 1.0]))
    X_cam = safe[..., None] * b[:, None]  # (N, S, 3 points, 3)
    R = _triad(X_cam) @ transpose(_triad(X))[:, None]
    t = X_cam.mean(axis=2) - times(R, X.mean(axis=1)[:, None])
    return se3.from_rt(R, t)


def _triad(X: Array) -> Array:
    """Right-handed frame of a triangle (..., 3 points, 3): axes as columns (..., 3, 3)."""
    x = X[..., 1, :] - X[..., 0, :]
    z = np.cross(x, X[..., 2, :] - X[..., 0, :])
    length = np.linalg.norm(z, axis=-1, keepdims=True)
    z = z / np.where(length > 0, length, 1.0)
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], -1)
