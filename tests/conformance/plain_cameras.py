"""Chapter 03 in plain NumPy: five lenses in closed form, Jacobians by complex steps, and known mistakes."""

from __future__ import annotations

from typing import Any

import numpy as np
from plain_motions import skew

Array = Any
STEP = 1e-40


def polynomial(c: Array, q: Array) -> Array:
    return 1 + sum(v * q ** (n + 1) for n, v in enumerate(c))


def lens(model: str, k: Array, X: Array, wrong: str | None = None) -> Array:
    """Distorted position; numbers may be complex."""
    if model == "fisheye" and wrong != "tangent-for-angle" and wrong != "not-distorted":
        return fisheye(k, X, wrong)
    x, y = X[0] / X[2], X[1] / X[2]
    q = x * x + y * y
    if wrong == "not-distorted" or model == "pinhole":
        return np.array([x, y])
    if model == "fov":
        return fov(k[0], q, wrong) * np.array([x, y])
    if model == "fisheye":
        return polynomial(k, q) * np.array([x, y])
    k1, k2, p1, p2, k3 = k[:5]
    if wrong == "tangential-swapped":
        p1, p2 = p2, p1
    if wrong == "k3-third":
        p1, p2, k3 = k3, p1, p2
        k1, k2, k3, p1, p2 = k[0], k[1], k[2], k[3], k[4]
    G = polynomial([k1, k2, k3], q) / polynomial(k[5:], q)
    moved = [2 * p1 * x * y + p2 * (q + 2 * x * x), p1 * (q + 2 * y * y) + 2 * p2 * x * y]
    return np.array([G * x + moved[0], G * y + moved[1]])


def fov(omega: Any, q: Any, wrong: str | None) -> Any:
    r = np.sqrt(q)
    if wrong == "ptam-factor-one" and r < 1e-3:
        return 1.0
    if wrong == "half-tangent":
        return np.arctan(r * np.tan(omega)) / (r * omega)
    if abs(omega) < 0.02:
        w = omega * omega
        A = 1 + w / 12 + w**2 / 120 + 17 * w**3 / 20160
        Q = w * A * A * q
        return A * (1 - Q / 3 + Q**2 / 5 - Q**3 / 7 + Q**4 / 9)
    T = 2 * np.tan(omega / 2)
    return T / omega if r == 0 else np.arctan(r * T) / (r * omega)


def fisheye(k: Array, X: Array, wrong: str | None = None) -> Array:
    rho = np.sqrt(X[0] ** 2 + X[1] ** 2)
    if rho == 0:
        return np.zeros(2)
    theta = np.arctan(rho / X[2]) if X[2] else np.pi / 2
    if X[2].real < 0 and wrong != "half-space-only":
        theta = theta + np.pi
    return theta * polynomial(k, theta * theta) * X[:2] / rho


def pixel(model: str, params: Array, X: Array, wrong: str | None = None) -> Array:
    """Numbers may be complex."""
    uv = params[:2] * lens(model, params[4:], X, wrong) + params[2:4]
    return uv - 0.5 if wrong == "ptam-half-pixel" else uv


def end_of_field(model: str, k: Array) -> float:
    """Radius (fisheye: angle) up to which the distorted radius grows, by a scan."""
    if model in ("pinhole", "fov"):
        return np.inf
    r = np.linspace(0, np.pi if model == "fisheye" else 8.0, 20001)
    d = r * (
        polynomial(k, r * r)
        if model == "fisheye"
        else polynomial(k[[0, 1, 4]], r * r) / polynomial(k[5:], r * r)
    )
    falls = np.flatnonzero(np.diff(d) <= 0)
    return float(r[falls[0]]) if len(falls) else np.inf


def seen(model: str, params: Array, X: Array) -> bool:
    rho = np.hypot(X[0], X[1])
    if model == "fisheye":
        return bool(np.arctan2(rho, X[2]) < min(end_of_field(model, params[4:]), np.pi))
    return bool(X[2] > 0 and rho / X[2] < end_of_field(model, params[4:]))


def project(model: str, params: Array, X_cam: Array, wrong: str | None = None) -> Any:
    if not seen(model, params, X_cam) and wrong != "mirrored":
        return {"uv": params[2:4], "valid": False}
    return {"uv": pixel(model, params, X_cam.astype(complex), wrong).real, "valid": True}


def unproject(model: str, params: Array, uv: Array, wrong: str | None = None) -> Any:
    xd = (uv - params[2:4]) / params[:2]
    size = float(np.hypot(*xd))
    if wrong == "not-undistorted" or model == "pinhole" or size == 0:
        ray = np.array([*xd, 1.0])
    elif model == "fov":
        omega = params[4]
        if size * omega >= np.pi / 2:
            raise ValueError("no ray")
        small = omega < 0.02
        stretch = 1 + (omega * size) ** 2 / 3 + 2 * (omega * size) ** 4 / 15 + 17 * (omega * size) ** 6 / 315
        A = 1 + omega**2 / 12 + omega**4 / 120 + 17 * omega**6 / 20160
        factor = stretch / A if small else np.tan(size * omega) / (2 * size * np.tan(omega / 2))
        ray = np.array([*(factor * xd), 1.0])
    else:
        ray = newton(model, params, xd, size)
    return {"bearing": ray / (ray[2] if wrong == "not-unit" else np.linalg.norm(ray)), "valid": True}


def newton(model: str, params: Array, xd: Array, size: float) -> Array:
    k = params[4:]
    end = end_of_field(model, k)
    if np.isfinite(end):
        edge = [end, 0.0, 1.0] if model != "fisheye" else [np.sin(end), 0.0, np.cos(end)]
        if size > np.hypot(*lens(model, k, np.array(edge, dtype=complex)).real):
            raise ValueError("no ray")
    if model == "fisheye":
        theta = min(size, 1.5)
        for _ in range(60):
            slope = (t := complex(theta, STEP)) * polynomial(k, t * t)
            theta -= (theta * polynomial(k, theta**2) - size) / (slope.imag / STEP)
        return np.array([*(np.sin(theta) * xd / size), np.cos(theta)])
    x = xd.copy()
    for _ in range(60):
        at = np.array([*x, 1.0], dtype=complex)
        J = slopes(lambda v: lens(model, k, v), at)[:, :2]
        x = x - np.linalg.solve(J, lens(model, k, at).real - xd)
    return np.array([*x, 1.0])


def slopes(f: Any, at: Array) -> Array:
    """Complex-step Jacobian."""
    columns = []
    for j in range(len(at)):
        x = at.astype(complex)
        x[j] += 1j * STEP
        columns.append(f(x).imag / STEP)
    return np.stack(columns, 1)


def jacobian_point(model: str, params: Array, X_cam: Array, wrong: str | None = None) -> Array:
    lens_used = "pinhole" if wrong == "ideal-jacobian" else model
    J = slopes(lambda X: pixel(lens_used, params, X), X_cam)
    if wrong == "depth-column-sign":
        J[:, 2] *= -1
    return J * X_cam[2] if wrong == "depth-not-divided" else J


def jacobian_intrinsics(model: str, params: Array, X_cam: Array, wrong: str | None = None) -> Array:
    J = slopes(lambda k: pixel(model, k, X_cam.astype(complex)), params)
    if wrong == "not-distorted-column":
        J[0, 0], J[1, 1] = X_cam[:2] / X_cam[2]
    return J


def jacobian_ray(model: str, params: Array, uv: Array, wrong: str | None = None) -> Array:
    """Inverse of the plane's Jacobian, then that of the length."""
    lens_used = "pinhole" if wrong == "ideal-ray" else model
    b = unproject(lens_used, params, uv)["bearing"]
    X = b / b[2]
    inverse = np.linalg.inv(jacobian_point(lens_used, params, X)[:, :2])
    plane = np.vstack([inverse, np.zeros(2)])
    if wrong == "ray-not-unit":
        return plane
    return (np.eye(3) - np.outer(b, b)) @ plane / np.linalg.norm(X)


def jacobian_pose(model: str, params: Array, pose: Array, X_world: Array, wrong: str | None = None) -> Array:
    R, t = pose[:3, :3], pose[:3, 3]
    X = R @ X_world + t
    J = jacobian_point(model, params, X)
    if wrong == "right-perturbation":
        return np.hstack([J @ R, -J @ R @ skew(X_world)])
    return np.hstack([J, -J @ skew(X_world if wrong == "world-point" else X)])


def jacobian_rig(
    model: str, params: Array, T_cam_rig: Array, pose: Array, X_world: Array, wrong: str | None = None
) -> Array:
    X_rig = pose[:3, :3] @ X_world + pose[:3, 3]
    R = T_cam_rig[:3, :3]
    X_cam = R @ X_rig + T_cam_rig[:3, 3]
    J = jacobian_point(model, params, X_cam)
    if wrong == "extrinsic-last":
        return np.hstack([J, -J @ skew(X_cam)])
    if wrong == "extrinsic-forgotten":
        R = np.eye(3)
    return np.hstack([J @ R, -J @ R @ skew(X_rig)])


FUNCTIONS = (
    project,
    unproject,
    jacobian_point,
    jacobian_intrinsics,
    jacobian_pose,
    jacobian_rig,
    jacobian_ray,
)
PROGRAM = {f"camera.{function.__name__}": function for function in FUNCTIONS}
