"""Rotations of space: the exponential by its power series, everything else from it."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf
from scipy.stats import norm

from generator.angles import AXES, BEYOND, GRID, MANY_TURNS, losing, vector_grid
from generator.building import Topic, tolerance
from generator.draws import digits, rotation_vector
from generator.exact import column, expm, floats, hat, matrix, vector
from generator.similarity import rotation
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "so3", 2
SERIES = "power series of the matrix exponential, 50 digits"
ROUNDING = "a few dozen operations on numbers of order 1, each within eps"
NEAR_POLE = "the inverse has a pole at 2 pi: its condition times eps"

NOTES = {
    "mirror": (
        "your nearest rotation is a mirror, det R = -1: the last singular vector must change its sign",
        "R = U V^T for U diag(1, 1, det U V^T) V^T",
    ),
    "transposed": (
        "your rotation is the transpose of the right one: the angle's sign, or the other frame",
        "I - sin(a)/a hat(phi) + (1 - cos(a))/a^2 hat(phi)^2",
    ),
    "right-jacobian": (
        "your left Jacobian is the right one",
        "I - (1 - cos(a))/a^2 hat(phi) + (a - sin(a))/a^3 hat(phi)^2",
    ),
    "small-angle-sign": (
        "your branch for small angles has the sign of the right Jacobian: I - hat(phi)/2 for I + hat(phi)/2",
        "I - hat(phi)/2",
    ),
    "uniform-angles": (
        "your rotations are not uniform: a uniform angle about a uniform axis has E tr R = 1, E (tr R)^2 = 3",
        "R = Exp(a n) with a uniform in (0, 2 pi)",
    ),
}

REGIMES: dict[str, tuple[float, float]] = {
    "small_angle": (1e-12, 1e-3),
    "generic": (0.1, 3.0),
    "near_pi": (np.pi - 1e-3, np.pi - 1e-9),
    "beyond_pi": (3.3, 6.0),
}
"""Flag -> range of the angle, log-uniform."""


def build(rng: np.random.Generator) -> Topic:
    """All groups of rotations."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    for flag, (low, high) in REGIMES.items():
        _regime(topic, flag, [rotation_vector(rng, low, high) for _ in range(12)])
    _ends(topic)
    near = tolerance(1e-13, "a logarithm and an exponential")
    topic.group("so3.interpolate", "eq-rodrigues", SERIES, near, [_between(rng) for _ in range(15)])
    rule = tolerance(1e-13, "condition of the polar factor, below 50, times eps", float32=1e-4)
    oracle = "polar factor by Newton's iteration, 50 digits"
    topic.group("so3.nearest", "eq-log-rotation", oracle, rule, [_nearest(rng) for _ in range(15)])
    _random(topic)
    _every_size(topic)
    _special(topic, rng)
    return topic


def _regime(topic: Topic, flag: str, phis: list[Array]) -> None:
    """Exponential, Jacobians and logarithm at some rotation vectors."""
    flags = () if flag == "generic" else (flag,)
    fine, pole = tolerance(2e-14, ROUNDING), tolerance(1e-13, NEAR_POLE, float32=1e-3)
    rule = tolerance(1e-13, SQUARED) if flag == "beyond_pi" else fine
    topic.group("so3.exp", "eq-rodrigues", SERIES, rule, [_exp(p) for p in phis], flags=flags)
    cases = [{**_jacobian(p, flag), "tolerance": losing(fine, _size(p), 1, COSINE)} for p in phis]
    topic.group("so3.left_jacobian", "eq-v", f"{SERIES}, integrated", fine, cases, flags=flags)
    oracle = "exact inverse of the left Jacobian"
    rules = [
        losing(pole, np.pi - _size(p), 1, HALF) if flag == "near_pi" else losing(pole, _size(p), 2, RATIO)
        for p in phis
    ]
    cases = [{**_inverse(p), "tolerance": rule} for p, rule in zip(phis, rules, strict=True)]
    topic.group("so3.left_jacobian_inverse", "eq-v-inverse", oracle, pole, cases, flags=flags)
    if flag != "beyond_pi":
        rule = _log_tolerance(flag)
        cases = [{**_log(p), "tolerance": losing(rule, np.pi - _size(p), 2, ARC)} for p in phis]
        oracle = "Newton's iteration on the series, 50 digits"
        topic.group("so3.log", "eq-log-rotation", oracle, rule, cases, flags=flags)


def _size(phi: Array) -> float:
    return float(np.linalg.norm(phi))


SQUARED = "a general matrix exponential halves the angle and squares as often: some ten eps of the angle"
COSINE = "(1 - cos a)/a^2 loses eps/a of the entries"
RATIO = "a sin a/(1 - cos a) loses eps/a^2"
HALF = "1 + cos a near a half turn: eps over the distance from pi"
ARC = "R - R^T over the sine of an arc cosine near a half turn: eps over its squared distance from pi"


def _every_size(topic: Topic) -> None:
    """Angles of a log-spaced grid, about the axes of coordinates and others."""
    fine, pole = tolerance(2e-14, ROUNDING), tolerance(1e-13, NEAR_POLE, float32=1e-3)
    squared = tolerance(1e-13, SQUARED)
    flags = ("any_angle",)
    for k, phi in enumerate(vector_grid([*GRID, *BEYOND])):
        a = abs((GRID + BEYOND)[k])
        case = {**_exp(phi), "tolerance": fine if a < np.pi else squared}
        topic.group("so3.exp", "eq-rodrigues", SERIES, fine, [case], flags=flags)
        case = {
            **_jacobian(phi, "small_angle" if a < 1e-3 else ""),
            "tolerance": losing(fine if a < np.pi else squared, a, 1, COSINE),
        }
        topic.group("so3.left_jacobian", "eq-v", f"{SERIES}, integrated", fine, [case], flags=flags)
        near = abs(np.pi - a)
        rule = losing(pole, near, 1, HALF) if near < 0.1 else losing(pole, a, 2, RATIO)
        case = {**_inverse(phi), "tolerance": rule}
        oracle = "exact inverse of the left Jacobian"
        topic.group("so3.left_jacobian_inverse", "eq-v-inverse", oracle, pole, [case], flags=flags)
        if a < np.pi:
            rule = _log_tolerance("small_angle" if a < 0.1 else "")
            case = {**_log(phi), "tolerance": losing(rule, near, 2, ARC)}
            oracle = "Newton's iteration on the series, 50 digits"
            topic.group("so3.log", "eq-log-rotation", oracle, rule, [case], flags=flags)
    for a, phi in zip(MANY_TURNS, vector_grid(MANY_TURNS), strict=True):
        rule = tolerance(float(f"{1e-14 * a:.1e}"), SQUARED, float32=1e-2)
        topic.group("so3.exp", "eq-rodrigues", SERIES, rule, [_exp(phi)], flags=("many_turns",))
        case = _jacobian(phi, "")
        topic.group("so3.left_jacobian", "eq-v", f"{SERIES}, integrated", rule, [case], flags=("many_turns",))


def _special(topic: Topic, rng: np.random.Generator) -> None:
    """Zero, the ends of an interpolation and beyond, the long way round, mirrors, and right angles."""
    zero, exact = np.zeros(3), tolerance(0.0, "exact", absolute=1e-300)
    one = {"inputs": {"phi": zero}, "expected": {"J": np.eye(3)}}
    topic.group("so3.left_jacobian", "eq-v", "definition", exact, [one], flags=("zero",))
    topic.group("so3.left_jacobian_inverse", "eq-v-inverse", "definition", exact, [one], flags=("zero",))
    near = tolerance(1e-13, "a logarithm and an exponential")
    parts = (0.0, 1.0, -0.5, 1.5, 3.0)
    a, phi = rotation_vector(rng, 0.2, 3.0), rotation_vector(rng, 0.3, 1.2)
    cases = [_on_the_way(a, phi, f) for f in parts]
    topic.group("so3.interpolate", "eq-rodrigues", SERIES, near, cases, flags=("outside",))
    cases = [_on_the_way(a, zero, f) for f in (0.0, 0.3, 1.0)]
    topic.group("so3.interpolate", "eq-rodrigues", SERIES, near, cases, flags=("same",))
    # the sum of both turns is more than a half: the short way is back
    long = [
        _on_the_way(digits(2.5 * n), digits(x * n), 0.4)
        for n, x in zip(AXES, (2.9, 3.1, 2.0, -2.9, 3.0), strict=True)
    ]
    topic.group("so3.interpolate", "eq-rodrigues", SERIES, near, long, flags=("long_way",))
    tiny = [
        _on_the_way(a, digits(x * n), 0.7) for n, x in zip(AXES, (1e-9, 1e-6, 1e-4, 1e-3, 1e-2), strict=True)
    ]
    topic.group("so3.interpolate", "eq-rodrigues", SERIES, near, tiny, flags=("small_angle",))
    rule = tolerance(1e-13, "condition of the polar factor, below 50, times eps", float32=1e-4)
    oracle = "largest trace(R^T M) by Horn's quaternion, 50 digits"
    cases = [_nearest_to_mirror(rng) for _ in range(8)]
    topic.group("so3.nearest", "eq-log-rotation", oracle, rule, cases, flags=("mirrored",))
    eye = {"inputs": {"M": np.eye(3)}, "expected": {"R": np.eye(3)}}
    topic.group("so3.nearest", "eq-log-rotation", "definition", rule, [eye], flags=("identity",))
    # exact matrices of right angles: sines of 1 and cosines of 0
    turns = [np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])]
    starts = (np.array([np.pi / 2, 0, 0]), 2 * np.pi / 3 / np.sqrt(3) * np.ones(3))
    cases = [
        {"inputs": {"R": R}, "expected": {"phi": floats(log_of(R, s))}}
        for R, s in zip(turns, starts, strict=True)
    ]
    topic.group(
        "so3.log", "eq-log-rotation", SERIES, tolerance(1e-14, ROUNDING), cases, flags=("right_angles",)
    )


def _on_the_way(a: Array, phi: Array, fraction: float) -> dict[str, Any]:
    """Part of the way from Exp(a) to Exp(a) Exp(phi), the angle of phi below pi."""
    A = expm(hat(vector(a)))
    Ra, Rb = np.array(floats(A)), np.array(floats(A * expm(hat(vector(phi)))))
    step = log_of(np.array(floats(polar(matrix(Ra)).T * polar(matrix(Rb)))), phi)
    R = polar(matrix(Ra)) * expm(hat([mpf(fraction) * s for s in step]))
    return {"inputs": {"a": Ra, "b": Rb, "fraction": fraction}, "expected": {"R": floats(R)}}


def _nearest_to_mirror(rng: np.random.Generator) -> dict[str, Any]:
    """A matrix of negative determinant: the polar factor is a mirror, and the nearest rotation is not."""
    R = expm(hat(vector(rotation_vector(rng, 0.2, 3.0))))
    M = digits(
        np.array(floats(R))
        @ np.diag([1.0, 1.0, -1.0])
        @ np.diag(rng.uniform([1.5, 1.0, 0.3], [2.0, 1.4, 0.7]))
    )
    right = rotation(matrix(M))
    mirror = polar(matrix(M))
    return {
        "inputs": {"M": M},
        "expected": {"R": floats(right)},
        "mistakes": {"mirror": {"R": floats(mirror)}},
    }


def _ends(topic: Topic) -> None:
    """The identity, exactly, and half turns, where both ends of the axis are right."""
    zero, exact = np.zeros(3), tolerance(0.0, "exact", absolute=1e-300)
    topic.group("so3.exp", "eq-rodrigues", "definition", exact, [_exp(zero)], flags=("zero",))
    topic.group("so3.log", "eq-log-rotation", "definition", exact, [_log(zero)], flags=("zero",))
    axes = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [1.0, 2.0, -2.0]])
    cases = [_half_turn(np.pi * axis / np.linalg.norm(axis)) for axis in axes]
    reason = "R is rounded: near pi a rounding of eps can move the angle by its root, never the axis"
    rule = tolerance(3e-8, reason, float32=2e-3)
    topic.group("so3.log", "eq-log-rotation", "definition", rule, cases, flags=("pi",))


def _exp(phi: Array) -> dict[str, Any]:
    R = expm(hat(vector(phi)))
    case = {"inputs": {"phi": phi}, "expected": {"R": floats(R)}}
    if np.linalg.norm(phi) > 1e-6 and abs(np.linalg.norm(phi) - np.pi) > 1e-2:
        case["mistakes"] = {"transposed": {"R": floats(R.T)}}
    return case


def left_jacobian(phi: list[Any]) -> Any:
    """Sum of hat(phi)^k / (k + 1)!: the integral of the exponential from 0 to 1."""
    big = mpmath.zeros(6, 6)
    H = hat(phi)
    for i in range(3):
        for j in range(3):
            big[i, j] = H[i, j]
        big[i, 3 + i] = mpf(1)
    full = expm(big)  # the upper right block of the exponential of [[H, I], [0, 0]] is that integral
    return full[0:3, 3:6]


def _jacobian(phi: Array, flag: str) -> dict[str, Any]:
    x = vector(phi)
    J = left_jacobian(x)
    mistakes = {"right-jacobian": {"J": floats(J.T)}}
    if flag == "small_angle":
        # told apart from the right answer down to a thousand tolerances
        wrong = {"small-angle-sign": {"J": floats(mpmath.eye(3) - hat(x) / 2)}}
        mistakes = wrong if np.linalg.norm(phi) > 1e-11 else {}
    return {"inputs": {"phi": phi}, "expected": {"J": floats(J)}, "mistakes": mistakes}


def _inverse(phi: Array) -> dict[str, Any]:
    return {"inputs": {"phi": phi}, "expected": {"J": floats(left_jacobian(vector(phi)) ** -1)}}


def _log_tolerance(flag: str) -> dict[str, Any]:
    if flag == "near_pi":
        reason = "the entries of R are rounded to eps; through the quaternion all digits are kept"
        return tolerance(1e-14, reason, float32=2e-3)
    if flag == "small_angle":
        return tolerance(1e-14, "the off-diagonal entries carry the angle", absolute=2.3e-16, float32=1e-4)
    return tolerance(1e-14, ROUNDING)


def _log(phi: Array) -> dict[str, Any]:
    """The logarithm of the *rounded* matrix: Newton's iteration from phi, on what the program is given."""
    R = np.array(floats(expm(hat(vector(phi)))))
    return {"inputs": {"R": R}, "expected": {"phi": floats(log_of(R, phi))}}


def log_of(R: Array, start: Array) -> list[Any]:
    """Rotation vector whose exponential is the rotation nearest to R, in 50 digits."""
    target = polar(matrix(R))
    x = vector(start)
    for _ in range(6):
        E = target * expm(hat(x)).T
        small = [(E[2, 1] - E[1, 2]) / 2, (E[0, 2] - E[2, 0]) / 2, (E[1, 0] - E[0, 1]) / 2]
        step = left_jacobian(x) ** -1 * mpmath.matrix(small)
        x = [a + b for a, b in zip(x, column(step), strict=True)]
    assert mpmath.mnorm(expm(hat(x)) - target, 1) < mpf(10) ** -40
    return x


def polar(M: Any) -> Any:
    """Orthogonal polar factor by Newton's iteration X <- (X + X^-T)/2."""
    X = M
    for _ in range(100):
        Y = (X + (X**-1).T) / 2
        if mpmath.mnorm(Y - X, 1) < mpf(10) ** -45:
            return Y
        X = Y
    raise ArithmeticError("the iteration for the polar factor does not end")


def _half_turn(phi: Array) -> dict[str, Any]:
    axis = phi / np.linalg.norm(phi)
    R = 2 * np.outer(axis, axis) - np.eye(3)
    return {"inputs": {"R": R}, "expected": {"phi": phi}, "accept": [{"phi": -phi}]}


def _between(rng: np.random.Generator) -> dict[str, Any]:
    a, phi = rotation_vector(rng, 0.2, 3.0), rotation_vector(rng, 0.1, 2.9)
    fraction = float(rng.uniform(0.05, 0.95))
    A = expm(hat(vector(a)))
    Ra, Rb = np.array(floats(A)), np.array(floats(A * expm(hat(vector(phi)))))
    step = log_of(np.array(floats(matrix(Ra).T * matrix(Rb))), phi)
    R = polar(matrix(Ra)) * expm(hat([mpf(fraction) * s for s in step]))
    return {"inputs": {"a": Ra, "b": Rb, "fraction": fraction}, "expected": {"R": floats(R)}}


def _nearest(rng: np.random.Generator) -> dict[str, Any]:
    R = expm(hat(vector(rotation_vector(rng, 0.2, 3.0))))
    M = np.array(floats(R)) @ (np.diag(rng.uniform(0.5, 2.0, 3)) + 0.05 * rng.standard_normal((3, 3)))
    return {"inputs": {"M": M}, "expected": {"R": floats(polar(matrix(M)))}}


def _random(topic: Topic) -> None:
    """Uniform rotations: characters have E chi = 0, E chi^2 = 1, E chi^4 = 3, so Var chi^2 = 2."""
    samples, false_alarm = 2000, 1e-4
    z = float(norm.isf(false_alarm / 2)) / samples**0.5
    bands = {
        "mean_trace": (-z, z, false_alarm),
        "mean_squared_trace": (1.0 - z * 2.0**0.5, 1.0 + z * 2.0**0.5, false_alarm),
        "worst_orthogonality": (0.0, 1e-12, 0.0),
    }
    # tr R = 1 + 2 cos a with a uniform: mean 1, variance 2; its square: mean 3, variance 10, taken as 16
    uneven = {
        "mean_trace": {"low": 1.0 - z * 2.0**0.5, "high": 1.0 + z * 2.0**0.5},
        "mean_squared_trace": {"low": 3.0 - 4.0 * z, "high": 3.0 + 4.0 * z},
    }
    for measure, (low, high, rate) in bands.items():
        rule: dict[str, Any] = {
            **{"output": "R", "measure": measure, "samples": samples},
            **{"low": low, "high": high, "false_alarm": rate},
        }
        if measure == "worst_orthogonality":
            rule["float32"] = {"low": 0.0, "high": 2e-6}  # a dozen roundings of entries of order 1
        if measure in uneven:
            rule["mistakes"] = {"uniform-angles": uneven[measure]}
        case = {"inputs": {"N": samples}, "expected": {"R": []}}
        oracle = "characters of SO(3)"
        flags = ("statistical", measure)
        topic.group(
            "so3.random",
            "eq-rodrigues",
            oracle,
            tolerance(0.0, "a band"),
            [case],
            flags=flags,
            statistic=rule,
        )
