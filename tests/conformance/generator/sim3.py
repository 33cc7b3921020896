"""Similarities: the power series of 4 x 4 generators with the logarithm of the scale on the diagonal."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import exact
from generator.angles import AXES, angle_grid, losing
from generator.building import Topic, tolerance
from generator.draws import digits, log_uniform
from generator.exact import column, floats, integrated, matrix, vector
from generator.groups import SIM3, Array, product, shift, turn
from generator.se3 import ROUNDING, case
from generator.so3 import log_of

TOPIC, CHAPTER = "sim3", 2
SERIES = "power series of the generator, 50 digits"

NOTES = {
    "rigid-translation": (
        "your translation is that of the rigid motion: the growing scale bends it, too",
        "t = V(phi) rho for t = W(phi, sigma) rho",
    ),
    "straight": ("your exponential copies the translation", "t = rho"),
    "inverse-not-scaled": ("the translation of your inverse is not divided by the scale", "t' = -R^T t"),
    "inverse-scaled-up": ("the translation of your inverse is multiplied by the scale", "t' = -s R^T t"),
    "translation-scaled": ("your action scales the translation as well", "s (R x + t)"),
    "wrong-order": ("your product is S_b S_a", "S_b S_a"),
    "rotation-not-scaled": ("the upper left block of your adjoint lacks the scale", "R for s R"),
    "right-jacobian": ("your left Jacobian is the right one", "J(-xi)"),
    "small-angle-sign": (
        "your branch for small vectors has the sign of the right Jacobian",
        "I - ad(xi)/2 for I + ad(xi)/2",
    ),
    "adjoint-sign": ("the scale's column of your adjoint has the wrong sign", "+t for -t"),
}

REGIMES: dict[str, tuple[str, float, float]] = {
    "generic": ("generic", 0.1, 0.9),
    "small_angle": ("small_angle", 0.1, 0.9),
    "small_scale": ("generic", 1e-10, 1e-4),
    "small_both": ("small_angle", 1e-10, 1e-4),
    "near_pi": ("near_pi", 0.1, 0.9),
}
"""Flag -> regime of the angle, and range of the logarithm of the scale."""


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    fine = tolerance(5e-14, ROUNDING)
    for flag in REGIMES:
        flags = () if flag == "generic" else (flag,)
        twists = [_twist(rng, flag) for _ in range(8)]
        rules = [_losing(fine, x) for x in twists]
        cases = [{**_exp(x), "tolerance": rule} for x, rule in zip(twists, rules, strict=True)]
        topic.group("sim3.exp", "eq-exp-similarity", SERIES, fine, cases, flags=flags)
        oracle = "Newton's iteration on the series, 50 digits"
        cases = [{**_log(x), "tolerance": rule} for x, rule in zip(twists, rules, strict=True)]
        topic.group("sim3.log", "eq-exp-similarity", oracle, fine, cases, flags=flags)
    some = [np.array(floats(SIM3.exp(vector(_twist(rng, "generic"))))) for _ in range(24)]
    cases = [_compose(a, b) for a, b in zip(some[::2], some[1::2], strict=True)]
    topic.group("sim3.compose", "eq-exp-similarity", "50-digit matrix product", fine, cases)
    cases = [_inverse(S) for S in some[:10]]
    topic.group("sim3.inverse", "eq-exp-similarity", "50-digit inverse", fine, cases)
    cases = [_act(S, shift(rng)) for S in some[:10]]
    topic.group("sim3.act", "eq-exp-similarity", "50-digit product", fine, cases)
    cases = [_adjoint(S) for S in some[:10]]
    topic.group("sim3.adjoint", "eq-adjoint-similarity", "conjugated generators, 50 digits", fine, cases)
    for flag in ("generic", "small_angle", "near_pi"):
        cases = [_left_jacobian(_twist(rng, flag)) for _ in range(5)]
        flags = () if flag == "generic" else (flag,)
        topic.group("sim3.left_jacobian", "eq-jacobian-halving", f"{SERIES}, of ad", fine, cases, flags=flags)
    cases = [_left_jacobian(1e-4 * _twist(rng, "generic"), small=True) for _ in range(4)]
    topic.group("sim3.left_jacobian", "eq-jacobian-halving", f"{SERIES}, of ad", fine, cases, flags=("tiny",))
    _every_size(topic, fine)
    _special(topic, fine)
    return topic


DIFFERENCE = "(s - 1)/sigma and (1 - cos a)/a lose eps over the smaller of sigma and a"
SHIFT = np.array([1.5, -0.4, 0.8])


def _every_size(topic: Topic, fine: dict[str, Any]) -> None:
    """Angle and scale on log-spaced grids, against each other: both small, one small, both large."""
    sizes = (1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 2e-3, 3e-2, 0.3, 0.9)
    some = []
    for k, a in enumerate(angle_grid([*sizes, 1.4, 2.0, 2.6, 3.0, 3.1])):
        for j, sigma in enumerate((sizes[k % 9], sizes[(4 * k + 3) % 9], 1.3 * (-1) ** k)):
            axis = AXES[(k + j) % len(AXES)]
            some.append(digits(np.array([*(SHIFT * (-1) ** k), *(abs(a) * axis), sigma * (-1) ** j])))
    rules = [_losing(fine, x) for x in some]
    cases = [{**_bare(_exp(x)), "tolerance": rule} for x, rule in zip(some, rules, strict=True)]
    topic.group("sim3.exp", "eq-exp-similarity", SERIES, fine, cases, flags=("any_size",))
    cases = [{**_bare(_log(x)), "tolerance": rule} for x, rule in zip(some, rules, strict=True)]
    oracle = "Newton's iteration on the series, 50 digits"
    topic.group("sim3.log", "eq-exp-similarity", oracle, fine, cases, flags=("any_size",))
    cases = [_bare(_left_jacobian(x)) for x in some[::3]]
    topic.group(
        "sim3.left_jacobian", "eq-jacobian-halving", f"{SERIES}, of ad", fine, cases, flags=("any_size",)
    )


def _losing(rule: dict[str, Any], xi: Array) -> dict[str, Any]:
    angle, sigma = float(np.linalg.norm(xi[3:6])), abs(float(xi[6]))
    if np.pi - angle < 0.2:
        return losing(rule, np.pi - angle, 2, "R - R^T over the sine of an arc cosine near a half turn")
    return losing(rule, min(angle, sigma), 1, DIFFERENCE)


def _special(topic: Topic, fine: dict[str, Any]) -> None:
    """Exact zeros: no rotation, scale 1, no translation, in all combinations."""
    phi, none = np.array([0.4, -1.1, 0.7]), np.zeros(3)
    some = {
        "zero": [np.zeros(7)],
        "no_rotation": [np.array([*SHIFT, *none, sigma]) for sigma in (0.0, 0.6, -0.6, 1e-6, 2.5)],
        "no_scale": [np.array([*SHIFT, *(x * phi), 0.0]) for x in (1.0, 1e-3, 1e-7, 2.2)],
        "no_translation": [np.array([*none, *phi, 0.4])],
    }
    oracle = "Newton's iteration on the series, 50 digits"
    for flag, twists in some.items():
        cases = [_bare(_exp(x)) for x in twists]
        topic.group("sim3.exp", "eq-exp-similarity", SERIES, fine, cases, flags=(flag,))
        rule = tolerance(5e-14, ROUNDING, absolute=5e-15) if flag == "zero" else fine
        topic.group(
            "sim3.log", "eq-exp-similarity", oracle, rule, [_bare(_log(x)) for x in twists], flags=(flag,)
        )
        cases = [_bare(_left_jacobian(x)) for x in twists]
        topic.group(
            "sim3.left_jacobian", "eq-jacobian-halving", f"{SERIES}, of ad", fine, cases, flags=(flag,)
        )
    scaled = [np.array(floats(SIM3.exp(vector([*SHIFT, *phi, sigma])))) for sigma in (-4.0, 4.0, 0.0)]
    cases = [_bare(_inverse(S)) for S in scaled]
    topic.group("sim3.inverse", "eq-exp-similarity", "50-digit inverse", fine, cases, flags=("any_size",))
    cases = [_bare(_act(S, SHIFT)) for S in scaled]
    topic.group("sim3.act", "eq-exp-similarity", "50-digit product", fine, cases, flags=("any_size",))
    cases = [_bare(_adjoint(S)) for S in scaled]
    topic.group(
        "sim3.adjoint",
        "eq-adjoint-similarity",
        "conjugated generators, 50 digits",
        fine,
        cases,
        flags=("any_size",),
    )
    cases = [_bare(_compose(a, b)) for a, b in ((scaled[0], np.eye(4)), (scaled[0], scaled[1]))]
    topic.group(
        "sim3.compose", "eq-exp-similarity", "50-digit matrix product", fine, cases, flags=("any_size",)
    )


def _bare(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if key != "mistakes"}


def _twist(rng: np.random.Generator, flag: str) -> Array:
    angle, low, high = REGIMES[flag]
    sigma = rng.choice([-1, 1]) * log_uniform(rng, low, high)
    return np.array([*shift(rng), *turn(rng, angle), sigma])


def _exp(xi: Array) -> dict[str, Any]:
    x = vector(xi)
    S = SIM3.exp(x)
    wrong = {}
    for note, t in (("straight", x[:3]), ("rigid-translation", _bent(x))):
        other = S.copy()
        for i in range(3):
            other[i, 3] = t[i]
        if max(abs(a - b) for a, b in zip(t, [S[i, 3] for i in range(3)], strict=True)) > 1e-8:
            wrong[note] = {"S": other}
    return case({"xi": xi}, "S", S, wrong)


def _bent(x: list[Any]) -> list[Any]:
    return column(integrated(exact.hat(x[3:6])) * mpmath.matrix(x[:3]))


def _log(xi: Array) -> dict[str, Any]:
    """Of the rounded matrix: scale by the determinant, rotation by Newton, then W rho = t."""
    S = np.array(floats(SIM3.exp(vector(xi))))
    M = matrix(S[:3, :3])
    s = mpmath.cbrt(mpmath.det(M))
    phi = log_of(np.array(floats(M / s)), xi[3:6])
    sigma = mpmath.log(s)
    t = mpmath.matrix(vector(S[:3, 3]))
    rho = column(integrated(exact.hat(phi) + sigma * mpmath.eye(3)) ** -1 * t)
    rigid = column(integrated(exact.hat(phi)) ** -1 * t)
    wrong = {}
    if abs(sigma) > mpf("1e-8"):
        wrong["rigid-translation"] = {"xi": [*rigid, *phi, sigma]}
    if max(abs(a - b) for a, b in zip(rho, t, strict=True)) > 1e-8:
        wrong["straight"] = {"xi": [*column(t), *phi, sigma]}
    return case({"S": S}, "xi", [*rho, *phi, sigma], wrong)


def _compose(a: Array, b: Array) -> dict[str, Any]:
    return case({"a": a, "b": b}, "S", product(a, b), {"wrong-order": {"S": product(b, a)}})


def _inverse(S: Array) -> dict[str, Any]:
    right = matrix(S) ** -1
    s = mpmath.cbrt(mpmath.det(matrix(S[:3, :3])))
    wrong = {}
    for note, power in (("inverse-not-scaled", 1), ("inverse-scaled-up", 2)):
        other = right.copy()
        for i in range(3):
            other[i, 3] = right[i, 3] * s**power
        wrong[note] = {"S": other}
    return case({"S": S}, "S", right, wrong)


def _act(S: Array, x: Array) -> dict[str, Any]:
    M, t, v = matrix(S[:3, :3]), mpmath.matrix(vector(S[:3, 3])), mpmath.matrix(vector(x))
    s = mpmath.cbrt(mpmath.det(M))
    return case(
        {"S": S, "x": x}, "x", column(M * v + t), {"translation-scaled": {"x": column(M * v + s * t)}}
    )


def _left_jacobian(xi: Array, small: bool = False) -> dict[str, Any]:
    x = vector(xi)
    wrong = {"right-jacobian": {"J": SIM3.left_jacobian([-v for v in x])}}
    if small:
        wrong = {"small-angle-sign": {"J": mpmath.eye(7) - SIM3.ad(x) / 2}}
    return case({"xi": xi}, "J", SIM3.left_jacobian(x), wrong)


def _adjoint(S: Array) -> dict[str, Any]:
    A = SIM3.adjoint(matrix(S))
    s = mpmath.cbrt(mpmath.det(matrix(S[:3, :3])))
    bare, flipped = A.copy(), A.copy()
    bare[0:3, 0:3] = A[0:3, 0:3] / s
    for i in range(3):
        flipped[i, 6] = -A[i, 6]
    return case({"S": S}, "A", A, {"rotation-not-scaled": {"A": bare}, "adjoint-sign": {"A": flipped}})
