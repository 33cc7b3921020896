r"""How far a pair is from fitting, in both pictures, to first order; and how that changes with the motion.

For a constraint e(x_a, x_b) = 0 with the derivative G in the four coordinates, the smallest change
that makes a pair fit has, to first order, the squared length :math:`e^T (G G^T)^{-1} e`.  One equation (an
essential matrix) leaves a signed number, two (a homography) a vector of two.

**Five numbers.**  A relative pose has a rotation and a direction.  Both are perturbed from the left,

.. math:: R \leftarrow \operatorname{Exp}(\varphi)\, R, \qquad
          t \leftarrow \operatorname{Exp}\bigl(t \times N^T \alpha\bigr)\, t, \qquad \lVert t \rVert = 1 ,

with N (2, 3) two unit vectors across t, so t moves by :math:`N^T\alpha`; the order is
:math:`(\alpha, \varphi)`, the direction first, as in every pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, as_array, times, transpose
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.multiview._rays import across
from vslam_ref.geometry.multiview.two_views._pairs import homogeneous

DOF = 5


class SampsonJacobians(NamedTuple):
    """Signed distances (..., 1) in the unit of the positions, and ``J_motion (..., 1, 5)``.

    J_motion is per radian: two numbers of the direction of t, three of the rotation.
    """

    residual: Array
    J_motion: Array


def perturb(T_b_a: ArrayLike, delta: ArrayLike) -> Array:
    """Relative pose (..., 4, 4) after a small change ``delta (..., 5)``, radians; t gets length 1.

    Implements :eq:`eq-five-numbers`.  ``T_b_a (..., 4, 4)`` has a translation of any unit and not zero.

    >>> T = se3.exp([2.0, 0, 0, 0, 0, 0])
    >>> perturb(T, [0.0, 0.0, 0.0, 0.0, 0.1])[:3, 3].tolist()
    [1.0, 0.0, 0.0]
    """
    T, delta = as_array("T_b_a", T_b_a, 4, 4), as_array("delta", delta, DOF)
    t = _direction(T)
    step = np.einsum("...ki,...k->...i", across(t), delta[..., :2])
    turned = so3.act(so3.exp(np.cross(t, step)), t)
    turned = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
    return se3.from_rt(so3.perturb(se3.rotation(T), delta[..., 2:]), turned)


def sampson(T_b_a: ArrayLike, xn_a: ArrayLike, xn_b: ArrayLike) -> Array:
    """Signed Sampson distances (..., 1) of pairs from a relative pose, in the unit of the positions.

    Parameters and errors as for :func:`sampson_with_jacobians`.  Implements :eq:`eq-sampson`.
    """
    T = as_array("T_b_a", T_b_a, 4, 4)
    E = so3.hat(_direction(T)) @ se3.rotation(T)
    return _signed(E, as_array("xn_a", xn_a, 2), as_array("xn_b", xn_b, 2))[..., None]


def sampson_with_jacobians(T_b_a: ArrayLike, xn_a: ArrayLike, xn_b: ArrayLike) -> SampsonJacobians:
    """Signed Sampson distances and their derivatives in the five numbers of :func:`perturb`.

    Implements :eq:`eq-sampson-jacobian`.

    Parameters
    ----------
    T_b_a : array_like, shape (..., 4, 4)
        From camera a to camera b; only the direction of its translation counts.
    xn_a, xn_b : array_like, shape (..., 2)
        Normalised positions.

    Returns
    -------
    SampsonJacobians

    Raises
    ------
    ValueError
        If shapes do not fit.

    Examples
    --------
    >>> T = se3.exp([-1.0, 0, 0, 0, 0, 0])  # epipolar lines are rows
    >>> at = sampson_with_jacobians(T, [0.1, 0.2], [0.0, 0.26])
    >>> at.residual.round(9).tolist(), at.J_motion.shape
    ([0.042426407], (1, 5))
    """
    T = as_array("T_b_a", T_b_a, 4, 4)
    a, b = homogeneous(as_array("xn_a", xn_a, 2)), homogeneous(as_array("xn_b", xn_b, 2))
    t, R = _direction(T), se3.rotation(T)
    E = so3.hat(t) @ R
    line_b, line_a = times(E, a), times(transpose(E), b)
    value = np.sum(b * line_b, axis=-1)
    length = np.sqrt(np.sum(line_a[..., :2] ** 2, axis=-1) + np.sum(line_b[..., :2] ** 2, axis=-1))
    safe = np.where(length > 0, length, np.inf)
    # derivatives of both lines in the five numbers, (..., 3, 5): E a = t x Ra, E'b = R'(b x t) = -R'(t x b)
    Ra, N = times(R, a), transpose(across(t))
    turn = so3.hat(t) @ -so3.hat(Ra)
    d_b = np.concatenate([-so3.hat(Ra) @ N, turn], axis=-1)
    crossed = np.cross(b, t)
    d_a = transpose(R) @ np.concatenate([so3.hat(b) @ N, so3.hat(crossed)], axis=-1)
    d_value = np.einsum("...i,...ij->...j", b, d_b)
    d_length = np.einsum("...i,...ij->...j", line_b[..., :2], d_b[..., :2, :])
    d_length = d_length + np.einsum("...i,...ij->...j", line_a[..., :2], d_a[..., :2, :])
    J = d_value / safe[..., None] - (value / safe**3)[..., None] * d_length
    return SampsonJacobians((value / safe)[..., None], J[..., None, :])


def essential_sampson(E: ArrayLike, xn_a: ArrayLike, xn_b: ArrayLike) -> Array:
    """Sampson distances (..., N), signed, of pairs ``xn (..., N, 2)`` from matrices ``E (..., 3, 3)``.

    Implements :eq:`eq-sampson`, for many matrices at once; E has any unit, the answer that of the positions.
    """
    E = as_array("E", E, 3, 3)[..., None, :, :]
    return _signed(E, as_array("xn_a", xn_a, 2), as_array("xn_b", xn_b, 2))


def _signed(c: Array, xn_a: Array, xn_b: Array) -> Array:
    """Signed distances (...) of ``xn (..., 2)`` from matrices ``c (..., 3, 3)``, a component at a time.

    Thousands of models are judged on hundreds of pairs: sums over axes of length three would take most of it.
    """
    a, b, u, v = xn_a[..., 0], xn_a[..., 1], xn_b[..., 0], xn_b[..., 1]
    first = c[..., 0, 0] * a + c[..., 0, 1] * b + c[..., 0, 2]  # the line E x_a
    second = c[..., 1, 0] * a + c[..., 1, 1] * b + c[..., 1, 2]
    third = c[..., 2, 0] * a + c[..., 2, 1] * b + c[..., 2, 2]
    back_first = c[..., 0, 0] * u + c[..., 1, 0] * v + c[..., 2, 0]  # the line E' x_b
    back_second = c[..., 0, 1] * u + c[..., 1, 1] * v + c[..., 2, 1]
    square = first**2 + second**2 + back_first**2 + back_second**2
    value = u * first + v * second + third
    return np.asarray(value / np.sqrt(np.where(square > 0, square, np.inf)))


def homography_sampson(H: ArrayLike, x_a: ArrayLike, x_b: ArrayLike) -> Array:
    """Residuals (..., N, 2) of pairs from homographies; the squared length is the Sampson distance.

    Implements :eq:`eq-homography-sampson`.

    Parameters
    ----------
    H : array_like, shape (..., 3, 3)
        x_b ~ H x_a, with the sign that puts points in front.
    x_a, x_b : array_like, shape (..., N, 2)
        Positions, normalised or in pixels.

    Returns
    -------
    ndarray, shape (..., N, 2)
        In the unit of the positions; infinite where H sends a point behind the camera.

    Examples
    --------
    >>> homography_sampson(np.eye(3), [[0.0, 0.0]], [[0.0, -0.2]]).round(9).tolist()  # shared by two pictures
    [[0.0, 0.141421356]]
    """
    H, a, b = as_array("H", H, 3, 3), as_array("x_a", x_a, 2), as_array("x_b", x_b, 2)
    at = _map_errors(H, a, b)
    # the residual is L^-1 times the error, with L L' the matrix ((p, q), (q, r))
    first = np.sqrt(at.p)
    below = at.q / first
    r0 = at.u / first
    r1 = (at.v - below * r0) / (np.sqrt(at.det) / first)
    return np.asarray(np.where(at.front[..., None], np.stack([r0, r1], axis=-1), np.inf))


def homography_squared(H: ArrayLike, x_a: ArrayLike, x_b: ArrayLike) -> Array:
    """Squared length (..., N) of :func:`homography_sampson`, in the squared unit of the positions.

    Parameters and errors as there.  Implements :eq:`eq-homography-sampson`.

    >>> homography_squared(np.eye(3), [[0.0, 0.0]], [[0.0, -0.2]]).round(9).tolist()
    [0.02]
    """
    at = _map_errors(as_array("H", H, 3, 3), as_array("x_a", x_a, 2), as_array("x_b", x_b, 2))
    squared = (at.r * at.u**2 - 2.0 * at.q * at.u * at.v + at.p * at.v**2) / at.det
    return np.asarray(np.where(at.front, squared, np.inf))


class _MapErrors(NamedTuple):
    """Errors u, v of mapped points, I + J J' as (p, q; q, r) and its determinant, and which lie in front."""

    u: Array
    v: Array
    p: Array
    q: Array
    r: Array
    det: Array
    front: BoolArray


def _map_errors(H: Array, a: Array, b: Array) -> _MapErrors:
    """How homographies map points, (..., N) each; a component at a time, as in :func:`_signed`."""
    h, x, y = H[..., None, :, :], a[..., 0], a[..., 1]
    depth = h[..., 2, 0] * x + h[..., 2, 1] * y + h[..., 2, 2]
    front = depth > 0
    scale = 1.0 / np.where(front, depth, 1.0)
    u = (h[..., 0, 0] * x + h[..., 0, 1] * y + h[..., 0, 2]) * scale
    v = (h[..., 1, 0] * x + h[..., 1, 1] * y + h[..., 1, 2]) * scale
    # J of H x_a in x_a; in x_b it is minus the identity
    J_ux, J_uy = (h[..., 0, 0] - u * h[..., 2, 0]) * scale, (h[..., 0, 1] - u * h[..., 2, 1]) * scale
    J_vx, J_vy = (h[..., 1, 0] - v * h[..., 2, 0]) * scale, (h[..., 1, 1] - v * h[..., 2, 1]) * scale
    p, q, r = 1.0 + J_ux**2 + J_uy**2, J_ux * J_vx + J_uy * J_vy, 1.0 + J_vx**2 + J_vy**2
    # det(I + J J') by a sum, not a difference
    det = p + r - 1.0 + (J_ux * J_vy - J_uy * J_vx) ** 2
    return _MapErrors(u - b[..., 0], v - b[..., 1], p, q, r, det, front)


def _direction(T: Array) -> Array:
    """Unit vector along the translation.

    Raises
    ------
    ValueError
        If it is zero.
    """
    t = se3.translation(T)
    length = np.linalg.norm(t, axis=-1, keepdims=True)
    if not (length > 0).all():
        raise ValueError("T_b_a has no translation: its direction is not defined")
    return np.asarray(t / length)
