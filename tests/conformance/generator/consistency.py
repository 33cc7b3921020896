"""NEES, and what its mean may do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, not_in_single, tolerance
from generator.draws import digits
from generator.ekf import trace_case
from generator.exact_arrays import big, doubles, inverse, wrap
from generator.exact_ekf import anchored_run
from generator.exact_quantiles import normal_quantile, quantile
from generator.random_answers import runs
from generator.world import drive
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "consistency", 17

NOTES = {
    "covariance-for-information": (
        "you multiply by the covariance where its inverse belongs",
        "e^T P e",
    ),
    "root": ("your value is the Mahalanobis distance; NEES is its square", "sqrt(e^T P^-1 e)"),
    "variances-only": (
        "you use the variances only and forget the correlations",
        "sum of e_i^2 / P_ii",
    ),
    "per-dof": ("you divide by the degrees of freedom", "e^T P^-1 e / d"),
    "start-not-carried": (
        "your start's covariance is added as it is; its heading turns the whole way since",
        "P0 + J P J^T",
    ),
    "own-not-turned": (
        "the covariance of your motion is added in the axes of the start; it has to be turned",
        "J_0 P0 J_0^T + P",
    ),
    "entries-inverted": ("you invert P by entries", "e^T (1/P_ij) e"),
    "heading-not-wrapped": ("your heading error leaves (-pi, pi]", "truth - estimate"),
    "estimate-minus-truth": ("your error has the other sign: estimate minus truth", "estimate - truth"),
    "one-run": (
        "your band is that of one run; the mean of M runs has M d degrees of freedom",
        "chi2_d quantiles",
    ),
    "not-divided": (
        "your band is that of the sum over runs; divide it by the number of runs",
        "chi2_(M d) quantiles",
    ),
    "whole-tails": (
        "you cut the whole of what is left at each end; a two-sided band cuts half at each",
        "chi2_(M d) at 1 - confidence and confidence, over M",
    ),
    "normal": (
        "your band takes the mean for normal; with few runs chi-squared is lopsided",
        "d -+ z sqrt(2 d/M)",
    ),
    "half-tail": (
        "your bound is the upper edge of the two-sided band",
        "chi2_(M d) at (1 + confidence)/2, over M",
    ),
    "uniform-noise": (
        "your noise is uniform where Gaussian is promised",
        "sigma sqrt(3) times uniform in (-1, 1): the same variance, E x^4 = 9/5 sigma^4",
    ),
    "gtpg": (
        "your predict computes G^T P G: its covariance does not fit its errors",
        "F^T P F + G cov_u G^T",
    ),
    "no-process-noise": ("your predict adds no noise: NEES is too large", "F P F^T"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of consistency."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _nees(topic, rng)
    _pose_errors(topic, rng)
    _bands(topic, rng)
    runs(topic)
    _anchored(topic, rng)
    return topic


# -- one value -------------------------------------------------------------------------------------


def _nees(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "inverse by elimination in 50 digits"
    rule = tolerance(1e-12, "condition of P, below 1e3, times a few eps")
    for flag, d in (("one", 1), ("pose", 3), ("rigid", 6), ("nine", 9)):
        cases = [_value(rng, _covariance(rng, d, 1e2)) for _ in range(15)]
        topic.group("consistency.nees", "eq-nees", oracle, rule, cases, flags=(flag,))
    cases = [_value(rng, _scaled(rng, _covariance(rng, 4, 1e2))) for _ in range(12)]
    reason = "the condition of the correlations counts, below 1e3; units are no matter"
    scaled = tolerance(1e-12, reason)
    topic.group("consistency.nees", "eq-nees", oracle, scaled, cases, flags=("mixed_units",))
    cases = [_value(rng, _covariance(rng, 3, 1e8)) for _ in range(10)]
    rule = not_in_single(tolerance(1e-6, "condition of P, 1e8, times eps and a margin of 40", float32=1.0))
    topic.group("consistency.nees", "eq-nees", oracle, rule, cases, flags=("ill_conditioned",))
    bad = [np.diag([1.0, -1.0]), np.ones((2, 2)), np.array([[1.0, 2.0], [2.0, 1.0]])]
    cases = [{"inputs": {"error": [1.0, 2.0], "P": P}, "expected": {}, "result": "invalid"} for P in bad]
    topic.group("consistency.nees", "eq-nees", "Sylvester's criterion", rule, cases, flags=("degenerate",))


def _covariance(rng: np.random.Generator, d: int, condition: float) -> Array:
    Q, _ = np.linalg.qr(rng.standard_normal((d, d)))
    P = Q @ np.diag(np.geomspace(1.0, 1.0 / condition, d)) @ Q.T
    return digits((P + P.T) / 2)


def _scaled(rng: np.random.Generator, P: Array) -> Array:
    scale = 10.0 ** rng.integers(-5, 4, len(P))
    return digits(P * np.outer(scale, scale))


def _value(rng: np.random.Generator, P: Array) -> dict[str, Any]:
    error = digits(np.linalg.cholesky(P) @ rng.standard_normal(len(P)), 6)
    e, C = big(error), big(P)
    right = e @ inverse(C) @ e
    wrong = {
        "covariance-for-information": e @ C @ e,
        "root": mpmath.sqrt(right),
        "variances-only": sum(e**2 / np.diag(C)),
        "per-dof": right / len(P),
        "entries-inverted": e @ (1 / C) @ e,
    }
    mistakes = {n: {"value": float(v)} for n, v in wrong.items() if abs(v - right) > mpf("1e-3") * right}
    case: dict[str, Any] = {"inputs": {"error": error, "P": P}, "expected": {"value": float(right)}}
    return {**case, "mistakes": mistakes} if mistakes else case


def _pose_errors(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-14, "a difference; 2 pi is rounded", absolute=2e-15)
    for flag, count in (("", 12), ("near_pi", 15)):
        cases = []
        for _ in range(count):
            truth = np.round([*rng.uniform(-9, 9, 2), rng.uniform(-1, 1)], 4)
            estimate = np.round(truth + rng.normal(0, 0.3, 3), 4)
            if flag:
                side = rng.choice([-1, 1])
                truth[2], estimate[2] = (
                    side * round(rng.uniform(2.9, 3.14), 4),
                    -side * round(rng.uniform(2.9, 3.14), 4),
                )
            cases.append(_error(truth, estimate))
        topic.group(
            "consistency.pose_error",
            "eq-nees",
            "definition, 50 digits",
            rule,
            cases,
            flags=flag,
        )


def _error(truth: Array, estimate: Array) -> dict[str, Any]:
    plain = big(truth) - big(estimate)
    right = plain.copy()
    right[2] = wrap(plain[2])
    mistakes = {"estimate-minus-truth": {"error": doubles(-right)}}
    if abs(plain[2]) > mpmath.pi:
        mistakes["heading-not-wrapped"] = {"error": doubles(plain)}
    inputs = {"truth": truth, "estimate": estimate}
    return {"inputs": inputs, "expected": {"error": doubles(right)}, "mistakes": mistakes}


# -- bands -----------------------------------------------------------------------------------------


def _bands(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "Newton's iteration on the incomplete gamma function, 50 digits"
    rule = tolerance(1e-10, "programs differ in their inverse of the incomplete gamma function", float32=1e-4)
    regimes: dict[str, Callable[[], tuple[int, int, float]]] = {
        "": lambda: (
            int(rng.integers(10, 101)),
            int(rng.choice([2, 3, 6])),
            float(rng.choice([0.9, 0.95, 0.99])),
        ),
        "few_runs": lambda: (
            int(rng.integers(1, 4)),
            int(rng.integers(1, 4)),
            float(rng.choice([0.9, 0.95, 0.99])),
        ),
        "many_runs": lambda: (int(rng.integers(300, 1001)), int(rng.choice([2, 3])), 0.95),
        "rare": lambda: (int(rng.integers(10, 101)), 3, 1.0 - 10.0 ** -float(rng.integers(4, 7))),
    }
    for flag, draw in regimes.items():
        rows = [(50, 3, 0.95), *(draw() for _ in range(11))] if not flag else [draw() for _ in range(10)]
        flags = (flag,) if flag else ()
        if flag == "rare":  # 1 - 1e-6 has but a digit of its complement in single precision
            rule["float32"]["asked"] = False
        topic.group("consistency.band", "eq-band", oracle, rule, [_band(*row) for row in rows], flags=flags)
        topic.group("consistency.bound", "eq-band", oracle, rule, [_bound(*row) for row in rows], flags=flags)
    bad = [(0, 3, 0.95), (10, 0, 0.95), (10, 3, 1.5), (10, 3, -0.1), (10, 3, 0.0), (10, 3, 1.0)]
    names = ("runs", "dof", "confidence")
    cases = [
        {"inputs": dict(zip(names, row, strict=True)), "expected": {}, "result": "invalid"} for row in bad
    ]
    topic.group("consistency.band", "eq-band", "definition", rule, cases, flags=("degenerate",))
    topic.group("consistency.bound", "eq-band", "definition", rule, cases, flags=("degenerate",))


def _band(runs: int, dof: int, confidence: float) -> dict[str, Any]:
    tail = (1 - mpf(confidence)) / 2
    spread = normal_quantile(1 - tail) * mpmath.sqrt(2 * mpf(dof) / runs)
    values = {
        "": (quantile(runs * dof, tail) / runs, quantile(runs * dof, 1 - tail) / runs),
        "one-run": (quantile(dof, tail), quantile(dof, 1 - tail)),
        "not-divided": (quantile(runs * dof, tail), quantile(runs * dof, 1 - tail)),
        "whole-tails": (quantile(runs * dof, 2 * tail) / runs, quantile(runs * dof, 1 - 2 * tail) / runs),
        "normal": (dof - spread, dof + spread),
    }
    return _edges(runs, dof, confidence, values, ("low", "high"))


def _bound(runs: int, dof: int, confidence: float) -> dict[str, Any]:
    p = mpf(confidence)
    values = {
        "": (quantile(runs * dof, p) / runs,),
        "one-run": (quantile(dof, p),),
        "not-divided": (quantile(runs * dof, p),),
        "half-tail": (quantile(runs * dof, (1 + p) / 2) / runs,),
    }
    return _edges(runs, dof, confidence, values, ("high",))


def _edges(
    runs: int, dof: int, confidence: float, values: dict[str, tuple[Any, ...]], outputs: tuple[str, ...]
) -> dict[str, Any]:
    answers = {n: dict(zip(outputs, map(float, v), strict=True)) for n, v in values.items()}
    right = answers.pop("")
    mistakes = {n: a for n, a in answers.items() if abs(a["high"] - right["high"]) > 1e-3}
    inputs = {"runs": runs, "dof": dof, "confidence": confidence}
    case: dict[str, Any] = {"inputs": inputs, "expected": right}
    return {**case, "mistakes": mistakes} if mistakes else case


def _anchored(topic: Topic, rng: np.random.Generator) -> None:
    """Runs in the frame of their start, whose uncertainty never meets a measurement."""
    rule = tolerance(1e-12, "20 steps of sums of 9 x 9 products, each rounded by eps: 1620 eps = 4e-13")
    mistakes = ["start-not-carried", "own-not-turned"]
    cases = [trace_case(drive(rng, n, 3, every), anchored_run, mistakes) for n, every in ((12, 1), (20, 5))]
    oracle = "straight-line filter in 50 digits, Jacobians by difference quotients"
    topic.group("consistency.anchored_trace", "eq-anchored", oracle, rule, cases)
