"""Rigid motions of the plane: the power series of 3 x 3 generators."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.angles import BEYOND, GRID, angle_grid, losing
from generator.building import Topic, not_in_single, tolerance
from generator.draws import log_uniform
from generator.exact import column, floats, integrated, vector
from generator.groups import REGIMES, SE2, Array

TOPIC, CHAPTER = "se2", 2
SERIES = "power series of the generator, 50 digits"
ROUNDING = "a hundred operations on numbers of order 1 within eps, as in a general matrix exponential"

NOTES = {
    "straight": (
        "your exponential copies the translation: it must be bent by the turn, t = V rho",
        "(rho, theta)",
    ),
    "right-jacobian": ("your left Jacobian is the right one", "J(-xi)"),
    "small-angle-sign": (
        "your branch for small angles has the sign of the right Jacobian",
        "I - ad(xi)/2 for I + ad(xi)/2",
    ),
    "turn-forgotten": (
        "your branch for small angles leaves the turn out of the rotation's block: it is the identity there",
        "[I, (y, -x)/2; 0, 1], without the terms theta/2",
    ),
    "translation-not-turned": ("your inverse turns back, but does not turn its translation", "(-t, -theta)"),
    "inverse-turned-forward": ("your inverse turns the translation forward, by R for R^T", "(-R t, -theta)"),
    "translations-added": ("your product adds the translations: t_b must be turned by a", "t_a + t_b"),
    "wrong-order": ("your product is T_b T_a: the factors stand in the wrong order", "T_b T_a"),
    "adjoint-sign": (
        "the translation's column of your adjoint has the wrong sign",
        "[R, (-y, x); 0, 1] for [R, (y, -x); 0, 1]",
    ),
    "other-end": ("your headings lie in [-pi, pi): half a turn is -pi; in (-pi, pi] it is pi", "[-pi, pi)"),
    "not-wrapped": ("your heading leaves (-pi, pi]", "theta_a + theta_b"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    fine = tolerance(5e-14, ROUNDING)
    for flag in REGIMES:
        flags = () if flag == "generic" else (flag,)
        twists = [_twist(rng, flag) for _ in range(8)]
        cases = [{**_exp(x), "tolerance": losing(fine, abs(x[2]), 1, CHORD)} for x in twists]
        topic.group("se2.exp", "eq-exp-rigid", SERIES, fine, cases, flags=flags)
        rules = [losing(fine, abs(x[2]), 2, CHORD_TWICE, zero=True) for x in twists]
        cases = [
            {**_left_jacobian(x, flag), "tolerance": rule} for x, rule in zip(twists, rules, strict=True)
        ]
        topic.group("se2.left_jacobian", "eq-left-jacobian", SERIES, fine, cases, flags=flags)
        if flag != "beyond_pi":
            cases = [{**_log(x), "tolerance": losing(fine, abs(x[2]), 2, CHORD_TWICE)} for x in twists]
            topic.group("se2.log", "eq-log-rigid", "inverse of the series", fine, cases, flags=flags)
    poses = [_pose(rng) for _ in range(24)]
    oracle = "product of 50-digit matrices"
    cases = [_compose(a, b) for a, b in zip(poses[::2], poses[1::2], strict=True)]
    topic.group("se2.compose", "eq-a2-1", oracle, fine, cases)
    topic.group(
        "se2.inverse", "eq-a2-1", "inverse of a 50-digit matrix", fine, [_inverse(x) for x in poses[:12]]
    )
    cases = [_adjoint(x) for x in poses[:12]]
    topic.group("se2.adjoint", "eq-adjoint-rigid", "conjugated generators", fine, cases)
    _every_size(topic, fine)
    _special(topic, fine)
    return topic


CHORD = "(1 - cos a)/a loses eps/a"
CHORD_TWICE = "(1 - cos a)/a^2, or a sin a/(1 - cos a), loses eps/a^2"


def _every_size(topic: Topic, fine: dict[str, Any]) -> None:
    """Turns of a log-spaced grid, to both sides."""
    flags = ("any_angle",)
    for k, a in enumerate(angle_grid([*GRID, *BEYOND])):
        xi, size = np.array([(1.5, -0.7)[k % 2], (0.4, 2.2, -1.1)[k % 3], a]), abs(a)
        case = {**_exp(xi), "tolerance": losing(fine, size, 1, CHORD)}
        topic.group("se2.exp", "eq-exp-rigid", SERIES, fine, [case], flags=flags)
        case = _left_jacobian(xi, "small_angle" if size < 1e-3 else "")
        case = {**case, "tolerance": losing(fine, size, 2, CHORD_TWICE, zero=True)}
        topic.group("se2.left_jacobian", "eq-left-jacobian", SERIES, fine, [case], flags=flags)
        if size < np.pi:
            case = {**_log(xi), "tolerance": losing(fine, size, 2, CHORD_TWICE)}
            topic.group("se2.log", "eq-log-rigid", "inverse of the series", fine, [case], flags=flags)


def _special(topic: Topic, fine: dict[str, Any]) -> None:
    """No turn, no way, right angles, half turns, and sums at the interval's ends."""
    still = [np.array(x) for x in ([0.0, 0.0, 0.0], [1.5, -0.4, 0.0], [0.0, 0.0, 0.8], [0.0, 0.0, -2.9])]
    topic.group(
        "se2.exp", "eq-exp-rigid", SERIES, fine, [_without_mistakes(_exp(x)) for x in still], flags=("zero",)
    )
    topic.group(
        "se2.log",
        "eq-log-rigid",
        "inverse of the series",
        fine,
        [_without_mistakes(_log(x)) for x in still],
        flags=("zero",),
    )
    cases = [_jacobian_only(x) for x in still]
    topic.group("se2.left_jacobian", "eq-left-jacobian", SERIES, fine, cases, flags=("zero",))
    cases = [_inverse_only(x) for x in still]
    topic.group("se2.inverse", "eq-a2-1", "inverse of a 50-digit matrix", fine, cases, flags=("zero",))
    cases = [_plain(SE2.adjoint(_matrix(x)), x) for x in still]
    topic.group("se2.adjoint", "eq-adjoint-rigid", "conjugated generators", fine, cases, flags=("zero",))
    oracle = "product of 50-digit matrices"
    a, b = np.array([1.0, 2.0, 2.5]), np.array([-0.5, 0.7, 2.9])
    pairs = [(still[0], a), (a, still[0]), (still[1], a), (a, b), (-a, -b), (a, -b)]
    cases = [_without_mistakes(_compose(x, y)) for x, y in pairs]
    topic.group("se2.compose", "eq-a2-1", oracle, fine, cases, flags=("zero",))
    top = {
        "inputs": {"a": [1.0, 2.0, np.pi / 2], "b": [3.0, 4.0, np.pi / 2]},
        "expected": {"x": [-3.0, 5.0, np.pi]},
    }
    top["mistakes"] = {"other-end": {"x": [-3.0, 5.0, -np.pi]}}
    rule = not_in_single(fine)
    topic.group("se2.compose", "eq-a2-1", "definition", rule, [top], flags=("pi",))


def _without_mistakes(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if key != "mistakes"}


def _jacobian_only(x: Array) -> dict[str, Any]:
    return _without_mistakes(_left_jacobian(x, ""))


def _inverse_only(x: Array) -> dict[str, Any]:
    return _without_mistakes(_inverse(x))


def _plain(A: Any, x: Array) -> dict[str, Any]:
    return {"inputs": {"x": x}, "expected": {"A": floats(A)}}


def _twist(rng: np.random.Generator, flag: str) -> Array:
    angle = rng.choice([-1, 1]) * log_uniform(rng, *REGIMES[flag])
    return np.array([*(rng.uniform(0.4, 3.0, 2) * rng.choice([-1.0, 1.0], 2)), angle])


def _pose(rng: np.random.Generator) -> Array:
    return np.array(
        [*rng.uniform(0.4, 3.0, 2) * rng.choice([-1, 1], 2), rng.uniform(0.2, 3.0) * rng.choice([-1, 1])]
    )


def _matrix(pose: Any) -> Any:
    x, y, a = vector(pose)
    c, s = mpmath.cos(a), mpmath.sin(a)
    return mpmath.matrix([[c, -s, x], [s, c, y], [0, 0, 1]])


def _read(M: Any) -> list[Any]:
    return [M[0, 2], M[1, 2], mpmath.atan2(M[1, 0], M[0, 0])]


def _exp(xi: Array) -> dict[str, Any]:
    right = _read(SE2.exp(vector(xi)))
    mistakes = {}
    if abs(xi[2]) > 1e-6:
        mistakes["straight"] = {"x": [xi[0], xi[1], right[2]]}
    if abs(xi[2]) > np.pi:
        mistakes["not-wrapped"] = {"x": [*right[:2], xi[2]]}
    return _case({"xi": xi}, "x", right, mistakes)


def _log(xi: Array) -> dict[str, Any]:
    pose = np.array(floats(_read(SE2.exp(vector(xi)))))
    x, y, a = vector(pose)
    V = integrated(mpmath.matrix([[0, -a], [a, 0]]))
    rho = column(V**-1 * mpmath.matrix([x, y]))
    mistakes = {"straight": {"xi": pose}} if abs(xi[2]) > 1e-6 else {}
    return _case({"x": pose}, "xi", [*rho, a], mistakes)


def _compose(a: Array, b: Array) -> dict[str, Any]:
    A, B = _matrix(a), _matrix(b)
    right = _read(A * B)
    wrong = {
        "wrong-order": {"x": _read(B * A)},
        "translations-added": {"x": [a[0] + b[0], a[1] + b[1], right[2]]},
    }
    if abs(a[2] + b[2]) > np.pi:
        wrong["not-wrapped"] = {"x": [*right[:2], a[2] + b[2]]}
    return _case({"a": a, "b": b}, "x", right, wrong)


def _inverse(x: Array) -> dict[str, Any]:
    T = _matrix(x)
    forward = T[0:2, 0:2] * mpmath.matrix([-T[0, 2], -T[1, 2]])
    wrong = {
        "translation-not-turned": {"x": [-x[0], -x[1], -x[2]]},
        "inverse-turned-forward": {"x": [forward[0], forward[1], -x[2]]},
    }
    return _case({"x": x}, "x", _read(T**-1), wrong)


def _adjoint(x: Array) -> dict[str, Any]:
    A = SE2.adjoint(_matrix(x))
    wrong = A.copy()
    wrong[0, 2], wrong[1, 2] = -A[0, 2], -A[1, 2]
    return _case({"x": x}, "A", A, {"adjoint-sign": {"A": wrong}})


def _left_jacobian(xi: Array, flag: str) -> dict[str, Any]:
    x = vector(xi)
    wrong = {"right-jacobian": {"J": SE2.left_jacobian([-v for v in x])}}
    if flag == "small_angle":
        wrong = {"small-angle-sign": {"J": mpmath.eye(3) - SE2.ad(x) / mpf(2)}}
        if abs(xi[2]) > 1e-9:
            flat = SE2.ad(x) / mpf(2)
            flat[0, 1] = flat[1, 0] = mpf(0)
            wrong["turn-forgotten"] = {"J": mpmath.eye(3) + flat}
    return _case({"xi": xi}, "J", SE2.left_jacobian(x), wrong)


def _case(inputs: dict[str, Any], name: str, right: Any, wrong: dict[str, Any]) -> dict[str, Any]:
    mistakes = {note: {key: floats(v) for key, v in answer.items()} for note, answer in wrong.items()}
    return {"inputs": inputs, "expected": {name: floats(right)}, "mistakes": mistakes}
