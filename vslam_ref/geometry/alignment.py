r"""The similarity or rigid motion that lays one point set over another (Umeyama's problem).

Given are N pairs of points, x_k in the *source* and y_k in the *target* frame, in the plane or in space
(d = 2 or 3), with weights w_k whose sum is 1.  Wanted are the scale s > 0, the rotation R and the
translation t of the smallest

.. math:: f(s, R, t) = \sum_k w_k \, \lVert s R x_k + t - y_k \rVert^2 .

**Translation.**  The gradient in t vanishes at :math:`t = \bar y - s R \bar x`, with the weighted means.
Put in, it leaves the same sum over the centred points :math:`p_k = x_k - \bar x`,
:math:`q_k = y_k - \bar y`:

.. math:: f = s^2 \sigma_p^2 - 2 s \operatorname{tr}(R^T C) + \sigma_q^2, \qquad
          C = \sum_k w_k\, q_k p_k^T, \quad \sigma_p^2 = \sum_k w_k \lVert p_k \rVert^2 .

**Rotation.**  Whatever s > 0 is, the best R has the largest :math:`\operatorname{tr}(R^T C)`.  With the
singular value decomposition :math:`C = U D V^T` (the values in D falling) this is
:math:`\operatorname{tr}(Z^T D)` for the orthogonal :math:`Z = U^T R V`, whose diagonal is at most 1 in size.
If det(U V^T) = 1, Z = I is allowed and best.  If it is -1, the best orthogonal matrix would be a mirror
image; among the rotations the least is lost by turning the sign where the singular value is smallest.  So

.. math:: R = U S V^T, \qquad S = \operatorname{diag}(1, \ldots, 1, \det(U V^T)) .

**Scale.**  f is a parabola in s with its vertex at :math:`s = \operatorname{tr}(D S) / \sigma_p^2`.

**When is R unique?**  A small turn phi in the plane of the singular directions i and j lowers the trace by
:math:`(D_i S_i + D_j S_j)\,\varphi^2/2`, and the two last directions give the smallest sum.  R is unique
exactly when this sum is positive.  It vanishes for points on one line (in space: a turn about the line
changes no distance), for points at one place, and for a mirror image that is as thick in one direction as
in another.

**Three points** are the fewest that fix a similarity of space.  A triangle is flat, so the smallest singular
value is 0, and no mirror image can be told from the triangle itself: only one place and one line are left to
fear.  :func:`align_triples` does many triangles at once, for samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, BoolArray, as_array

EPS = float(np.finfo(np.float64).eps)

FLAT = 1e-12
"""Share of the largest singular value of C below which a sum of two counts as zero.

Singular values grow with the square of an extent: 1e-12 is a path that leaves its line by a millionth of
its length.  The rounding of C is some 1e-16 of the largest value, far below.
"""

LARGEST = 1e75
"""Coordinates must be smaller in size, so that fourth powers do not overflow."""


@dataclass(frozen=True)
class Alignment:
    """The map ``X_target = scale * R @ X_source + t``, a similarity ``S_target_source``.

    Attributes
    ----------
    scale : float
        1 for a rigid alignment.
    R_target_source : ndarray, shape (d, d)
    t_target_source : ndarray, shape (d,)
        In the unit of the target.
    rmse : float
        Root of the weighted mean of squared distances that remain, in the unit of the target.
    reason : str
        Empty if the answer is unique; else what the points leave open.  The map is then one of several
        that are equally good.
    scale_known : bool
        Whether the points determine a scale: neither set lies at one place.  If not, ``scale`` is 1.
    """

    scale: float
    R_target_source: Array
    t_target_source: Array
    rmse: float
    reason: str
    scale_known: bool

    @property
    def unique(self) -> bool:
        """Whether the points determine the map."""
        return not self.reason

    def act(self, points: ArrayLike) -> Array:
        """Map points (..., d) of the source frame into the target frame and its unit."""
        x = np.asarray(points, dtype=np.float64)
        moved: Array = self.scale * x @ self.R_target_source.T + self.t_target_source
        return moved


def align(
    source: ArrayLike, target: ArrayLike, *, with_scale: bool = False, weights: ArrayLike | None = None
) -> Alignment:
    """Find the motion (and, if asked, the scale) that brings ``source`` closest to ``target``.

    Implements :eq:`eq-umeyama`.

    Parameters
    ----------
    source, target : array_like, shape (N, d)
        Pairs of points, d = 2 or 3, N >= 1; each set in a unit of its own, usually metres.
    with_scale : bool
        Whether the scale is free (similarity) or 1 (rigid motion).
    weights : array_like, shape (N,), optional
        Not negative, one of them positive; only their ratios count.  Equal by default.

    Returns
    -------
    Alignment

    Raises
    ------
    ValueError
        If the shapes do not fit, a number is not finite or is 1e75 and more, or the weights are not as said.

    Notes
    -----
    The module's text derives the answer.  It costs O(N) and one decomposition of a d x d matrix.
    R is a rotation for mirror images too.  The smallest cost is that of the whole sum: one gross outlier
    moves everything.

    Examples
    --------
    >>> found = align([[0, 0], [1, 0], [0, 1]], [[5, 5], [5, 7], [3, 5]], with_scale=True)
    >>> round(found.scale, 12), found.R_target_source.round(12) + 0.0, found.t_target_source.round(12)
    (2.0, array([[ 0., -1.], [ 1.,  0.]]), array([5., 5.]))
    >>> align([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 0, 0], [0, 1, 0], [0, 2, 0]]).reason
    'the points lie on one line: any turn about it fits as well'
    """
    x, y = _points(source, target)
    w = _weights(weights, len(x))
    mean_x, mean_y = w @ x, w @ y
    p, q = x - mean_x, y - mean_y
    U, D, Vt = np.linalg.svd((q * w[:, None]).T @ p)  # C (d, d)
    S = np.ones(x.shape[1])
    S[-1] = 1.0 if np.linalg.det(U) * np.linalg.det(Vt) > 0 else -1.0
    moves_x, moves_y = _spread(p, w, x), _spread(q, w, y)
    scale_known = bool(moves_x > 0 and moves_y > 0)
    if scale_known:
        R = (U * S) @ Vt
    else:  # C is nothing but rounding
        R = np.eye(x.shape[1])
    scale = float(D @ S) / moves_x if with_scale and scale_known else 1.0
    t = mean_y - scale * R @ mean_x
    left = scale * p @ R.T - q
    rmse = float(np.sqrt(w @ np.sum(left**2, axis=1)))
    return Alignment(scale, R, t, rmse, _reason(D, S, moves_x, moves_y), scale_known)


class Triples(NamedTuple):
    """Similarities of many triangles.

    Attributes
    ----------
    S_target_source : ndarray, shape (..., 4, 4)
        The identity where the triangle determines none; translations in the unit of the target.
    reason : ndarray of str, shape (...)
        Empty, or what is wrong with the triangle.
    """

    S_target_source: Array
    reason: NDArray[np.str_]

    @property
    def valid(self) -> BoolArray:
        """Whether each triangle determines a similarity, (...)."""
        found: BoolArray = self.reason == ""
        return found


def align_triples(source: ArrayLike, target: ArrayLike) -> Triples:
    """Similarities of many pairs of triangles, as :func:`align` finds that of one.

    Implements :eq:`eq-umeyama` with three points of space.

    Parameters
    ----------
    source, target : array_like, shape (..., 3, 3)
        Three points, one a row, of each triangle; each set in a unit of its own.

    Returns
    -------
    Triples
        A triangle whose corners lie on one line, or at one place, is named; so is one with a number that is
        not finite.

    Raises
    ------
    ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> found = align_triples([triangle, triangle * [1, 0, 0]], [2 * triangle + 1, triangle])
    >>> found.S_target_source[0].round(12).tolist()
    [[2.0, 0.0, 0.0, 1.0], [0.0, 2.0, 0.0, 1.0], [0.0, 0.0, 2.0, 1.0], [0.0, 0.0, 0.0, 1.0]]
    >>> found.reason.tolist()
    ['', 'one line']
    """
    x, y = as_array("source", source, 3, 3), as_array("target", target, 3, 3)
    if x.shape != y.shape:
        raise ValueError(f"source {x.shape} and target {y.shape}: need the same shape (..., 3, 3)")
    finite = np.asarray((np.maximum(np.abs(x), np.abs(y)) < LARGEST).all((-2, -1)))
    x, y = (np.where(finite[..., None, None], points, 0.0) for points in (x, y))
    mean_x, mean_y = x.mean(-2), y.mean(-2)
    p, q = x - mean_x[..., None, :], y - mean_y[..., None, :]
    U, D, Vt = np.linalg.svd(np.swapaxes(q, -1, -2) @ p)
    U[..., :, 2] *= np.sign(np.linalg.det(U) * np.linalg.det(Vt))[..., None]
    moves_x, moves_y = np.sum(p * p, (-2, -1)), np.sum(q * q, (-2, -1))
    rounding = [(8 * EPS * np.abs(points).max((-2, -1))) ** 2 for points in (x, y)]
    still = (moves_x <= rounding[0]) | (moves_y <= rounding[1])
    cases = [~finite, still, D[..., 1] <= FLAT * np.sqrt(moves_x * moves_y)]
    reason = np.select(cases, ["not finite", "one place", "one line"], "")
    good = reason == ""
    s = np.where(good, (D[..., 0] + D[..., 1]) / np.where(good, moves_x, 1.0), 1.0)
    S = np.zeros((*x.shape[:-2], 4, 4))
    S[..., :3, :3] = np.where(good[..., None, None], s[..., None, None] * (U @ Vt), np.eye(3))
    turned = np.einsum("...ij,...j->...i", S[..., :3, :3], mean_x)
    S[..., :3, 3], S[..., 3, 3] = np.where(good[..., None], mean_y - turned, 0.0), 1.0
    return Triples(S, reason)


def _points(source: ArrayLike, target: ArrayLike) -> tuple[Array, Array]:
    x, y = np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64)
    if x.shape != y.shape or x.ndim != 2 or x.shape[1] not in (2, 3) or len(x) == 0:
        raise ValueError(f"source {x.shape} and target {y.shape}: need (N, 2) twice or (N, 3) twice, N >= 1")
    for name, points in (("source", x), ("target", y)):
        bad = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))  # NaN is not below, either
        if len(bad):
            what = f"need finite numbers below {LARGEST:g}"
            raise ValueError(f"{name} point {bad[0]} is {points[bad[0]].tolist()}: {what}")
    return x, y


def _weights(weights: ArrayLike | None, count: int) -> Array:
    """Weights with sum 1, shape (N,)."""
    if weights is None:
        return np.full(count, 1.0 / count)
    w = np.asarray(weights, dtype=np.float64)
    if w.shape != (count,):
        raise ValueError(f"weights {w.shape}: need ({count},), one for each pair")
    if not np.isfinite(w).all() or (w < 0).any() or not w.any():
        raise ValueError("weights must be finite, not negative, and one of them positive")
    w = w / w.max()  # the sum of huge weights must not overflow
    unit: Array = w / w.sum()
    return unit


def _spread(centred: Array, w: Array, points: Array) -> float:
    """Weighted mean square distance from the mean; 0 if it is the rounding of the coordinates."""
    spread = float(w @ np.sum(centred**2, axis=1))
    rounding = 8 * EPS * float(np.abs(points).max())
    return spread if spread > rounding**2 else 0.0


def _reason(D: Array, S: Array, moves_x: float, moves_y: float) -> str:
    """What the points leave open, or nothing."""
    if not moves_x or not moves_y:
        which = " and ".join(n for n, moves in (("source", moves_x), ("target", moves_y)) if not moves)
        return f"the points of the {which} lie at one place: no rotation and no scale is determined"
    if D[0] <= FLAT * np.sqrt(moves_x * moves_y):
        return "source and target are uncorrelated: every rotation fits as well"
    if D[-2] + S[-1] * D[-1] > FLAT * D[0]:
        return ""
    if len(D) == 3 and D[1] <= FLAT * D[0]:
        return "the points lie on one line: any turn about it fits as well"
    return "the target is a mirror image of the source: several rotations fit equally well"
