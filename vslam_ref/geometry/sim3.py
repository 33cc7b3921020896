r"""Sim(3), rigid motions with a change of scale, as matrices ``S (..., 4, 4)``.

::

    S_a_b = [ s R  t ]        X_a = s R X_b + t,   s > 0
            [  0   1 ]

The scale multiplies the rotation; the translation is not scaled by it.  (Another layout in use keeps R
and writes 1/s into the corner: there X_a = s (R X_b + t).)  A tangent vector is ``xi = (rho, phi, sigma)
(..., 7)``: metres, radians, and the log-scale, s = exp(sigma).  Perturbations act from the left.  Accuracy
as in :mod:`.so3`, for :math:`|\sigma| \le 8` where a Jacobian is asked for.  Arrays of other shapes raise
ValueError.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, blocks, times, transpose
from vslam_ref.geometry import so3
from vslam_ref.geometry.coefficients import (
    inverse_coefficients,
    rotation_polynomial,
    similarity_coefficients,
)
from vslam_ref.geometry.jacobians import Acted, Combined, Unary, combined
from vslam_ref.geometry.nearest import nearest_rotation
from vslam_ref.geometry.orthonormal import require_rotation

# of 4 x 4 matrices: the same functions as for rigid motions
from vslam_ref.geometry.se3 import act as act
from vslam_ref.geometry.se3 import compose as compose
from vslam_ref.geometry.se3 import identity as identity
from vslam_ref.geometry.se3 import matrix as matrix
from vslam_ref.geometry.se3 import translation as translation

DOF = 7

_HALVINGS = 4  # then |sigma + i theta| < 0.65 for |sigma| < 8 and theta < 2 pi
_TERMS = 14  # the first one left out is below 0.65^15 / 16! < 1e-16


def from_srt(s: ArrayLike, R: ArrayLike, t: ArrayLike) -> Array:
    """Similarity of scale ``s (...)``, rotation ``R (..., 3, 3)``, translation ``t (..., 3)``.

    ``t`` in metres: S_a_b from s, R_a_b and t_a_b; the scale has no unit.

    Raises
    ------
    ValueError
        If a scale is not positive.
    """
    s, R, t = np.asarray(s, dtype=np.float64), as_array("R", R, 3, 3), as_array("t", t, 3)
    if not np.all(s > 0.0):
        raise ValueError(f"scale {np.min(s)}: must be positive")
    S = np.zeros((*np.broadcast_shapes(s.shape, R.shape[:-2], t.shape[:-1]), 4, 4))
    S[..., :3, :3], S[..., :3, 3], S[..., 3, 3] = s[..., None, None] * R, t, 1.0
    return S


def scale(S: ArrayLike) -> Array:
    """s, the length of s R over that of R, shape (..., 4, 4) -> (...).

    A scale has no unit.
    """
    M = as_array("S", S, 4, 4)[..., :3, :3]
    return np.asarray(np.linalg.norm(M, axis=(-2, -1)) / np.sqrt(3.0))


def rotation(S: ArrayLike) -> Array:
    """R_a_b of S_a_b, shape (..., 4, 4) -> (..., 3, 3).

    A rotation has no unit.
    """
    S = as_array("S", S, 4, 4)
    return np.asarray(S[..., :3, :3] / scale(S)[..., None, None])


def hat(xi: ArrayLike) -> Array:
    """Generator [[sigma I + hat(phi), rho], [0, 0]] of Exp(xi), shape (..., 7) -> (..., 4, 4).

    The tangent vector is xi = (rho, phi, sigma): metres, radians, log-scale.
    """
    xi = as_array("xi", xi, 7)
    M = np.zeros((*xi.shape[:-1], 4, 4))
    M[..., :3, :3] = so3.hat(xi[..., 3:6]) + xi[..., 6, None, None] * np.eye(3)
    M[..., :3, 3] = xi[..., :3]
    return M


def vee(M: ArrayLike) -> Array:
    """Undo :func:`hat`, shape (..., 4, 4) -> (..., 7).

    Returns xi = (rho, phi, sigma): metres, radians, log-scale.
    """
    M = as_array("M", M, 4, 4)
    sigma = np.trace(M[..., :3, :3], axis1=-2, axis2=-1) / 3.0
    return np.concatenate([M[..., :3, 3], so3.vee(M[..., :3, :3]), sigma[..., None]], -1)


def w_matrix(phi: ArrayLike, sigma: ArrayLike) -> Array:
    """W(phi, sigma) with t = W rho in Exp, shapes (..., 3) and (...) -> (..., 3, 3).

    ``phi`` in radians, ``sigma`` the log-scale; the result has no unit.

    Implements :eq:`eq-w-matrix`; the coefficients and their four regimes (phi and sigma, small or not) are
    those of :func:`.similarity_coefficients`.  W(phi, 0) is V of SO(3); W(0, sigma) = (exp(sigma) - 1) /
    sigma I.
    """
    phi, sigma = as_array("phi", phi, 3), np.asarray(sigma, dtype=np.float64)
    return rotation_polynomial(*similarity_coefficients(sigma, np.sum(phi * phi, -1)), so3.hat(phi))


def w_matrix_inverse(phi: ArrayLike, sigma: ArrayLike) -> Array:
    """Inverse of :func:`w_matrix`; it exists unless sigma = 0 and the angle is a multiple of 2 pi.

    Shapes (..., 3) and (...) -> (..., 3, 3); ``phi`` in radians, ``sigma`` the log-scale.
    """
    phi, sigma = as_array("phi", phi, 3), np.asarray(sigma, dtype=np.float64)
    theta2 = np.sum(phi * phi, -1)
    coefficients = inverse_coefficients(*similarity_coefficients(sigma, theta2), theta2)
    return rotation_polynomial(*coefficients, so3.hat(phi))


def exp(xi: ArrayLike) -> Array:
    """Similarity [[exp(sigma) Exp(phi), W rho], [0, 1]], shape (..., 7) -> (..., 4, 4).

    The tangent vector is xi = (rho, phi, sigma): metres, radians, log-scale.

    Implements :eq:`eq-exp-similarity`.

    >>> np.round(exp([1, 0, 0, 0, 0, 0, np.log(2)]), 6)[0].tolist()  # (2 - 1) / log 2 along x
    [2.0, 0.0, 0.0, 1.442695]
    """
    xi = as_array("xi", xi, 7)
    rho, phi, sigma = xi[..., :3], xi[..., 3:6], xi[..., 6]
    return from_srt(np.exp(sigma), so3.exp(phi), times(w_matrix(phi, sigma), rho))


def log(S: ArrayLike, *, project: bool = False) -> Array:
    """Tangent vector with Exp(xi) = S and an angle in [0, pi], shape (..., 4, 4) -> (..., 7).

    Returns xi = (rho, phi, sigma): metres, radians, log-scale.  ValueError if the 3 x 3 block over its scale
    is no rotation up to rounding; with ``project`` the nearest similarity is taken.
    """
    if project:
        S = nearest(S)
    s = scale(S)
    if not np.all((s > 0.0) & np.isfinite(s)):
        raise ValueError("S is no similarity: its scale is zero or not finite")
    R = rotation(S)
    require_rotation("R of S", R)
    phi, sigma = so3.log_of_rotation(R), np.log(s)
    rho = times(w_matrix_inverse(phi, sigma), translation(S))
    return np.concatenate([rho, phi, sigma[..., None]], -1)


def inverse(S: ArrayLike) -> Array:
    """S^-1: scale 1/s, rotation R^T, translation -R^T t / s; shape (..., 4, 4).

    An element T_a_b gives T_b_a.  Translations in metres.
    """
    s, R_back = scale(S), transpose(rotation(S))
    return from_srt(1.0 / s, R_back, -times(R_back, translation(S)) / s[..., None])


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """S_a^-1 S_b, shapes (..., 4, 4).

    Elements ``a (..., 4, 4)`` and ``b (..., 4, 4)``: T_w_a and T_w_b give T_a_b.  Translations in metres.
    """
    return compose(inverse(a), b)


def ad(xi: ArrayLike) -> Array:
    """Matrix of the Lie bracket, shape (..., 7) -> (..., 7, 7).

    The tangent vector is xi = (rho, phi, sigma): metres, radians, log-scale; shape of the result (..., 7, 7).

    [[sigma I + hat(phi), hat(rho), -rho], [0, hat(phi), 0], [0, 0, 0]].
    """
    xi = as_array("xi", xi, 7)
    M = hat(xi)[..., :3, :3]
    top = [M, so3.hat(xi[..., :3]), -xi[..., :3, None]]
    return blocks([top, [0.0, so3.hat(xi[..., 3:6]), 0.0], [0.0, 0.0, np.zeros((1, 1))]])


def adjoint(S: ArrayLike) -> Array:
    """Matrix with S Exp(xi) S^-1 = Exp(Ad xi), shape (..., 4, 4) -> (..., 7, 7).

    Maps xi = (rho, phi, sigma): metres, radians, log-scale at b to the same at a.

    Implements :eq:`eq-adjoint-similarity`: [[s R, hat(t) R, -t], [0, R, 0], [0, 0, 1]].
    """
    S = as_array("S", S, 4, 4)
    R, t = rotation(S), translation(S)
    top = [S[..., :3, :3], so3.hat(t) @ R, -t[..., None]]
    return blocks([top, [0.0, R, 0.0], [0.0, 0.0, np.ones((1, 1))]])


def left_jacobian(xi: ArrayLike) -> Array:
    """J with Exp(xi + d) = Exp(J d) Exp(xi) to first order, shape (..., 7) -> (..., 7, 7).

    The tangent vector is xi = (rho, phi, sigma): metres, radians, log-scale.

    Implements :eq:`eq-jacobian-halving`: J(2 x) = (I + Ad_Exp(x)) J(x) / 2 takes the sum of ad^n / (n + 1)!
    from a small x, where it needs few terms, to xi.  No case is special: neither phi = 0 nor sigma = 0 is
    divided by.
    """
    part = as_array("xi", xi, 7) / 2**_HALVINGS
    A, one = ad(part), np.eye(DOF)
    J = np.broadcast_to(one, A.shape)
    # eq-left-jacobian, by Horner's rule: I + A/2 (I + A/3 (I + ...))
    for n in range(_TERMS + 1, 1, -1):
        J = one + A @ J / n
    for _ in range(_HALVINGS):
        J = (J + adjoint(exp(part)) @ J) / 2
        part = 2 * part
    return J


def left_jacobian_inverse(xi: ArrayLike) -> Array:
    """Inverse of :func:`left_jacobian`, shape (..., 7, 7): block by block, as J is block triangular.

    The tangent vector is xi = (rho, phi, sigma): metres, radians, log-scale; shape of the result (..., 7, 7).
    """
    xi = as_array("xi", xi, 7)
    phi, sigma = xi[..., 3:6], xi[..., 6]
    J = left_jacobian(xi)
    W_inv, V_inv = w_matrix_inverse(phi, sigma), so3.left_jacobian_inverse(phi)
    top = [W_inv, -W_inv @ J[..., :3, 3:6] @ V_inv, -W_inv @ J[..., :3, 6:]]
    return blocks([top, [0.0, V_inv, 0.0], [0.0, 0.0, np.ones((1, 1))]])


def perturb(S: ArrayLike, xi: ArrayLike) -> Array:
    """Exp(xi) S, shapes (..., 4, 4) and (..., 7).

    The tangent vector is xi = (rho, phi, sigma): metres, radians, log-scale, in the frame a of T_a_b.
    """
    return compose(exp(xi), S)


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Constant velocity from a (fraction 0) to b (1), the short way round; shapes (..., 4, 4), (...).

    Elements and result ``(..., 4, 4)`` map to the same frame; ``fraction (...)`` has no unit.  Translations
    in metres.
    """
    fraction = np.asarray(fraction, dtype=np.float64)[..., None]
    return compose(a, exp(fraction * log(between(a, b))))


def random(
    rng: np.random.Generator, shape: tuple[int, ...] = (), *, spread: float = 1.0, log_scale: float = 0.5
) -> Array:
    """Uniform rotations with Gaussian translations and log-scales, shape (*shape, 4, 4).

    ``spread`` (metres) and ``log_scale`` are standard deviations.
    """
    R = so3.random(rng, shape)
    t = spread * rng.standard_normal((*shape, 3))
    return from_srt(np.exp(log_scale * rng.standard_normal(shape)), R, t)


def nearest(M: ArrayLike) -> Array:
    """Similarity nearest to a matrix ``(..., 4, 4)`` whose last row is ignored.

    The last column in metres.

    The rotation is the one nearest to the 3 x 3 block B, whatever the scale; then |s R - B| is least for
    s = tr(R^T B) / 3.  ValueError where :func:`.so3.nearest` is undefined.
    """
    M = as_array("M", M, 4, 4)
    found = nearest_rotation(M[..., :3, :3])
    return from_srt(found.trace / 3.0, found.R, M[..., :3, 3])


def act_with_jacobians(S: ArrayLike, x: ArrayLike) -> Acted:
    """Value and Jacobians of :func:`act`: J_pose = [I, -hat(S x), S x] (..., 3, 7), J_point = s R.

    ``value (..., 3)`` in the points' unit; J_pose is in a left perturbation, xi = (rho, phi, sigma):
    metres, radians, log-scale.
    """
    value = act(S, x)
    J_point = np.broadcast_to(matrix(S)[..., :3, :3], (*value.shape, 3))
    return Acted(value, blocks([[np.eye(3), -so3.hat(value), value[..., None]]]), J_point)


def compose_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`compose`: I in a, Ad_a in b.

    Elements ``(..., 4, 4)``; J_a and J_b ``(..., 7, 7)`` are in left perturbations, xi = (rho, phi, sigma):
    metres, radians, log-scale.
    """
    return combined(compose(a, b), np.eye(DOF), adjoint(a))


def between_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`between`: -Ad of S_a^-1 in a, Ad of S_a^-1 in b.

    Elements ``(..., 4, 4)``; J_a and J_b ``(..., 7, 7)`` are in left perturbations, xi = (rho, phi, sigma):
    metres, radians, log-scale.
    """
    Ad = adjoint(inverse(a))
    return combined(between(a, b), -Ad, Ad)


def inverse_with_jacobians(S: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`inverse`: -Ad of S^-1.

    Elements ``(..., 4, 4)``; J_pose ``(..., 7, 7)`` is in a left perturbation, xi = (rho, phi, sigma):
    metres, radians, log-scale.
    """
    value = inverse(S)
    return Unary(value, -adjoint(value))


def log_with_jacobians(S: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`log`: the inverse of the left Jacobian there.

    An element ``(..., 4, 4)``; J_pose ``(..., 7, 7)`` is in a left perturbation, xi = (rho, phi, sigma):
    metres, radians, log-scale.
    """
    xi = log(S)
    return Unary(xi, left_jacobian_inverse(xi))
