"""Cameras: five models, forwards, backwards, and all Jacobians."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import floats, vector
from generator.lens_grid import every_omega, every_radius, narrow, stopping
from generator.lens_slopes import SLOPES, in_intrinsics, in_pixel, in_point, jacobians
from generator.lenses import (
    EQUATIONS,
    LENSES,
    Array,
    camera,
    fisheye,
    pinhole,
    project,
    ray,
    unproject,
)

TOPIC, CHAPTER = "camera", 3
DEFINITION = "the model's definition, 50 digits"

NOTES = {
    "ptam-factor-one": (
        "near the axis you take the factor 1, as PTAM below r = 0.001; its limit is 2 tan(omega/2)/omega",
        "xd = x for r < 0.001",
    ),
    "ptam-half-pixel": (
        "your principal point is half a pixel off, as when PTAM reads its camera.cfg",
        "(u0 - 0.5, v0 - 0.5)",
    ),
    "mirrored": (
        "you project points behind the camera: their image is mirrored; there is none",
        "f x/z + c with z < 0",
    ),
    "not-distorted": ("your lens has no effect: the pixel is that of the pinhole", "f x/z + c"),
    "tangential-swapped": ("you exchange p1 and p2", "p1 (q + 2 x^2) + 2 p2 x y"),
    "k3-third": (
        "you read the coefficients as k1 k2 k3 p1 p2; p1 p2 come before k3",
        "k = (k1, k2, k3, p1, p2)",
    ),
    "half-tangent": ("you take tan(omega)/2 for tan(omega/2)", "arctan(r tan(omega)) / omega"),
    "tangent-for-angle": (
        "your fisheye polynomial is in tan(theta) = r; it must be in the angle theta",
        "r (1 + k1 r^2 + ...)",
    ),
    "half-space-only": (
        "your fisheye takes atan(r/z): rays beyond a right angle fold to the other side",
        "theta = atan(r/z) for atan2(r, z)",
    ),
    "not-unit": ("your ray has z = 1; a bearing has length 1", "(x, y, 1)"),
    "not-undistorted": ("your ray is that of the pinhole", "((u - cx)/fx, (v - cy)/fy, 1) / length"),
    "ray-not-unit": ("your ray's Jacobian is that of (x, y, 1), not of the unit bearing", "d(x, y, 1)/du"),
    "ideal-ray": ("your ray's Jacobian leaves out the lens", "that of the pinhole"),
    "depth-column-sign": ("the depth's column of your Jacobian has the wrong sign", "+x/z^2 for -x/z^2"),
    "depth-not-divided": ("your Jacobian is that at depth 1: it lacks the factor 1/z", "dh/d(x/z)"),
    "ideal-jacobian": (
        "your Jacobian leaves out the lens: it is that of the pinhole",
        "f/z [1, 0, -x/z; 0, 1, -y/z]",
    ),
    "not-distorted-column": (
        "the focal length's column holds the ideal position; it must be the distorted one",
        "du/dfx = x/z",
    ),
    "right-perturbation": ("your pose is perturbed on the right, T Exp(xi)", "J Ad(T)"),
    "world-point": (
        "your rotation columns use the world point; for a left perturbation it is the point in the camera",
        "-J_point hat(X_world)",
    ),
    "extrinsic-forgotten": (
        "you forget the rotation between rig and camera: J_point R_cam_rig [I, -hat(X_rig)]",
        "J_point [I, -hat(X_rig)]",
    ),
    "extrinsic-last": ("you perturb the camera's pose, not the rig's", "J_point [I, -hat(X_cam)]"),
}


def build(rng: np.random.Generator) -> Topic:
    """All models."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    for model in LENSES:
        _project(topic, rng, model)
        _unproject(topic, rng, model)
        jacobians(topic, rng, model)
    _zero_omega(topic, rng)
    for model in LENSES:
        in_pixel(topic, rng, model)
    fine, newton = _fine(), "Newton's iteration on the definition, 50 digits"
    for model in LENSES:
        rule = stopping(_inverse_rule(), model)
        made = SimpleNamespace(
            pixel=_pixel, bearing=_bearing, definition=DEFINITION, newton=newton, fine=fine
        )
        every_radius(topic, rng, model, SimpleNamespace(**vars(made), rule=rule, inverse=_inverse_of(model)))
    every_omega(topic, rng, made)
    cases = [
        _pixel("fisheye", _mild(rng), X) for X in (np.array([2.0, -1.0, 0.0]), np.array([0.0, 3.0, 0.0]))
    ]
    cases = [{key: value for key, value in case.items() if key != "mistakes"} for case in cases]
    topic.group("camera.project", EQUATIONS["fisheye"], DEFINITION, fine, cases, flags=("fisheye", "at_90"))
    slopes = tolerance(1e-13, "closed forms of some fifty operations", float32=1e-4)
    cases = [in_point("fisheye", _mild(rng), ray(rng, 1.0, 5.0) * [1, 1, -1]) for _ in range(3)]
    cases = [{key: value for key, value in case.items() if key != "mistakes"} for case in cases]
    flags = ("fisheye", "beyond_90")
    topic.group("camera.jacobian_point", "eq-jacobian-point", SLOPES, slopes, cases, flags=flags)
    for model in ("radtan", "rational", "fisheye"):
        rule = stopping(_inverse_rule(), model)
        here = SimpleNamespace(**{**vars(made), "rule": rule, "inverse": _inverse_of(model)})
        narrow(topic, rng, model, here)
    return topic


def _inverse_rule() -> dict[str, Any]:
    reason = "two dozen operations, or Newton's iteration to the end, times the lens's condition, below 30"
    return tolerance(1e-14, reason)


def _fine() -> dict[str, Any]:
    why = "two dozen operations within eps, on terms of some 300 pixels whose sum may be small"
    return tolerance(2e-15, why, absolute=6e-13)


def _project(topic: Topic, rng: np.random.Generator, model: str) -> None:
    nearest = 1e-5 if model == "fov" else 1e-9  # from there on PTAM's factor shows
    regimes = {"near_axis": (nearest, 9e-4, 6), "generic": (0.05, 0.6, 8)}
    wide = {"pinhole": (1.0, 5.0), "fov": (1.0, 50.0), "radtan": (0.65, 0.9), "rational": (0.65, 0.9)}
    for flag, (low, high, count) in {**regimes, "wide": (*wide.get(model, (1.0, 5.0)), 6)}.items():
        cases = [_pixel(model, camera(rng, model), ray(rng, low, high)) for _ in range(count)]
        flags = (model,) if flag == "generic" else (model, flag)
        topic.group("camera.project", EQUATIONS[model], DEFINITION, _fine(), cases, flags=flags)
    axis = [_pixel(model, camera(rng, model), np.array([0.0, 0.0, rng.uniform(0.5, 5.0)])) for _ in range(2)]
    topic.group("camera.project", EQUATIONS[model], DEFINITION, _fine(), axis, flags=(model, "on_axis"))
    if model == "fisheye":
        cases = [_pixel(model, _mild(rng), ray(rng, 1.0, 5.0) * [1, 1, -1]) for _ in range(6)]
        topic.group(
            "camera.project", EQUATIONS[model], DEFINITION, _fine(), cases, flags=(model, "beyond_90")
        )
        hidden = [_no_pixel(model, camera(rng, model), np.array([0.0, 0.0, -2.0])) for _ in range(2)]
    else:
        hidden = [_no_pixel(model, camera(rng, model), ray(rng, 0.05, 0.9) * [1, 1, -1]) for _ in range(5)]
        hidden.append(_no_pixel(model, camera(rng, model), np.array([0.3, 0.2, 0.0])))
    topic.group(
        "camera.project", EQUATIONS[model], "definition", _fine(), hidden, flags=(model, "behind_camera")
    )
    if model in ("radtan", "rational", "fisheye"):
        cases = [_no_pixel(model, _closed(rng, model), ray(rng, 1.8, 4.0)) for _ in range(4)]
        oracle = "the radius at which the distorted radius stops to grow, closed form"
        topic.group(
            "camera.project", EQUATIONS[model], oracle, _fine(), cases, flags=(model, "outside_field")
        )


def _mild(rng: np.random.Generator) -> Array:
    """A fisheye whose radius grows up to an angle of pi: |k1| 3 pi^2 + |k2| 5 pi^4 < 1."""
    params = camera(rng, "fisheye")
    params[4:] *= [0.4, 0.05, 0.0, 0.0]
    return params


def _closed(rng: np.random.Generator, model: str) -> Array:
    """A lens whose field ends early: 1 + 3 k1 q = 0 at 1.05 to 1.3 (fisheye: at an angle of 0.8 to 1)."""
    params = camera(rng, model)
    params[4:] = 0.0
    end = rng.uniform(0.8, 1.0) if model == "fisheye" else rng.uniform(1.05, 1.3)
    params[4] = -1.0 / (3.0 * end**2)
    return params


def _pixel(model: str, params: Array, X: Array) -> dict[str, Any]:
    k, x = vector(params), vector(X)
    right = project(model, k, x)
    r = float(np.hypot(X[0], X[1]) / abs(X[2])) if X[2] else np.inf
    wrong: dict[str, Any] = {"ptam-half-pixel": [v - mpf(0.5) for v in right]} if model == "fov" else {}
    if model == "fov" and r < 1e-3:
        wrong["ptam-factor-one"] = project(model, k, x, lens=pinhole)
    elif model != "pinhole" and X[2] > 0:
        wrong["not-distorted"] = project(model, k, x, lens=pinhole)
    if model in ("radtan", "rational"):
        k1, k2, p1, p2, k3, *rest = k[4:]
        wrong["tangential-swapped"] = project(model, [*k[:4], k1, k2, p2, p1, k3, *rest], x)
        wrong["k3-third"] = project(model, [*k[:4], k1, k2, p2, k3, p1, *rest], x)
    if model == "fov" and params[4] > 0:
        wrong["half-tangent"] = project(model, k, x, lens=_half_tangent)
    if model == "fisheye" and X[2] > 0:
        wrong["tangent-for-angle"] = project(model, k, x, lens=_tangent_for_angle)
    if model == "fisheye" and X[2] < 0:
        wrong["half-space-only"] = project(model, k, x, lens=_half_space)
    off = {
        note: uv
        for note, uv in wrong.items()
        if max(abs(a - b) for a, b in zip(uv, right, strict=True)) > 1e-6
    }
    mistakes = {note: {"uv": floats(uv), "valid": True} for note, uv in off.items()}
    inputs = {"model": model, "params": params, "X_cam": X}
    return {"inputs": inputs, "expected": {"uv": floats(right), "valid": True}, "mistakes": mistakes}


def _half_tangent(k: Any, X: Any) -> list[Any]:
    x, y = pinhole(k, X)
    r = mpmath.sqrt(x * x + y * y)
    factor = mpmath.atan(r * mpmath.tan(k[0])) / (r * k[0]) if r else mpf(0)
    return [factor * x, factor * y]


def _tangent_for_angle(k: Any, X: Any) -> list[Any]:
    x, y = pinhole(k, X)
    factor = 1 + sum(c * (x * x + y * y) ** (n + 1) for n, c in enumerate(k))
    return [factor * x, factor * y]


def _half_space(k: Any, X: Any) -> list[Any]:
    """Theta = atan(rho / z) is negative behind."""
    return [-v for v in fisheye(k, [X[0], X[1], abs(X[2])])]


def _no_pixel(model: str, params: Array, X: Array) -> dict[str, Any]:
    mistakes: dict[str, Any] = {}
    if X[2] < 0 and model != "fisheye":
        mistakes["mirrored"] = {"uv": floats(project(model, vector(params), vector(X))), "valid": True}
    inputs = {"model": model, "params": params, "X_cam": X}
    return {"inputs": inputs, "expected": {}, "mistakes": mistakes, "result": "invalid"}


def _unproject(topic: Topic, rng: np.random.Generator, model: str) -> None:
    rule = stopping(_inverse_rule(), model)
    far = {"pinhole": (1.0, 5.0), "fov": (1.0, 5.0), "radtan": (0.65, 0.85), "rational": (0.65, 0.85)}
    for flag, (low, high, count) in {
        "near_axis": (1e-9, 9e-4, 4),
        "generic": (0.05, 0.6, 8),
        "wide": (*far.get(model, (1.0, 5.0)), 5),
    }.items():
        cases = [_bearing(model, camera(rng, model), ray(rng, low, high)) for _ in range(count)]
        flags = (model,) if flag == "generic" else (model, flag)
        oracle = "Newton's iteration on the definition, 50 digits"
        topic.group("camera.unproject", _inverse_of(model), oracle, rule, cases, flags=flags)
    if model == "pinhole":
        return
    params = [_closed(rng, model) if model != "fov" else camera(rng, model) for _ in range(4)]
    cases = [
        {
            "inputs": {"model": model, "params": k, "uv": k[2:4] + k[:2] * _beyond(model, k)},
            "expected": {},
            "result": "invalid",
        }
        for k in params
    ]
    oracle = "the largest distorted radius, closed form"
    topic.group("camera.unproject", _inverse_of(model), oracle, rule, cases, flags=(model, "outside_field"))


def _inverse_of(model: str) -> str:
    return "eq-fov-inverse" if model == "fov" else EQUATIONS[model]


def _beyond(model: str, params: Array) -> Array:
    """Distorted position a fifth outside the image of the whole field."""
    if model == "fov":
        largest = np.pi / (2 * params[4])
    else:  # d = r + k1 r^3 is largest at 1 + 3 k1 r^2 = 0, where it is 2 r / 3
        largest = 2.0 / 3.0 * np.sqrt(-1.0 / (3.0 * params[4]))
    return np.asarray(1.2 * largest * np.array([0.6, -0.8]))


def _bearing(model: str, params: Array, X: Array) -> dict[str, Any]:
    k = vector(params)
    uv = np.array(floats(project(model, k, vector(X))))
    right = unproject(model, k, vector(uv), X)
    ideal = [(vector(uv)[i] - k[2 + i]) / k[i] for i in range(2)]
    length = mpmath.sqrt(ideal[0] ** 2 + ideal[1] ** 2 + 1)
    wrong: dict[str, Any] = {"not-unit": [v / right[2] for v in right]}
    if model != "pinhole":
        wrong["not-undistorted"] = [ideal[0] / length, ideal[1] / length, 1 / length]
    off = {
        note: b for note, b in wrong.items() if max(abs(a - c) for a, c in zip(b, right, strict=True)) > 1e-8
    }
    mistakes = {note: {"bearing": floats(b), "valid": True} for note, b in off.items()}
    inputs = {"model": model, "params": params, "uv": uv}
    return {"inputs": inputs, "expected": {"bearing": floats(right), "valid": True}, "mistakes": mistakes}


def _zero_omega(topic: Topic, rng: np.random.Generator) -> None:
    """The FOV lens at omega = 0 and near it: the pinhole."""
    rule = tolerance(1e-13, "series of even order in omega")
    for flag, omegas in {
        "zero_omega": (0.0, 0.0, 0.0),
        "small_omega": (1e-9, 1e-6, 1e-4, 1e-3, 1e-2),
    }.items():
        some = []
        for omega in omegas:
            params = camera(rng, "fov")
            params[4] = omega
            some.append((params, ray(rng, 0.05, 1.0)))
        flags = ("fov", flag)
        cases = [_pixel("fov", k, X) for k, X in some]
        topic.group("camera.project", EQUATIONS["fov"], DEFINITION, _fine(), cases, flags=flags)
        cases = [_bearing("fov", k, X) for k, X in some]
        topic.group("camera.unproject", "eq-fov-inverse", DEFINITION, rule, cases, flags=flags)
        cases = [in_intrinsics("fov", k, X) for k, X in some]
        topic.group("camera.jacobian_intrinsics", "eq-fov-omega", SLOPES, rule, cases, flags=flags)
        cases = [in_point("fov", k, X) for k, X in some]
        topic.group("camera.jacobian_point", "eq-fov-jacobian", SLOPES, rule, cases, flags=flags)
