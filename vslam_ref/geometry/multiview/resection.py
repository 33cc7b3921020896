r"""A camera's pose from points it sees, by linear equations: the start of every refinement.

Point X is seen along the unit bearing b, so the part of :math:`X_{cam}` across b vanishes:

.. math:: N_b\, (R X + t) = N_b\, [R \; t] \begin{bmatrix} X \\ 1 \end{bmatrix} = 0 .

Two linear equations a point.  **Six points and more:** forget that R is a rotation, and solve for the twelve
numbers of P = [R t] by the smallest singular vector.  It comes with an unknown factor: the nearest rotation
to its left part fixes sign and size.

**Points of a plane** leave P undetermined: two of its columns would do.  With plane coordinates
:math:`X = X_0 + x_1 e_1 + x_2 e_2` the equation is :math:`N_b H (x_1, x_2, 1)^T = 0` with nine numbers,
:math:`H \sim [R e_1 \; R e_2 \; R X_0 + t]`: four points.  Two columns of a rotation make the third.

With the rotation known, the translation is the solution of the linear system :math:`N_b t = -N_b R X`.

**Far points.**  These equations measure distances from rays, in the world's unit, and not pixels.  An error of
the rotation moves X off its ray by that angle times its distance: one point a thousand times as far as the
others has a thousand times their say, and the translation serves it alone.  So what is more than ``FAR`` times
as far as the points usually are counts by its direction only: its equations are divided by its distance, and
the shape of the set is judged with such points drawn near.  Without far points nothing is weighted.

What comes out is a start, and not optimal.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview._rays import across
from vslam_ref.geometry.multiview.three_points import p3p
from vslam_ref.geometry.nearest import nearest_rotation

FLAT = 1e-3
"""Thickness of a point set, relative to its width, below which :func:`resect_linear` calls it a plane.

At this ratio the twelve numbers are known about a thousand times less well than the noise.
"""
FAR = 10.0
"""Distance from the middle of the points, in medians of these distances, beyond which a point is far.

Up to there equations without weights find the pose (no trial of many refused); beyond, what a far point says of
the translation is less than a tenth of what the others say.
"""
TRIED = 12
"""Of so many points, spread from the nearest to the farthest, all triples are tried."""
RANK = 1e-12
"""Second smallest singular value, as a share of the largest, below which the answer is not unique.

Without noise it is a power of the thickness; rounding of the rows gives some 1e-16.
"""


class PoseState(Enum):
    """What became of a linear resection; the value is the sentence."""

    OK = ""
    TOO_FEW = "too few points"
    ONE_PLACE = "the points lie at one place"
    COLLINEAR = "the points lie on one line: a turn about it changes nothing"
    COPLANAR = "the points lie in one plane: use the planar method"
    NOT_COPLANAR = "the points do not lie in one plane"
    AMBIGUOUS = "the equations have more than one solution"
    BEHIND = "in the best pose a point lies behind the camera"
    NO_ROTATION = "the linear solution is far from any rotation"


@dataclass(frozen=True)
class LinearPose:
    """Pose by linear equations.

    Attributes
    ----------
    T_cam_world : ndarray, shape (4, 4)
        The identity where ``state`` is neither ``OK`` nor ``BEHIND``.
    state : PoseState
    method : str
        ``dlt``, ``planar`` or ``p3p``.
    spread : float
        Ratio of the two smallest singular values, 0 to 1: how close the equations were to a second answer;
        0 for ``p3p``.
    """

    T_cam_world: Array
    state: PoseState
    method: str
    spread: float

    @property
    def ok(self) -> bool:
        """Whether the pose may be used."""
        return self.state is PoseState.OK

    @property
    def reason(self) -> str:
        """Empty, or what is wrong."""
        return self.state.value


def resect_linear(bearings: ArrayLike, X_world: ArrayLike) -> LinearPose:
    """Pose by the method that number and shape of the points ask for.

    Parameters
    ----------
    bearings, X_world : array_like, shape (N, 3)
        Unit vectors in the camera's frame, and the points seen along them.

    Returns
    -------
    LinearPose
        By :func:`planar_dlt` if the points are flatter than one in a thousand, by :func:`dlt` if there are
        six and more; four or five are answered with :func:`best_of_three`, and so is where these two find
        no pose.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is not finite, or a bearing has not length 1.
    """
    b, X = _checked(bearings, X_world)
    _, extent, _, _ = _shape(X)
    flat = bool(extent[2] <= FLAT * extent[0])
    if not flat and 4 <= len(X) <= 5:
        return best_of_three(b, X)
    found = planar_dlt(b, X) if flat else dlt(b, X)
    if found.state not in (PoseState.BEHIND, PoseState.NO_ROTATION, PoseState.AMBIGUOUS):
        return found
    other = best_of_three(b, X)
    return other if other.ok else found


def dlt(bearings: ArrayLike, X_world: ArrayLike) -> LinearPose:
    """Pose from six points and more that do not lie in a plane.

    Implements :eq:`eq-resection-dlt`.

    Parameters, returns and errors as for :func:`resect_linear`.  Points of a plane, or of a twisted cubic
    through the centre, are answered with ``COPLANAR`` or ``AMBIGUOUS``.

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 6], [-1, 1, 5], [1, 1, 4], [-2, -1, 7.0]])
    >>> dlt(X / np.linalg.norm(X, axis=1, keepdims=True), X).T_cam_world.round(9) + 0.0
    array([[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]])
    """
    b, X = _checked(bearings, X_world)
    middle, extent, _, size = _shape(X)
    if len(X) < 6:
        return _failed(PoseState.TOO_FEW, "dlt")
    if (state := _narrow(extent)) is not PoseState.OK:
        return _failed(state, "dlt")
    if extent[2] <= 1e-7 * extent[0]:  # a power of it, and rounding, must differ
        return _failed(PoseState.COPLANAR, "dlt")
    x = np.concatenate([(X - middle) / size, np.ones((len(X), 1))], 1)
    P, spread, unique = _smallest(b, x * nearness(X)[:, None])
    return _pose(b, X, P[:, :3], "dlt", spread) if unique else _failed(PoseState.AMBIGUOUS, "dlt", spread)


def planar_dlt(bearings: ArrayLike, X_world: ArrayLike) -> LinearPose:
    """Pose from four points of a plane and more, no three of the four on a line.

    Implements :eq:`eq-resection-planar`.

    Parameters, returns and errors as for :func:`resect_linear`.  A small or distant plane looks nearly the
    same from a second pose, tilted the other way; noise may choose the wrong one.

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 4], [0, 2, 4], [-1, 1, 4.0]])
    >>> planar_dlt(X / np.linalg.norm(X, axis=1, keepdims=True), X).T_cam_world.round(9) + 0.0
    array([[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]])
    """
    b, X = _checked(bearings, X_world)
    middle, extent, axes, size = _shape(X)
    if len(X) < 4:
        return _failed(PoseState.TOO_FEW, "planar")
    if (state := _narrow(extent)) is not PoseState.OK:
        return _failed(state, "planar")
    if extent[2] > 0.1 * extent[0]:
        return _failed(PoseState.NOT_COPLANAR, "planar")
    x = np.concatenate([(X - middle) @ axes[:2].T / size, np.ones((len(X), 1))], 1)
    H, spread, unique = _smallest(b, x * nearness(X)[:, None])
    if not unique:
        return _failed(PoseState.AMBIGUOUS, "planar", spread)
    # the third column as the others' cross product, at their length; the sign of both is the sign of H
    third = np.cross(H[:, 0], H[:, 1])
    third /= np.sqrt(max(float(np.linalg.norm(third)), 1e-300))
    first = np.column_stack([H[:, 0], H[:, 1], third]) @ axes
    second = np.column_stack([-H[:, 0], -H[:, 1], third]) @ axes
    poses = [_pose(b, X, M, "planar", spread) for M in (first, second)]
    return max(poses, key=lambda pose: _in_front(pose, b, X))


def tilted_twin(T_cam_world: ArrayLike, X_world: ArrayLike) -> Array:
    """The pose from which a small plane looks nearly the same: tilted the other way.

    Implements :eq:`eq-tilted-twin`.
    Seen from afar only what lies across the line of sight v shows.  Turn the sign of what lies along it:
    both axes of the plane are mirrored by I - 2 v v^T, the third is their cross product, and the middle of
    the points stays.  It is a start for a second search, no solution.

    Parameters
    ----------
    T_cam_world : array_like, shape (4, 4)
    X_world : array_like, shape (N, 3)
        Points of a plane, N >= 3.

    Examples
    --------
    >>> X = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    >>> T = se3.exp([0, 0, 8.0, 0, 0, 0]) @ se3.exp([0, 0, 0, 0.3, 0, 0])  # tilted by 0.3 about x
    >>> np.round(se3.log(tilted_twin(T, X))[3:], 12) + 0.0
    array([-0.3,  0. ,  0. ])
    """
    T, X = as_array("T_cam_world", T_cam_world, 4, 4), as_array("X_world", X_world, 3)
    middle, _, axes, _ = _shape(X)
    seat = se3.act(T, middle)
    v = seat / np.linalg.norm(seat)
    e = axes[:2] @ T[:3, :3].T  # the plane's axes in the camera, as rows
    e = e - 2.0 * (e @ v)[:, None] * v
    R = np.column_stack([e[0], e[1], np.cross(e[0], e[1])]) @ axes
    return se3.from_rt(R, seat - R @ middle)


def nearness(X_world: ArrayLike) -> Array:
    """Weights (N,) of the points' equations: 1, and for a far point the usual distance over its own.

    Distances are those from the median point, and the usual one is their median; a point is far beyond
    :data:`FAR` of it.

    Parameters
    ----------
    X_world : array_like, shape (N, 3)

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 5], [-1, 1, 5], [0, 0, 2005.0]])
    >>> nearness(X)
    array([1.   , 1.   , 1.   , 1.   , 0.0005])
    """
    X = as_array("X_world", X_world, 3)
    if len(X) == 0:
        return np.ones(0)
    distance = np.linalg.norm(X - np.median(X, axis=0), axis=1)
    usual = float(np.median(distance))
    far = distance > FAR * usual
    return np.where(far, usual / np.where(far, distance, 1.0), 1.0) if usual > 0 else np.ones(len(X))


def best_of_three(bearings: ArrayLike, X_world: ArrayLike) -> LinearPose:
    """Of the poses of triples the one in which all points lie best on their rays, and in front.

    Angles from rays are what is compared, so a far point counts as any other.  At most ``TRIED`` points
    give triples.  Parameters, returns and errors as for :func:`resect_linear`; at least four points.

    Examples
    --------
    >>> X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 6], [-100, 100, 5000.0]])
    >>> best_of_three(X / np.linalg.norm(X, axis=1, keepdims=True), X).T_cam_world.round(6) + 0.0
    array([[1., 0., 0., 0.], [0., 1., 0., 0.], [0., 0., 1., 0.], [0., 0., 0., 1.]])
    """
    b, X = _checked(bearings, X_world)
    if len(X) < 4:
        return _failed(PoseState.TOO_FEW, "p3p")
    tried = np.arange(len(X))
    if len(X) > TRIED:
        order = np.argsort(np.linalg.norm(X - np.median(X, axis=0), axis=1), kind="stable")
        tried = order[np.linspace(0, len(X) - 1, TRIED).round().astype(int)]
    triples = np.array(list(combinations(tried.tolist(), 3)))
    found = p3p(b[triples], X[triples])
    poses = found.T_cam_world[found.valid]
    X_cam = se3.act(poses[:, None], X)
    front = (np.sum(X_cam * b, axis=-1) > 0).all(axis=1)
    if not front.any():
        return _failed(PoseState.BEHIND if len(poses) else PoseState.AMBIGUOUS, "p3p")
    poses, X_cam = poses[front], X_cam[front]
    sine = np.linalg.norm(np.cross(X_cam, b), axis=-1) / np.linalg.norm(X_cam, axis=-1)
    order = np.argsort(np.sum(sine**2, axis=1))
    return LinearPose(poses[order[0]], PoseState.OK, "p3p", 0.0)


def _smallest(b: Array, x: Array) -> tuple[Array, float, bool]:
    """Matrix (3, k) with N_b M x = 0 in least squares, its spread, and whether it is unique."""
    rows = (across(b)[..., None] * x[:, None, None, :]).reshape(2 * len(b), -1)  # (2N, 3 k)
    _, s, Vt = np.linalg.svd(rows, full_matrices=True)
    s = np.pad(s, (0, rows.shape[1] - len(s)))
    spread = float(s[-1] / s[-2]) if s[-2] > 0 else 1.0
    return Vt[-1].reshape(3, -1), spread, bool(s[-2] > RANK * s[0])


def _pose(b: Array, X: Array, M: Array, method: str, spread: float) -> LinearPose:
    """Rotation nearest to M or -M, then the translation; the sign that puts more points in front."""
    sign = 1.0 if method == "planar" or np.linalg.det(M) > 0 else -1.0
    try:
        R = nearest_rotation(sign * M).R
    except ValueError:
        return _failed(PoseState.NO_ROTATION, method, spread)
    N = across(b) * nearness(X)[:, None, None]
    t = np.linalg.lstsq(N.reshape(-1, 3), -np.einsum("nij,nj->ni", N, X @ R.T).ravel(), rcond=None)[0]
    T = se3.from_rt(R, t)
    behind = bool((np.sum(b * se3.act(T, X), axis=1) <= 0).any())
    return LinearPose(T, PoseState.BEHIND if behind else PoseState.OK, method, spread)


def _in_front(pose: LinearPose, b: Array, X: Array) -> int:
    if pose.state not in (PoseState.OK, PoseState.BEHIND):
        return -1
    return int(np.count_nonzero(np.sum(b * se3.act(pose.T_cam_world, X), axis=1) > 0))


def _shape(X: Array) -> tuple[Array, Array, Array, float]:
    """Middle, extents along three axes (falling), the axes (rows), and the root mean square distance.

    A far point is drawn near, towards the middle of the others: it leaves neither their plane nor their line.
    """
    if len(X) == 0:
        return np.zeros(3), np.zeros(3), np.eye(3), 1.0
    weight = nearness(X)
    middle = X[weight == 1.0].mean(axis=0)
    _, s, axes = np.linalg.svd((X - middle) * weight[:, None], full_matrices=True)
    axes[2] = np.cross(axes[0], axes[1])  # right-handed
    extent = np.pad(s, (0, 3 - len(s))) / np.sqrt(len(X))
    rounding = 8 * np.finfo(np.float64).eps * float(np.abs(X).max())
    extent = np.where(extent > rounding, extent, 0.0)
    size = float(np.sqrt(np.sum(extent**2)))
    return middle, extent, axes, size if size > 0 else 1.0


def _narrow(extent: Array) -> PoseState:
    if extent[0] == 0.0:
        return PoseState.ONE_PLACE
    return PoseState.COLLINEAR if extent[1] <= 1e-7 * extent[0] else PoseState.OK


def _failed(state: PoseState, method: str, spread: float = 1.0) -> LinearPose:
    return LinearPose(np.eye(4), state, method, spread)


def _checked(bearings: ArrayLike, X_world: ArrayLike) -> tuple[Array, Array]:
    b, X = as_array("bearings", bearings, 3), as_array("X_world", X_world, 3)
    if b.ndim != 2 or b.shape != X.shape:
        raise ValueError(f"bearings {b.shape} and X_world {X.shape}: need (N, 3) twice")
    for name, values in (("bearing", b), ("point", X)):
        bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(bad):
            raise ValueError(f"{name} {bad[0]} is {values[bad[0]].tolist()}: must be finite")
    bad = np.flatnonzero(~(np.abs(np.linalg.norm(b, axis=1) - 1.0) < 1e-6))
    if len(bad):
        raise ValueError(f"bearing {bad[0]} is {b[bad[0]].tolist()}: must be a unit vector")
    return b, X
