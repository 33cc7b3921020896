"""Blocks of the normal equations of one view: Jacobians by central differences, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.exact import column, derivative, floats, matrix, vector
from generator.groups import SE3, Array, motion
from generator.lenses import camera, project, ray


def normal_case(rng: np.random.Generator, model: str, n: int = 2) -> dict[str, Any]:
    """Points with full covariances, some pixels off."""
    params, pose = camera(rng, model), motion(rng)
    k, T = vector(params), matrix(pose)
    X_cam = np.stack([ray(rng, 0.05, 0.5) for _ in range(n)])
    X = np.array([floats(list(T**-1 * mpmath.matrix([*vector(x), 1])))[:3] for x in X_cam])
    exact = [_seen(model, k, T, vector(x)) for x in X]
    uv = np.array(floats(exact)) + rng.normal(0, 2.0, (n, 2))
    half = rng.normal(0, 1.0, (n, 2, 2)) + 1.5 * np.eye(2)
    cov = half @ np.swapaxes(half, 1, 2)
    cov = 0.5 * (cov + np.swapaxes(cov, 1, 2))
    right = _blocks(model, k, T, X, uv, cov)
    wrong = {
        "right-perturbation": _blocks(model, k, T, X, uv, cov, right=True),
        "covariance-not-inverted": _blocks(
            model, k, T, X, uv, np.asarray(np.linalg.inv(cov), dtype=np.float64)
        ),
        "covariance-ignored": _blocks(model, k, T, X, uv, np.tile(np.eye(2), (n, 1, 1))),
        "gradient-sign": {**right, **{g: _negative(right[g]) for g in ("g_view", "g_point")}},
    }
    inputs = {"model": model, "params": params, "pose": pose, "X_world": X, "uv": uv, "cov": cov}
    return {"inputs": inputs, "expected": right, "mistakes": wrong}


def _negative(value: Any) -> Any:
    return [_negative(v) for v in value] if isinstance(value, list) else -value


def _seen(model: str, k: list[Any], T: Any, x: list[Any]) -> list[Any]:
    point = T * mpmath.matrix([*x, 1])
    return project(model, k, [point[0], point[1], point[2]])


def _blocks(
    model: str, k: list[Any], T: Any, X: Array, uv: Array, cov: Array, *, right: bool = False
) -> dict[str, Any]:
    """B, W_T, C, g_view, g_point."""
    B, g_view, W, C, g_point = mpmath.zeros(6, 6), mpmath.zeros(1, 6), [], [], []
    for x, u, S in zip(X, uv, cov, strict=True):
        at, weight = vector(x), matrix(S) ** -1

        def moved(xi: list[Any], at: list[Any] = at) -> list[Any]:
            return _seen(model, k, T * SE3.exp(xi) if right else SE3.exp(xi) * T, at)

        J = derivative(moved, [mpf(0)] * 6)
        J_point = derivative(lambda p: _seen(model, k, T, p), at)
        r = mpmath.matrix([a - b for a, b in zip(_seen(model, k, T, at), vector(u), strict=True)])
        B += J.T * weight * J
        g_view += (J.T * weight * r).T
        W += floats(J_point.T * weight * J)
        C.append(floats(J_point.T * weight * J_point))
        g_point += floats(column(J_point.T * weight * r))
    return {"B": floats(B), "W_T": W, "C": C, "g_view": floats(g_view), "g_point": g_point}
