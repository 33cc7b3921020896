"""Bundle adjustment's formulas: residual, cost, and the elimination of points, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, not_in_single, tolerance
from generator.draws import digits
from generator.exact import column, floats, matrix, vector
from generator.groups import motion
from generator.lenses import LENSES, camera, project, ray
from generator.normal import normal_case
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "bundle", 6

NOTES = {
    "measured-minus-predicted": ("your residual is measured minus predicted", "u - h(C, X)"),
    "pose-inverted": ("you read the pose as T_world_cam", "h(R^T (X - t))"),
    "squared-twice": (
        "you square e^T cov^-1 e once more: A1.4 calls it a norm as printed, but it is a square already",
        "1/2 sum (e^T cov^-1 e)^2",
    ),
    "norms-not-squared": (
        "you add up norms; their squares are wanted",
        "1/2 sum (e^T cov^-1 e)^(1/2)",
    ),
    "not-halved": ("your cost is the whole sum; it is half of it", "sum e^T cov^-1 e"),
    "covariance-not-inverted": ("you weigh with the covariance; its inverse is wanted", "1/2 sum e^T cov e"),
    "diagonal-only": ("you leave out the correlation of u and v", "1/2 sum e_u^2/s_uu + e_v^2/s_vv"),
    "one-covariance": (
        "you weigh all with one covariance: each observation has its own (A2.9 as printed lost the index i)",
        "1/2 sum e^T cov_0^-1 e",
    ),
    "covariance-ignored": ("your cost ignores the covariances", "1/2 sum e^T e"),
    "right-perturbation": ("your pose is perturbed on the right, T Exp(xi)", "M^T B M with M = Ad(T)"),
    "gradient-sign": (
        "your gradients have the wrong sign: residuals are predicted minus measured",
        "-J^T cov^-1 r",
    ),
    "schur-sign": ("your Schur complement adds where it must subtract", "B + W C^-1 W^T"),
    "rhs-sign": ("the right side has the wrong sign of its second part", "-g_view - W C^-1 g_point"),
    "c-not-inverted": ("you multiply by C; its inverse is wanted", "B - W C W^T"),
    "element-wise": (
        "you invert C entry by entry: * and / between arrays where matrices are meant",
        "B - W (1/C) W^T",
    ),
    "points-not-pulled": ("your points step as if the views stood still", "-C^-1 g_point"),
    "pulled-the-wrong-way": ("the views' step enters with the wrong sign", "-C^-1 (g_point - W^T step)"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    reason = "a pixel of some hundreds, rounded a few times, less another: the residual keeps what is left"
    rule = tolerance(0.0, reason, absolute=2e-12)
    rule["float32"]["absolute"] = 2e-3
    for model in LENSES:
        cases = [_residual(rng, model) for _ in range(5)]
        oracle = "the model's definition, 50 digits"
        topic.group("bundle.residual", "eq-ba-residual", oracle, rule, cases, flags=(model,))
    reason = "residuals of a few pixels, from pixels of some hundreds: 500 eps, twice for the square"
    fine = tolerance(1e-12, reason, float32=1e-2)
    for model in ("pinhole", "fov", "radtan"):
        cases = [_cost(rng, model) for _ in range(6)]
        oracle = "definition of A1.4, 50 digits"
        topic.group("bundle.cost", "eq-a1-4", oracle, fine, cases, flags=(model,))
    for flag, condition in (("generic", 10.0), ("ill_conditioned", 1e6)):
        flags = () if flag == "generic" else (flag,)
        reason = f"condition of C, at most {condition:g}, times eps and some ten operations"
        rule = tolerance(1e-14 * condition * 5, reason, float32=1e-2)
        rule = not_in_single(rule) if condition > 1e5 else rule
        some = [_blocks(rng, condition, views) for views in (1, 1, 1, 1, 1, 1, 2, 2)]
        oracle = "block elimination in 50 digits"
        topic.group("bundle.schur", "eq-schur", oracle, rule, [_schur(*s) for s in some], flags=flags)
        cases = [_back(rng, *s) for s in some]
        topic.group("bundle.back_substitute", "eq-back-substitution", oracle, rule, cases, flags=flags)
    blocks = [
        (model, normal_case(rng, model))
        for model in ("pinhole", "radtan", "fisheye", "fov")
        for _ in range(3)
    ]
    reason = "sums of products of Jacobians and residuals, the latter from pixels of some hundreds"
    rule = tolerance(1e-11, reason, float32=1e-2)
    oracle = "central differences of the definition, 50 digits"
    for model in ("pinhole", "radtan", "fisheye", "fov"):
        cases = [case for name, case in blocks if name == model]
        topic.group("bundle.normal_equations", "eq-ba-blocks", oracle, rule, cases, flags=(model,))
    _sizes(topic, rng)
    return topic


def _sizes(topic: Topic, rng: np.random.Generator) -> None:
    """Views and points in every number: what is right in the first two blocks only is found out."""
    reason = "condition of C, at most 10, times eps and some ten operations for each point"
    rule, oracle = tolerance(2e-12, reason, float32=1e-2), "block elimination in 50 digits"
    for views, points in ((1, 1), (1, 3), (2, 5), (3, 1), (3, 3), (4, 2)):
        blocks = [digits(v) for v in _blocks(rng, 10.0, views, points)]
        schur, back = _schur(*blocks), _back(rng, *blocks)
        for name, equation, case in (
            ("schur", "eq-schur", schur),
            ("back_substitute", "eq-back-substitution", back),
        ):
            del case["mistakes"]
            topic.group(f"bundle.{name}", equation, oracle, rule, [case], flags=("any_size",))
    reason = "sums of products of Jacobians and residuals, the latter from pixels of some hundreds"
    rule, oracle = (
        tolerance(1e-11, reason, float32=1e-2),
        "central differences of the definition, 50 digits",
    )
    cases = [normal_case(rng, model, n) for model, n in (("pinhole", 1), ("pinhole", 3), ("radtan", 5))]
    topic.group("bundle.normal_equations", "eq-ba-blocks", oracle, rule, cases, flags=("any_size",))


def _seen(model: str, k: list[Any], T: Any, X: Any) -> list[Any]:
    point = T * mpmath.matrix([*vector(X), 1])
    return project(model, k, [point[0], point[1], point[2]])


def _place(pose: Array, X_cam: Array) -> Array:
    return np.array(floats(list(matrix(pose) ** -1 * mpmath.matrix([*vector(X_cam), 1]))))[:3]


def _residual(rng: np.random.Generator, model: str) -> dict[str, Any]:
    params, pose = camera(rng, model), motion(rng)
    X = _place(pose, ray(rng, 0.05, 0.6))
    k, T = vector(params), matrix(pose)
    h = _seen(model, k, T, X)
    uv = np.array(floats(h)) + rng.normal(0, 3.0, 2)
    right = [a - mpf(b) for a, b in zip(h, uv, strict=True)]
    wrong = {"measured-minus-predicted": [-v for v in right]}
    back = _seen(model, k, T**-1, X)
    point = T**-1 * mpmath.matrix([*vector(X), 1])
    if point[2] > 0.5 and max(abs(v) for v in back) < 2000:
        wrong["pose-inverted"] = [a - mpf(b) for a, b in zip(back, uv, strict=True)]
    inputs = {"model": model, "params": params, "pose": pose, "X_world": X, "uv": uv}
    mistakes = {note: {"r": floats(v)} for note, v in wrong.items()}
    return {"inputs": inputs, "expected": {"r": floats(right)}, "mistakes": mistakes}


def _cost(rng: np.random.Generator, model: str) -> dict[str, Any]:
    n = int(rng.integers(3, 6))
    params, pose = camera(rng, model), motion(rng)
    X = np.stack([_place(pose, ray(rng, 0.05, 0.5)) for _ in range(n)])
    k, T = vector(params), matrix(pose)
    exact = [_seen(model, k, T, x) for x in X]
    uv = np.array(floats(exact)) + rng.normal(0, 2.0, (n, 2))
    half = rng.normal(0, 1.0, (n, 2, 2)) + 1.5 * np.eye(2)
    cov = half @ np.swapaxes(half, 1, 2)
    cov = 0.5 * (cov + np.swapaxes(cov, 1, 2))
    errors = [
        mpmath.matrix([a - mpf(b) for a, b in zip(h, row, strict=True)])
        for h, row in zip(exact, uv, strict=True)
    ]
    covs = [matrix(c) for c in cov]
    squares = [(e.T * C**-1 * e)[0] for e, C in zip(errors, covs, strict=True)]
    right = sum(squares) / 2
    wrong = {
        "squared-twice": sum(s * s for s in squares) / 2,
        "norms-not-squared": sum(mpmath.sqrt(s) for s in squares) / 2,
        "not-halved": sum(squares),
        "covariance-not-inverted": sum((e.T * C * e)[0] for e, C in zip(errors, covs, strict=True)) / 2,
        "diagonal-only": sum(e[i] ** 2 / C[i, i] for e, C in zip(errors, covs, strict=True) for i in range(2))
        / 2,
        "one-covariance": sum((e.T * covs[0] ** -1 * e)[0] for e in errors) / 2,
        "covariance-ignored": sum((e.T * e)[0] for e in errors) / 2,
    }
    inputs = {"model": model, "params": params, "pose": pose, "X_world": X, "uv": uv, "cov": cov}
    mistakes = {note: {"value": float(v)} for note, v in wrong.items()}
    return {"inputs": inputs, "expected": {"value": float(right)}, "mistakes": mistakes}


def _positive(rng: np.random.Generator, n: int, condition: float) -> Array:
    Q = np.linalg.qr(rng.standard_normal((n, n)))[0]
    M = Q * np.geomspace(condition, 1.0, n) @ Q.T
    return np.asarray(0.5 * (M + M.T))


def _blocks(rng: np.random.Generator, condition: float, views: int, points: int = 2) -> tuple[Array, ...]:
    """B, W, C, g_view, g_point; C is a little stiffer than what W takes off B."""
    D = 6 * views
    B = np.zeros((D, D))
    for v in range(views):
        B[6 * v : 6 * v + 6, 6 * v : 6 * v + 6] = _positive(rng, 6, 5.0) + 10.0 * np.eye(6)
    C = np.stack([_positive(rng, 3, condition) for _ in range(points)])
    W = rng.standard_normal((D, 3 * points))
    return B, W, C, rng.standard_normal(D), rng.standard_normal(3 * points)


def _full(C: Array) -> Any:
    """Block diagonal matrix of the points."""
    big = mpmath.zeros(3 * len(C), 3 * len(C))
    for n, block in enumerate(C):
        big[3 * n : 3 * n + 3, 3 * n : 3 * n + 3] = matrix(block)
    return big


def _reciprocal(C: Array) -> Any:
    """Inverse entry by entry, inside the blocks."""
    big = mpmath.zeros(3 * len(C), 3 * len(C))
    for n, block in enumerate(C):
        for i in range(3):
            for j in range(3):
                big[3 * n + i, 3 * n + j] = 1 / mpf(block[i, j])
    return big


def _schur(B: Array, W: Array, C: Array, g_view: Array, g_point: Array) -> dict[str, Any]:
    Bm, Wm, Cm = matrix(B), matrix(W), _full(C)
    a, b = mpmath.matrix(vector(g_view)), mpmath.matrix(vector(g_point))
    inv = Cm**-1
    S, rhs = Bm - Wm * inv * Wm.T, -a + Wm * inv * b
    other = _reciprocal(C)
    wrong = {
        "schur-sign": (Bm + Wm * inv * Wm.T, rhs),
        "rhs-sign": (S, -a - Wm * inv * b),
        "c-not-inverted": (Bm - Wm * Cm * Wm.T, -a + Wm * Cm * b),
        "element-wise": (Bm - Wm * other * Wm.T, -a + Wm * other * b),
    }
    inputs = {"B": B, "W": W, "C": C, "g_view": g_view, "g_point": g_point}
    kept = wrong if len(B) == 6 else {note: wrong[note] for note in ("schur-sign", "rhs-sign")}
    mistakes = {note: {"S": floats(s), "rhs": floats(column(r))} for note, (s, r) in kept.items()}
    return {"inputs": inputs, "expected": {"S": floats(S), "rhs": floats(column(rhs))}, "mistakes": mistakes}


def _back(
    rng: np.random.Generator, B: Array, W: Array, C: Array, g_view: Array, g_point: Array
) -> dict[str, Any]:
    step = rng.standard_normal(len(B))
    Wm, inv = matrix(W), _full(C) ** -1
    b, d = mpmath.matrix(vector(g_point)), mpmath.matrix(vector(step))
    wrong = {
        "points-not-pulled": -(inv * b),
        "pulled-the-wrong-way": -(inv * (b - Wm.T * d)),
        "element-wise": -(_reciprocal(C) * (b + Wm.T * d)),
    }
    mistakes = {note: {"point_step": floats(column(v))} for note, v in wrong.items()}
    right = floats(column(-(inv * (b + Wm.T * d))))
    inputs = {"W": W, "C": C, "g_point": g_point, "view_step": step}
    return {"inputs": inputs, "expected": {"point_step": right}, "mistakes": mistakes}
