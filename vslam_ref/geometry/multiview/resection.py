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

**Far points.**  These equations measure distances from rays, in the world's unit, and not pixels.  An error
of the rotation moves X off its ray by that angle times its distance: one point a thousand times as far as
the others has a thousand times their say, and the translation serves it alone.  So what is more than ``FAR``
times as far as usual counts by its direction only: its equations are divided by its distance, and the shape
of the set is judged with such points drawn near.  Without far points nothing is weighted.

What comes out is a start, and not optimal.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview._rays import across
from vslam_ref.geometry.multiview.linear_pose import LinearPose, PoseState, checked_rays, no_pose
from vslam_ref.geometry.multiview.point_shape import nearness, point_shape
from vslam_ref.geometry.multiview.triples import best_of_three
from vslam_ref.geometry.nearest import nearest_rotation

FLAT = 1e-3
"""Thickness of a point set, relative to its width, below which :func:`resect_linear` calls it a plane.

At this ratio the twelve numbers are known about a thousand times less well than the noise.
"""
RANK = 1e-12
"""Second smallest singular value, as a share of the largest, below which the answer is not unique.

Without noise it is a power of the thickness; rounding of the rows gives some 1e-16.
"""


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
    b, X = checked_rays(bearings, X_world)
    _, extent, _, _ = point_shape(X)
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
    b, X = checked_rays(bearings, X_world)
    middle, extent, _, size = point_shape(X)
    if len(X) < 6:
        return no_pose(PoseState.TOO_FEW, "dlt")
    if (state := _narrow(extent)) is not PoseState.OK:
        return no_pose(state, "dlt")
    if extent[2] <= 1e-7 * extent[0]:  # a power of it, and rounding, must differ
        return no_pose(PoseState.COPLANAR, "dlt")
    x = np.concatenate([(X - middle) / size, np.ones((len(X), 1))], 1)
    P, spread, unique = _smallest(b, x * nearness(X)[:, None])
    return _pose(b, X, P[:, :3], "dlt", spread) if unique else no_pose(PoseState.AMBIGUOUS, "dlt", spread)


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
    b, X = checked_rays(bearings, X_world)
    middle, extent, axes, size = point_shape(X)
    if len(X) < 4:
        return no_pose(PoseState.TOO_FEW, "planar")
    if (state := _narrow(extent)) is not PoseState.OK:
        return no_pose(state, "planar")
    if extent[2] > 0.1 * extent[0]:
        return no_pose(PoseState.NOT_COPLANAR, "planar")
    x = np.concatenate([(X - middle) @ axes[:2].T / size, np.ones((len(X), 1))], 1)
    H, spread, unique = _smallest(b, x * nearness(X)[:, None])
    if not unique:
        return no_pose(PoseState.AMBIGUOUS, "planar", spread)
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
    middle, _, axes, _ = point_shape(X)
    seat = se3.act(T, middle)
    v = seat / np.linalg.norm(seat)
    e = axes[:2] @ T[:3, :3].T  # the plane's axes in the camera, as rows
    e = e - 2.0 * (e @ v)[:, None] * v
    R = np.column_stack([e[0], e[1], np.cross(e[0], e[1])]) @ axes
    return se3.from_rt(R, seat - R @ middle)


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
        return no_pose(PoseState.NO_ROTATION, method, spread)
    N = across(b) * nearness(X)[:, None, None]
    t = np.linalg.lstsq(N.reshape(-1, 3), -np.einsum("nij,nj->ni", N, X @ R.T).ravel(), rcond=None)[0]
    T = se3.from_rt(R, t)
    behind = bool((np.sum(b * se3.act(T, X), axis=1) <= 0).any())
    return LinearPose(T, PoseState.BEHIND if behind else PoseState.OK, method, spread)


def _in_front(pose: LinearPose, b: Array, X: Array) -> int:
    if pose.state not in (PoseState.OK, PoseState.BEHIND):
        return -1
    return int(np.count_nonzero(np.sum(b * se3.act(pose.T_cam_world, X), axis=1) > 0))


def _narrow(extent: Array) -> PoseState:
    if extent[0] == 0.0:
        return PoseState.ONE_PLACE
    return PoseState.COLLINEAR if extent[1] <= 1e-7 * extent[0] else PoseState.OK
