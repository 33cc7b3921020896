"""Levenberg-Marquardt with Nielsen's damping, and linear systems of every size."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance
from generator.exact import vector
from vslam_ref.arrays import Array

STEPS = 8


def nielsen_runs(topic: Topic, rng: np.random.Generator) -> None:
    """Runs in which steps are taken, and refused, and refused again."""
    rule = tolerance(
        1e-9, "eight steps, each of condition below 1e4; a gain is a ratio of differences", float32=1e-1
    )
    oracle = "straight-line Levenberg-Marquardt in 50 digits"
    for flag, refused, damping in (("falling", 0, 1e-3), ("refusing", 2, 1e-5), ("stiff", 0, 10.0)):
        cases = [_run_case(rng, damping, refused) for _ in range(4)]
        topic.group(
            "least_squares.nielsen_trace", "eq-gain-ratio", oracle, rule, cases, flags=("trace", flag)
        )


def _run_case(rng: np.random.Generator, damping: float, refused: int) -> dict[str, Any]:
    """Draw until no decision hangs on rounding, and as many steps are refused as were asked for."""
    while True:
        t = np.linspace(0.0, 4.0, 8)
        y = np.round(
            rng.uniform(2.0, 4.0) * np.exp(-rng.uniform(0.5, 1.5) * t) + 0.3 * rng.standard_normal(8), 6
        )
        start = np.round(
            [rng.uniform(0.5, 1.5), rng.uniform(2.0, 6.0) if refused else rng.uniform(0.1, 0.4)], 6
        )
        with contextlib.suppress(ZeroDivisionError, OverflowError):
            steps, clear = run(y, t, start, damping)
            in_a_row = "0" * refused in "".join(str(int(s["taken"])) for s in steps)
            if clear and in_a_row and (refused or all(s["taken"] for s in steps[:4])):
                break
    mistakes: dict[str, Any] = {}
    for note in ("promise-of-gauss-newton", "growth-not-doubled", "factor-not-cubed", "always-taken"):
        with contextlib.suppress(ZeroDivisionError, OverflowError):
            found, steady = run(y, t, start, damping, wrong=note)
            answer = {"steps": [_record(s) for s in found]}
            if steady and _apart(found, steps) and answer not in mistakes.values():
                mistakes[note] = answer
    inputs = {"y": y, "t": t, "start": start, "damping": damping, "count": STEPS}
    return {"inputs": inputs, "expected": {"steps": [_record(s) for s in steps]}, "mistakes": mistakes}


def _apart(a: list[dict[str, Any]], b: list[dict[str, Any]]) -> bool:
    names = ("cost", "gain", "damping")
    return any(abs(s[k] - r[k]) > mpf("1e-4") * abs(r[k]) for s, r in zip(a, b, strict=True) for k in names)


def _record(step: dict[str, Any]) -> dict[str, Any]:
    return {k: float(step[k]) for k in ("cost", "gain", "damping")} | {"taken": int(step["taken"])}


def run(
    y: Array, t: Array, start: Array, damping: float, wrong: str = ""
) -> tuple[list[dict[str, Any]], bool]:
    """One record a step, and whether every decision was clear: a gain above 0.01 or below 0."""
    ts, ys = vector(t), vector(y)
    b, lam, growth, clear, steps = vector(start), mpf(damping), mpf(2), True, []

    def half_square(r: Any) -> Any:
        return sum(v * v for v in r) / 2

    def residual(at: list[Any]) -> Any:
        return mpmath.matrix([at[0] * mpmath.exp(-at[1] * s) - v for s, v in zip(ts, ys, strict=True)])

    for _ in range(STEPS):
        r, e = residual(b), [mpmath.exp(-b[1] * s) for s in ts]
        J = mpmath.matrix([[v, -b[0] * s * v] for s, v in zip(ts, e, strict=True)])
        whole = J.T * J + lam * mpmath.eye(2)
        spread = (whole[0, 0] + whole[1, 1]) ** 2 / mpmath.det(whole)
        step = mpmath.lu_solve(whole, -(J.T * r))
        trial = [b[0] + step[0], b[1] + step[1]]
        cost, new = half_square(r), half_square(residual(trial))
        promised = half_square(J * step) + (
            0 if wrong == "promise-of-gauss-newton" else lam * (step.T * step)[0]
        )
        gain = (cost - new) / promised
        taken = gain > 0 or wrong == "always-taken"
        clear = clear and promised > mpf("1e-6") * cost and not 0 <= gain < mpf("0.01")
        clear = clear and spread < mpf("1e4") and abs(trial[1]) < 50 and abs(gain) < 100
        steps.append({"cost": new if taken else cost, "gain": gain, "damping": lam, "taken": taken})
        if taken:
            power = 2 if wrong == "factor-not-cubed" else 3
            b, growth = trial, mpf(2)
            lam = lam * max(mpf(1) / 3, 1 - (2 * min(gain, mpf(1)) - 1) ** power)
        else:
            lam, growth = lam * growth, growth if wrong == "growth-not-doubled" else 2 * growth
    return steps, clear


def sizes(topic: Topic, rng: np.random.Generator, made: dict[str, Callable[..., Any]], normal: str) -> None:
    """One unknown, and many; residuals of zero; damping of zero and nearly endless."""
    fine = tolerance(
        1e-11, "condition of J, below 1e2, squared, times eps and some ten operations", float32=1e-2
    )
    shapes = ((1, 1), (3, 1), (6, 6), (12, 7))
    some = [made["system"](rng, m, n, 10.0) for m, n in shapes]
    cases = [_bare(made["step"](*s)) for s in some]
    topic.group("least_squares.gauss_newton_step", "eq-normal", normal, fine, cases, flags=("any_size",))
    zero = {"inputs": {"J": some[1][0], "r": np.zeros(3)}, "expected": {"step": [0.0]}}
    exact = tolerance(0.0, "zero", absolute=1e-300)
    topic.group("least_squares.gauss_newton_step", "eq-normal", "definition", exact, [zero], flags=("zero",))
    cases = [_bare(made["damped"](*s, lam, rng)) for s in some for lam in (1e-9, 0.4, 1e9)]
    topic.group("least_squares.lm_step", "eq-damped", normal, fine, cases, flags=("any_size",))
    cases = [_bare(made["damped"](*s, 0.0, rng)) for s in some[1:]]
    topic.group("least_squares.lm_step", "eq-damped", normal, fine, cases, flags=("no_damping",))
    cases = [
        _bare(made["covariance"](*made["system"](rng, m, n, 10.0))) for m, n in ((2, 1), (7, 6), (12, 7))
    ]
    oracle = "inverse in 50 digits"
    topic.group("least_squares.covariance", "eq-covariance", oracle, fine, cases, flags=("any_size",))
    square, _ = some[2]
    twice = np.outer(np.arange(1.0, 6.0), [1.0, 2.0])
    wide = [{"J": J, "r": np.arange(1.0 * len(J))} for J in (square, square[:5], twice)]
    cases = [{"inputs": row, "expected": {}, "result": "invalid"} for row in wide]
    topic.group("least_squares.covariance", "eq-covariance", "definition", fine, cases, flags=("degenerate",))


def _bare(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if key != "mistakes"}
