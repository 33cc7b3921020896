"""One step of Gauss-Newton and of Levenberg-Marquardt, and whole runs: normal equations in 50 digits."""

from __future__ import annotations

import contextlib
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import solver_runs
from generator.building import Topic, tolerance
from generator.draws import log_uniform
from generator.exact import column, floats, matrix, vector
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "least_squares", 5
NORMAL = "normal equations in 50 digits"

NOTES = {
    "uphill": ("your step goes uphill: the residual's sign, or the step's", "+(J^T J)^-1 J^T r"),
    "gradient-step": ("your step is the bare gradient: J^T J is missing", "-J^T r"),
    "scale-not-squared": ("you damp with diag(scale); it must be its square", "J^T J + lambda diag(scale)"),
    "scale-ignored": ("your damping ignores the scale", "J^T J + lambda I"),
    "damping-squared": ("you square the damping", "J^T J + lambda^2 diag(scale)^2"),
    "marquardt-diagonal": ("you damp with the diagonal of J^T J", "J^T J + lambda diag(J^T J)"),
    "not-damped": ("your step is not damped", "J^T J step = -J^T r"),
    "promise-of-gauss-newton": (
        "your gain leaves the damping out of what the model promised",
        "promised = |J step|^2/2 for |J step|^2/2 + lambda |step|^2",
    ),
    "growth-not-doubled": (
        "your damping doubles after each refused step; it must grow by 2, 4, 8 in a row",
        "lambda <- 2 lambda",
    ),
    "factor-not-cubed": ("you square where Nielsen takes the cube", "max(1/3, 1 - (2 gain - 1)^2)"),
    "always-taken": ("you take a step although the cost rises", "b <- b + step, always"),
    "cost-not-halved": ("your cost is |r|^2; it is half of it", "|r|^2"),
    "divided-by-m": ("you divide by the number of residuals; m - n is wanted", "|r|^2/m (J^T J)^-1"),
    "noise-of-one": ("you leave out the noise: your covariance is for residuals of variance 1", "(J^T J)^-1"),
    "information": ("your covariance is its inverse", "J^T J (m - n)/|r|^2"),
    "gain-not-bounded": ("you do not bound the gain by 1: the factor falls below 1/3", "1 - (2 gain - 1)^3"),
    "square-for-cube": ("you square where Nielsen takes the cube", "max(1/3, 1 - (2 gain - 1)^2)"),
    "damping-late": ("you use each damping one step too late", "lambda of the step before"),
}


def build(rng: np.random.Generator) -> Topic:
    """Steps, and runs."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    reason = (
        "condition of J, below 1e2, squared as in the normal equations, times eps and some ten operations"
    )
    fine = tolerance(1e-11, reason, float32=1e-2)
    ill = "the square of the condition of J, 1e4, times eps: normal equations are allowed"
    hard = tolerance(1e-7, ill, float32=1e-2)
    some = [_system(rng, int(rng.integers(4, 9)), int(rng.integers(2, 4)), 10.0) for _ in range(15)]
    topic.group(
        "least_squares.gauss_newton_step", "eq-normal", NORMAL, fine, [_gauss_newton(*s) for s in some]
    )
    square = [_system(rng, 3, 3, 10.0) for _ in range(5)]
    cases = [_gauss_newton(*s) for s in square]
    topic.group("least_squares.gauss_newton_step", "eq-normal", NORMAL, fine, cases, flags=("square",))
    bad = [_system(rng, 8, 3, 1e4) for _ in range(8)]
    cases = [_gauss_newton(*s) for s in bad]
    topic.group(
        "least_squares.gauss_newton_step", "eq-normal", NORMAL, hard, cases, flags=("ill_conditioned",)
    )
    cases = [_singular(rng) for _ in range(4)]
    topic.group(
        "least_squares.gauss_newton_step", "eq-normal", "definition", fine, cases, flags=("degenerate",)
    )
    for flag, (low, high) in {
        "small_damping": (1e-6, 1e-3),
        "damped": (0.05, 5.0),
        "large_damping": (1e3, 1e6),
    }.items():
        cases = [_damped(*s, log_uniform(rng, low, high), rng) for s in some[:10]]
        topic.group("least_squares.lm_step", "eq-damped", NORMAL, fine, cases, flags=(flag,))
    cases = [_damped(*_rank_one(rng), float(rng.uniform(0.1, 2.0)), rng) for _ in range(5)]
    topic.group("least_squares.lm_step", "eq-damped", NORMAL, fine, cases, flags=("degenerate",))
    reason = "a dozen steps, each of condition below 1e4, times eps"
    long = tolerance(1e-10, reason, float32=1e-2)
    for flag, damping in RUNS.items():
        cases = [_trace(rng, damping) for _ in range(4)]
        oracle = "straight-line Levenberg-Marquardt in 50 digits"
        topic.group("least_squares.lm_trace", "eq-damped", oracle, long, cases, flags=("trace", flag))
    cases = [
        _covariance(*_system(rng, int(rng.integers(5, 9)), int(rng.integers(2, 4)), 10.0)) for _ in range(10)
    ]
    topic.group("least_squares.covariance", "eq-covariance", "inverse in 50 digits", fine, cases)
    cases = [
        _nielsen(float(g)) for g in [*rng.uniform(0.0, 1.0, 6), *rng.uniform(1.05, 2.0, 3), 0.5, 1.0, 1e-3]
    ]
    simple = tolerance(2e-15, "four operations")
    topic.group("least_squares.nielsen_factor", "eq-nielsen", "definition, 50 digits", simple, cases)
    made = {"system": _system, "step": _gauss_newton, "damped": _damped, "covariance": _covariance}
    solver_runs.sizes(topic, rng, made, NORMAL)
    solver_runs.nielsen_runs(topic, rng)
    ends = [_nielsen(g) for g in (1e-9, 0.25, 0.75, 0.9367, 0.9369, 0.99, 5.0, 1e6)]
    ends = [{key: value for key, value in case.items() if key != "mistakes"} for case in ends]
    topic.group(
        "least_squares.nielsen_factor", "eq-nielsen", "definition, 50 digits", simple, ends, flags=("ends",)
    )
    return topic


RUNS = {
    "constant": [0.3] * 10,
    "falling": [10.0 * 0.5**k for k in range(10)],
    "refusing": [1.0, 0.01, 0.1, 1.0, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3],
}
"""Flag -> damping of each step."""


def _system(rng: np.random.Generator, m: int, n: int, condition: float) -> tuple[Array, Array]:
    """Jacobian of a given condition, and residual."""
    U = np.linalg.qr(rng.standard_normal((m, n)))[0]
    V = np.linalg.qr(rng.standard_normal((n, n)))[0]
    return U * np.geomspace(condition, 1.0, n) @ V.T, rng.standard_normal(m)


def _rank_one(rng: np.random.Generator) -> tuple[Array, Array]:
    """Columns that are multiples of one another, by powers of two so that this is exact."""
    column_ = rng.standard_normal(5)
    return np.stack([column_, 2 * column_, -0.5 * column_], 1), rng.standard_normal(5)


def _solve(J: Any, r: Any, extra: Any = None) -> Any:
    """(J^T J + extra)^-1 (-J^T r)."""
    H = J.T * J
    return mpmath.lu_solve(H if extra is None else H + extra, -(J.T * r))


def _gauss_newton(J: Array, r: Array) -> dict[str, Any]:
    A, b = matrix(J), mpmath.matrix(vector(r))
    step = _solve(A, b)
    wrong = {"uphill": -step, "gradient-step": -(A.T * b)}
    return _case({"J": J, "r": r}, step, wrong)


def _singular(rng: np.random.Generator) -> dict[str, Any]:
    J, r = _rank_one(rng)
    return {"inputs": {"J": J, "r": r}, "expected": {}, "result": "invalid"}


def _damped(J: Array, r: Array, damping: float, rng: np.random.Generator) -> dict[str, Any]:
    A, b = matrix(J), mpmath.matrix(vector(r))
    scale = rng.uniform(0.3, 4.0, J.shape[1])
    d, lam = vector(scale), mpf(damping)

    def diagonal(values: list[Any]) -> Any:
        return mpmath.diag(values)

    step = _solve(A, b, diagonal([lam * v**2 for v in d]))
    H = A.T * A
    candidates = {
        "uphill": -step,
        "scale-not-squared": _solve(A, b, diagonal([lam * v for v in d])),
        "scale-ignored": _solve(A, b, diagonal([lam for _ in d])),
        "damping-squared": _solve(A, b, diagonal([lam**2 * v**2 for v in d])),
        "marquardt-diagonal": _solve(A, b, diagonal([lam * H[i, i] for i in range(H.rows)])),
    }
    if np.linalg.matrix_rank(J) == J.shape[1]:
        candidates["not-damped"] = _solve(A, b)
    size = mpmath.norm(step, mpmath.inf)
    wrong: dict[str, Any] = {}
    for note, other in candidates.items():
        if all(mpmath.norm(other - s, mpmath.inf) > mpf("1e-7") * size for s in (step, *wrong.values())):
            wrong[note] = other
    return _case({"J": J, "r": r, "damping": damping, "scale": scale}, step, wrong)


def _case(inputs: dict[str, Any], step: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    mistakes = {note: {"step": floats(column(s))} for note, s in wrong.items()}
    return {"inputs": inputs, "expected": {"step": floats(column(step))}, "mistakes": mistakes}


def _covariance(J: Array, r: Array) -> dict[str, Any]:
    A, m, n = matrix(J), len(r), J.shape[1]
    total = sum(v * v for v in vector(r))
    inverse = (A.T * A) ** -1
    right = inverse * (total / (m - n))
    wrong = {"divided-by-m": inverse * (total / m), "noise-of-one": inverse, "information": right**-1}
    mistakes = {note: {"cov": floats(C)} for note, C in wrong.items()}
    return {"inputs": {"J": J, "r": r}, "expected": {"cov": floats(right)}, "mistakes": mistakes}


def _nielsen(gain: float) -> dict[str, Any]:
    g = mpf(gain)
    right = max(mpf(1) / 3, 1 - (2 * min(g, mpf(1)) - 1) ** 3)
    wrong = {
        "gain-not-bounded": 1 - (2 * g - 1) ** 3,
        "square-for-cube": max(mpf(1) / 3, 1 - (2 * min(g, mpf(1)) - 1) ** 2),
    }
    mistakes: dict[str, Any] = {}
    for note, v in wrong.items():
        if abs(v - right) > 1e-6 and {"factor": float(v)} not in mistakes.values():
            mistakes[note] = {"factor": float(v)}
    return {"inputs": {"gain": gain}, "expected": {"factor": float(right)}, "mistakes": mistakes}


def _trace(rng: np.random.Generator, damping: list[float]) -> dict[str, Any]:
    """Draw until no decision hangs on rounding; runs of a list that refuses must refuse."""
    refusing = damping == RUNS["refusing"]
    while True:
        t = np.linspace(0.0, 4.0, 8)
        y = rng.uniform(2.0, 4.0) * np.exp(-rng.uniform(0.5, 1.5) * t) + 0.05 * rng.standard_normal(8)
        y = np.round(y, 12)  # an exponential's last bit differs from processor to processor
        start = np.array(
            [rng.uniform(0.5, 1.5), rng.uniform(2.0, 5.0) if refusing else rng.uniform(0.1, 0.4)]
        )
        steps, clear, _ = _run(y, t, start, damping)
        if not clear or refusing != any(not s["taken"] for s in steps):
            continue
        with contextlib.suppress(ZeroDivisionError):
            if not refusing or _run(y, t, start, damping, always=True)[2]:
                break
    runs: dict[str, Any] = {
        "marquardt-diagonal": lambda: _run(y, t, start, damping, rule="diagonal"),
        "not-damped": lambda: _run(y, t, start, [0.0] * len(damping)),
        "cost-not-halved": lambda: ([{**s, "cost": 2 * s["cost"]} for s in steps], True, True),
    }
    if refusing:
        runs["always-taken"] = lambda: _run(y, t, start, damping, always=True)
    if len(set(damping)) > 1:
        runs["damping-late"] = lambda: _run(y, t, start, [damping[0], *damping[:-1]])
    mistakes: dict[str, Any] = {}
    for note, run in runs.items():
        with contextlib.suppress(ZeroDivisionError):  # a wrong rule may lead anywhere
            found, _, steady = run()
            answer = {"steps": [_record(s) for s in found]}
            if steady and answer not in mistakes.values():
                mistakes[note] = answer
    inputs = {"y": y, "t": t, "start": start, "damping": damping}
    return {"inputs": inputs, "expected": {"steps": [_record(s) for s in steps]}, "mistakes": mistakes}


def _record(step: dict[str, Any]) -> dict[str, Any]:
    return {"b": floats(step["b"]), "cost": float(step["cost"]), "taken": int(step["taken"])}


def _run(
    y: Array, t: Array, start: Array, damping: list[float], *, rule: str = "identity", always: bool = False
) -> tuple[list[dict[str, Any]], bool, bool]:
    """One record a step, whether every decision was clear, and whether doubles would give the same run.

    Clear is a step whose gain, what it wins over what the model promises, is above 0.01 or below 0, and which
    promises more than 1e-9 of the cost: then rounding, and any sensible threshold, decide alike.
    """
    ts, ys = vector(t), vector(y)
    b, clear, steady, steps = vector(start), True, True, []

    def residual(at: list[Any]) -> Any:
        return mpmath.matrix([at[0] * mpmath.exp(-at[1] * s) - v for s, v in zip(ts, ys, strict=True)])

    for value in damping:
        r = residual(b)
        J = mpmath.matrix([[mpmath.exp(-b[1] * s), -b[0] * s * mpmath.exp(-b[1] * s)] for s in ts])
        H, lam = J.T * J, mpf(value)
        extra = mpmath.diag([lam * (H[i, i] if rule == "diagonal" else 1) for i in range(2)])
        whole = H + extra
        spread = (whole[0, 0] + whole[1, 1]) ** 2 / mpmath.det(whole)  # about the condition
        step = mpmath.lu_solve(whole, -(J.T * r))
        trial = [b[0] + step[0], b[1] + step[1]]
        cost, new = _half_square(r), _half_square(residual(trial))
        promised = _half_square(J * step) + (step.T * extra * step)[0]
        taken = new < cost or always
        clear = clear and promised > mpf("1e-9") * cost and not 0 <= (cost - new) / promised < mpf("0.01")
        # below 1e4 ten steps lose five digits at most; a decision on rounding is none
        steady = (
            steady and spread < mpf("1e4") and abs(new - cost) > mpf("1e-9") * cost and abs(trial[1]) < 50
        )
        b, cost = (trial, new) if taken else (b, cost)
        steps.append({"b": list(b), "cost": cost, "taken": taken})
    return steps, clear, steady


def _half_square(v: Any) -> Any:
    return sum(x * x for x in v) / 2
