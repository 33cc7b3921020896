"""Robust losses: costs from their definitions, influences as derivatives of the costs, in 50 digits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, lost_digits, tolerance
from generator.draws import digits
from generator.exact import floats, vector
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "loss", 4

NOTES = {
    "tukey-as-printed": (
        "you use x (1 - x^2/c^2), the reweighted residual, which is neither loss nor influence nor weight",
        "x (1 - x^2/c^2)",
    ),
    "tukey-third": (
        "your Tukey cost has c^2/3 for c^2/6: near 0 it is x^2 and not x^2/2",
        "c^2/3 (1 - (1 - u)^3)",
    ),
    "tukey-mixed": (
        "your Tukey cost has c^2/6 inside and c^2/3 beyond c: it jumps at c",
        "c^2/6 (1 - (1 - u)^3) inside, c^2/3 beyond",
    ),
    "tukey-constant": ("your Tukey cost is c^2/3 beyond c; it is c^2/6", "c^2/3 for |x| > c"),
    "tukey-falls-to-zero": ("your Tukey cost is 0 beyond c, where it is c^2/6", "0 for |x| > c"),
    "weight-not-squared": ("your weight is its own root", "1 - u (Tukey), 1/(1 + u) (Geman-McClure)"),
    "huber-without-offset": ("the straight part of your Huber cost starts at the wrong height", "c |x|"),
    "twice": ("your cost is x^2 near 0, not x^2/2", "2 rho"),
    "cost-of-square": (
        "you give rho the size where it takes the square of the residual, or the reverse",
        "rho(|x|^(1/2))",
    ),
    "weight-for-influence": ("you answer the weight; the influence is weight times residual", "psi(x)/x"),
    "cost-over-square": ("your weight is the cost over x^2/2; it is the influence over x", "2 rho(x)/x^2"),
}


def _l2(x: Any, c: Any) -> Any:
    return x * x / 2


def _huber(x: Any, c: Any) -> Any:
    return x * x / 2 if abs(x) <= c else c * (abs(x) - c / 2)


def _cauchy(x: Any, c: Any) -> Any:
    return c * c / 2 * mpmath.log(1 + (x / c) ** 2)


def _geman_mcclure(x: Any, c: Any) -> Any:
    return x * x / 2 / (1 + (x / c) ** 2)


def _tukey(x: Any, c: Any) -> Any:
    u = (x / c) ** 2
    return c * c / 6 * (1 - (1 - u) ** 3) if u < 1 else c * c / 6


COSTS: dict[str, Callable[[Any, Any], Any]] = {
    "l2": _l2,
    "huber": _huber,
    "cauchy": _cauchy,
    "geman-mcclure": _geman_mcclure,
    "tukey": _tukey,
}
REGIMES = {
    "inside": (0.05, 0.95, 6),
    "beyond": (1.05, 30.0, 5),
    "across": (0.2, 4.0, 3),
    "tiny": (1e-12, 1e-6, 2),
}
"""Flag -> range of |x|/c, log-uniform, and number of cases."""


def build(rng: np.random.Generator) -> Topic:
    """Five losses, three functions, four regimes, and the seam."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    for name in COSTS:
        for flag, (low, high, count) in REGIMES.items():
            if name == "l2" and flag not in ("inside", "tiny"):
                continue
            some = [_residuals(rng, low, high) for _ in range(count)]
            _group(topic, name, (name.replace("-", "_"), flag), some)
        seam = [(c, np.array([-c, c, 0.0])) for c in (1.0, 2.5)]
        _group(topic, name, (name.replace("-", "_"), "seam"), seam)
    return topic


def _residuals(rng: np.random.Generator, low: float, high: float) -> tuple[float, Array]:
    """A constant, and five residuals in a range of it; two lie on either side of the middle."""
    c = float(rng.uniform(0.8, 6.0))
    u = (np.arange(5) + rng.uniform(0.1, 0.9, 5)) / 5.0
    return c, digits(c * rng.choice([-1.0, 1.0], 5) * low * (high / low) ** u)


def _group(topic: Topic, name: str, flags: tuple[str, ...], some: list[tuple[float, Array]]) -> None:
    equation = "eq-a2-8" if name == "tukey" else "eq-m-estimator"
    rule = tolerance(2e-15, "about ten operations within eps", float32=2e-6)
    if "tiny" in flags:
        reason = "x^2/2 times a factor near 1, which a formula with differences from 1 would lose"
        rule = tolerance(1e-14, reason, float32=1e-5)
        if name in ("cauchy", "tukey", "geman-mcclure"):
            # a minimiser compares costs of the size c^2, c up to 6: there nothing is lost
            why = "1 - (1 - u^2)^3, log(1 + u^2): a difference from 1 keeps eps of c^2, c at most 6"
            rule["lost_digits"] = lost_digits(1e-14, why, absolute=2e-14)
            rule["float32"]["lost_digits"] = lost_digits(1e-5, why, absolute=1e-5)
    for what in ("cost", "influence", "weight"):
        cases = [_case(what, name, c, x) for c, x in some]
        oracle = "definition, 50 digits" if what == "cost" else "derivative of the cost, 50 digits"
        topic.group(f"loss.{what}", equation, oracle, rule, cases, flags=flags)


def value(what: str, name: str, x: Any, c: Any) -> Any:
    """Cost, its derivative, or the derivative over x."""
    rho = COSTS[name]
    if what == "cost":
        return rho(x, c)
    if abs(x) == c:  # one-sided derivatives agree there for all five
        slope = _slope(lambda v: rho(v, c), x * (1 - mpf(10) ** -25))
        slope = mpf(0) if name == "tukey" else slope
    else:
        slope = _slope(lambda v: rho(v, c), x)
    if what == "influence":
        return slope
    return mpf(1) if x == 0 else slope / x


def _slope(f: Callable[[Any], Any], x: Any) -> Any:
    h = mpf(10) ** -15 * max(abs(x), mpf(10) ** -10)
    with mpmath.workdps(80):
        return (f(x + h) - f(x - h)) / (2 * h)


def _case(what: str, name: str, c: float, x: Array) -> dict[str, Any]:
    right = [value(what, name, v, mpf(c)) for v in vector(x)]
    kept: dict[str, list[Any]] = {}
    for note, wrong in _mistakes(what, name, mpf(c), vector(x), right).items():
        if all(_differ(wrong, other) for other in (right, *kept.values())):
            kept[note] = wrong
    mistakes = {note: {"value": floats(wrong)} for note, wrong in kept.items()}
    return {
        "inputs": {"name": name, "c": c, "x": x},
        "expected": {"value": floats(right)},
        "mistakes": mistakes,
    }


def _differ(a: list[Any], b: list[Any]) -> bool:
    size = max(abs(v) for v in (*a, *b))
    return bool(max(abs(v - w) for v, w in zip(a, b, strict=True)) > mpf("1e-6") * size)


def _mistakes(what: str, name: str, c: Any, xs: list[Any], right: list[Any]) -> dict[str, list[Any]]:
    """What wrong formulas answer; where two answer alike, the first is the one that is told."""
    if name == "tukey" and what == "cost":
        return _tukey_costs(c, xs, right)
    found: dict[str, list[Any]] = {}
    if name == "tukey":
        found["tukey-as-printed"] = _as_printed(c, xs)
    if what == "cost":
        found["twice"] = [2 * v for v in right]
        if name == "huber":
            pairs = zip(right, xs, strict=True)
            found["huber-without-offset"] = [r if abs(x) <= c else c * abs(x) for r, x in pairs]
        if name != "l2":
            found["cost-of-square"] = [COSTS[name](mpmath.sqrt(abs(x)), c) for x in xs]
    if what == "influence":
        found["weight-for-influence"] = [value("weight", name, x, c) for x in xs]
    if what == "weight" and name in ("tukey", "geman-mcclure"):
        found["weight-not-squared"] = [mpmath.sqrt(abs(v)) for v in right]
    if what == "weight" and name in ("huber", "cauchy", "tukey"):
        costs = [value("cost", name, x, c) for x in xs]
        found["cost-over-square"] = [
            2 * r / x**2 if x != 0 else mpf(1) for r, x in zip(costs, xs, strict=True)
        ]
    return found


def _as_printed(c: Any, xs: list[Any]) -> list[Any]:
    return [x * (1 - (x / c) ** 2) if abs(x) < c else mpf(0) for x in xs]


def _tukey_costs(c: Any, xs: list[Any], right: list[Any]) -> dict[str, list[Any]]:
    inside = [abs(x) < c and x != 0 for x in xs]
    pairs = list(zip(right, inside, strict=True))
    mixed, fallen = [r if i else 2 * r for r, i in pairs], [r if i else mpf(0) for r, i in pairs]
    if not any(inside):  # only the constant shows
        return {"tukey-constant": mixed, "tukey-falls-to-zero": fallen}
    return {
        "tukey-as-printed": _as_printed(c, xs),
        "tukey-third": [2 * r for r in right],
        "tukey-mixed": mixed,
        "tukey-falls-to-zero": fallen,
        "cost-of-square": [_tukey(mpmath.sqrt(abs(x)), c) for x in xs],
    }
