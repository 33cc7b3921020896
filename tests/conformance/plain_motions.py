"""Chapter 02 in plain NumPy and SciPy: a program to be verified, and on demand one of its known mistakes.

Every function takes ``wrong``, the id of a note; without it, it is right.  Exponentials are SciPy's Pade
approximation, rotations its quaternions: neither is the generator's way.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

Array = Any


def skew(v: Array) -> Array:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def mean_exp(M: Array) -> Array:
    """Integral of expm(u M) for u from 0 to 1: the upper right block of one larger exponential."""
    return _mean_exp(len(M), M.astype(float).tobytes()).copy()


@functools.cache
def _mean_exp(n: int, given: bytes) -> Array:
    M = np.frombuffer(given).reshape(n, n)
    big = np.zeros((2 * n, 2 * n))
    big[:n, :n], big[:n, n:] = M, np.eye(n)
    return expm(big)[:n, n:]


def group_jacobian(ad: Array, wrong: str | None, small: Array) -> Array:
    """Left Jacobian from ad; wrong: the right one, or its sign in the branch for small angles."""
    if wrong == "right-jacobian":
        return mean_exp(-ad)
    if wrong == "small-angle-sign":
        return np.eye(len(ad)) - ad / 2
    return mean_exp(ad)


# --- the plane


def so2_exp(angle: float, wrong: str | None = None) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    if wrong == "small-angle-only":
        c, s = 1.0, angle
    R = np.array([[c, -s], [s, c]])
    return R.T if wrong == "transposed" else R


def so2_wrap(angle: float, wrong: str | None = None) -> Array:
    if wrong == "wrapped-to-positive":
        return np.mod(angle, 2 * np.pi)
    if wrong == "wrapped-once":
        return angle - 2 * np.pi * np.sign(angle) if abs(angle) > np.pi else angle
    if wrong == "other-end":
        return (angle + np.pi) % (2 * np.pi) - np.pi
    if wrong == "wrapped-by-pi":
        return np.mod(angle + np.pi / 2, np.pi) - np.pi / 2
    return angle if abs(angle) < np.pi else np.arctan2(np.sin(angle), np.cos(angle))


def plane(x: Array) -> Array:
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.array([[c, -s, x[0]], [s, c, x[1]], [0, 0, 1]])


def read_plane(T: Array) -> Array:
    return np.array([T[0, 2], T[1, 2], np.arctan2(T[1, 0], T[0, 0])])


def ad_plane(xi: Array) -> Array:
    x, y, a = xi
    return np.array([[0, -a, y], [a, 0, -x], [0, 0, 0]])


def se2_exp(xi: Array, wrong: str | None = None) -> Array:
    x, y, a = xi
    pose = read_plane(expm(np.array([[0, -a, x], [a, 0, y], [0, 0, 0]])))
    if wrong == "straight":
        pose[:2] = xi[:2]
    if wrong == "not-wrapped":
        pose[2] = a
    return pose


def se2_log(x: Array, wrong: str | None = None) -> Array:
    if wrong == "straight":
        return x
    half = x[2] / 2
    h = half / np.tan(half) if half else 1.0
    return np.array([h * x[0] + half * x[1], -half * x[0] + h * x[1], x[2]])


def se2_compose(a: Array, b: Array, wrong: str | None = None) -> Array:
    x = read_plane(plane(b) @ plane(a) if wrong == "wrong-order" else plane(a) @ plane(b))
    if wrong == "translations-added":
        x[:2] = a[:2] + b[:2]
    if wrong == "not-wrapped":
        x[2] = a[2] + b[2]
    if wrong == "other-end" and x[2] >= np.pi:
        x[2] = -np.pi
    return x


def se2_inverse(x: Array, wrong: str | None = None) -> Array:
    R = plane(x)[:2, :2]
    t = {"translation-not-turned": -x[:2], "inverse-turned-forward": -R @ x[:2]}.get(
        wrong or "", -R.T @ x[:2]
    )
    return np.array([*t, -x[2]])


def se2_adjoint(x: Array, wrong: str | None = None) -> Array:
    A = plane(x)
    A[:2, 2] = [x[1], -x[0]] if wrong != "adjoint-sign" else [-x[1], x[0]]
    return A


def se2_left_jacobian(xi: Array, wrong: str | None = None) -> Array:
    if wrong == "turn-forgotten":
        return np.array([[1, 0, xi[1] / 2], [0, 1, -xi[0] / 2], [0, 0, 1]])
    return group_jacobian(ad_plane(xi), wrong, xi[2])


# --- rotations


def so3_exp(phi: Array, wrong: str | None = None) -> Array:
    R = Rotation.from_rotvec(phi).as_matrix()
    return R.T if wrong == "transposed" else R


def so3_log(R: Array, wrong: str | None = None) -> Array:
    return Rotation.from_matrix(R).as_rotvec()


def so3_left_jacobian(phi: Array, wrong: str | None = None) -> Array:
    return group_jacobian(skew(phi), wrong, phi)


def so3_left_jacobian_inverse(phi: Array, wrong: str | None = None) -> Array:
    return np.linalg.inv(mean_exp(skew(phi)))


def so3_interpolate(a: Array, b: Array, fraction: float, wrong: str | None = None) -> Array:
    return a @ Rotation.from_rotvec(fraction * Rotation.from_matrix(a.T @ b).as_rotvec()).as_matrix()


def so3_nearest(M: Array, wrong: str | None = None) -> Array:
    U, _, Vt = np.linalg.svd(M)
    if wrong == "mirror":
        return U @ Vt
    return U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt


def so3_random(N: int, wrong: str | None = None) -> Array:
    rng = np.random.default_rng(5)
    if wrong == "uniform-angles":
        axes = rng.standard_normal((int(N), 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        return Rotation.from_rotvec(rng.uniform(0, 2 * np.pi, (int(N), 1)) * axes).as_matrix()
    return Rotation.random(int(N), random_state=5).as_matrix()


def quaternion_to_rotation(q: Array, wrong: str | None = None) -> Array:
    R = Rotation.from_quat(np.roll(q, -1)).as_matrix()
    return R.T if wrong == "conjugated" else R


def quaternion_from_rotation(R: Array, wrong: str | None = None) -> Array:
    q = np.roll(Rotation.from_matrix(R).as_quat(), 1)
    if wrong == "conjugated":
        return q * [1, -1, -1, -1]
    if wrong == "whole-angle":
        phi = Rotation.from_matrix(R).as_rotvec()
        angle = np.linalg.norm(phi)
        return np.array([np.cos(angle), *(np.sin(angle) / angle * phi)])
    if wrong == "identity-near-a-half-turn":
        w = np.sqrt(max(1 + np.trace(R), 0)) / 2
        if w < 1e-6:
            return np.array([1.0, 0, 0, 0])
    return q


# --- rigid motions


def hat6(xi: Array) -> Array:
    M = np.zeros((4, 4))
    M[:3, :3], M[:3, 3] = skew(xi[3:6]), xi[:3]
    return M


def ad6(xi: Array) -> Array:
    return np.block([[skew(xi[3:]), skew(xi[:3])], [np.zeros((3, 3)), skew(xi[3:])]])


def adjoint6(T: Array) -> Array:
    R = T[:3, :3]
    return np.block([[R, skew(T[:3, 3]) @ R], [np.zeros((3, 3)), R]])


def with_t(T: Array, t: Array) -> Array:
    out = T.copy()
    out[:3, 3] = t
    return out


def se3_exp(xi: Array, wrong: str | None = None) -> Array:
    T = expm(hat6(xi))
    return with_t(T, xi[:3]) if wrong == "straight" else T


def se3_log(T: Array, wrong: str | None = None) -> Array:
    phi = Rotation.from_matrix(T[:3, :3]).as_rotvec()
    t = T[:3, 3]
    return np.array([*(t if wrong == "straight" else np.linalg.solve(mean_exp(skew(phi)), t)), *phi])


def se3_left_jacobian(xi: Array, wrong: str | None = None) -> Array:
    J = group_jacobian(ad6(xi), wrong, xi[3:])
    if wrong == "no-coupling":
        J[:3, 3:] = 0
    return J


def se3_left_jacobian_inverse(xi: Array, wrong: str | None = None) -> Array:
    if wrong == "small-angle-sign":
        return np.eye(6) + ad6(xi) / 2
    return np.linalg.inv(group_jacobian(ad6(xi), wrong, xi[3:]))


def se3_compose(a: Array, b: Array, wrong: str | None = None) -> Array:
    if wrong == "element-wise":
        return a * b
    return b @ a if wrong == "wrong-order" else a @ b


def se3_inverse(T: Array, wrong: str | None = None) -> Array:
    if wrong == "transposed":
        return T.T
    out = np.linalg.inv(T)
    return with_t(out, -T[:3, 3]) if wrong == "translation-not-turned" else out


def se3_act(T: Array, x: Array, wrong: str | None = None) -> Array:
    R, t = T[:3, :3], T[:3, 3]
    if wrong == "turned-back":
        return R.T @ x + t
    return R @ (x + t) if wrong == "moved-first" else R @ x + t


def se3_act_jacobian(pose: Array, x: Array, wrong: str | None = None) -> Array:
    R, t = pose[:3, :3], pose[:3, 3]
    if wrong == "right-perturbation":
        return np.hstack([R, -R @ skew(x)])
    return np.hstack([np.eye(3), -skew(x if wrong == "body-point" else R @ x + t)])


def se3_adjoint(T: Array, wrong: str | None = None) -> Array:
    if wrong == "adjoint-of-inverse":
        return adjoint6(np.linalg.inv(T))
    A = adjoint6(T)
    if wrong == "adjoint-block":
        A[:3, 3:] = T[:3, :3] @ skew(T[:3, 3])
    return A


def se3_interpolate(a: Array, b: Array, fraction: float, wrong: str | None = None) -> Array:
    step = expm(hat6(fraction * se3_log(np.linalg.inv(a) @ b)))
    if wrong == "on-the-left":
        return step @ a
    T = a @ step
    return with_t(T, (1 - fraction) * a[:3, 3] + fraction * b[:3, 3]) if wrong == "straight-line" else T


# --- similarities


def hat7(xi: Array) -> Array:
    M = hat6(xi)
    M[:3, :3] += xi[6] * np.eye(3)
    return M


def sim3_exp(xi: Array, wrong: str | None = None) -> Array:
    S = expm(hat7(xi))
    if wrong == "straight":
        return with_t(S, xi[:3])
    return with_t(S, mean_exp(skew(xi[3:6])) @ xi[:3]) if wrong == "rigid-translation" else S


def sim3_log(S: Array, wrong: str | None = None) -> Array:
    s = np.cbrt(np.linalg.det(S[:3, :3]))
    phi, sigma, t = Rotation.from_matrix(S[:3, :3] / s).as_rotvec(), np.log(s), S[:3, 3]
    if wrong == "straight":
        return np.array([*t, *phi, sigma])
    W = mean_exp(skew(phi) + (0 if wrong == "rigid-translation" else sigma) * np.eye(3))
    return np.array([*np.linalg.solve(W, t), *phi, sigma])


def sim3_compose(a: Array, b: Array, wrong: str | None = None) -> Array:
    return b @ a if wrong == "wrong-order" else a @ b


def sim3_inverse(S: Array, wrong: str | None = None) -> Array:
    s = np.cbrt(np.linalg.det(S[:3, :3]))
    R = S[:3, :3] / s
    factor = {"inverse-not-scaled": 1.0, "inverse-scaled-up": s}.get(wrong or "", 1 / s)
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = R.T / s, -factor * R.T @ S[:3, 3]
    return out


def sim3_act(S: Array, x: Array, wrong: str | None = None) -> Array:
    s = np.cbrt(np.linalg.det(S[:3, :3]))
    return S[:3, :3] @ x + (s if wrong == "translation-scaled" else 1.0) * S[:3, 3]


def sim3_adjoint(S: Array, wrong: str | None = None) -> Array:
    s = np.cbrt(np.linalg.det(S[:3, :3]))
    R, t = S[:3, :3] / s, S[:3, 3]
    A = np.eye(7)
    A[:3, :3] = R if wrong == "rotation-not-scaled" else s * R
    A[:3, 3:6], A[3:6, 3:6] = skew(t) @ R, R
    A[:3, 6] = t if wrong == "adjoint-sign" else -t
    return A


def sim3_left_jacobian(xi: Array, wrong: str | None = None) -> Array:
    rho, phi, sigma = xi[:3], xi[3:6], xi[6]
    ad = np.zeros((7, 7))
    ad[:3, :3], ad[:3, 3:6], ad[:3, 6], ad[3:6, 3:6] = (
        skew(phi) + sigma * np.eye(3),
        skew(rho),
        -rho,
        skew(phi),
    )
    return group_jacobian(ad, wrong, phi)


NAMES = {
    "so2": ("exp", "wrap"),
    "se2": ("exp", "log", "compose", "inverse", "adjoint", "left_jacobian"),
    "so3": ("exp", "log", "left_jacobian", "left_jacobian_inverse", "interpolate", "nearest", "random"),
    "quaternion": ("to_rotation", "from_rotation"),
    "se3": (
        *("exp", "log", "left_jacobian", "left_jacobian_inverse", "compose", "inverse", "act", "adjoint"),
        *("act_jacobian", "interpolate"),
    ),
    "sim3": ("exp", "log", "compose", "inverse", "act", "adjoint", "left_jacobian"),
}
PROGRAM = {
    f"{topic}.{name}": globals()[f"{topic}_{name}"] for topic, names in NAMES.items() for name in names
}
