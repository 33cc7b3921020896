"""Occupancy grids: log odds, the recursion of chapter 4 of A, the maps S and D, and the cells of a ray."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, not_in_single, tolerance
from generator.draws import digits
from generator.exact_rays import rays
from generator.two_maps import explained, histories, logit, two_maps
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "grid", 19
DEFINITION = "definition, 50 digits"

NOTES = {
    "odds": ("your value is the odds; its logarithm was asked for", "p/(1 - p)"),
    "log-of-p": ("your value is the logarithm of the probability", "ln p"),
    "base-ten": ("your logarithm has base ten", "log10(p/(1 - p))"),
    "base-two": ("your logarithm has base two", "log2(p/(1 - p))"),
    "free-for-occupied": ("your probability is that of the complement", "1/(1 + exp(L))"),
    "overflow": ("your exponential overflows: infinity over infinity", "exp(L)/(1 + exp(L))"),
    "prior-counted-twice": (
        "your prior counts twice: a table conditioned on S_t-1 holds its odds, and they come once more",
        "L(S_t | o_t, S_t-1) + L(S_t-1), the first with the prior in it",
    ),
    "probabilities-multiplied": ("you multiply probabilities where odds multiply", "logit(p q)"),
    "probabilities-averaged": ("you average the probabilities", "logit((p + q)/2)"),
    "transition-added": (
        "you add the log odds of the transition; they stand in the denominator",
        "table + transition + prediction",
    ),
    "not-explained": (
        "your hits beside a wall are not taken for the wall's: noise makes walls move",
        "state of the cell itself, whatever is beside it",
    ),
    "no-diagonals": ("your neighbours are four; diagonals count, too", "|i| + |j| for max(|i|, |j|)"),
    "memory-lost": ("your cell forgets what it knew", "L = logit(measured)"),
    "recursion-printed": (
        "your recursion is the printed one with a table that holds the prior: the state doubles at each step",
        "L <- (e + L) + L",
    ),
    "d-remembers": (
        "your D remembers, as the formula A4.3 has it; d_memory 'text' was asked for",
        "L(D_t) = L(D | o_t, S_t-1) + L(D_t-1)",
    ),
    "d-forgets": (
        "your D starts anew, as the text at A4.3 has it; d_memory 'formula' was asked for",
        "L(D_t) = L(D | o_t, S_t-1)",
    ),
    "d-never-stale": (
        "your D keeps what was not looked at for longer than its lifetime",
        "L(D_t-1) however old",
    ),
    "never-settles": (
        "your S never takes in what came to stay on free floor",
        "S keeps its log odds however long the cell is hit",
    ),
    "stay-never-ends": (
        "your stays do not end: a miss long after the last hit means that the thing has left",
        "first hit ever for first hit of this stay",
    ),
    "unseen-time-counts": (
        "you count the time at which nobody looked to a stay",
        "now - first hit, gaps included",
    ),
    "d-high-elsewhere": (
        "your D is high where S was unknown for free, or free for unknown: the other of the two readings",
        "d_high at the other d_high_where",
    ),
    "not-bounded": ("your log odds pass the bound", "no clipping"),
    "s-ignores-state": ("your S takes every hit as s_high, on free floor, too", "s_high for s_low"),
    "bresenham": (
        "your cells are those of Bresenham's line, one for each column or row: it leaves cells out",
        "rounding of the minor axis",
    ),
    "columns-for-rows": ("your cells are (row, column); (x, y) was asked for", "(j, i)"),
    "end-cell-missing": ("your last cell is missing", "all cells but the last"),
    "corners-count": (
        "your cells hold those that the segment touches in a corner only",
        "closed squares for half-open ones",
    ),
    "backwards": ("your cells run from the end to the start", "reversed"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of grids."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _log_odds(topic, rng)
    _probabilities(topic, rng)
    _recursion(topic, rng)
    two_maps(topic, rng)
    rays(topic, rng)
    histories(topic, rng)
    explained(topic, rng)
    return topic


def _answers(inputs: dict[str, Any], name: str, right: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    """A case of one number, and the wrong formulas that give another one."""
    far = {n: v for n, v in wrong.items() if not abs(v - right) < mpf("1e-6") * (1 + abs(right))}
    case: dict[str, Any] = {"inputs": inputs, "expected": {name: float(right)}}
    return {**case, "mistakes": {n: {name: float(v)} for n, v in far.items()}} if far else case


# -- log odds --------------------------------------------------------------------------------------


def _log_odds(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-15, "two logarithms, each within an eps", absolute=2.3e-16)
    half = "p is 1/2 but for a little: the difference of two logarithms near ln 1/2 is right to eps, absolute"
    near_half = tolerance(0.0, half, absolute=2.3e-16)
    one = tolerance(1e-15, "1 - p is exact")
    regimes: dict[str, tuple[Callable[[], float], Any]] = {
        "": (lambda: float(rng.uniform(0.05, 0.95)), rule),
        "near_zero": (lambda: float(digits(10.0 ** rng.uniform(-300, -3))), rule),
        "near_one": (lambda: 1.0 - float(2.0 ** -rng.integers(8, 53)), one),
        "near_half": (
            lambda: 0.5 + float(rng.choice([-1, 1]) * 10.0 ** rng.integers(-14, -2)) * rng.uniform(1, 9),
            near_half,
        ),
    }
    for flag, (draw, allowed) in regimes.items():
        cases = [_one_log_odds(draw()) for _ in range(15)]
        flags = (flag,) if flag else ()
        if flag in ("near_zero", "near_one"):
            allowed = not_in_single(allowed)
        topic.group("grid.log_odds", "eq-odds-recursion", DEFINITION, allowed, cases, flags=flags)
    cases = [
        {"inputs": {"probability": p}, "expected": {}, "result": "invalid"} for p in (-0.1, 1.1, "nan", 2.0)
    ]
    topic.group("grid.log_odds", "eq-odds-recursion", "definition", rule, cases, flags=("degenerate",))


def _one_log_odds(p: float) -> dict[str, Any]:
    right = logit(p)
    odds = mpf(p) / (1 - mpf(p))
    wrong = {
        **{"odds": odds, "log-of-p": mpmath.log(p)},
        **{"base-ten": mpmath.log10(odds), "base-two": mpmath.log(odds, 2)},
    }
    return _answers({"probability": p}, "value", right, wrong)


def _probabilities(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-15, "an exponential, rounded by eps times |L| at most 30")
    small = tolerance(1e-12, "exp of a rounded L is wrong by eps times |L|, below 700", float32=1e-3)
    small["float32"]["absolute"] = 1.2e-38  # what is smaller is zero in single precision
    regimes: dict[str, tuple[Callable[[], float], Any]] = {
        "": (lambda: float(rng.uniform(-4, 4)), rule),
        "sure": (lambda: float(rng.uniform(10, 36)), rule),
        "unlikely": (lambda: -float(rng.uniform(10, 600)), small),
    }
    for flag, (draw, allowed) in regimes.items():
        cases = [_one_probability(draw()) for _ in range(15)]
        flags = (flag,) if flag else ()
        topic.group("grid.probability", "eq-odds-recursion", DEFINITION, allowed, cases, flags=flags)
    cases = [_one_probability(L) for L in (0.0, 709.0, 800.0, 1e4, -1e4, 1e300, -1e300)]
    exact = tolerance(0.0, "1, 0 or 1/2 to the last digit", absolute=1e-300)
    topic.group("grid.probability", "eq-odds-recursion", DEFINITION, exact, cases, flags=("huge",))


def _one_probability(L: float) -> dict[str, Any]:
    right = 1 / (1 + mpmath.exp(-mpf(L)))
    wrong = {"free-for-occupied": 1 - right}
    if L > 709.8:
        wrong["overflow"] = mpf("nan")
    return _answers({"log_odds": L}, "value", right, wrong)


# -- recursion -------------------------------------------------------------------------------------


def _recursion(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-14, "two log odds and a sum", absolute=1e-15)
    rule["float32"]["relative"] = 2e-2  # the complement of a probability of 1 - 1e-6 has two digits
    draws: dict[str, Callable[[], Array]] = {
        "": lambda: rng.uniform(0.05, 0.95, 2),
        "sure": lambda: 1 - rng.uniform(1e-6, 0.02, 2),
    }
    for flag, draw in draws.items():
        cases = [_one_update(*np.round(draw(), 7).tolist()) for _ in range(15)]
        topic.group("grid.update", "eq-a4-2", DEFINITION, rule, cases, flags=flag)
    cases = []
    for table, transition, prediction in np.round(rng.normal(0, 2, (10, 3)), 3).tolist():
        inputs = {"table": table, "transition": transition, "prediction": prediction}
        values = [mpf(v) for v in (table, transition, prediction)]
        wrong = {"transition-added": sum(values), "memory-lost": values[0] - values[1]}
        cases.append(_answers(inputs, "log_odds", values[0] - values[1] + values[2], wrong))
    topic.group("grid.recursion", "eq-odds-recursion", DEFINITION, rule, cases)
    cases = [_follow(round(rng.uniform(-2, 2), 3), np.round(rng.normal(0.5, 1.2, 8), 3)) for _ in range(12)]
    topic.group("grid.follow", "eq-odds-recursion", DEFINITION, rule, cases)


def _one_update(prior: float, measured: float) -> dict[str, Any]:
    p, q = mpf(prior), mpf(measured)
    wrong = {
        "prior-counted-twice": 2 * logit(p) + logit(q),
        "probabilities-multiplied": logit(p * q),
        "probabilities-averaged": logit((p + q) / 2),
        "memory-lost": logit(q),
    }
    return _answers({"prior": prior, "measured": measured}, "log_odds", logit(p) + logit(q), wrong)


def _follow(start: float, evidence: Array) -> dict[str, Any]:
    right, printed, lost = [], [], []
    now = twice = mpf(start)
    for e in map(mpf, evidence.tolist()):
        now, twice = now + e, (e + twice) + twice
        right.append(now)
        printed.append(twice)
        lost.append(e)
    wrong = {"recursion-printed": printed, "memory-lost": lost}
    mistakes = {name: {"log_odds": [float(v) for v in values]} for name, values in wrong.items()}
    inputs = {"start": start, "evidence": evidence}
    return {"inputs": inputs, "expected": {"log_odds": [float(v) for v in right]}, "mistakes": mistakes}
