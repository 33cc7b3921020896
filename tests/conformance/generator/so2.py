"""Rotations of the plane: fifty-digit sine and cosine, and the angle's home interval."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.angles import BEYOND, GRID, MANY_TURNS, angle_grid
from generator.building import Topic, lost_digits, not_in_single, tolerance
from generator.draws import log_uniform
from generator.exact import DIGITS

TOPIC, CHAPTER = "so2", 2

NOTES = {
    "other-end": (
        "your angles lie in [-pi, pi): half a turn is -pi; in (-pi, pi] it is pi",
        "mod(a + pi, 2 pi) - pi",
    ),
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
    with mpmath.workdps(DIGITS):
        return _built(rng)


def _built(rng: np.random.Generator) -> Topic:
    topic = Topic(CHAPTER, TOPIC, NOTES)
    fine = tolerance(1e-15, "sine and cosine within an ulp, or by the half angle", float32=5e-7)
    for flag, (low, high) in RANGES.items():
        flags = () if flag == "generic" else (flag,)
        angles = [float(rng.choice([-1, 1]) * log_uniform(rng, low, high)) for _ in range(8)]
        cases = [_exp(a) for a in angles]
        rule = _turned(high) if flag == "many_turns" else fine
        topic.group("so2.exp", "eq-rodrigues", "50-digit sine and cosine", rule, cases, flags=flags)
        cases = [_wrap(a) for a in angles]
        topic.group("so2.wrap", "eq-a2-1", "50-digit remainder", _home(high), cases, flags=flags)
    exact = tolerance(0.0, "exact: inside the interval nothing changes", absolute=1e-300)
    exact["float32"]["absolute"] = 1e-300
    zero = {"inputs": {"angle": 0.0}, "expected": {"angle": 0.0}}
    topic.group("so2.wrap", "eq-a2-1", "definition", exact, [zero], flags=("zero",))
    _every_size(topic, fine)
    return topic


def _every_size(topic: Topic, fine: dict[str, Any]) -> None:
    """Angles of a log-spaced grid, of many turns, and the two ends of the interval."""
    oracle = "50-digit sine and cosine"
    some = angle_grid([*GRID, *BEYOND])
    topic.group("so2.exp", "eq-rodrigues", oracle, fine, [_exp(a) for a in some], flags=("any_angle",))
    cases = [_wrap(a) for a in some[1:]]
    topic.group("so2.wrap", "eq-a2-1", "50-digit remainder", _home(2 * np.pi), cases, flags=("any_angle",))
    for turns in angle_grid(MANY_TURNS):
        rule = _turned(abs(turns))
        topic.group("so2.exp", "eq-rodrigues", oracle, rule, [_exp(turns)], flags=("many_turns",))
        rule = _home(abs(turns))
        topic.group("so2.wrap", "eq-a2-1", "50-digit remainder", rule, [_wrap(turns)], flags=("many_turns",))
    other = {"inputs": {"angle": np.pi}, "expected": {"angle": np.pi}}
    top = {**other, "mistakes": {"other-end": {"angle": -np.pi}}}
    # 4e-16 beyond it, and inside by 1e-16: by a rounding either end
    rows = [_bare(_wrap(a)) for a in (-np.pi, 3 * np.pi)]
    either = [{**row, "accept": [{"angle": -row["expected"]["angle"]}]} for row in rows]
    rule = not_in_single(_home(np.pi))
    topic.group("so2.wrap", "eq-a2-1", "definition", rule, [top, *either], flags=("pi",))
    axes = [_exp(k * np.pi / 2) for k in (1, 2, 3, -1, -2)]
    topic.group("so2.exp", "eq-rodrigues", oracle, fine, axes, flags=("right_angles",))
    topic.group("so2.exp", "eq-rodrigues", "definition", fine, [_exp(0.0)], flags=("zero",))


def _bare(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if key != "mistakes"}


def _home(high: float) -> dict[str, Any]:
    """Tolerance of an angle that was brought home from at most ``high``."""
    reason = "an angle plus pi is rounded, and 2 pi as often as it is taken off: 2 eps of pi and the angle"
    rule = tolerance(0.0, reason, absolute=float(f"{4.5e-16 * (high + np.pi):.1e}"))
    rule["float32"]["absolute"] = float(f"{2.5e-7 * (high + np.pi):.1e}")
    if high > 20.0:
        wide = "a loop that takes off one turn after another rounds once for each: eps angle turns/4"
        turns = high / (2 * np.pi)
        most = float(f"{max(1.0, turns / 4) * 2.3e-16 * high + 4.5e-16 * high:.1e}")
        rule["lost_digits"] = lost_digits(0.0, wide, absolute=min(most, 1e-5))
    return rule


def _turned(high: float) -> dict[str, Any]:
    """Tolerance of sine and cosine of many turns: the angle was brought home first, or rounded."""
    reason = "brought home first, the angle keeps eps of what it was"
    return tolerance(float(f"{4.5e-16 * high:.1e}"), reason, float32=float(f"{2.5e-7 * high:.1e}"))


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
