"""SE(2), the rigid motions of the plane.

An element is a *pose vector* ``(x, y, theta)``, shape (..., 3): the translation, then the angle in
(-pi, pi].  As a transform ``T_world_vehicle`` it maps vehicle coordinates to world coordinates,
``X_world = R(theta) X_vehicle + (x, y)``.  Tangent vectors are xi = (rho_x, rho_y, phi), metres and
radians, translation first; the perturbation is on the left, T <- Exp(xi) T.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, blocks
from vslam_ref.geometry import so2
from vslam_ref.geometry.jacobians import Acted, Combined, Mapped

DOF = 3

_SMALL = 0.05
"""Below this angle the series of :func:`_sinc_cosc` are used.

Their first neglected terms are phi^10/11! and phi^9/10!-sized: under 1e-18 at the threshold, so both
branches agree to rounding; above it ``(1 - cos)/phi`` is evaluated as ``2 sin^2(phi/2)/phi`` and loses
no digit either.
"""


def _sinc_cosc(phi: Array) -> tuple[Array, Array]:
    """sin(phi)/phi and (1 - cos(phi))/phi, exact at 0."""
    small = np.abs(phi) < _SMALL
    p = np.where(small, 1.0, phi)
    q = phi * phi
    sinc_series = 1 - q / 6 * (1 - q / 20 * (1 - q / 42 * (1 - q / 72)))
    cosc_series = phi / 2 * (1 - q / 12 * (1 - q / 30 * (1 - q / 56)))
    sinc = np.where(small, sinc_series, np.sin(p) / p)
    cosc = np.where(small, cosc_series, 2 * np.sin(p / 2) ** 2 / p)
    return sinc, cosc


def identity(shape: tuple[int, ...] = ()) -> Array:
    """Pose vectors of the identity, shape (*shape, 3)."""
    return np.zeros((*shape, 3))


def matrix(pose: ArrayLike) -> Array:
    """Homogeneous matrix of a pose vector, shape (..., 3) -> (..., 3, 3)."""
    pose = np.asarray(pose, dtype=np.float64)
    T = np.zeros((*pose.shape[:-1], 3, 3))
    T[..., :2, :2] = so2.exp(pose[..., 2])
    T[..., :2, 2] = pose[..., :2]
    T[..., 2, 2] = 1.0
    return T


def hat(xi: ArrayLike) -> Array:
    """Generator [[0, -phi, rho_x], [phi, 0, rho_y], [0, 0, 0]] of Exp(xi), shape (..., 3) -> (..., 3, 3)."""
    xi = as_array("xi", xi, 3)
    M = np.zeros((*xi.shape[:-1], 3, 3))
    M[..., :2, :2], M[..., :2, 2] = so2.hat(xi[..., 2]), xi[..., :2]
    return M


def vee(M: ArrayLike) -> Array:
    """Undo :func:`hat`, shape (..., 3, 3) -> (..., 3)."""
    M = as_array("M", M, 3, 3)
    return np.concatenate([M[..., :2, 2], so2.vee(M[..., :2, :2])[..., None]], -1)


def compose(a: ArrayLike, b: ArrayLike) -> Array:
    """Pose vector of the product ``T_a T_b`` (the seed's circled plus), shapes (..., 3)."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    t = a[..., :2] + so2.rotate(a[..., 2], b[..., :2])
    return np.concatenate([t, so2.wrap(a[..., 2] + b[..., 2])[..., None]], -1)


def inverse(pose: ArrayLike) -> Array:
    """Pose vector of ``T^-1`` (the seed's circled minus), shape (..., 3)."""
    pose = np.asarray(pose, dtype=np.float64)
    t = -so2.rotate(-pose[..., 2], pose[..., :2])
    return np.concatenate([t, so2.wrap(-pose[..., 2])[..., None]], -1)


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """Pose of b seen from a, ``T_a^-1 T_b``, shapes (..., 3)."""
    return compose(inverse(a), b)


def act(pose: ArrayLike, x: ArrayLike) -> Array:
    """Apply ``T`` (..., 3) to points ``x`` (..., 2)."""
    pose = np.asarray(pose, dtype=np.float64)
    moved: Array = so2.rotate(pose[..., 2], x) + pose[..., :2]
    return moved


def exp(xi: ArrayLike) -> Array:
    """Pose vector of Exp(xi), shape (..., 3): theta = phi, t = V(phi) rho.

    V(phi) = [[sin, -(1 - cos)], [1 - cos, sin]] / phi; the motion at constant velocity xi for unit time.
    """
    xi = np.asarray(xi, dtype=np.float64)
    sinc, cosc = _sinc_cosc(xi[..., 2])
    x = sinc * xi[..., 0] - cosc * xi[..., 1]
    y = cosc * xi[..., 0] + sinc * xi[..., 1]
    return np.stack([x, y, so2.wrap(xi[..., 2])], -1)


def log(pose: ArrayLike) -> Array:
    """Tangent vector xi with Exp(xi) = T and phi in (-pi, pi], shape (..., 3) -> (..., 3).

    rho = V(phi)^-1 t, where V^-1 = [[h, phi/2], [-phi/2, h]] and h = (phi/2) cot(phi/2).
    """
    pose = np.asarray(pose, dtype=np.float64)
    phi = so2.wrap(pose[..., 2])
    h = _half_cot(phi)
    x = h * pose[..., 0] + phi / 2 * pose[..., 1]
    y = -phi / 2 * pose[..., 0] + h * pose[..., 1]
    return np.stack([x, y, phi], -1)


def _half_cot(phi: Array) -> Array:
    """(phi/2) cot(phi/2), equal to 1 at 0: sinc/(2 cosc/phi) with both factors smooth."""
    half = phi / 2
    sinc, _ = _sinc_cosc(half)
    return np.cos(half) / sinc


def ad(xi: ArrayLike) -> Array:
    """Matrix of the Lie bracket, shape (..., 3) -> (..., 3, 3).

    [[0, -phi, rho_y], [phi, 0, -rho_x], [0, 0, 0]].
    """
    xi = as_array("xi", xi, 3)
    A = hat(xi)
    A[..., 0, 2], A[..., 1, 2] = xi[..., 1], -xi[..., 0]
    return A


def adjoint(pose: ArrayLike) -> Array:
    """Matrix Ad_T with T Exp(xi) T^-1 = Exp(Ad_T xi), shape (..., 3) -> (..., 3, 3)."""
    pose = np.asarray(pose, dtype=np.float64)
    Ad = np.zeros((*pose.shape[:-1], 3, 3))
    Ad[..., :2, :2] = so2.exp(pose[..., 2])
    Ad[..., 0, 2] = pose[..., 1]
    Ad[..., 1, 2] = -pose[..., 0]
    Ad[..., 2, 2] = 1.0
    return Ad


def left_jacobian(xi: ArrayLike) -> Array:
    """J_l(xi) with Exp(xi + d) = Exp(J_l d) Exp(xi) to first order, shape (..., 3) -> (..., 3, 3).

    With V as in :func:`exp`, J_l = [[V, b], [0, 1]]; b follows from dt/dphi = V'(phi) rho less the
    lever S t of the left rotation, S = [[0, -1], [1, 0]].
    """
    xi = np.asarray(xi, dtype=np.float64)
    rx, ry, phi = xi[..., 0], xi[..., 1], xi[..., 2]
    sinc, cosc = _sinc_cosc(phi)
    k1, k2 = _jacobian_tail(phi)
    J = np.zeros((*xi.shape[:-1], 3, 3))
    J[..., 0, 0] = J[..., 1, 1] = sinc
    J[..., 0, 1], J[..., 1, 0] = -cosc, cosc
    J[..., 0, 2] = k1 * rx + k2 * ry
    J[..., 1, 2] = -k2 * rx + k1 * ry
    J[..., 2, 2] = 1.0
    return J


def _jacobian_tail(phi: Array) -> tuple[Array, Array]:
    """k1 = (phi - sin phi)/phi^2 and k2 = (1 - cos phi)/phi^2, exact at 0."""
    small = np.abs(phi) < 0.5
    p = np.where(small, 1.0, phi)
    q = phi * phi
    # six terms: the first neglected one is below 2^-53 of the sum at |phi| = 0.5
    tail = 1 - q / 20 * (1 - q / 42 * (1 - q / 72 * (1 - q / 110 * (1 - q / 156 * (1 - q / 210)))))
    k1 = np.where(small, phi / 6 * tail, (p - np.sin(p)) / (p * p))
    half, _ = _sinc_cosc(phi / 2)
    return k1, half * half / 2


def left_jacobian_inverse(xi: ArrayLike) -> Array:
    """Inverse of :func:`left_jacobian`, shape (..., 3) -> (..., 3, 3); defined for |phi| < 2 pi."""
    xi = np.asarray(xi, dtype=np.float64)
    J = left_jacobian(xi)
    phi = xi[..., 2]
    h = _half_cot(phi)
    inv = np.zeros_like(J)
    inv[..., 0, 0] = inv[..., 1, 1] = h
    inv[..., 0, 1], inv[..., 1, 0] = phi / 2, -phi / 2
    inv[..., :2, 2] = -np.einsum("...ij,...j->...i", inv[..., :2, :2], J[..., :2, 2])
    inv[..., 2, 2] = 1.0
    return inv


def interpolate(a: ArrayLike, b: ArrayLike, fraction: ArrayLike) -> Array:
    """Point at ``fraction`` in [0, 1] of the constant-velocity motion from pose a to pose b."""
    fraction = np.asarray(fraction, dtype=np.float64)[..., None]
    a = np.asarray(a, dtype=np.float64)
    return compose(a, exp(fraction * log(between(a, b))))


def perturb(pose: ArrayLike, xi: ArrayLike) -> Array:
    """Pose vector of Exp(xi) T, shapes (..., 3)."""
    return compose(exp(xi), pose)


def random(rng: np.random.Generator, shape: tuple[int, ...] = (), *, spread: float = 1.0) -> Array:
    """Uniform angles, Gaussian translations of standard deviation ``spread`` (metres), shape (*shape, 3)."""
    t = spread * rng.standard_normal((*shape, 2))
    return np.concatenate([t, so2.wrap(rng.uniform(-np.pi, np.pi, (*shape, 1)))], -1)


def nearest(M: ArrayLike) -> Array:
    """Pose vector whose matrix is nearest to ``M (..., 3, 3)``, the last row ignored.

    The angle is that of :func:`.so2.nearest` (ValueError where it is undefined); the translation stays.
    """
    M = as_array("M", M, 3, 3)
    angle = so2.log(so2.nearest(M[..., :2, :2]))
    return np.concatenate([M[..., :2, 2], angle[..., None]], -1)


def act_with_jacobians(pose: ArrayLike, x: ArrayLike) -> Acted:
    """Value and Jacobians of :func:`act`: J_point = R, J_pose = [I, S T x] (..., 2, 3).

    S = [[0, -1], [1, 0]].
    """
    pose = as_array("pose", pose, 3)
    value = act(pose, x)
    turned = np.stack([-value[..., 1], value[..., 0]], -1)[..., None]
    J_point = np.broadcast_to(so2.exp(pose[..., 2]), (*value.shape, 2))
    return Acted(value, blocks([[np.eye(2), turned]]), J_point)


def compose_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`compose`: I in a, Ad_a in b."""
    value = compose(a, b)
    shape = (*value.shape, DOF)
    return Combined(value, np.broadcast_to(np.eye(DOF), shape), np.broadcast_to(adjoint(a), shape))


def between_with_jacobians(a: ArrayLike, b: ArrayLike) -> Combined:
    """Value and Jacobians of :func:`between`: -Ad of T_a^-1 in a, Ad of T_a^-1 in b."""
    value = between(a, b)
    J_b = np.broadcast_to(adjoint(inverse(a)), (*value.shape, DOF))
    return Combined(value, -J_b, J_b)


def inverse_with_jacobians(pose: ArrayLike) -> Mapped:
    """Value and Jacobian of :func:`inverse`: -Ad of T^-1."""
    value = inverse(pose)
    return Mapped(value, -adjoint(value))


def log_with_jacobians(pose: ArrayLike) -> Mapped:
    """Value and Jacobian of :func:`log`: the inverse of the left Jacobian there."""
    xi = log(pose)
    return Mapped(xi, left_jacobian_inverse(xi))
