"""Tracking: one reweighted step of a pose, and where a camera that goes on is next, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import column, derivative, floats, matrix, vector
from generator.groups import SE3, log_rigid, motion, twist
from generator.se3 import case
from generator.views import in_camera, looking, pixel, sensor

TOPIC, CHAPTER = "tracking", 10

NOTES = {
    "scalar-constants": (
        "your scale and constant belong to scalars, 1.4826 and 4.6851; errors in the plane are norms",
        "1.4826 med |e|, c = 4.6851 sigma",
    ),
    "scalar-constant": (
        "your constant 4.6851 belongs to scalars; for norms it is 5.1230",
        "c = 4.6851 sigma",
    ),
    "uphill": (
        "your step goes uphill: measured minus predicted, with the Jacobian of predicted",
        "Exp(-mu) T",
    ),
    "levels-forgotten": ("your errors are not divided by the size of their level's pixel", "e for e / s"),
    "root-weight": ("your weights are the roots of Tukey's", "1 - x^2/c^2"),
    "least-squares": ("your weights are all 1", "w = 1"),
    "on-the-right": ("your step is applied on the right of the pose", "T Exp(mu)"),
    "no-floor": ("your scale may be as small as it likes; it is at least 0.4 pixels", "0.8493 med |e|"),
    "stands-still": ("your camera stands still", "T_now"),
    "decay-forgotten": ("your camera goes on without decay", "Exp(xi) T_now"),
    "velocity-on-the-right": ("your velocity is applied on the right of the pose", "T_now Exp(d xi)"),
    "backwards": ("your velocity leads back", "Exp(-d xi) T_now"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of tracking."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    rule = tolerance(
        1e-8, "5.1230 for 5.122986 moves a weight by 1e-6 and a step of 1e-3 by 1e-9", float32=1e-4
    )
    oracle = "normal equations from differences of 50-digit numbers"
    for flag, noise, wrong in (("noisy", 1.0, 0), ("wrong_matches", 1.0, 4), ("floor", 0.15, 2)):
        cases = [_step(rng, noise, wrong) for _ in range(4)]
        topic.group("tracking.tukey_step", "eq-track-normal", oracle, rule, cases, flags=(flag,))
    fine = tolerance(1e-12, "a logarithm and an exponential: some hundred operations")
    cases = [_goes_on(rng, decay) for decay in (1.0, 0.9, 0.5, 0.0)]
    topic.group("tracking.predict", "eq-decaying-velocity", "power series, 50 digits", fine, cases)
    return topic


def _scene(rng: np.random.Generator, noise: float, wrong: int) -> dict[str, Any]:
    """Fifteen points around the origin, pixels with noise of their level, some far off, a start near by."""
    n, params = 15, sensor(rng)
    X = rng.uniform(-1.5, 1.5, (n, 3))
    direction = rng.standard_normal(3)
    truth = looking(rng, 6.0 * direction / np.linalg.norm(direction), np.zeros(3))
    size = 2.0 ** rng.integers(0, 4, n)
    uv = np.array([floats(pixel(vector(params), in_camera(truth, x))) for x in X])
    uv += noise * size[:, None] * rng.standard_normal((n, 2))
    uv[:wrong] += size[:wrong, None] * rng.uniform(10, 30, (wrong, 2))
    step = rng.normal(0, 3e-4 * noise, 6)
    start = np.array(floats(SE3.exp(vector(step)) * matrix(truth)))
    return {"params": params, "X_world": X, "uv": uv, "size": size, "start": start}


def _step(rng: np.random.Generator, noise: float, wrong: int) -> dict[str, Any]:
    given = _scene(rng, noise, wrong)
    T, points = matrix(given["start"]), [mpmath.matrix([*vector(x), 1]) for x in given["X_world"]]
    k, flat, size = vector(given["params"]), vector(given["uv"]), vector(given["size"])

    def residual(xi: list[Any]) -> list[Any]:
        seen = [SE3.exp(xi) * T * p for p in points]
        return [
            a - b for a, b in zip((v for p in seen for v in pixel(k, [p[0], p[1], p[2]])), flat, strict=True)
        ]

    zero = [mpf(0)] * 6
    r, J = residual(zero), derivative(residual, zero)
    mu = _solved(r, J, size)
    moved = SE3.exp(mu) * T
    wrongs = {
        "scalar-constants": {"scale": 1 / mpf("0.674489750196081743"), "c": mpf("4.685065")},
        "scalar-constant": {"c": mpf("4.685065")},
        "levels-forgotten": {"divide": False},
        "root-weight": {"power": 1},
        "least-squares": {"power": 0},
        "no-floor": {"least": mpf(0)},
    }
    answers = {name: SE3.exp(_solved(r, J, size, **change)) * T for name, change in wrongs.items()}
    answers["uphill"] = SE3.exp([-v for v in mu]) * T
    answers["on-the-right"] = T * SE3.exp(mu)
    return case(given, "pose", moved, _distinct("pose", moved, answers))


def _solved(
    r: list[Any],
    J: Any,
    size: list[Any],
    *,
    scale: Any = None,
    c: Any = None,
    divide: bool = True,
    power: int = 2,
    least: Any = None,
) -> list[Any]:
    """Step of the normal equations; by default right."""
    s = size if divide else [mpf(1)] * len(size)
    x = [mpmath.hypot(r[2 * j], r[2 * j + 1]) / s[j] for j in range(len(s))]
    factor = 1 / mpmath.sqrt(2 * mpmath.log(2)) if scale is None else scale
    sigma = max(factor * sorted(x)[len(x) // 2], mpf("0.4") if least is None else least)
    end = (mpf("5.122986089952371") if c is None else c) * sigma
    H, g = mpmath.zeros(6), mpmath.zeros(6, 1)
    for j, x_j in enumerate(x):
        w = (1 - (x_j / end) ** 2) ** power if x_j < end or power == 0 else mpf(0)
        rows = J[2 * j : 2 * j + 2, :] / s[j]
        e = mpmath.matrix(r[2 * j : 2 * j + 2]) / s[j]
        H += w * rows.T * rows
        g += w * rows.T * e
    return column(mpmath.lu_solve(H, -g))


def _goes_on(rng: np.random.Generator, decay: float) -> dict[str, Any]:
    """Two poses some degrees and decimetres apart."""
    before = motion(rng)
    step = 0.1 * twist(rng)
    now = np.array(floats(SE3.exp(vector(step)) * matrix(before)))
    moved = matrix(now) * matrix(before) ** -1
    xi = log_rigid(moved, step[3:])
    there = {
        name: SE3.exp([factor * v for v in xi])
        for name, factor in (("right", mpf(decay)), ("decay-forgotten", mpf(1)), ("backwards", -mpf(decay)))
    }
    answers = {name: there[name] * matrix(now) for name in ("decay-forgotten", "backwards")}
    answers["stands-still"] = matrix(now)
    answers["velocity-on-the-right"] = matrix(now) * there["right"]
    right = there["right"] * matrix(now)
    given = {"T_before": before, "T_now": now, "decay": decay}
    return case(given, "pose", right, _distinct("pose", right, answers))


def _distinct(name: str, right: Any, answers: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Mistakes whose answers differ from the right one and from each other."""
    kept: dict[str, Any] = {}
    for note, value in answers.items():
        if all(mpmath.mnorm(value - other, mpmath.inf) > 1e-5 for other in (right, *kept.values())):
            kept[note] = value
    return {note: {name: value} for note, value in kept.items()}
