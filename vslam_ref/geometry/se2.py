"""SE(2), the rigid motions of the plane.

An element is a *pose vector* ``(x, y, theta)``, shape (..., 3): the translation, then the angle in
(-pi, pi].  As a transform ``T_world_vehicle`` it maps vehicle coordinates to world coordinates,
``X_world = R(theta) X_vehicle + (x, y)``.  Tangent vectors are xi = (rho_x, rho_y, phi), metres and
radians, translation first; the perturbation is on the left, T <- Exp(xi) T.  Arrays of other shapes raise
ValueError.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, blocks, times
from vslam_ref.geometry import so2
from vslam_ref.geometry.coefficients import require_no_pole, rotation_coefficients
from vslam_ref.geometry.jacobians import Acted, Combined, Unary, combined

DOF = 3


def _turn(a: Array, b: Array) -> Array:
    """Matrices [[a, -b], [b, a]], shapes (...) -> (..., 2, 2)."""
    return np.stack([np.stack([a, -b], -1), np.stack([b, a], -1)], -2)


def _v(phi: Array) -> Array:
    """V(phi) = [[sin, -(1 - cos)], [1 - cos, sin]] / phi, shape (...) -> (..., 2, 2)."""
    c = rotation_coefficients(phi * phi)
    return _turn(c[1], phi * c[2])


def _v_inverse(phi: Array) -> Array:
    """V(phi)^-1 = [[h, phi/2], [-phi/2, h]] with h = (phi/2) cot(phi/2), shape (...) -> (..., 2, 2)."""
    half = rotation_coefficients(phi * phi / 4)
    return _turn(half[0] / half[1], -phi / 2)


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Pose vectors of the identity, shape (*shape, 3).

    Translations, in metres, are zero.
    """
    return np.zeros((*shape, 3))


def matrix(pose: ArrayLike) -> Array:
    """Homogeneous matrix of a pose vector, shape (..., 3) -> (..., 3, 3).

    Its last column in metres.
    """
    pose = as_array("pose", pose, 3)
    return blocks([[so2.exp(pose[..., 2]), pose[..., :2, None]], [0.0, np.ones((1, 1))]])


def hat(xi: ArrayLike) -> Array:
    """Generator [[0, -phi, rho_x], [phi, 0, rho_y], [0, 0, 0]] of Exp(xi), shape (..., 3) -> (..., 3, 3).

    The tangent vector is xi = (rho, phi) in metres and radians.
    """
    xi = as_array("xi", xi, 3)
    M = np.zeros((*xi.shape[:-1], 3, 3))
    M[..., :2, :2], M[..., :2, 2] = so2.hat(xi[..., 2]), xi[..., :2]
    return M


def vee(M: ArrayLike) -> Array:
    """Undo :func:`hat`, shape (..., 3, 3) -> (..., 3).

    Returns xi = (rho, phi) in metres and radians.
    """
    M = as_array("M", M, 3, 3)
    return np.concatenate([M[..., :2, 2], so2.vee(M[..., :2, :2])[..., None]], -1)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Pose vector of the product ``T_a T_b`` (the seed's circled plus), shapes (..., 3).

    Elements ``a (..., 3)`` and ``b (..., 3)``: T_a_b and T_b_c give T_a_c.  Translations in metres.
    """
    a, b = as_array("a", a, 3), as_array("b", b, 3)
    t = a[..., :2] + so2.rotate(a[..., 2], b[..., :2])
    return np.concatenate([t, so2.wrap(a[..., 2] + b[..., 2])[..., None]], -1)


def inverse(pose: ArrayLike) -> Array:
    """Pose vector of ``T^-1`` (the seed's circled minus), shape (..., 3).

    An element T_a_b gives T_b_a.  Translations in metres.
    """
    pose = as_array("pose", pose, 3)
    t = -so2.rotate(-pose[..., 2], pose[..., :2])
    return np.concatenate([t, so2.wrap(-pose[..., 2])[..., None]], -1)


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """Pose of b seen from a, ``T_a^-1 T_b``, shapes (..., 3).

    Elements ``a (..., 3)`` and ``b (..., 3)``: T_w_a and T_w_b give T_a_b.  Translations in metres.
    """
    return compose(inverse(a), b)


def act(pose: ArrayLike, x: ArrayLike) -> Array:
    """Apply ``T`` (..., 3) to points ``x`` (..., 2).

    Points and result in metres.
    """
    pose = as_array("pose", pose, 3)
    moved: Array = so2.rotate(pose[..., 2], x) + pose[..., :2]
    return moved


def exp(xi: ArrayLike) -> Array:
    """Pose vector of Exp(xi), shape (..., 3): theta = phi, t = V(phi) rho.

    V(phi) = [[sin, -(1 - cos)], [1 - cos, sin]] / phi; the motion at constant velocity xi for unit time.
    """
    xi = as_array("xi", xi, 3)
    t = times(_v(xi[..., 2]), xi[..., :2])
    return np.concatenate([t, so2.wrap(xi[..., 2:])], -1)


def log(pose: ArrayLike) -> Array:
    """Tangent vector xi with Exp(xi) = T and phi in (-pi, pi], shape (..., 3) -> (..., 3).

    Returns xi = (rho, phi) in metres and radians.

    rho = V(phi)^-1 t, where V^-1 = [[h, phi/2], [-phi/2, h]] and h = (phi/2) cot(phi/2).
    """
    pose = as_array("pose", pose, 3)
    phi = so2.wrap(pose[..., 2:])
    return np.concatenate([times(_v_inverse(phi[..., 0]), pose[..., :2]), phi], -1)


def ad(xi: ArrayLike) -> Array:
    """Matrix of the Lie bracket, shape (..., 3) -> (..., 3, 3).

    The tangent vector is xi = (rho, phi) in metres and radians; shape of the result (..., 3, 3).

    [[0, -phi, rho_y], [phi, 0, -rho_x], [0, 0, 0]].
    """
    xi = as_array("xi", xi, 3)
    A = hat(xi)
    A[..., 0, 2], A[..., 1, 2] = xi[..., 1], -xi[..., 0]
    return A


def adjoint(pose: ArrayLike) -> Array:
    """Matrix Ad_T with T Exp(xi) T^-1 = Exp(Ad_T xi), shape (..., 3) -> (..., 3, 3).

    Maps xi = (rho, phi) in metres and radians at b to the same at a.
    """
    pose = as_array("pose", pose, 3)
    lever = np.stack([pose[..., 1], -pose[..., 0]], -1)[..., None]
    return blocks([[so2.exp(pose[..., 2]), lever], [0.0, np.ones((1, 1))]])


def left_jacobian(xi: ArrayLike) -> Array:
    """J_l(xi) with Exp(xi + d) = Exp(J_l d) Exp(xi) to first order, shape (..., 3) -> (..., 3, 3).

    The tangent vector is xi = (rho, phi) in metres and radians.

    With V as in :func:`exp`, J_l = [[V, b], [0, 1]]; b follows from dt/dphi = V'(phi) rho less the
    lever S t of the left rotation, S = [[0, -1], [1, 0]].
    """
    xi = as_array("xi", xi, 3)
    return blocks([[_v(xi[..., 2]), _bend(xi)], [0.0, np.ones((1, 1))]])


def _bend(xi: Array) -> Array:
    """Last column b of the left Jacobian, c_3 phi rho + c_2 (rho_y, -rho_x), shape (..., 2, 1)."""
    phi = xi[..., 2]
    c = rotation_coefficients(phi * phi)
    return times(_turn(phi * c[3], -c[2]), xi[..., :2])[..., None]


def left_jacobian_inverse(xi: ArrayLike) -> Array:
    """Inverse of :func:`left_jacobian`, shape (..., 3) -> (..., 3, 3); it has poles at 2 pi, 4 pi, ...

    The tangent vector is xi = (rho, phi) in metres and radians; shape of the result (..., 3, 3).  ValueError
    next to a pole: V there is 2 sin(phi / 2) / phi times a rotation.
    """
    xi = as_array("xi", xi, 3)
    half = rotation_coefficients(xi[..., 2] ** 2 / 4)[1]  # sin(phi/2) / (phi/2)
    require_no_pole(half * half, np.ones(()), xi[..., 2] ** 2)
    V_inv = _v_inverse(xi[..., 2])
    return blocks([[V_inv, -V_inv @ _bend(xi)], [0.0, np.ones((1, 1))]])


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Point at ``fraction (...)`` in [0, 1] of the motion at constant velocity from a to b.

    Poses ``a (..., 3)`` and ``b (..., 3)`` of one frame.

    Elements and result ``(..., 3)`` map to the same frame; ``fraction (...)`` has no unit.  Translations in
    metres.
    """
    fraction = np.asarray(fraction, dtype=np.float64)[..., None]
    return compose(a, exp(fraction * log(between(a, b))))


def perturb(pose: ArrayLike, xi: ArrayLike) -> Array:
    """Pose vector of Exp(xi) T, ``pose (..., 3)`` and ``xi (..., 3)``.

    The tangent vector is xi = (rho, phi) in metres and radians, in the frame a of T_a_b.
    """
    return compose(exp(xi), pose)


def random(rng: np.random.Generator, shape: tuple[int, ...] = (), *, spread: float = 1.0) -> Array:
    """Uniform angles, Gaussian translations of standard deviation ``spread`` (metres), shape (*shape, 3)."""
    t = spread * rng.standard_normal((*shape, 2))
    return np.concatenate([t, so2.wrap(rng.uniform(-np.pi, np.pi, (*shape, 1)))], -1)


def nearest(M: ArrayLike) -> Array:
    """Pose vector whose matrix is nearest to ``M (..., 3, 3)``, the last row ignored.

    The last column in metres.

    The angle is that of :func:`.so2.nearest` (ValueError where it is undefined); the translation stays.
    """
    M = as_array("M", M, 3, 3)
    angle = so2.log(so2.nearest(M[..., :2, :2]))
    return np.concatenate([M[..., :2, 2], angle[..., None]], -1)


def act_with_jacobians(pose: ArrayLike, x: ArrayLike) -> Acted:
    """Value and Jacobians of :func:`act`: J_point = R, J_pose = [I, S T x] (..., 2, 3).

    ``value (..., 2)`` in the points' unit; J_pose is in a left perturbation, xi = (rho, phi) in metres and
    radians.

    S = [[0, -1], [1, 0]].
    """
    pose = as_array("pose", pose, 3)
    value = act(pose, x)
    turned = np.stack([-value[..., 1], value[..., 0]], -1)[..., None]
    J_point = np.broadcast_to(so2.exp(pose[..., 2]), (*value.shape, 2))
    return Acted(value, blocks([[np.eye(2), turned]]), J_point)


def compose_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`compose`: I in a, Ad_a in b.

    Elements ``(..., 3)``; J_a and J_b ``(..., 3, 3)`` are in left perturbations, xi = (rho, phi) in metres
    and radians.
    """
    return combined(compose(a, b), np.eye(DOF), adjoint(a), axes=1)


def between_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`between`: -Ad of T_a^-1 in a, Ad of T_a^-1 in b.

    Elements ``(..., 3)``; J_a and J_b ``(..., 3, 3)`` are in left perturbations, xi = (rho, phi) in metres
    and radians.
    """
    Ad = adjoint(inverse(a))
    return combined(between(a, b), -Ad, Ad, axes=1)


def inverse_with_jacobians(pose: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`inverse`: -Ad of T^-1.

    Elements ``(..., 3)``; J_pose ``(..., 3, 3)`` is in a left perturbation, xi = (rho, phi) in metres and
    radians.
    """
    value = inverse(pose)
    return Unary(value, -adjoint(value))


def log_with_jacobians(pose: ArrayLike) -> Unary:
    """Value and Jacobian of :func:`log`: the inverse of the left Jacobian there.

    An element ``(..., 3)``; J_pose ``(..., 3, 3)`` is in a left perturbation, xi = (rho, phi) in metres and
    radians.
    """
    xi = log(pose)
    return Unary(xi, left_jacobian_inverse(xi))
