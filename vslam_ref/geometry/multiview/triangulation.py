r"""Points from two views or more, by linear equations.

Camera i sees X along the unit bearing b.  Both are parallel, so the part of
:math:`X_{cam} = R_i X + t_i` across b vanishes.  With :math:`N_b` (2, 3), two unit vectors across b,

.. math:: N_{b_i} \,[R_i \; t_i] \begin{bmatrix} X \\ 1 \end{bmatrix} = 0 ,

two rows a view for four homogeneous numbers.  Bearings, not pixels: any lens will do.

The rows measure distances from rays; the noise is in pixels.  The point with the smallest reprojection error
is one floor up, in :mod:`vslam_ref.estimation.triangulation`, and starts from here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array, times
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.multiview._rays import across, largest_angle
from vslam_ref.geometry.multiview.point_state import PointState, StateArray

MIN_PARALLAX = float(np.radians(1.0))
"""Parallax, radians, below which a point is flagged: its depth is then known to some 60 pixel-angles.

At a parallax alpha a bearing error e moves the depth Z by about Z e / alpha.
"""

RANK = 1e-12
"""Share of the largest singular value below which the two smallest ones both count as zero."""

FAR = 1e-12
"""Homogeneous coordinate, of a unit vector, below which a point lies at infinity."""


class LinearPoints(NamedTuple):
    """Points (N, 3), their states (N,) and the largest angle (N,) between two rays of each, radians."""

    X_world: Array
    state: StateArray
    parallax: Array


def triangulate_linear(
    T_cam_world: ArrayLike,
    bearings: ArrayLike,
    mask: ArrayLike | None = None,
    *,
    min_parallax: float = MIN_PARALLAX,
) -> LinearPoints:
    """Points from rays, by the smallest singular vector of two rows a view.

    Implements :eq:`eq-triangulation-linear`.

    Parameters
    ----------
    T_cam_world : array_like, shape (V, 4, 4)
        Poses of the views.
    bearings : array_like, shape (N, V, 3)
        Unit vectors in the frames of the cameras, from any lens.
    mask : array_like of bool, shape (N, V), optional
        Which views see which point; all by default.  What is masked out may be NaN.
    min_parallax : float
        Flag points whose rays differ by less, radians.

    Returns
    -------
    LinearPoints

    Raises
    ------
    ValueError
        If shapes do not fit, or a bearing that counts is not a finite unit vector.

    Notes
    -----
    The world is first moved and scaled so that the camera centres lie around the origin at distance 1;
    the answer then does not depend on the world's frame or unit.

    Examples
    --------
    >>> T = [se3.identity(), se3.exp([-1.0, 0, 0, 0, 0, 0])]
    >>> rays = np.array([[[0.0, 0.0, 5.0], [-1.0, 0.0, 5.0]]])
    >>> found = triangulate_linear(T, rays / np.linalg.norm(rays, axis=-1, keepdims=True))
    >>> found.X_world.round(12).tolist(), found.state.tolist()
    ([[0.0, 0.0, 5.0]], [0])
    """
    T = as_array("T_cam_world", T_cam_world, 4, 4)
    b, used = _checked(T, bearings, mask)
    middle, size = _frame(T)
    R, p = se3.rotation(T), (camera_pose.centre_from_pose(T) - middle) / size
    near = np.concatenate([R, -times(R, p)[..., None]], -1)  # [R | t] in the moved and scaled world
    rows = (across(b) @ near) * used[..., None, None]  # (N, V, 2, 4)
    _, s, Vt = np.linalg.svd(rows.reshape(len(b), 2 * len(T), 4), full_matrices=True)
    s = np.pad(s, ((0, 0), (0, 4 - s.shape[1])))  # a single view has two singular values only
    h = Vt[:, 3]
    flat = (s[:, 2] <= RANK * s[:, 0]) | (np.abs(h[:, 3]) <= FAR)
    X = size * h[:, :3] / np.where(flat, 1.0, h[:, 3])[:, None] + middle
    parallax = largest_angle(np.einsum("vji,nvj->nvi", R, b), used)
    few = used.sum(axis=1) < 2
    X = np.where((flat | few)[:, None], 0.0, X)
    depth = np.einsum("nvi,nvi->nv", b, se3.act(T, X[:, None]))
    behind = (used & (depth <= 0.0)).any(axis=1)
    state = np.full(len(b), PointState.OK, dtype=np.int8)
    state[behind] = PointState.BEHIND
    state[parallax < min_parallax] = PointState.SMALL_PARALLAX
    state[flat] = PointState.NO_DEPTH
    state[few] = PointState.TOO_FEW
    return LinearPoints(X, state, parallax)


def _frame(T: Array) -> tuple[Array, float]:
    """Middle of the camera centres, and their spread; 1 if they are all at one place."""
    centres = camera_pose.centre_from_pose(T)
    middle = centres.mean(axis=0)
    size = float(np.sqrt(np.mean(np.sum((centres - middle) ** 2, axis=1))))
    rounding = 8 * np.finfo(np.float64).eps * float(np.abs(centres).max(initial=0.0))
    return middle, size if size > rounding else 1.0


def as_mask(mask: ArrayLike | None, shape: tuple[int, ...]) -> BoolArray:
    """Mask of the given shape (N, V); all True where there is none.

    Raises
    ------
    ValueError
        If it has another shape, or is not bool.
    """
    used = np.ones(shape, dtype=bool) if mask is None else np.asarray(mask)
    if used.shape != shape or used.dtype != bool:
        raise ValueError(f"mask is {used.dtype} of shape {used.shape}: need bool of {shape}")
    return used


def _checked(T: Array, bearings: ArrayLike, mask: ArrayLike | None) -> tuple[Array, BoolArray]:
    """Bearings, the optical axis where masked out, and the mask."""
    b = as_array("bearings", bearings, 3)
    if T.ndim != 3 or b.ndim != 3 or b.shape[1] != len(T):
        raise ValueError(f"T_cam_world {T.shape} and bearings {b.shape}: need (V, 4, 4) and (N, V, 3)")
    used = as_mask(mask, b.shape[:2])
    length = np.linalg.norm(np.where(used[..., None], b, np.array([0.0, 0.0, 1.0])), axis=-1)
    refuse(~(np.abs(length - 1.0) < 1e-6), b, "bearing", "must be a unit vector, or masked out")
    return np.where(used[..., None], b, np.array([0.0, 0.0, 1.0])), used


def refuse(bad: BoolArray, values: Array, what: str, right: str) -> None:
    """Raise ValueError for the first of ``bad (N, V)`` in ``values (N, V, k)``, with what would be right."""
    if bad.any():
        n, v = np.argwhere(bad)[0]
        raise ValueError(f"{what} of point {n} in view {v} is {values[n, v].tolist()}: {right}")
