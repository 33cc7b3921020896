"""The pose of least reprojection error: Gauss-Newton on SE(3) to the end, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.exact import column, derivative, floats, matrix, vector
from generator.groups import SE3
from generator.se3 import case
from generator.views import in_camera, looking, pixel, sensor


def pose_case(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """Points around the origin, pixels half a pixel off, and a start some centimetres and degrees away."""
    params, X = sensor(rng), rng.uniform(-1.5, 1.5, (n, 3))
    direction = rng.standard_normal(3)
    truth = looking(rng, 6.0 * direction / np.linalg.norm(direction), np.zeros(3))
    k = vector(params)
    uv = np.array([floats(pixel(k, in_camera(truth, x))) for x in X]) + rng.normal(0, 0.5, (n, 2))
    start = np.array(floats(SE3.exp(vector(rng.normal(0, 0.05, 6))) * matrix(truth)))
    points = [mpmath.matrix([*vector(x), 1]) for x in X]
    flat = vector(uv)

    def residual(T: Any, xi: list[Any]) -> list[Any]:
        moved = SE3.exp(xi) * T
        seen = [moved * p for p in points]
        return [v for p in seen for v in pixel(k, [p[0], p[1], p[2]])]

    T, poses, zero = matrix(start), [], [mpf(0)] * 6
    for _ in range(30):
        J = derivative(lambda xi, T=T: residual(T, xi), zero)
        r = mpmath.matrix([a - b for a, b in zip(residual(T, zero), flat, strict=True)])
        step = column(mpmath.lu_solve(J.T * J, -(J.T * r)))
        T = SE3.exp(step) * T
        poses.append(T)
        if max(abs(v) for v in step) < mpf("1e-22"):
            break
    else:
        raise ArithmeticError("Gauss-Newton does not end")
    wrong = {
        "start-kept": {"pose": matrix(start)},
        "one-step": {"pose": poses[0]},
        "world-from-cam": {"pose": T**-1},
    }
    return case({"params": params, "X_world": X, "uv": uv, "start": start}, "pose", T, wrong)
