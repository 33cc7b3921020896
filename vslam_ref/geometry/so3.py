r"""SO(3), the rotations of space, as matrices ``R (..., 3, 3)``.

A tangent vector ``phi (..., 3)`` is a rotation vector: its direction is the axis, its length :math:`\theta`
the angle in radians.  Perturbations act from the left, ``R <- Exp(phi) R``.  ``R_a_b`` turns coordinates in
b to coordinates in a.  Matrices have no unit; arrays of other shapes raise ValueError.

Accuracy: every function is within 1e-14 of the exact value (relative, in the Frobenius norm) for angles up to
:math:`2\pi`.  The inverse of the left Jacobian has poles at
:math:`2\pi` and its multiples, loses near them what its condition takes, and is refused where fewer than four
digits are left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, times, transpose
from vslam_ref.geometry import quaternion
from vslam_ref.geometry.coefficients import (
    inverse_coefficients,
    rotation_coefficients,
    rotation_polynomial,
)
from vslam_ref.geometry.jacobians import Acted, Combined, Unary, combined
from vslam_ref.geometry.nearest import nearest_rotation
from vslam_ref.geometry.orthonormal import rotation_of

DOF = 3


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Identity rotations, shape (*shape, 3, 3).

    No unit.
    """
    return np.broadcast_to(np.eye(3), (*shape, 3, 3)).copy()


def matrix(R: ArrayLike) -> Array:
    """The element as a matrix: itself, shape (..., 3, 3).

    No unit.
    """
    return as_array("R", R, 3, 3)


def hat(phi: ArrayLike) -> Array:
    """Matrix Phi with Phi x = phi x x (cross product), shape (..., 3) -> (..., 3, 3).

    ``phi (..., 3)`` in radians.

    Implements :eq:`eq-hat`.

    >>> hat([1.0, 2.0, 3.0]).tolist()
    [[0.0, -3.0, 2.0], [3.0, 0.0, -1.0], [-2.0, 1.0, 0.0]]
    """
    phi = as_array("phi", phi, 3)
    Phi = np.zeros((*phi.shape[:-1], 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        Phi[..., k, j], Phi[..., j, k] = phi[..., i], -phi[..., i]
    return Phi


def vee(Phi: ArrayLike) -> Array:
    """Undo :func:`hat`, shape (..., 3, 3) -> (..., 3); a symmetric part is ignored.

    Returns ``phi (..., 3)`` in radians.
    """
    Phi = as_array("Phi", Phi, 3, 3)
    pairs = ((2, 1), (0, 2), (1, 0))
    return np.stack([(Phi[..., i, j] - Phi[..., j, i]) / 2 for i, j in pairs], -1)


def exp(phi: ArrayLike) -> Array:
    """Rotation matrix of a rotation vector, shape (..., 3) -> (..., 3, 3).

    ``phi (..., 3)`` in radians.

    Implements :eq:`eq-rodrigues`: I + c_1 Phi + c_2 Phi^2.

    >>> np.round(exp([0.0, 0.0, np.pi / 2]), 12).tolist()
    [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """
    phi = as_array("phi", phi, 3)
    c = rotation_coefficients(np.sum(phi * phi, -1))
    return rotation_polynomial(np.ones_like(c[1]), c[1], c[2], hat(phi))


def log(R: ArrayLike, *, project: bool = False) -> Array:
    """Rotation vector with Exp(phi) = R and an angle in [0, pi], shape (..., 3, 3) -> (..., 3).

    Returns ``phi (..., 3)`` in radians.  ValueError if a matrix is no rotation up to rounding (see
    :mod:`.orthonormal`); with ``project`` the nearest rotation is taken.

    Implements :eq:`eq-log-rotation`.  It goes through the quaternion, which is well conditioned at every
    angle: arccos((tr R - 1) / 2) would lose half of all digits near 0 and near pi, and the antisymmetric
    part its direction near pi.  At pi itself both ends of the axis are right; see
    :func:`.quaternion.canonical`.
    """
    return log_of_rotation(rotation_of("R", R, project))


def log_of_rotation(R: Array) -> Array:
    """:func:`log` of what is known to be rotations ``R (..., 3, 3)``: nothing is checked.

    Returns ``phi (..., 3)`` in radians.
    """
    return quaternion.log(quaternion.of_rotation(R))


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Product R_a R_b, shapes (..., 3, 3).

    Elements ``a (..., 3, 3)`` and ``b (..., 3, 3)``: T_a_b and T_b_c give T_a_c.
    """
    return np.asarray(as_array("a", a, 3, 3) @ as_array("b", b, 3, 3))


def inverse(R: ArrayLike) -> Array:
    """Transpose, shape (..., 3, 3).

    An element T_a_b gives T_b_a.
    """
    return transpose(as_array("R", R, 3, 3)).copy()


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """R_a^-1 R_b, shapes (..., 3, 3).

    Elements ``a (..., 3, 3)`` and ``b (..., 3, 3)``: T_w_a and T_w_b give T_a_b.
    """
    return compose(inverse(a), b)


def act(R: ArrayLike, x: ArrayLike) -> Array:
    """Turn points ``x (..., 3)``.

    Points in any unit; the result has the same.
    """
    return times(as_array("R", R, 3, 3), as_array("x", x, 3))


def ad(phi: ArrayLike) -> Array:
    """Matrix of the Lie bracket, vee of hat(a) hat(b) - hat(b) hat(a): hat itself, the cross product.

    ``phi (..., 3)`` in radians; shape of the result (..., 3, 3).
    """
    return hat(phi)


def adjoint(R: ArrayLike) -> Array:
    """Matrix with R Exp(phi) R^-1 = Exp(Ad phi), shape (..., 3, 3): R itself.

    No unit; maps tangent vectors in radians.
    """
    return as_array("R", R, 3, 3).copy()


def left_jacobian(phi: ArrayLike) -> Array:
    """J with Exp(phi + d) = Exp(J d) Exp(phi) to first order, shape (..., 3) -> (..., 3, 3).

    ``phi (..., 3)`` in radians.

    Implements :eq:`eq-v`: I + c_2 Phi + c_3 Phi^2, the average of the rotations on the way.
    The right Jacobian is that of -phi, the transpose.
    """
    phi = as_array("phi", phi, 3)
    c = rotation_coefficients(np.sum(phi * phi, -1))
    return rotation_polynomial(np.ones_like(c[2]), c[2], c[3], hat(phi))


def left_jacobian_inverse(phi: ArrayLike) -> Array:
    """Inverse of :func:`left_jacobian`, shape (..., 3) -> (..., 3, 3); it has poles at 2 pi, 4 pi, ...

    ``phi (..., 3)`` in radians; shape of the result (..., 3, 3).  ValueError so near to a pole that
    fewer than four digits are left (see :func:`.inverse_coefficients`).

    Implements :eq:`eq-v-inverse`.
    """
    phi = as_array("phi", phi, 3)
    q = np.sum(phi * phi, -1)
    c = rotation_coefficients(q)
    return rotation_polynomial(*inverse_coefficients(np.ones_like(q), c[2], c[3], q), hat(phi))


def perturb(R: ArrayLike, phi: ArrayLike) -> Array:
    """Exp(phi) R, shapes (..., 3, 3) and (..., 3).

    ``phi (..., 3)`` in radians, in the frame a of T_a_b.
    """
    return compose(exp(phi), R)


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Turn at constant speed from a (fraction 0) to b (1), the short way round; shapes (..., 3, 3), (...).

    Elements and result ``(..., 3, 3)`` map to the same frame; ``fraction (...)`` has no unit.
    """
    fraction = np.asarray(fraction, dtype=np.float64)[..., None]
    return compose(a, exp(fraction * log(between(a, b))))


def random(rng: np.random.Generator, shape: tuple[int, ...] = ()) -> Array:
    """Uniform rotations (Haar measure), shape (*shape, 3, 3).

    No unit.
    """
    return quaternion.matrix(quaternion.random(rng, shape))


def nearest(M: ArrayLike) -> Array:
    """Rotation nearest to ``M (..., 3, 3)``; ValueError where it is not unique.

    No unit.

    See :func:`.nearest_rotation`.
    """
    return nearest_rotation(M).R


def act_with_jacobians(R: ArrayLike, x: ArrayLike) -> Acted:
    """Value and Jacobians of :func:`act`: J_pose = -hat(R x), J_point = R.

    ``value (..., 3)`` in the points' unit; J_pose is in a left perturbation, ``phi (..., 3)`` in radians.
    """
    value = act(R, x)
    return Acted(value, -hat(value), np.broadcast_to(matrix(R), (*value.shape, 3)))


def compose_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`compose`: Exp(d) goes through a as Exp(R_a d).

    Elements ``(..., 3, 3)``; J_a and J_b ``(..., 3, 3)`` are in left perturbations, ``phi (..., 3)`` in
    radians.
    """
    return combined(compose(a, b), np.eye(DOF), matrix(a))


def between_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`between`: -R_a^-1 and R_a^-1.

    Elements ``(..., 3, 3)``; J_a and J_b ``(..., 3, 3)`` are in left perturbations, ``phi (..., 3)`` in
    radians.
    """
    return combined(between(a, b), -inverse(a), inverse(a))


def inverse_with_jacobians(R: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`inverse`: -R^-1.

    Elements ``(..., 3, 3)``; J_pose ``(..., 3, 3)`` is in a left perturbation, ``phi (..., 3)`` in radians.
    """
    value = inverse(R)
    return Unary(value, -value)


def log_with_jacobians(R: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`log`: the inverse of the left Jacobian there.

    An element ``(..., 3, 3)``; J_pose ``(..., 3, 3)`` is in a left perturbation, ``phi (..., 3)`` in
    radians.
    """
    phi = log(R)
    return Unary(phi, left_jacobian_inverse(phi))
