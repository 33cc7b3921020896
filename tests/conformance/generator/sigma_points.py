"""One step of a filter with sigma points, in 50 digits: the points, a prediction, an update."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import exact_ekf
from generator.building import Topic, tolerance
from generator.exact_arrays import Big, big, block_diagonal, doubles, from_matrix, inverse, stack, wrap
from generator.world import covariance

TOPIC, CHAPTER = "sigma_points", 15
ORACLE = "definition in 50 digits"
SPREADS = {"": (1.0, 2.0, 0.0), "spread": (0.5, 2.0, 1.0), "near": (0.1, 2.0, 0.0)}
"""alpha, beta, kappa."""

NOTES = {
    "rows-for-columns": (
        "you take the rows of the Cholesky factor; its columns are the directions",
        "x + L^T e_k",
    ),
    "beta-forgotten": (
        "your middle point has one weight for means and covariances: 1 - alpha^2 + beta is missing",
        "w_cov[0] = w_mean[0]",
    ),
    "not-spread": ("your points stand at one standard deviation: the root of n + lambda is missing", "x + L"),
    "angles-averaged": (
        "you average angles as numbers: across the seam the mean is far off; take differences from the first",
        "sum w theta",
    ),
    "noise-forgotten": ("your innovation's covariance has no sensor noise", "S without cov"),
    "bearing-not-wrapped": ("your innovation of the bearing is off by a turn", "b - h"),
    "control-noise-forgotten": ("your points leave out the noise of the control", "cov_u = 0"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    for flag, spread in SPREADS.items():
        rule = tolerance(2e-14, "a Cholesky factor of three rows, and one sum")
        cases = [_points(rng, n, spread) for n in (1, 2, 3, 5)]
        topic.group("sigma_points.points", "eq-sigma-points", ORACLE, rule, cases, flags=flag)
        rule = tolerance(
            1e-10, "weights up to n/alpha^2 = 500, numbers of 20 m with covariances of 0.01: 1e6 eps"
        )
        cases = [_prediction(rng, spread, h) for h in (0.4, -1.9, 3.14, -3.13)]
        topic.group("sigma_points.predict", "eq-sigma-moments", ORACLE, rule, cases, flags=flag)
        cases = [_update(rng, spread, behind) for behind in (0, 0, 1, -1)]
        topic.group("sigma_points.update", "eq-gain", ORACLE, rule, cases, flags=flag)
    return topic


def _named(spread: tuple[float, float, float]) -> dict[str, float]:
    return dict(zip(("alpha", "beta", "kappa"), spread, strict=True))


def points(mean: Big, cov: Big, spread: tuple[float, float, float], wrong: str = "") -> tuple[Big, Big, Big]:
    """Points, weights of means, weights of covariances."""
    alpha, beta, kappa = map(mpf, spread)
    n = len(mean)
    total = alpha**2 * (n + kappa)
    L = from_matrix(mpmath.cholesky(mpmath.matrix(cov.tolist())))
    L = (1 if wrong == "not-spread" else mpmath.sqrt(total)) * (L.T if wrong == "rows-for-columns" else L)
    rows = [mean, *(mean + L[:, k] for k in range(n)), *(mean - L[:, k] for k in range(n))]
    w = stack([1 - n / total] + [1 / (2 * total)] * (2 * n))
    c = w.copy()
    if wrong != "beta-forgotten":
        c[0] = c[0] + 1 - alpha**2 + beta
    return np.stack(rows), w, c


def _points(rng: np.random.Generator, n: int, spread: tuple[float, float, float]) -> dict[str, Any]:
    mean = np.round(rng.uniform(-3, 3, n), 3)
    cov = covariance(rng, np.round(rng.uniform(0.2, 1.5, n), 2))

    def answer(wrong: str = "") -> dict[str, Any]:
        found = points(big(mean), big(cov), spread, wrong)
        return dict(zip(("points", "w_mean", "w_cov"), map(doubles, found), strict=True))

    notes = [
        *(["rows-for-columns"] if n > 1 else []),
        *(["not-spread"] if spread[0] ** 2 * (n + spread[2]) != 1 else []),
        "beta-forgotten",
    ]
    inputs = {"mean": mean, "cov": cov, **_named(spread)}
    return {"inputs": inputs, "expected": answer(), "mistakes": {note: answer(note) for note in notes}}


def _mean(values: Big, w: Big, angle: int, wrong: str) -> tuple[Big, Big]:
    """Mean, and differences from it."""
    off = values - values[0]
    if wrong != "angles-averaged":
        off[:, angle] = [wrap(v) for v in off[:, angle]]
    step = w @ off
    return values[0] + step, off - step


def _prediction(
    rng: np.random.Generator, spread: tuple[float, float, float], heading: float
) -> dict[str, Any]:
    x = np.array([*np.round(rng.uniform(-20, 20, 2), 3), heading])
    P, cov_u = covariance(rng, np.array([0.2, 0.15, 0.06])), covariance(rng, np.array([0.3, 0.05]))
    control = np.round([rng.uniform(0.8, 4.0), rng.uniform(-0.6, 0.6)], 3)
    inputs = {"x": x, "P": P, "control": control, "cov_u": cov_u, "wheelbase": 1.7, "dt": 0.25}

    def answer(wrong: str = "") -> dict[str, Any]:
        noise = big(1e-30 * np.eye(2)) if wrong == "control-noise-forgotten" else big(cov_u)
        rows, w, c = points(stack([*big(x), *big(control)]), block_diagonal([big(P), noise]), spread, wrong)
        moved = [
            exact_ekf.wrapped(exact_ekf.moved(row[:3], exact_ekf.increment(row[3:], mpf(1.7), mpf(0.25))))
            for row in rows
        ]
        mean, off = _mean(np.stack(moved), w, 2, wrong)
        return {"x": doubles(exact_ekf.wrapped(mean)), "P": doubles((off.T * c) @ off)}

    right = answer()
    notes = ["beta-forgotten", "rows-for-columns", "control-noise-forgotten"]
    across = answer("angles-averaged")
    if abs(across["P"][2][2] - right["P"][2][2]) > 1e-3:
        notes.append("angles-averaged")
    return {
        "inputs": {**inputs, **_named(spread)},
        "expected": right,
        "mistakes": {note: answer(note) for note in notes},
    }


def _update(rng: np.random.Generator, spread: tuple[float, float, float], behind: int) -> dict[str, Any]:
    x = np.array([*np.round(rng.uniform(-20, 20, 2), 3), round(float(rng.uniform(-2.5, 2.5)), 3)])
    P, cov = covariance(rng, np.array([0.2, 0.15, 0.06])), covariance(rng, np.array([0.1, 0.03]))
    bearing = behind * 3.13 if behind else float(rng.uniform(-1.0, 1.0))
    r = float(rng.uniform(4.0, 9.0))
    landmark = np.round(x[:2] + r * np.array([np.cos(x[2] + bearing), np.sin(x[2] + bearing)]), 3)
    polar = np.array([round(r + 0.1, 3), -behind * 3.12 if behind else round(bearing + 0.02, 3)])
    inputs = {"x": x, "P": P, "landmark": landmark, "polar": polar, "cov": cov}

    def answer(wrong: str = "") -> dict[str, Any]:
        rows, w, c = points(big(x), big(P), spread, wrong)
        seen = []
        for row in rows:
            d = big(landmark) - row[:2]
            seen.append(stack([mpmath.sqrt(d @ d), wrap(mpmath.atan2(d[1], d[0]) - row[2])]))
        mean, off = _mean(np.stack(seen), w, 1, wrong)
        S = (off.T * c) @ off
        S = S if wrong == "noise-forgotten" else S + big(cov)
        K = ((rows - rows[0]).T * c) @ off @ inverse(S)
        nu = big(polar) - mean
        nu = nu if wrong == "bearing-not-wrapped" else stack([nu[0], wrap(nu[1])])
        return {"x": doubles(exact_ekf.wrapped(big(x) + K @ nu)), "P": doubles(big(P) - K @ S @ K.T)}

    notes = ["beta-forgotten", "rows-for-columns", "noise-forgotten"]
    right = answer()
    if behind:
        notes.append("bearing-not-wrapped")
    kept = {note: answer(note) for note in notes}
    across = answer("angles-averaged")
    if behind and np.abs(np.array(across["x"]) - right["x"]).max() > 1e-3:
        kept["angles-averaged"] = across
    return {"inputs": {**inputs, **_named(spread)}, "expected": right, "mistakes": kept}
