r"""From the matrix to the motion: four of an essential matrix, two of a homography.

**E = hat(t) R.**  With :math:`E = U \operatorname{diag}(1, 1, 0)\, V^T` and W the quarter turn about z,

.. math:: R = U W V^T \;\text{or}\; U W^T V^T, \qquad t = \pm u_3 .

The second rotation is the first after half a turn about the baseline; only one of the four motions has the
points in front of both cameras.

**H = R + t n^T / d.**  Directions across n keep their length.  After scaling the middle singular value to 1,
:math:`H^T H` has the eigenvalues :math:`\sigma_1^2 \ge 1 \ge \sigma_3^2`, and the two planes of directions
that keep their length are spanned by :math:`v_2` and

.. math:: u_\pm = \bigl(\sqrt{1 - \sigma_3^2}\; v_1 \pm \sqrt{\sigma_1^2 - 1}\; v_3\bigr)
          / \sqrt{\sigma_1^2 - \sigma_3^2} .

Each plane gives one motion: R carries :math:`(v_2, u, v_2 \times u)` to
:math:`(H v_2, H u, H v_2 \times H u)`, the normal is :math:`v_2 \times u` and t / d = (H - R) n.  A plane
that is seen has
:math:`n^T x_a > 0` for every point on it.  Often both pass: then only a third picture, or points off the
plane, can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array, transpose
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview.two_views._pairs import homogeneous

TURN_ONLY = 1e-6
"""Spread of the singular values (largest minus smallest over the middle one) below which H is a rotation."""
SAME = 1e-6
"""Both answers of a homography are one where normals and motions differ by less."""
_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class PlanarMotions:
    """The two answers of a homography.

    Attributes
    ----------
    T_b_a : ndarray, shape (2, 4, 4)
        The translation's unit is the distance of the plane from camera a.
    normal : ndarray, shape (2, 3)
        Unit normals in the frame of camera a, away from it: n . X_a = 1 on the plane.
    possible : ndarray of bool, shape (2,)
        Whether the plane of this answer lies in front of camera a at all points.
    reason : str
        Empty if just one answer is possible; else why the homography alone does not tell the motion.
    """

    T_b_a: Array
    normal: Array
    possible: BoolArray
    reason: str


def essential_motions(E: ArrayLike) -> Array:
    """Four motions ``T_b_a (..., 4, 4, 4)`` of an essential matrix ``E (..., 3, 3)``; t has length 1.

    Implements :eq:`eq-essential-motions`.  Their order: both rotations with +t, then both with -t.  The
    unit of length is the baseline.  E need not be exactly essential: the nearest one is decomposed.

    Examples
    --------
    >>> T = essential_motions([[0, 0, 0], [0, 0, -1], [0, 1, 0.0]])  # a step along x
    >>> sorted(set(np.abs(T[:, :3, 3]).round(9)[:, 0].tolist()))
    [1.0]
    >>> bool((np.abs(T[:, :3, :3] - np.eye(3)).max(axis=(1, 2)) < 1e-12).any())
    True
    """
    U, _, Vt = np.linalg.svd(as_array("E", E, 3, 3))
    first, second = U @ _QUARTER @ Vt, U @ _QUARTER.T @ Vt
    sign = np.sign(np.linalg.det(first))[..., None, None]
    t = U[..., :, 2]
    pairs = [(first, t), (second, t), (first, -t), (second, -t)]
    return np.stack([se3.from_rt(sign * R, s) for R, s in pairs], axis=-3)


def homography_motions(H: ArrayLike, xn_a: ArrayLike) -> PlanarMotions:
    """Both motions and planes of a homography, and which of them the points allow.

    Implements :eq:`eq-homography-motions`.

    Parameters
    ----------
    H : array_like, shape (3, 3)
        Between normalised positions, x_b ~ H x_a, of any size and sign.
    xn_a : array_like, shape (N, 2)
        Normalised positions in picture a of points of the plane.

    Returns
    -------
    PlanarMotions

    Raises
    ------
    ValueError
        If H is not a finite, regular (3, 3), or there are no points.

    Notes
    -----
    Both cameras are taken to be on the same side of the plane, so det H > 0.

    Examples
    --------
    >>> H = np.eye(3) + np.outer([-0.5, 0, 0], [0, 0, 1.0])  # a step along x, a wall ahead
    >>> found = homography_motions(H, [[-0.3, 0.2], [0.4, -0.1], [0.1, 0.3]])
    >>> int(np.argmin(np.abs(found.T_b_a - se3.exp([-0.5, 0, 0, 0, 0, 0])).max(axis=(1, 2)))) in (0, 1)
    True
    """
    H, x = as_array("H", H, 3, 3), as_array("xn_a", xn_a, 2)
    if H.shape != (3, 3) or x.ndim != 2 or len(x) == 0:
        raise ValueError(f"H {H.shape} and xn_a {x.shape}: need (3, 3) and (N, 2), N at least 1")
    if not (np.isfinite(H).all() and np.isfinite(x).all()):
        raise ValueError("H and points must be finite")
    _, s, Vt = np.linalg.svd(H)
    if s[2] <= 1e-12 * s[0]:
        raise ValueError(f"H has the singular values {s.tolist()}: need a regular matrix")
    H = np.asarray(H * np.sign(np.linalg.det(H)) / s[1], dtype=np.float64)
    s = s / s[1]
    if s[0] - s[2] <= TURN_ONLY:
        U, _, Wt = np.linalg.svd(H)
        T = np.broadcast_to(se3.from_rt(U @ Wt, np.zeros(3)), (2, 4, 4)).copy()
        return PlanarMotions(
            T, np.zeros((2, 3)), np.zeros(2, dtype=bool), "a pure rotation: no plane is seen"
        )
    T, n = _both(H, s, Vt.T)
    front = homogeneous(x) @ n.T  # (N, 2)
    turned = np.sign(front.sum(axis=0))
    turned = np.where(turned == 0, 1.0, turned)
    n = turned[:, None] * n
    T[:, :3, 3] *= turned[:, None]
    possible = np.asarray((front * turned > 0).all(axis=0))
    same = np.abs(T[0] - T[1]).max() < SAME and np.abs(n[0] - n[1]).max() < SAME
    return PlanarMotions(T, n, possible, _reason(possible, bool(same)))


def _both(H: Array, s: Array, V: Array) -> tuple[Array, Array]:
    """Motions (2, 4, 4), with t / d, and normals (2, 3), of a scaled homography."""
    a, c = np.sqrt(max(1.0 - s[2] ** 2, 0.0)), np.sqrt(max(s[0] ** 2 - 1.0, 0.0))
    T, normals = se3.identity((2,)), np.zeros((2, 3))
    for k, sign in enumerate((1.0, -1.0)):
        u = (a * V[:, 0] + sign * c * V[:, 2]) / np.hypot(a, c)
        n = np.cross(V[:, 1], u)
        kept = np.column_stack([V[:, 1], u, n])
        Hv, Hu = H @ V[:, 1], H @ u
        R = np.column_stack([Hv, Hu, np.cross(Hv, Hu)]) @ transpose(kept)
        T[k], normals[k] = se3.from_rt(R, (H - R) @ n), n
    return T, normals


def _reason(possible: BoolArray, same: bool) -> str:
    if not possible.any():
        return "no answer has all points in front of the camera"
    if possible.all() and not same:
        return "both answers have all points in front: a third picture must decide"
    return ""
