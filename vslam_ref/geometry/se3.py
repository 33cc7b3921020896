r"""SE(3), the rigid motions of space, as matrices ``T (..., 4, 4)``.

::

    T_a_b = [ R_a_b  t_a_b ]        X_a = T_a_b X_b = R_a_b X_b + t_a_b
            [   0      1   ]        T_a_c = T_a_b T_b_c

A tangent vector is ``xi = (rho, phi) (..., 6)``, translation first: metres, then radians.  Perturbations
act from the left, ``T <- Exp(xi) T``, so xi is written in the frame a of ``T_a_b``.  Accuracy as in
:mod:`.so3`; a translation is exact relative to the length of rho.  Arrays of other shapes raise ValueError.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, blocks, times, transpose
from vslam_ref.geometry import so3
from vslam_ref.geometry.coefficients import rotation_coefficients, rotation_polynomial
from vslam_ref.geometry.jacobians import Acted, Combined, Unary, combined
from vslam_ref.geometry.orthonormal import rotation_of

DOF = 6


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Identity motions, shape (*shape, 4, 4).

    Translations, in metres, are zero.
    """
    return np.broadcast_to(np.eye(4), (*shape, 4, 4)).copy()


def from_rt(R: ArrayLike, t: ArrayLike) -> Array:
    """Motion with rotation ``R (..., 3, 3)`` and translation ``t (..., 3)``, shape (..., 4, 4).

    ``t`` in metres: T_a_b from R_a_b and t_a_b.
    """
    R, t = as_array("R", R, 3, 3), as_array("t", t, 3)
    T = np.zeros((*np.broadcast_shapes(R.shape[:-2], t.shape[:-1]), 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1.0
    return T


def rotation(T: ArrayLike) -> Array:
    """R_a_b of T_a_b, shape (..., 4, 4) -> (..., 3, 3).

    A rotation has no unit.
    """
    return as_array("T", T, 4, 4)[..., :3, :3]


def translation(T: ArrayLike) -> Array:
    """t_a_b of T_a_b: where b's origin is, seen from a; shape (..., 4, 4) -> (..., 3).

    In metres, in the frame a.
    """
    return as_array("T", T, 4, 4)[..., :3, 3]


def matrix(T: ArrayLike) -> Array:
    """The element as a matrix: itself, shape (..., 4, 4).

    Its last column in metres.
    """
    return as_array("T", T, 4, 4)


def hat(xi: ArrayLike) -> Array:
    """Generator [[hat(phi), rho], [0, 0]] of Exp(xi), shape (..., 6) -> (..., 4, 4).

    The tangent vector is xi = (rho, phi) in metres and radians.
    """
    xi = as_array("xi", xi, 6)
    M = np.zeros((*xi.shape[:-1], 4, 4))
    M[..., :3, :3], M[..., :3, 3] = so3.hat(xi[..., 3:]), xi[..., :3]
    return M


def vee(M: ArrayLike) -> Array:
    """Undo :func:`hat`, shape (..., 4, 4) -> (..., 6).

    Returns xi = (rho, phi) in metres and radians.
    """
    M = as_array("M", M, 4, 4)
    return np.concatenate([M[..., :3, 3], so3.vee(M[..., :3, :3])], -1)


def exp(xi: ArrayLike) -> Array:
    """Motion at the constant velocity xi for unit time, shape (..., 6) -> (..., 4, 4).

    Implements :eq:`eq-exp-rigid`: [[Exp(phi), V rho], [0, 1]] with the left Jacobian V of SO(3).

    >>> np.round(exp([1.0, 0.0, 0.0, 0.0, 0.0, np.pi]), 6)[:3, 3].tolist()  # half a circle
    [0.0, 0.63662, 0.0]
    """
    xi = as_array("xi", xi, 6)
    rho, phi = xi[..., :3], xi[..., 3:]
    c, Phi = rotation_coefficients(np.sum(phi * phi, -1)), so3.hat(phi)
    one = np.ones_like(c[1])
    R, V = rotation_polynomial(one, c[1], c[2], Phi), rotation_polynomial(one, c[2], c[3], Phi)
    return from_rt(R, times(V, rho))  # so3.exp and so3.left_jacobian share what costs them time


def log(T: ArrayLike, *, project: bool = False) -> Array:
    """Tangent vector with Exp(xi) = T and an angle in [0, pi], shape (..., 4, 4) -> (..., 6).

    Returns xi = (rho, phi) in metres and radians.  ValueError if the 3 x 3 block is no rotation up to
    rounding; with ``project`` the nearest rotation is taken.

    Implements :eq:`eq-log-rigid`.
    """
    T = as_array("T", T, 4, 4)
    return _log(rotation_of("R of T", T[..., :3, :3], project), T[..., :3, 3])


def log_of_motion(T: Array) -> Array:
    """:func:`log` of what is known to be rigid motions ``T (..., 4, 4)``: nothing is checked.

    Returns xi = (rho, phi) in metres and radians.
    """
    return _log(T[..., :3, :3], T[..., :3, 3])


def _log(R: Array, t: Array) -> Array:
    phi = so3.log_of_rotation(R)
    return np.concatenate([times(so3.left_jacobian_inverse(phi), t), phi], -1)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Product T_a T_b, shapes (..., 4, 4).

    Elements ``a (..., 4, 4)`` and ``b (..., 4, 4)``: T_a_b and T_b_c give T_a_c.  Translations in metres.
    """
    return np.asarray(as_array("a", a, 4, 4) @ as_array("b", b, 4, 4))


def inverse(T: ArrayLike) -> Array:
    """T^-1 = [[R^T, -R^T t], [0, 1]], shape (..., 4, 4).

    An element T_a_b gives T_b_a.  Translations in metres.
    """
    R_back = transpose(rotation(T))
    return from_rt(R_back, -times(R_back, translation(T)))


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """T_a^-1 T_b, shapes (..., 4, 4).

    Elements ``a (..., 4, 4)`` and ``b (..., 4, 4)``: T_w_a and T_w_b give T_a_b.  Translations in metres.
    """
    return compose(inverse(a), b)


def act(T: ArrayLike, x: ArrayLike) -> Array:
    """Coordinates in a of points ``x (..., 3)`` in b, by ``T_a_b (..., 4, 4)``: R x + t.

    Points and result in metres.

    Implements :eq:`eq-a2-1` (A2.1): the report's E_KW is ``T_kf_world``, its p_W the world point.

    >>> act(exp([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), [1.0, 2.0, 3.0]).tolist()
    [1.0, 2.0, 4.0]
    """
    return np.asarray(times(rotation(T), as_array("x", x, 3)) + translation(T))


def ad(xi: ArrayLike) -> Array:
    """Matrix of the Lie bracket, [[hat(phi), hat(rho)], [0, hat(phi)]], shape (..., 6) -> (..., 6, 6).

    The tangent vector is xi = (rho, phi) in metres and radians; shape of the result (..., 6, 6).
    """
    xi = as_array("xi", xi, 6)
    Phi = so3.hat(xi[..., 3:])
    return blocks([[Phi, so3.hat(xi[..., :3])], [0.0, Phi]])


def adjoint(T: ArrayLike) -> Array:
    """Matrix with T Exp(xi) T^-1 = Exp(Ad xi), shape (..., 4, 4) -> (..., 6, 6).

    Maps xi = (rho, phi) in metres and radians at b to the same at a.

    Implements :eq:`eq-adjoint-rigid`: [[R, hat(t) R], [0, R]].
    """
    R = rotation(T)
    return blocks([[R, so3.hat(translation(T)) @ R], [0.0, R]])


def left_jacobian(xi: ArrayLike) -> Array:
    """J with Exp(xi + d) = Exp(J d) Exp(xi) to first order, shape (..., 6) -> (..., 6, 6).

    The tangent vector is xi = (rho, phi) in metres and radians.

    Implements :eq:`eq-jacobian-rigid`: [[V, Q], [0, V]].
    """
    xi = as_array("xi", xi, 6)
    V = so3.left_jacobian(xi[..., 3:])
    return blocks([[V, q_matrix(xi)], [0.0, V]])


def q_matrix(xi: ArrayLike) -> Array:
    """Upper right block of the left Jacobian, shape (..., 6) -> (..., 3, 3).

    The tangent vector is xi = (rho, phi) in metres and radians; the result in metres.

    Implements :eq:`eq-q-matrix`: the derivative of V(phi) when phi moves along rho, which is
    c_2 P + c_3 (Phi P + P Phi) + (phi . rho) ((2 c_4 - c_3) Phi + (3 c_5 - c_4) Phi^2).
    """
    xi = as_array("xi", xi, 6)
    rho, phi = xi[..., :3], xi[..., 3:]
    c = rotation_coefficients(np.sum(phi * phi, -1))[..., None, None]
    P, Phi = so3.hat(rho), so3.hat(phi)
    dot = np.sum(phi * rho, -1)[..., None, None]
    straight = c[2] * P + c[3] * (Phi @ P + P @ Phi)
    return np.asarray(straight + dot * ((2 * c[4] - c[3]) * Phi + (3 * c[5] - c[4]) * (Phi @ Phi)))


def left_jacobian_inverse(xi: ArrayLike) -> Array:
    """Inverse of :func:`left_jacobian`: [[V^-1, -V^-1 Q V^-1], [0, V^-1]]; poles at 2 pi, 4 pi, ...

    The tangent vector is xi = (rho, phi) in metres and radians; shape of the result (..., 6, 6).
    ValueError next to a pole, as :func:`.so3.left_jacobian_inverse`.
    """
    xi = as_array("xi", xi, 6)
    V_inv = so3.left_jacobian_inverse(xi[..., 3:])
    return blocks([[V_inv, -V_inv @ q_matrix(xi) @ V_inv], [0.0, V_inv]])


def perturb(T: ArrayLike, xi: ArrayLike) -> Array:
    """Exp(xi) T, shapes (..., 4, 4) and (..., 6).

    The tangent vector is xi = (rho, phi) in metres and radians, in the frame a of T_a_b.

    Implements :eq:`eq-a2-5` (A2.5): E_{t+1} = exp(mu) E_t, from one frame to the next.
    """
    return compose(exp(xi), T)


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Constant velocity (a screw) from a (fraction 0) to b (1); shapes (..., 4, 4), (...).

    Elements and result ``(..., 4, 4)`` map to the same frame; ``fraction (...)`` has no unit.  Translations
    in metres.
    """
    fraction = np.asarray(fraction, dtype=np.float64)[..., None]
    return compose(a, exp(fraction * log(between(a, b))))


def random(rng: np.random.Generator, shape: tuple[int, ...] = (), *, spread: float = 1.0) -> Array:
    """Uniform rotations with Gaussian translations, shape (*shape, 4, 4).

    ``spread`` is the standard deviation of each coordinate, in metres.  No uniform distribution of
    translations exists, because space is not bounded.
    """
    return from_rt(so3.random(rng, shape), spread * rng.standard_normal((*shape, 3)))


def nearest(M: ArrayLike) -> Array:
    """Rigid motion nearest to a matrix ``(..., 4, 4)`` whose last row is ignored.

    The last column in metres.

    In the Frobenius norm rotation and translation do not meet: the rotation is the nearest one, the
    translation stays.  ValueError where :func:`.so3.nearest` is undefined.
    """
    M = as_array("M", M, 4, 4)
    return from_rt(so3.nearest(M[..., :3, :3]), M[..., :3, 3])


def act_with_jacobians(T: ArrayLike, x: ArrayLike) -> Acted:
    """Value and Jacobians of :func:`act`: J_pose = [I, -hat(T x)] (..., 3, 6), J_point = R.

    ``value (..., 3)`` in the points' unit; J_pose is in a left perturbation, xi = (rho, phi) in metres and
    radians.

    Implements :eq:`eq-act-jacobian`.
    """
    value = act(T, x)
    J_point = np.broadcast_to(rotation(T), (*value.shape, 3))
    return Acted(value, blocks([[np.eye(3), -so3.hat(value)]]), J_point)


def compose_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`compose`: I in a; Ad_a in b, as Exp(d) goes through a as Exp(Ad_a d).

    Elements ``(..., 4, 4)``; J_a and J_b ``(..., 6, 6)`` are in left perturbations, xi = (rho, phi) in
    metres and radians.
    """
    return combined(compose(a, b), np.eye(DOF), adjoint(a))


def between_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`between`: -Ad of T_a^-1 in a, Ad of T_a^-1 in b.

    Elements ``(..., 4, 4)``; J_a and J_b ``(..., 6, 6)`` are in left perturbations, xi = (rho, phi) in
    metres and radians.
    """
    Ad = adjoint(inverse(a))
    return combined(between(a, b), -Ad, Ad)


def inverse_with_jacobians(T: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`inverse`: -Ad of T^-1.

    Elements ``(..., 4, 4)``; J_pose ``(..., 6, 6)`` is in a left perturbation, xi = (rho, phi) in metres
    and radians.
    """
    value = inverse(T)
    return Unary(value, -adjoint(value))


def log_with_jacobians(T: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`log`: the inverse of the left Jacobian there.

    An element ``(..., 4, 4)``; J_pose ``(..., 6, 6)`` is in a left perturbation, xi = (rho, phi) in metres
    and radians.
    """
    xi = log(T)
    return Unary(xi, left_jacobian_inverse(xi))
