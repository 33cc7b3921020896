# ruff: noqa: E501
"""Rotations and motions as programs write them: closed formulas, with a branch for small angles and half turns.

Right as they stand; what is wrong is put in by ``wrong_programs``.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

Array = Any
SMALL = 1e-2


def hat(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def weights(angle: float) -> tuple[float, float, float]:
    """Sin x / x, (1 - cos x)/x^2, (x - sin x)/x^3."""
    q = angle * angle
    if angle < SMALL:
        return (
            1 - q / 6 + q * q / 120 - q**3 / 5040,
            0.5 - q / 24 + q * q / 720 - q**3 / 40320,
            1 / 6 - q / 120 + q * q / 5040,
        )
    if angle < 0.5:
        return long_series(q)
    return np.sin(angle) / angle, 2 * np.sin(angle / 2) ** 2 / q, (angle - np.sin(angle)) / (q * angle)


def long_series(q: float) -> Array:
    rows, term = np.zeros(3), np.array([1.0, 0.5, 1 / 6])
    for k in range(12):
        rows = rows + term
        term = -term * q / np.array([(2 * k + j) * (2 * k + j + 1) for j in (2, 3, 4)])
    return rows


def so3_exp(phi: Array) -> Array:
    a, b, _ = weights(np.linalg.norm(phi))
    W = hat(phi)
    return np.eye(3) + a * W + b * W @ W


def quaternion_from_rotation(R: Array) -> Array:
    trace = np.trace(R)
    if trace > 0:
        s = 2 * np.sqrt(1 + trace)
        return np.array([s / 4, (R[2, 1] - R[1, 2]) / s, (R[0, 2] - R[2, 0]) / s, (R[1, 0] - R[0, 1]) / s])
    i = int(np.argmax(np.diag(R)))
    j, k = (i + 1) % 3, (i + 2) % 3
    s = 2 * np.sqrt(1 + R[i, i] - R[j, j] - R[k, k])
    q = np.zeros(4)
    q[0] = (R[k, j] - R[j, k]) / s
    q[1 + i], q[1 + j], q[1 + k] = s / 4, (R[j, i] + R[i, j]) / s, (R[k, i] + R[i, k]) / s
    return q


def quaternion_to_rotation(q: Array) -> Array:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def so3_log(R: Array) -> Array:
    q = quaternion_from_rotation(R)
    if q[0] < 0:
        q = -q
    n = np.linalg.norm(q[1:])
    if n < 1e-12:
        return 2 * q[1:]
    return 2 * np.arctan2(n, q[0]) / n * q[1:]


def so3_left_jacobian(phi: Array) -> Array:
    _, b, c = weights(np.linalg.norm(phi))
    W = hat(phi)
    return np.eye(3) + b * W + c * W @ W


def so3_left_jacobian_inverse(phi: Array) -> Array:
    angle = np.linalg.norm(phi)
    W = hat(phi)
    if angle < 0.2:
        q = angle * angle
        d = 1 / 12 + q / 720 + q * q / 30240 + q**3 / 1209600 + q**4 / 47900160
    else:
        half = angle / 2
        d = (1 - half * np.cos(half) / np.sin(half)) / angle**2
    return np.eye(3) - 0.5 * W + d * W @ W


def so3_interpolate(a: Array, b: Array, fraction: float) -> Array:
    return a @ so3_exp(fraction * so3_log(a.T @ b))


def so2_wrap(angle: float) -> float:
    if -np.pi < angle <= np.pi:
        return angle
    return np.arctan2(np.sin(angle), np.cos(angle))


def se3_exp(xi: Array) -> Array:
    rho, phi = xi[:3], xi[3:]
    T = np.eye(4)
    T[:3, :3] = so3_exp(phi)
    T[:3, 3] = so3_left_jacobian(phi) @ rho
    return T


def se3_log(T: Array) -> Array:
    phi = so3_log(T[:3, :3])
    return np.concatenate([so3_left_jacobian_inverse(phi) @ T[:3, 3], phi])


def se3_inverse(T: Array) -> Array:
    R, t = T[:3, :3], T[:3, 3]
    out = np.eye(4)
    out[:3, :3] = R.T
    out[:3, 3] = -R.T @ t
    return out


def se3_adjoint(T: Array) -> Array:
    R, t = T[:3, :3], T[:3, 3]
    A = np.zeros((6, 6))
    A[:3, :3] = A[3:, 3:] = R
    A[:3, 3:] = hat(t) @ R
    return A


def pinhole_pose_jacobian(model: str, params: Array, pose: Array, X_world: Array) -> Array:
    if model != "pinhole":
        raise NotImplementedError(model)
    fx, fy = params[:2]
    x, y, z = pose[:3, :3] @ X_world + pose[:3, 3]
    return np.array(
        [
            [fx / z, 0.0, -fx * x / z**2, -fx * x * y / z**2, fx + fx * x**2 / z**2, -fx * y / z],
            [0.0, fy / z, -fy * y / z**2, -fy - fy * y**2 / z**2, fy * x * y / z**2, fy * x / z],
        ]
    )


def ray_cells(start: Array, end: Array) -> Array:
    """Cell to cell over the nearer edge; the segment's pieces by the middle of each."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    cuts = {0.0, 1.0}
    for k in range(2):
        low, high = sorted((a[k], b[k]))
        for line in range(int(np.ceil(low)), int(np.floor(high)) + 1):
            if b[k] != a[k]:
                cuts.add((line - a[k]) / (b[k] - a[k]))
    t = sorted(c for c in cuts if 0 <= c <= 1)
    cells = []
    for low, high in itertools.pairwise(t):
        if high - low > 1e-13:
            cell = [int(v) for v in np.floor(a + (low + high) / 2 * (b - a))]
            if not cells or cells[-1] != cell:
                cells.append(cell)
    return cells


PROGRAM = {
    "so2.wrap": so2_wrap,
    "so3.exp": so3_exp,
    "so3.log": so3_log,
    "so3.left_jacobian": so3_left_jacobian,
    "so3.left_jacobian_inverse": so3_left_jacobian_inverse,
    "so3.interpolate": so3_interpolate,
    "quaternion.from_rotation": quaternion_from_rotation,
    "quaternion.to_rotation": quaternion_to_rotation,
    "se3.exp": se3_exp,
    "se3.log": se3_log,
    "se3.inverse": se3_inverse,
    "se3.adjoint": se3_adjoint,
    "camera.jacobian_pose": pinhole_pose_jacobian,
    "grid.ray_cells": ray_cells,
}
