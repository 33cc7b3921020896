"""SO(2), the rotations of the plane.

An element is a 2 x 2 matrix; its tangent is one number, the angle in radians, shape (...) and not (..., 1).
Jacobians are 1 x 1 matrices.  Where only angles are at hand, :func:`wrap` and :func:`rotate` spare the
matrix.  All functions take any batch shape ``(...)``; arrays of other shapes raise ValueError.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, times, transpose
from vslam_ref.geometry.orthonormal import require_rotation

DOF = 1


def wrap(angle: ArrayLike) -> Array:
    """Wrap angles to (-pi, pi].

    Parameters
    ----------
    angle : array_like, shape (...)
        Radians.

    Returns
    -------
    ndarray, shape (...)
        The same rotation in (-pi, pi].  Angles already inside come back bit for bit.

    Examples
    --------
    >>> bool(wrap(3 * np.pi) == np.pi)
    True
    """
    a = np.asarray(angle, dtype=np.float64)
    if np.abs(a).max(initial=0.0) < np.pi:  # the common case, cheaply
        return a.copy()
    inside = (a > -np.pi) & (a <= np.pi)
    turned = np.pi - np.mod(np.pi - a, 2.0 * np.pi)
    # mod of a number a hair below 0 rounds to 2 pi, which would give -pi, the excluded end
    turned = np.where(turned <= -np.pi, np.pi, turned)
    return np.where(inside, a, turned)


def exp(phi: ArrayLike) -> Array:
    """Rotation matrix of an angle, shape (...) -> (..., 2, 2): ``[[cos, -sin], [sin, cos]]``.

    ``phi (...)`` in radians.
    """
    phi = np.asarray(phi, dtype=np.float64)
    c, s = np.cos(phi), np.sin(phi)
    return np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)


def log(R: ArrayLike, *, project: bool = False) -> Array:
    """Angle in (-pi, pi] of a rotation matrix, shape (..., 2, 2) -> (...).

    Returns ``phi (...)`` in radians.  ValueError if a matrix is no rotation up to rounding; with ``project``
    the nearest rotation is taken, and only a matrix without one is refused.
    """
    R = as_array("R", R, 2, 2)
    if project:
        R = nearest(R)
    else:
        require_rotation("R", R)
    angle: Array = np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])
    return angle


def rotate(phi: ArrayLike, x: ArrayLike) -> Array:
    """Rotate points ``x (..., 2)``, of any unit, by angles ``phi (...)`` in radians."""
    phi, x = np.asarray(phi, dtype=np.float64), as_array("x", x, 2)
    c, s = np.cos(phi), np.sin(phi)
    return np.stack([c * x[..., 0] - s * x[..., 1], s * x[..., 0] + c * x[..., 1]], -1)


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Identity rotations, shape (*shape, 2, 2).

    No unit.
    """
    return np.broadcast_to(np.eye(2), (*shape, 2, 2)).copy()


def matrix(R: ArrayLike) -> Array:
    """The element as a matrix: itself, shape (..., 2, 2).

    No unit.
    """
    return as_array("R", R, 2, 2)


def hat(phi: ArrayLike) -> Array:
    """Generator ``[[0, -phi], [phi, 0]]``, shape (...) -> (..., 2, 2).

    ``phi (...)`` in radians.
    """
    phi = np.asarray(phi, dtype=np.float64)
    generator: Array = phi[..., None, None] * np.array([[0.0, -1.0], [1.0, 0.0]])
    return generator


def vee(Phi: ArrayLike) -> Array:
    """Undo :func:`hat`, shape (..., 2, 2) -> (...).

    Returns ``phi (...)`` in radians.
    """
    Phi = as_array("Phi", Phi, 2, 2)
    return np.asarray((Phi[..., 1, 0] - Phi[..., 0, 1]) / 2)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Product R_a R_b, shapes (..., 2, 2).

    Elements ``a (..., 2, 2)`` and ``b (..., 2, 2)``: T_a_b and T_b_c give T_a_c.
    """
    return np.asarray(as_array("a", a, 2, 2) @ as_array("b", b, 2, 2))


def inverse(R: ArrayLike) -> Array:
    """Transpose, shape (..., 2, 2).

    An element T_a_b gives T_b_a.
    """
    return transpose(as_array("R", R, 2, 2)).copy()


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """R_a^-1 R_b, shapes (..., 2, 2).

    Elements ``a (..., 2, 2)`` and ``b (..., 2, 2)``: T_w_a and T_w_b give T_a_b.
    """
    return compose(inverse(a), b)


def act(R: ArrayLike, x: ArrayLike) -> Array:
    """Turn points ``x (..., 2)`` by matrices ``R (..., 2, 2)``.

    Points in any unit; the result has the same.
    """
    return times(as_array("R", R, 2, 2), as_array("x", x, 2))


def ad(phi: ArrayLike) -> Array:
    """Matrix of the Lie bracket, shape (...) -> (..., 1, 1): zero, as turns of the plane commute.

    ``phi (...)`` in radians; shape of the result (..., 1, 1).
    """
    return np.zeros((*np.shape(phi), 1, 1))


def adjoint(R: ArrayLike) -> Array:
    """Matrix with R Exp(phi) R^-1 = Exp(Ad phi), shape (..., 2, 2) -> (..., 1, 1): one.

    No unit; maps tangent vectors in radians.
    """
    return np.ones((*as_array("R", R, 2, 2).shape[:-2], 1, 1))


def left_jacobian(phi: ArrayLike) -> Array:
    """J with Exp(phi + d) = Exp(J d) Exp(phi), shape (...) -> (..., 1, 1): one.

    ``phi (...)`` in radians.
    """
    return np.ones((*np.shape(phi), 1, 1))


def left_jacobian_inverse(phi: ArrayLike) -> Array:
    """Inverse of :func:`left_jacobian`, shape (...) -> (..., 1, 1): one.

    ``phi (...)`` in radians; shape of the result (..., 1, 1).
    """
    return np.ones((*np.shape(phi), 1, 1))


def perturb(R: ArrayLike, phi: ArrayLike) -> Array:
    """Exp(phi) R, shapes (..., 2, 2) and (...).

    ``phi (...)`` in radians, in the frame a of T_a_b.
    """
    return compose(exp(phi), R)


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Turn at constant speed from a (fraction 0) to b (1), the short way round; shapes (..., 2, 2), (...).

    Elements and result ``(..., 2, 2)`` map to the same frame; ``fraction (...)`` has no unit.
    """
    return compose(a, exp(np.asarray(fraction, dtype=np.float64) * log(between(a, b))))


def random(rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Uniform rotations, shape (*shape, 2, 2).

    Angles in radians.
    """
    return exp(rng.uniform(-np.pi, np.pi, shape))


def nearest(M: ArrayLike) -> Array:
    """Rotation matrix nearest to ``M (..., 2, 2)`` in the Frobenius norm.

    No unit.

    It maximises tr(R^T M); with R = R(phi) that is cos(phi)(M00 + M11) + sin(phi)(M10 - M01),
    so :func:`log`'s arctan2 of these two sums is the answer.

    Raises
    ------
    ValueError
        If both sums vanish: then every rotation is equally near.
    """
    M = as_array("M", M, 2, 2)
    even, odd = M[..., 0, 0] + M[..., 1, 1], M[..., 1, 0] - M[..., 0, 1]
    if np.any(np.hypot(even, odd) == 0.0):
        raise ValueError("nearest rotation undefined: M00 + M11 and M10 - M01 both vanish")
    angle: Array = np.arctan2(odd, even)
    return exp(angle)
