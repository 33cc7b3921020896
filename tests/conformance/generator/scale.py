"""Robust scales: medians by sorting, constants from the distributions, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import vector

TOPIC, CHAPTER = "scale", 4

NOTES = {
    "constant-of-scalars": (
        "you take the constant of scalars, 1.4826, for norms of plane errors: sigma is 1.75 times too large",
        "1.4826 med |e|",
    ),
    "constant-of-norms": ("you take the constant of norms, 0.8493, for scalars", "0.8493 med |e|"),
    "about-the-median": (
        "you measure errors from their median; residuals are measured from zero",
        "1.4826 med |e - med e|",
    ),
    "signed-median": ("you take the median of signed errors", "1.4826 |med e|"),
    "upper-median": ("of an even number you take the upper one of the middle two", "sorted[n / 2]"),
    "not-scaled": ("your scale is the bare median", "med |e|"),
    "root-mean-square": ("your scale is the root mean square: one outlier decides it", "(mean e^2)^(1/2)"),
    "componentwise": (
        "you take the median of coordinates; it must be that of norms",
        "0.8493 med |e_x|, |e_y|",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """Odd and even numbers, with outliers and without."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    rule = tolerance(1e-15, "a product of a constant of 16 digits and a median", float32=1e-6)
    for flag, first, outliers in (("odd", 5, False), ("even", 6, False), ("outliers", 9, True)):
        sizes = [first + 2 * k for k in range(8)]
        oracle = "sorted, with the constant of 50 digits"
        scalars = [_errors(rng, (n,), outliers) for n in sizes]
        topic.group("scale.mad", "eq-mad", oracle, rule, [_mad(e) for e in scalars], flags=(flag,))
        planes = [_errors(rng, (n, 2), outliers) for n in sizes]
        topic.group("scale.norm", "eq-mad-norm", oracle, rule, [_norm(e) for e in planes], flags=(flag,))
    return topic


def _errors(rng: np.random.Generator, shape: tuple[int, ...], outliers: bool) -> Any:
    e = rng.uniform(0.2, 3.0) * rng.standard_normal(shape)
    if outliers:
        e[: shape[0] // 3] += 50.0 + 10.0 * rng.standard_normal(e[: shape[0] // 3].shape)
    return e


def median(values: list[Any]) -> Any:
    """Middle one, or the mean of the middle two."""
    ranked = sorted(values)
    n = len(ranked)
    return (ranked[(n - 1) // 2] + ranked[n // 2]) / 2


def constants() -> tuple[Any, Any]:
    """1 / Phi^-1(3/4), and 1 / sqrt(2 ln 2)."""
    quartile = mpmath.sqrt(2) * mpmath.erfinv(mpf(1) / 2)
    return 1 / quartile, 1 / mpmath.sqrt(2 * mpmath.log(2))


def _mad(errors: Any) -> dict[str, Any]:
    one, two = constants()
    e = vector(errors)
    sizes, middle = [abs(v) for v in e], median(e)
    wrong = {
        "constant-of-norms": two * median(sizes),
        "about-the-median": one * median([abs(v - middle) for v in e]),
        "signed-median": one * abs(middle),
        "not-scaled": median(sizes),
        "root-mean-square": mpmath.sqrt(sum(v * v for v in e) / len(e)),
    }
    if len(e) % 2 == 0:
        wrong["upper-median"] = one * sorted(sizes)[len(e) // 2]
    return _case(errors, one * median(sizes), wrong)


def _norm(errors: Any) -> dict[str, Any]:
    one, two = constants()
    norms = [mpmath.sqrt(sum(v * v for v in vector(row))) for row in errors]
    flat = [abs(v) for v in vector(errors)]
    wrong = {
        "constant-of-scalars": one * median(norms),
        "componentwise": two * median(flat),
        "not-scaled": median(norms),
        "root-mean-square": mpmath.sqrt(sum(v * v for v in flat) / len(flat)),
    }
    if len(norms) % 2 == 0:
        wrong["upper-median"] = two * sorted(norms)[len(norms) // 2]
    return _case(errors, two * median(norms), wrong)


def _case(errors: Any, right: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    mistakes = {
        note: {"sigma": float(v)} for note, v in wrong.items() if abs(v - right) > mpf("1e-6") * right
    }
    return {"inputs": {"errors": errors}, "expected": {"sigma": float(right)}, "mistakes": mistakes}
