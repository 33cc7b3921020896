"""Jacobians of cameras: central differences of the definitions, and what wrong formulas would give."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import derivative, floats, hat, matrix, vector
from generator.groups import SE3, motion, twist
from generator.lenses import (
    Array,
    camera,
    jacobian_intrinsics,
    jacobian_point,
    project,
    ray,
    unproject,
)

SLOPES = "central differences of the definition, 50 digits, h = 1e-15"


def jacobians(topic: Topic, rng: np.random.Generator, model: str) -> None:
    """All four Jacobians of a model."""
    reason = (
        "closed forms of some fifty operations; near the axis their differences cancel at most three digits"
    )
    rule = tolerance(1e-13, reason, float32=1e-4)
    far = 5.0 if model in ("pinhole", "fov", "fisheye") else 0.85
    for flag, (low, high, count) in {
        "near_axis": (1e-9, 9e-4, 3),
        "generic": (0.05, 0.6, 7),
        "wide": (0.65, far, 4),
    }.items():
        some = [(camera(rng, model), ray(rng, low, high)) for _ in range(count)]
        flags = (model,) if flag == "generic" else (model, flag)
        cases = [in_point(model, k, X) for k, X in some]
        topic.group("camera.jacobian_point", "eq-jacobian-point", SLOPES, rule, cases, flags=flags)
        cases = [in_intrinsics(model, k, X) for k, X in some]
        topic.group("camera.jacobian_intrinsics", "eq-jacobian-intrinsics", SLOPES, rule, cases, flags=flags)
    some = [(camera(rng, model), ray(rng, 0.05, 0.6)) for _ in range(6)]
    cases = [_in_pose(model, k, X, motion(rng)) for k, X in some]
    topic.group("camera.jacobian_pose", "eq-jacobian-pose", SLOPES, rule, cases, flags=(model,))
    cases = [
        _in_rig(model, k, X, motion(rng), np.array(floats(SE3.exp(vector(_small(rng)))))) for k, X in some[:4]
    ]
    topic.group("camera.jacobian_rig", "eq-jacobian-pose", SLOPES, rule, cases, flags=(model,))


def _small(rng: np.random.Generator) -> Array:
    return np.asarray(twist(rng) * [0.1, 0.1, 0.1, 0.5, 0.5, 0.5])


def in_point(model: str, params: Array, X: Array) -> dict[str, Any]:
    """Jacobian of the pixel in the point."""
    k, x = vector(params), vector(X)
    J = jacobian_point(model, k, x)
    flipped, ideal = J.copy(), jacobian_point("pinhole", k, x)
    for i in range(2):
        flipped[i, 2] = -J[i, 2]
    wrong = {"depth-not-divided": J * x[2]}
    if np.hypot(X[0], X[1]) > 1e-2:
        wrong["depth-column-sign"] = flipped
    if model != "pinhole" and mpmath.mnorm(ideal - J) > 1e-3:
        wrong["ideal-jacobian"] = ideal
    return _matrix({"model": model, "params": params, "X_cam": X}, J, wrong)


def in_pixel(topic: Topic, rng: np.random.Generator, model: str) -> None:
    """Jacobian of the bearing in the pixel: differences of Newton's solutions."""
    reason = "the inverse of a Jacobian of condition below 30, times some fifty operations"
    rule = tolerance(1e-13, reason, float32=1e-3)
    cases = [in_pixel_case(model, camera(rng, model), ray(rng, 0.05, 0.6)) for _ in range(4)]
    topic.group("camera.jacobian_ray", "eq-jacobian-ray", SLOPES, rule, cases, flags=(model,))


def in_pixel_case(model: str, params: Array, X: Array) -> dict[str, Any]:
    """Jacobian of the bearing in the pixel of a point."""
    k = vector(params)
    uv = np.array(floats(project(model, k, vector(X))))
    u = vector(uv)

    def plane(at: Any) -> list[Any]:
        b = unproject(model, k, at, X)
        return [b[0] / b[2], b[1] / b[2], mpf(1)]

    J = derivative(lambda at: unproject(model, k, at, X), u)
    wrong = {"ray-not-unit": derivative(plane, u)}
    if model != "pinhole":
        wrong["ideal-ray"] = derivative(lambda at: unproject("pinhole", k[:4], at, X), u)
    return _matrix({"model": model, "params": params, "uv": uv}, J, wrong)


def in_intrinsics(model: str, params: Array, X: Array) -> dict[str, Any]:
    """Jacobian of the pixel in the intrinsics."""
    k, x = vector(params), vector(X)
    J = jacobian_intrinsics(model, k, x)
    ideal = J.copy()
    ideal[0, 0], ideal[1, 1] = x[0] / x[2], x[1] / x[2]
    wrong = {"not-distorted-column": ideal} if mpmath.mnorm(ideal - J) > 1e-3 else {}
    return _matrix({"model": model, "params": params, "X_cam": X}, J, wrong)


def _moved(model: str, k: Any, T: Any, X: Any) -> list[Any]:
    point = T * mpmath.matrix([*X, 1])
    return project(model, k, [point[0], point[1], point[2]])


def _in_pose(model: str, params: Array, X_cam: Array, pose: Array) -> dict[str, Any]:
    k, T = vector(params), matrix(pose)
    X_world = np.array(floats(list(T**-1 * mpmath.matrix([*vector(X_cam), 1]))))[:3]
    x = vector(X_world)
    zero = [mpf(0)] * 6
    J = derivative(lambda xi: _moved(model, k, SE3.exp(xi) * T, x), zero)
    right = derivative(lambda xi: _moved(model, k, T * SE3.exp(xi), x), zero)
    point = T * mpmath.matrix([*x, 1])
    J_point = jacobian_point(model, k, [point[0], point[1], point[2]])
    wrong = {"right-perturbation": right, "world-point": _beside(J_point, -J_point * hat(x))}
    return _matrix({"model": model, "params": params, "pose": pose, "X_world": X_world}, J, wrong)


def _in_rig(model: str, params: Array, X_cam: Array, pose: Array, T_cam_rig: Array) -> dict[str, Any]:
    k, T, mount = vector(params), matrix(pose), matrix(T_cam_rig)
    X_world = np.array(floats(list((mount * T) ** -1 * mpmath.matrix([*vector(X_cam), 1]))))[:3]
    x = vector(X_world)
    J = derivative(lambda xi: _moved(model, k, mount * SE3.exp(xi) * T, x), [mpf(0)] * 6)
    last = derivative(lambda xi: _moved(model, k, SE3.exp(xi) * mount * T, x), [mpf(0)] * 6)
    in_rig = T * mpmath.matrix([*x, 1])
    in_cam = mount * in_rig
    J_point = jacobian_point(model, k, [in_cam[0], in_cam[1], in_cam[2]])
    forgotten = _beside(J_point, -J_point * hat([in_rig[0], in_rig[1], in_rig[2]]))
    inputs = {"model": model, "params": params, "T_cam_rig": T_cam_rig, "pose": pose, "X_world": X_world}
    return _matrix(inputs, J, {"extrinsic-forgotten": forgotten, "extrinsic-last": last})


def _beside(a: Any, b: Any) -> Any:
    rows = [[a[i, j] for j in range(a.cols)] + [b[i, j] for j in range(b.cols)] for i in range(a.rows)]
    return mpmath.matrix(rows)


def _matrix(inputs: dict[str, Any], J: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    mistakes = {note: {"J": floats(M)} for note, M in wrong.items()}
    return {"inputs": inputs, "expected": {"J": floats(J)}, "mistakes": mistakes}
