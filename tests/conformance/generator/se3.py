"""Rigid motions of space: the power series of 4 x 4 generators, everything else from it."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import exact
from generator.angles import BEYOND, GRID, MANY_TURNS, losing, vector_grid
from generator.building import Topic, tolerance
from generator.exact import column, derivative, floats, matrix, vector
from generator.groups import (
    REGIMES,
    SE3,
    Array,
    log_rigid,
    motion,
    product,
    rigid_inverse,
    shift,
    turned,
    twist,
)

TOPIC, CHAPTER = "se3", 2
SERIES = "power series of the generator, 50 digits"
ROUNDING = "a hundred operations on numbers of order 1 within eps, as in a general matrix exponential"

NOTES = {
    "straight": (
        "your exponential copies the translation: the screw bends it, t = V rho",
        "[[Exp(phi), rho], [0, 1]]",
    ),
    "right-jacobian": ("your left Jacobian is the right one", "J(-xi)"),
    "small-angle-sign": (
        "your branch for small angles has the sign of the right Jacobian",
        "I - ad(xi)/2 for I + ad(xi)/2",
    ),
    "no-coupling": (
        "your Jacobian lacks the block Q that couples translation and rotation",
        "[[V, 0], [0, V]]",
    ),
    "wrong-order": ("your product is T_b T_a: the new factor stands on the wrong side", "T_b T_a"),
    "element-wise": ("your product multiplies entry by entry: * between arrays for @", "T_a * T_b"),
    "translation-not-turned": ("your inverse turns back, but does not turn its translation", "[R^T, -t]"),
    "transposed": ("your inverse is the transposed 4 x 4 matrix", "T^T"),
    "turned-back": ("your action turns by R^T", "R^T x + t"),
    "moved-first": ("your action adds the translation before it turns", "R (x + t)"),
    "right-perturbation": ("your pose is perturbed on the right, T Exp(xi)", "[R, -R hat(x)]"),
    "body-point": ("your rotation columns use the point before the motion", "[I, -hat(x)]"),
    "adjoint-block": ("the upper right block of your adjoint is R hat(t)", "R hat(t) for hat(t) R"),
    "adjoint-of-inverse": ("your adjoint is that of the inverse motion", "Ad(T^-1)"),
    "straight-line": (
        "you interpolate rotation and position apart, on a straight line; the screw is bent",
        "t = (1 - f) t_a + f t_b",
    ),
    "on-the-left": ("you apply the fraction of the step on the left of a", "Exp(f Log(a^-1 b)) a"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    for flag in REGIMES:
        _regime(topic, flag, [twist(rng, flag) for _ in range(8)])
    fine = tolerance(5e-14, ROUNDING)
    zero = {"inputs": {"xi": np.zeros(6)}, "expected": {"T": np.eye(4)}}
    topic.group("se3.exp", "eq-exp-rigid", "definition", fine, [zero], flags=("zero",))
    zero = {"inputs": {"T": np.eye(4)}, "expected": {"xi": np.zeros(6)}}
    exactly = tolerance(0.0, "exact", absolute=1e-300)
    topic.group("se3.log", "eq-log-rigid", "definition", exactly, [zero], flags=("zero",))
    pure = np.concatenate([shift(rng), np.zeros(3)])
    topic.group("se3.exp", "eq-exp-rigid", SERIES, fine, [_exp(pure)], flags=("no_rotation",))
    oracle = "50-digit matrix product"
    topic.group(
        "se3.compose", "eq-a2-1", oracle, fine, [_compose(motion(rng), motion(rng)) for _ in range(12)]
    )
    topic.group(
        "se3.inverse", "eq-centre", "50-digit inverse", fine, [_inverse(motion(rng)) for _ in range(12)]
    )
    topic.group("se3.act", "eq-a2-1", oracle, fine, [_act(motion(rng), shift(rng)) for _ in range(12)])
    cases = [_adjoint(motion(rng, flag)) for flag in ("generic", "near_pi") for _ in range(6)]
    topic.group("se3.adjoint", "eq-adjoint-rigid", "conjugated generators, 50 digits", fine, cases)
    near = tolerance(1e-13, "a logarithm, an exponential and two products")
    for flag in ("small_angle", "generic"):
        flags = () if flag == "generic" else (flag,)
        cases = [_between(motion(rng), twist(rng, flag), float(rng.uniform(0.1, 0.9))) for _ in range(8)]
        topic.group("se3.interpolate", "eq-exp-rigid", SERIES, near, cases, flags=flags)
    cases = [_act_jacobian(motion(rng), shift(rng)) for _ in range(8)]
    oracle = "central differences of the series, 50 digits"
    topic.group("se3.act_jacobian", "eq-act-jacobian", oracle, fine, cases)
    _every_size(topic)
    _special(topic, rng)
    return topic


COSINE = "(1 - cos a)/a^2 loses eps/a"
QUARTIC = "(1 - a^2/2 - cos a)/a^4, or a sin a/(1 - cos a), loses eps/a^2"
HALF = "1 + cos a, or R - R^T over the sine of an arc cosine, near a half turn: eps over its squared distance"
SHIFTS = np.array([[1.5, -0.4, 0.8], [-0.6, 2.2, -1.1]])


def _losing(rule: dict[str, Any], xi: Array, power: int, *, half: bool = False) -> dict[str, Any]:
    """Tolerance of a case with the digits that a common formula loses at small angles, or near pi."""
    a = float(np.linalg.norm(xi[3:]))
    if half and a > 2.0:
        return losing(rule, abs(np.pi - a), 2, HALF)
    return losing(rule, a, power, COSINE if power == 1 else QUARTIC)


def _every_size(topic: Topic) -> None:
    """Angles of a log-spaced grid, with translations of order 1."""
    twists = [np.array([*SHIFTS[k % 2], *phi]) for k, phi in enumerate(vector_grid([*GRID, *BEYOND], 3))]
    _regime(topic, "any_angle", twists)
    for group in topic.groups:  # each whole answer is long: every third case has the wrong ones, too
        if group["flags"] == ["any_angle"]:
            rows = group["cases"]
            group["cases"] = [row if k % 3 == 0 else _bare(row) for k, row in enumerate(rows)]
    fine = tolerance(5e-14, ROUNDING)
    for a, phi in zip(MANY_TURNS, vector_grid(MANY_TURNS, 3), strict=True):
        rule = tolerance(
            float(f"{1e-14 * a:.1e}"), "twenty squarings, or a root: eps of the angle", float32=1e-2
        )
        twist_ = np.array([*SHIFTS[0], *phi])
        topic.group("se3.exp", "eq-exp-rigid", SERIES, rule, [_exp(twist_)], flags=("many_turns",))
    for size, regime in ((1e-6, "near"), (1e4, "far")):
        cases = [
            _exp(np.array([*(size * SHIFTS[k % 2]), *phi]))
            for k, phi in enumerate(vector_grid([0.3, 1.2, 2.9]))
        ]
        topic.group("se3.exp", "eq-exp-rigid", SERIES, fine, cases, flags=(regime,))


def _special(topic: Topic, rng: np.random.Generator) -> None:
    """No rotation, no translation, the identity; an interpolation's ends, outside, and the long way round."""
    fine, near = tolerance(5e-14, ROUNDING), tolerance(1e-13, "a logarithm, an exponential and two products")
    zero = [np.zeros(6), np.array([*SHIFTS[0], 0, 0, 0]), np.array([0, 0, 0, 0.4, -1.1, 0.7])]
    cases = [_bare(_left_jacobian(x, "")) for x in zero]
    topic.group("se3.left_jacobian", "eq-jacobian-rigid", SERIES, fine, cases, flags=("zero",))
    cases = [_bare(_inverse_jacobian(x, "")) for x in zero]
    topic.group(
        "se3.left_jacobian_inverse", "eq-jacobian-rigid", "exact inverse", fine, cases, flags=("zero",)
    )
    topic.group("se3.exp", "eq-exp-rigid", SERIES, fine, [_bare(_exp(zero[2]))], flags=("no_translation",))
    cases = [_bare(_log(x)) for x in zero[1:]]
    topic.group(
        "se3.log",
        "eq-log-rigid",
        "Newton's iteration on the series, 50 digits",
        fine,
        cases,
        flags=("no_rotation",),
    )
    one, T = np.eye(4), motion(rng)
    cases = [_bare(_compose(a, b)) for a, b in ((one, T), (T, one), (one, one))]
    topic.group("se3.compose", "eq-a2-1", "50-digit matrix product", fine, cases, flags=("identity",))
    topic.group(
        "se3.inverse", "eq-centre", "50-digit inverse", fine, [_bare(_inverse(one))], flags=("identity",)
    )
    topic.group(
        "se3.adjoint", "eq-adjoint-rigid", "definition", fine, [_bare(_adjoint(one))], flags=("identity",)
    )
    origin = [_bare(_act(T, np.zeros(3))), _bare(_act(one, SHIFTS[0]))]
    topic.group("se3.act", "eq-a2-1", "50-digit matrix product", fine, origin, flags=("zero",))
    cases = [_bare(_act_jacobian(T, np.zeros(3))), _bare(_act_jacobian(one, SHIFTS[0]))]
    oracle = "central differences of the series, 50 digits"
    topic.group("se3.act_jacobian", "eq-act-jacobian", oracle, fine, cases, flags=("zero",))
    xi = np.array([*SHIFTS[1], 0.5, -0.3, 0.7])
    cases = [_bare(_between(T, xi, f)) for f in (0.0, 1.0, -0.5, 1.5)]
    topic.group("se3.interpolate", "eq-exp-rigid", SERIES, near, cases, flags=("outside",))
    cases = [_bare(_between(T, np.zeros(6), f)) for f in (0.0, 0.3, 1.0)]
    topic.group("se3.interpolate", "eq-exp-rigid", SERIES, near, cases, flags=("same",))
    long = [
        _bare(_between(T, np.array([*SHIFTS[0], *phi]), 0.4)) for phi in vector_grid([2.6, 2.9, 3.0, 3.1])
    ]
    topic.group(
        "se3.interpolate",
        "eq-exp-rigid",
        SERIES,
        tolerance(1e-12, "the same, and 1/sin near pi"),
        long,
        flags=("long_way",),
    )


def _bare(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if key != "mistakes"}


def _regime(topic: Topic, flag: str, twists: list[Array]) -> None:
    """Exponential, logarithm and Jacobians."""
    flags = () if flag == "generic" else (flag,)
    fine = tolerance(5e-14, ROUNDING)
    cases = [{**_exp(x), "tolerance": _losing(fine, x, 1)} for x in twists]
    topic.group("se3.exp", "eq-exp-rigid", SERIES, fine, cases, flags=flags)
    cases = [{**_left_jacobian(x, _branch(flag, x)), "tolerance": _losing(fine, x, 2)} for x in twists]
    topic.group("se3.left_jacobian", "eq-jacobian-rigid", SERIES, fine, cases, flags=flags)
    reason = "the inverse has a pole at 2 pi: its condition, at most 100 for these angles, times the rounding"
    pole = tolerance(1e-13, reason, float32=1e-3)
    some = twists if flag == "any_angle" else twists[:6]
    cases = [
        {**_inverse_jacobian(x, _branch(flag, x)), "tolerance": _losing(pole, x, 2, half=True)} for x in some
    ]
    topic.group("se3.left_jacobian_inverse", "eq-jacobian-rigid", "exact inverse", pole, cases, flags=flags)
    if flag == "beyond_pi":
        return
    reason = "R is rounded to eps and the translation is divided by V, whose inverse is of order 1"
    rule = tolerance(1e-14, reason, float32=2e-3)
    twists = [x for x in twists if np.linalg.norm(x[3:]) < np.pi]
    cases = [{**_log(x), "tolerance": _losing(rule, x, 2, half=True)} for x in twists]
    topic.group(
        "se3.log", "eq-log-rigid", "Newton's iteration on the series, 50 digits", rule, cases, flags=flags
    )


def _branch(flag: str, xi: Array) -> str:
    """Which mistakes are listed: on the grid, those of small angles below a thousandth."""
    small = flag == "any_angle" and np.linalg.norm(xi[3:]) < 1e-3
    return "small_angle" if small else flag


def _exp(xi: Array) -> dict[str, Any]:
    T = SE3.exp(vector(xi))
    wrong = T.copy()
    for i in range(3):
        wrong[i, 3] = mpf(xi[i])
    mistakes = {"straight": {"T": wrong}} if np.linalg.norm(xi[3:]) > 1e-6 else {}
    return case({"xi": xi}, "T", T, mistakes)


def _log(xi: Array) -> dict[str, Any]:
    T = np.array(floats(SE3.exp(vector(xi))))
    right = log_rigid(T, xi[3:])
    mistakes = {"straight": {"xi": [*T[:3, 3], *right[3:]]}} if np.linalg.norm(xi[3:]) > 1e-6 else {}
    return case({"T": T}, "xi", right, mistakes)


def _left_jacobian(xi: Array, flag: str) -> dict[str, Any]:
    x = vector(xi)
    J = SE3.left_jacobian(x)
    apart = J.copy()
    apart[0:3, 3:6] = mpmath.zeros(3, 3)
    wrong = {"right-jacobian": {"J": SE3.left_jacobian([-v for v in x])}, "no-coupling": {"J": apart}}
    if flag == "small_angle":
        wrong = {"small-angle-sign": {"J": mpmath.eye(6) - SE3.ad(x) / 2}, "no-coupling": {"J": apart}}
    return case({"xi": xi}, "J", J, wrong)


def _inverse_jacobian(xi: Array, flag: str) -> dict[str, Any]:
    x = vector(xi)
    wrong = {"right-jacobian": {"J": SE3.left_jacobian([-v for v in x]) ** -1}}
    if flag == "small_angle":
        wrong = {"small-angle-sign": {"J": mpmath.eye(6) + SE3.ad(x) / 2}}
    return case({"xi": xi}, "J", SE3.left_jacobian(x) ** -1, wrong)


def _compose(a: Array, b: Array) -> dict[str, Any]:
    wrong = {"wrong-order": {"T": product(b, a)}, "element-wise": {"T": matrix(a * b)}}
    return case({"a": a, "b": b}, "T", product(a, b), wrong)


def _inverse(T: Array) -> dict[str, Any]:
    R, t = turned(T)
    still = mpmath.eye(4)
    still[0:3, 0:3] = R.T
    for i in range(3):
        still[i, 3] = -t[i]
    wrong = {"translation-not-turned": {"T": still}, "transposed": {"T": matrix(T.T)}}
    return case({"T": T}, "T", rigid_inverse(T), wrong)


def _act(T: Array, x: Array) -> dict[str, Any]:
    R, t, v = matrix(T[:3, :3]), mpmath.matrix(vector(T[:3, 3])), mpmath.matrix(vector(x))
    wrong = {"turned-back": {"x": column(R.T * v + t)}, "moved-first": {"x": column(R * (v + t))}}
    return case({"T": T, "x": x}, "x", column(R * v + t), wrong)


def _act_jacobian(T: Array, x: Array) -> dict[str, Any]:
    M, v, zero = matrix(T), mpmath.matrix([*vector(x), 1]), [mpf(0)] * 6
    J = derivative(lambda xi: list(SE3.exp(xi) * M * v)[:3], zero)
    right = derivative(lambda xi: list(M * SE3.exp(xi) * v)[:3], zero)
    body = derivative(lambda xi: list(SE3.exp(xi) * v)[:3], zero)
    wrong = {"right-perturbation": {"J": right}, "body-point": {"J": body}}
    return case({"pose": T, "x": x}, "J", J, wrong)


def _adjoint(T: Array) -> dict[str, Any]:
    R, t = turned(T)
    A = SE3.adjoint(matrix(T))
    block = A.copy()
    block[0:3, 3:6] = R * exact.hat(t)
    wrong = {"adjoint-block": {"A": block}, "adjoint-of-inverse": {"A": SE3.adjoint(rigid_inverse(T))}}
    return case({"T": T}, "A", A, wrong)


def _between(a: Array, xi: Array, fraction: float) -> dict[str, Any]:
    b = np.array(floats(matrix(a) * SE3.exp(vector(xi))))
    f = mpf(fraction)
    step = log_rigid(rigid_inverse(a) * matrix(b), xi[3:])
    part = SE3.exp([f * v for v in step])
    T = matrix(a) * part
    line = T.copy()
    for i in range(3):
        line[i, 3] = (1 - f) * mpf(a[i, 3]) + f * mpf(b[i, 3])
    wrong = {"on-the-left": {"T": part * matrix(a)}}
    if np.linalg.norm(xi[3:]) > 1e-6:
        wrong["straight-line"] = {"T": line}
    return case({"a": a, "b": b, "fraction": fraction}, "T", T, wrong)


def case(inputs: dict[str, Any], name: str, right: Any, wrong: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """One case with one output; numbers of 50 digits become doubles."""
    mistakes = {note: {key: floats(v) for key, v in answer.items()} for note, answer in wrong.items()}
    return {"inputs": inputs, "expected": {name: floats(right)}, "mistakes": mistakes}
