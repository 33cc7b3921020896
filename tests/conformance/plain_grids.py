"""NEES, bands, log odds, two maps and rays as a program would write them, and their mistakes."""

from __future__ import annotations

from fractions import Fraction
from math import floor
from typing import Any

import numpy as np
from plain_filters import Answer, arrays
from plain_filters import predict as ekf_predict
from scipy.stats import chi2, norm

# -- chapter 17 --------------------------------------------------------------------------------------


def nees(error: Any, P: Any, wrong: str = "") -> Answer:
    e, P = arrays(error, P)
    np.linalg.cholesky(P)  # fails where P is not positive definite
    right = float(e @ np.linalg.solve(P, e))
    return {
        "value": {
            "covariance-for-information": float(e @ P @ e),
            "root": abs(right) ** 0.5,
            "variances-only": float(np.sum(e**2 / np.diag(P))),
            "per-dof": right / len(e),
            "entries-inverted": float(e @ (1 / P) @ e) if wrong == "entries-inverted" else 0.0,
        }.get(wrong, right)
    }


def pose_error(truth: Any, estimate: Any, wrong: str = "") -> Answer:
    t, e = arrays(truth, estimate)
    d = e - t if wrong == "estimate-minus-truth" else t - e
    if wrong != "heading-not-wrapped":
        d[2] = np.arctan2(np.sin(d[2]), np.cos(d[2]))
    return {"error": d}


def band(runs: int, dof: int, confidence: float, wrong: str = "") -> Answer:
    if runs < 1 or dof < 1 or not 0 < confidence < 1:
        raise ValueError("no band")
    tail, n = (1 - confidence) / 2, runs
    if wrong == "whole-tails":
        tail = 1 - confidence
    if wrong == "normal":
        half = norm.isf(tail) * (2 * dof / runs) ** 0.5
        return {"low": dof - half, "high": dof + half}
    if wrong == "one-run":
        n = 1
    scale = 1 if wrong == "not-divided" else n
    return {"low": chi2.ppf(tail, n * dof) / scale, "high": chi2.isf(tail, n * dof) / scale}


def bound(runs: int, dof: int, confidence: float, wrong: str = "") -> Answer:
    if runs < 1 or dof < 1 or not 0 < confidence < 1:
        raise ValueError("no bound")
    n = 1 if wrong == "one-run" else runs
    tail = (1 - confidence) / (2 if wrong == "half-tail" else 1)
    return {"high": chi2.isf(tail, n * dof) / (1 if wrong == "not-divided" else n)}


def runs(
    N: int, x: Any, P: Any, control: Any, cov_u: Any, wheelbase: float, dt: float, wrong: str = ""
) -> Answer:
    """Both covariances are diagonal in the vectors."""
    rng = np.random.default_rng(17)
    x, P, control, cov_u = arrays(x, P, control, cov_u)

    def draw(n: int) -> Any:
        if wrong == "uniform-noise":
            return rng.uniform(-(3**0.5), 3**0.5, (N, n))
        return rng.standard_normal((N, n))

    start, u = x + draw(3) * np.diag(P) ** 0.5, control + draw(2) * np.diag(cov_u) ** 0.5
    ds = u[:, 0] * dt
    turn = ds * np.tan(u[:, 1]) / wheelbase
    truth = start + np.column_stack([ds * np.cos(start[:, 2]), ds * np.sin(start[:, 2]), turn])
    mean, cov = ekf_predict(x, P, control, cov_u, wheelbase, dt, wrong).values()
    e = truth - mean
    return {"nees": np.einsum("ni,ij,nj->n", e, np.linalg.inv(cov), e)}


# -- chapter 19 --------------------------------------------------------------------------------------


def log_odds(probability: Any, wrong: str = "") -> Answer:
    p = float(probability)
    if not 0 < p < 1:
        raise ValueError("no probability")
    right = 2 * np.arctanh(2 * p - 1) if 0.3 < p < 0.7 else np.log(p / (1 - p))
    wrongs = {"odds": p / (1 - p), "log-of-p": np.log(p)}
    wrongs |= {"base-ten": np.log10(p / (1 - p)), "base-two": np.log2(p / (1 - p))}
    return {"value": float(wrongs.get(wrong, right))}


def probability(log_odds: float, wrong: str = "") -> Answer:
    with np.errstate(over="ignore", invalid="ignore"):
        L = np.float64(-log_odds if wrong == "free-for-occupied" else log_odds)
        value = np.exp(L) / (1 + np.exp(L)) if wrong == "overflow" or L < 0 else 1 / (1 + np.exp(-L))
    return {"value": "nan" if np.isnan(value) else float(value)}


def logit(p: float) -> float:
    return float(np.log(p / (1 - p)))


def grid_update(prior: float, measured: float, wrong: str = "") -> Answer:
    p, q = prior, measured
    wrongs = {
        "prior-counted-twice": 2 * logit(p) + logit(q),
        "probabilities-multiplied": logit(p * q),
        "probabilities-averaged": logit((p + q) / 2),
        "memory-lost": logit(q),
    }
    return {"log_odds": wrongs.get(wrong, logit(p) + logit(q))}


def follow(start: float, evidence: Any, wrong: str = "") -> Answer:
    now, path = start, []
    for e in evidence:
        table = e + now if wrong == "recursion-printed" else e
        now = table + (0 if wrong == "memory-lost" else now)
        path.append(now)
    return {"log_odds": path}


def static_dynamic(
    s: float,
    d: float,
    observation: str,
    table: Any,
    d_memory: str,
    d_high_where: str,
    most: Any,
    wrong: str = "",
) -> Answer:
    def state(value: float) -> str:
        return "occupied" if value > np.log(9) else "free" if value < -np.log(9) else "unknown"

    def entries(of: str) -> tuple[str, str]:
        high_where = d_high_where
        if wrong == "d-high-elsewhere":
            high_where = "unknown" if d_high_where == "free" else "free"
        if observation == "miss":
            return "s_miss", "d_miss"
        low = of == "free" and wrong != "s-ignores-state"
        return "s_low" if low else "s_high", "d_high" if of == high_where else "d_low"

    of_s, of_d = entries(state(s))
    memory = {"d-remembers": "formula", "d-forgets": "text"}.get(wrong, d_memory)
    new_s, new_d = s + logit(table[of_s]), (d if memory == "formula" else 0.0) + logit(table[of_d])
    if wrong != "not-bounded":
        new_s, new_d = (
            float(np.clip(value, -logit(most[key]), logit(most[key])))
            for value, key in ((new_s, "s"), (new_d, "d"))
        )
    return {"s": new_s, "d": new_d}


def recursion(table: float, transition: float, prediction: float, wrong: str = "") -> Answer:
    sign = 1 if wrong == "transition-added" else -1
    return {"log_odds": table + sign * transition + (0 if wrong == "memory-lost" else prediction)}


def explained(s_around: Any, d: float, table: Any, most: Any, reach: int, wrong: str = "") -> Answer:
    beside = False
    for i in range(5):
        for j in range(5):
            away = abs(i - 2) + abs(j - 2) if wrong == "no-diagonals" else max(abs(i - 2), abs(j - 2))
            beside |= away <= reach and s_around[i][j] > np.log(9) and wrong != "not-explained"
    s = s_around[2][2]
    free = s < -np.log(9) and not beside
    s, d = s + logit(table["s_low" if free else "s_high"]), d + logit(table["d_high" if free else "d_low"])
    limits = logit(most["s"]), logit(most["d"])
    return {"s": float(np.clip(s, -limits[0], limits[0])), "d": float(np.clip(d, -limits[1], limits[1]))}


def history(
    times: Any, observations: Any, d_lifetime: float, settle_seconds: float, hit_gap: float, most: Any,
    wrong: str = "", **rules: Any,
) -> Answer:  # fmt: skip
    s = d = 0.0
    looked, stay, last_hit, out = -np.inf, -1.0, -np.inf, []
    for now, what in zip(times, observations, strict=True):
        if now - looked > d_lifetime and wrong != "d-never-stale":
            d = 0.0
        if what == "hit":
            there = 0.0 if stay < 0 else stay + now - looked
            if stay >= 0 and now - looked > hit_gap and wrong != "unseen-time-counts":
                there = stay
            stay, last_hit = there, now
            if s < -np.log(9) and stay >= settle_seconds and wrong != "never-settles":
                s = 0.0
        elif stay >= 0:
            left = now - last_hit > hit_gap and wrong != "stay-never-ends"
            stay = -1.0 if left else stay + now - looked
        s, d = static_dynamic(s, d, what, most=most, **rules).values()
        looked = now
        out.append((s, d))
    return {"s": [a for a, _ in out], "d": [b for _, b in out]}


def ray_cells(start: Any, end: Any, wrong: str = "") -> Answer:
    """Clip the segment with every cell of its bounding box."""
    a, b = [Fraction(v) for v in start], [Fraction(v) for v in end]
    if wrong == "bresenham":
        return {"cells": _bresenham(start, end)}
    if a == b:
        return {"cells": [[floor(a[0]), floor(a[1])]]}
    found = []
    for i in range(floor(min(a[0], b[0])), floor(max(a[0], b[0])) + 1):
        for j in range(floor(min(a[1], b[1])), floor(max(a[1], b[1])) + 1):
            spans = [_inside(a[k], b[k], cell) for k, cell in enumerate((i, j))]
            low, high = max(Fraction(0), *(t for t, _ in spans)), min(Fraction(1), *(t for _, t in spans))
            if low < high or (wrong == "corners-count" and low == high and 0 < low < 1):
                found.append((low, high, [i, j]))
    # of the two cells at a corner, the one in the row that the segment leaves comes first
    order = sorted(found, key=lambda f: (f[0], f[1], abs(f[2][1] - _row_before(found, f[0]))))
    cells = [cell for *_, cell in order]
    return {"cells": {"columns-for-rows": [c[::-1] for c in cells], "end-cell-missing": cells[:-1],
                      "backwards": cells[::-1]}.get(wrong, cells)}  # fmt: skip


def _row_before(found: Any, t: Fraction) -> int:
    """Row of the cell that the segment leaves at t."""
    return next((cell[1] for low, high, cell in found if low < high == t), 0)


def _inside(a: Fraction, b: Fraction, cell: int) -> tuple[Fraction, Fraction]:
    """Where on the segment one coordinate lies in [cell, cell + 1)."""
    if a == b:
        return (Fraction(0), Fraction(1)) if floor(a) == cell else (Fraction(1), Fraction(0))
    t, u = (cell - a) / (b - a), (cell + 1 - a) / (b - a)
    return min(t, u), max(t, u)


def _bresenham(start: Any, end: Any) -> list[list[int]]:
    a, b = [floor(v) for v in start], [floor(v) for v in end]
    n = max(abs(q - p) for p, q in zip(a, b, strict=True))
    return [
        [floor(p + (q - p) * k / max(n, 1) + 0.5) for p, q in zip(a, b, strict=True)] for k in range(n + 1)
    ]
