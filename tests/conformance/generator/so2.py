"""Rotations of the plane: fifty-digit sine and cosine, and the angle's home interval."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.draws import log_uniform

TOPIC, CHAPTER = "so2", 2

NOTES = {
    "transposed": ("your rotation turns the other way: clockwise for a positive angle", "[[c, s], [-s, c]]"),
    "small-angle-only": ("your sine is the angle itself, far beyond small angles", "[[1, -a], [a, 1]]"),
    "wrapped-to-positive": (
        "your angles lie in [0, 2 pi), not in (-pi, pi]: differences of headings jump by a turn",
        "mod(a, 2 pi)",
    ),
    "wrapped-once": (
        "your angle is brought back by one turn only; it needs as many as it takes",
        "a - 2 pi sign(a) where |a| > pi",
    ),
    "wrapped-by-pi": (
        "your angle is taken modulo pi: it loses which way it points",
        "mod(a + pi/2, pi) - pi/2",
    ),
}

RANGES = {
    "small_angle": (1e-12, 1e-3),
    "generic": (0.1, 3.0),
    "near_pi": (np.pi - 1e-3, np.pi - 1e-9),
    "beyond_pi": (3.3, 9.0),
    "many_turns": (20.0, 2000.0),
}


def build(rng: np.random.Generator) -> Topic:
    """Exponential and home interval."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    fine = tolerance(4e-16, "one sine and one cosine, each within an ulp", float32=2e-7)
    for flag, (low, high) in RANGES.items():
        flags = () if flag == "generic" else (flag,)
        angles = [float(rng.choice([-1, 1]) * log_uniform(rng, low, high)) for _ in range(8)]
        cases = [_exp(a) for a in angles]
        topic.group("so2.exp", "eq-rodrigues", "50-digit sine and cosine", fine, cases, flags=flags)
        reason = "2 pi, rounded to a double, is taken off as often as the angle turns: eps times the angle"
        rule = tolerance(0.0, reason, absolute=4.5e-16 * high)
        rule["float32"]["absolute"] = 2.5e-7 * high
        topic.group(
            "so2.wrap", "eq-a2-1", "50-digit remainder", rule, [_wrap(a) for a in angles], flags=flags
        )
    exact = tolerance(0.0, "exact: inside the interval nothing changes", absolute=1e-300)
    exact["float32"]["absolute"] = 1e-300
    zero = {"inputs": {"angle": 0.0}, "expected": {"angle": 0.0}}
    topic.group("so2.wrap", "eq-a2-1", "definition", exact, [zero], flags=("zero",))
    return topic


def _exp(angle: float) -> dict[str, Any]:
    c, s = float(mpmath.cos(mpf(angle))), float(mpmath.sin(mpf(angle)))
    mistakes = {"transposed": {"R": [[c, s], [-s, c]]}} if abs(s) > 1e-6 else {}
    if abs(angle) > 0.05:
        mistakes["small-angle-only"] = {"R": [[1.0, -angle], [angle, 1.0]]}
    return {"inputs": {"angle": angle}, "expected": {"R": [[c, -s], [s, c]]}, "mistakes": mistakes}


def _wrap(angle: float) -> dict[str, Any]:
    two_pi = 2 * mpmath.pi
    a = mpf(angle)
    right = a - two_pi * mpmath.ceil((a - mpmath.pi) / two_pi)
    wrong = {
        "wrapped-to-positive": a - two_pi * mpmath.floor(a / two_pi),
        "wrapped-once": a - two_pi * mpmath.sign(a) if abs(a) > mpmath.pi else a,
        "wrapped-by-pi": a - mpmath.pi * mpmath.floor(a / mpmath.pi + mpf(1) / 2),
    }
    told = abs(angle) > 1e-2  # a turn has not the digits of a tiny angle
    mistakes = {n: {"angle": float(x)} for n, x in wrong.items() if told and abs(x - right) > 1e-3}
    return {"inputs": {"angle": angle}, "expected": {"angle": float(right)}, "mistakes": mistakes}
