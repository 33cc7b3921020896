"""Camera models in fifty digits, each written from its definition; derivatives are central differences.

A lens maps a point of the camera's frame to a distorted position (xd, yd); the pixel is
(fx xd + cx, fy yd + cy).  All intrinsics come in one list, fx fy cx cy first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.draws import digits, log_uniform
from generator.exact import Matrix, derivative, vector
from vslam_ref.arrays import Array

Vector = list[Any]
Lens = Callable[[Sequence[Any], Sequence[Any]], Vector]


def pinhole(k: Sequence[Any], X: Sequence[Any]) -> Vector:
    """(x/z, y/z)."""
    return [X[0] / X[2], X[1] / X[2]]


def fov(k: Sequence[Any], X: Sequence[Any]) -> Vector:
    """Radius r = tan(angle) appears at arctan(2 r tan(omega/2)) / omega."""
    x, y = pinhole(k, X)
    r, omega = mpmath.sqrt(x * x + y * y), k[0]
    if omega == 0:
        return [x, y]
    if r == 0:
        return [mpf(0), mpf(0)]
    factor = mpmath.atan(2 * r * mpmath.tan(omega / 2)) / (r * omega)
    return [factor * x, factor * y]


def rational(k: Sequence[Any], X: Sequence[Any]) -> Vector:
    """OpenCV's k1 k2 p1 p2 k3, and k4 k5 k6 of the denominator."""
    x, y = pinhole(k, X)
    k1, k2, p1, p2, k3, k4, k5, k6 = [*k, *[mpf(0)] * (8 - len(k))]
    q = x * x + y * y
    G = (1 + k1 * q + k2 * q**2 + k3 * q**3) / (1 + k4 * q + k5 * q**2 + k6 * q**3)
    return [
        G * x + 2 * p1 * x * y + p2 * (q + 2 * x * x),
        G * y + p1 * (q + 2 * y * y) + 2 * p2 * x * y,
    ]


def fisheye(k: Sequence[Any], X: Sequence[Any]) -> Vector:
    """The angle theta off the axis appears at the radius theta + k1 theta^3 + ... + k4 theta^9."""
    rho = mpmath.sqrt(X[0] ** 2 + X[1] ** 2)
    if rho == 0:
        return [mpf(0), mpf(0)]
    theta = mpmath.atan2(rho, X[2])
    d = theta * (1 + sum(c * theta ** (2 * n + 2) for n, c in enumerate(k)))
    return [d * X[0] / rho, d * X[1] / rho]


LENSES: dict[str, Lens] = {
    "pinhole": pinhole,
    "fov": fov,
    "radtan": rational,
    "rational": rational,
    "fisheye": fisheye,
}
EQUATIONS = {
    "pinhole": "eq-a1-2",
    "fov": "eq-a2-2",
    "radtan": "eq-radtan",
    "rational": "eq-radtan",
    "fisheye": "eq-fisheye",
}


def project(model: str, params: Sequence[Any], X: Sequence[Any], lens: Lens | None = None) -> Vector:
    """Pixel of a point in the camera's frame."""
    x, y = (lens or LENSES[model])(params[4:], X)
    return [params[0] * x + params[2], params[1] * y + params[3]]


def unproject(model: str, params: Sequence[Any], uv: Sequence[Any], start: Array) -> Vector:
    """Unit bearing with this pixel, by Newton's iteration in the plane z = 1 or -1 from a point nearby."""
    depth = mpf(1) if start[2] > 0 else mpf(-1)
    x = [mpf(start[0] / abs(start[2])), mpf(start[1] / abs(start[2]))]

    def miss(at: Sequence[Any]) -> Vector:
        return [a - b for a, b in zip(project(model, params, [*at, depth]), uv, strict=True)]

    for _ in range(12):
        step = mpmath.lu_solve(derivative(miss, x), -mpmath.matrix(miss(x)))
        x = [x[0] + step[0], x[1] + step[1]]
    assert mpmath.norm(mpmath.matrix(miss(x))) < mpf(10) ** -35
    length = mpmath.sqrt(x[0] ** 2 + x[1] ** 2 + 1)
    return [x[0] / length, x[1] / length, depth / length]


def jacobian_point(model: str, params: Sequence[Any], X: Sequence[Any]) -> Matrix:
    """(2, 3)."""
    return derivative(lambda x: project(model, params, x), X)


def jacobian_intrinsics(model: str, params: Sequence[Any], X: Sequence[Any]) -> Matrix:
    """(2, n)."""
    return derivative(lambda k: project(model, k, X), params)


def camera(rng: np.random.Generator, model: str) -> Array:
    """Intrinsics of a plausible camera."""
    f = rng.uniform(250.0, 600.0)
    sensor = [f, f * rng.uniform(0.9, 1.1), rng.uniform(300.0, 400.0), rng.uniform(220.0, 280.0)]
    radial = [rng.uniform(-0.35, -0.15), rng.uniform(0.02, 0.12)]
    tangential = list(rng.uniform(-3e-3, 3e-3, 2))
    lens: dict[str, list[float]] = {
        "pinhole": [],
        "fov": [rng.uniform(0.5, 1.2)],
        "radtan": [*radial, *tangential, rng.uniform(-0.01, 0.01)],
        "rational": [*radial, *tangential, 0.01, rng.uniform(0.02, 0.1), rng.uniform(-0.02, 0.02), 0.003],
        "fisheye": [rng.uniform(-0.03, 0.03), rng.uniform(-0.01, 0.01), 0.002, -0.0005],
    }
    return np.array([*sensor, *lens[model]])


def ray(rng: np.random.Generator, low: float, high: float) -> Array:
    """Point at depth 1 to 6 whose ray has a tangent to the axis in a range, log-uniform."""
    turn, depth = rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 6.0)
    r = log_uniform(rng, low, high)
    return digits([r * np.cos(turn) * depth, r * np.sin(turn) * depth, depth])


def as_params(values: Array) -> Vector:
    """Exact numbers of intrinsics."""
    return vector(values)
