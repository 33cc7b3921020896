"""Unit quaternions and rotation matrices: q = (cos a/2, sin a/2 n) and Exp(a n), in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.angles import BEYOND, GRID, losing, vector_grid
from generator.building import Topic, tolerance
from generator.exact import expm, floats, hat, vector
from generator.groups import REGIMES, Array, turn

TOPIC, CHAPTER = "quaternion", 2

NOTES = {
    "conjugated": (
        "your quaternion turns the other way: its rotation is the transpose",
        "(w, -x, -y, -z) for (w, x, y, z)",
    ),
    "whole-angle": ("your quaternion uses the whole angle; it must use half of it", "(cos a, sin a n)"),
    "identity-near-a-half-turn": (
        "you divide by w, which vanishes at a half turn: take the largest of the four as the divisor",
        "w = sqrt(1 + tr R)/2 with a guard, v = vee(R - R^T)/(4 w)",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """Both ways, in all regimes."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    fine = tolerance(2e-15, "a dozen operations on numbers up to 1, each within eps = 2.2e-16")
    oracle = "half-angle definition and power series of the rotation, 50 digits"
    for flag in REGIMES:
        flags = () if flag == "generic" else (flag,)
        phis = [turn(rng, flag) for _ in range(10)]
        topic.group(
            "quaternion.to_rotation", "eq-half", oracle, fine, [_to_rotation(p) for p in phis], flags=flags
        )
        near = [abs(np.pi - float(np.linalg.norm(p))) for p in phis]
        cases = [
            {**_from_rotation(p), "tolerance": losing(fine, d, 2, DIVIDED)}
            for p, d in zip(phis, near, strict=True)
        ]
        topic.group("quaternion.from_rotation", "eq-half", oracle, fine, cases, flags=flags)
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0], [0, 0.6, -0.8], [2 / 3, -1 / 3, 2 / 3]])
    topic.group(
        "quaternion.from_rotation",
        "eq-half",
        "definition",
        fine,
        [_half_turn(a) for a in axes],
        flags=("pi",),
    )
    exact = tolerance(0.0, "exact", absolute=1e-300)
    q, eye = [1.0, 0.0, 0.0, 0.0], np.eye(3)
    one = {"inputs": {"R": eye}, "expected": {"q": q}, "accept": [{"q": [-1.0, 0.0, 0.0, 0.0]}]}
    topic.group("quaternion.from_rotation", "eq-half", "definition", exact, [one], flags=("zero",))
    one = {"inputs": {"q": q}, "expected": {"R": eye}}
    topic.group("quaternion.to_rotation", "eq-half", "definition", exact, [one], flags=("zero",))
    _every_size(topic, fine, oracle)
    return topic


DIVIDED = "(R - R^T)/(4 w) with w = sqrt(1 + tr R)/2, which vanishes at a half turn: eps over w^2"


def _every_size(topic: Topic, fine: dict[str, Any], oracle: str) -> None:
    """Angles of a log-spaced grid; every one of the four entries is the largest once; other signs of w."""
    for k, phi in enumerate(vector_grid([*GRID, *BEYOND])):
        size = abs((GRID + BEYOND)[k])
        case = {**_from_rotation(phi), "tolerance": losing(fine, abs(np.pi - size), 2, DIVIDED)}
        topic.group("quaternion.from_rotation", "eq-half", oracle, fine, [case], flags=("any_angle",))
        topic.group(
            "quaternion.to_rotation", "eq-half", oracle, fine, [_to_rotation(phi)], flags=("any_angle",)
        )
    flipped = [_to_rotation(p, -1.0) for p in vector_grid([1e-3, 1.0, 2.0, 3.0])]
    topic.group("quaternion.to_rotation", "eq-half", oracle, fine, flipped, flags=("other_sign",))
    half = [
        {"inputs": {"q": [0.0, *axis]}, "expected": {"R": 2 * np.outer(axis, axis) - np.eye(3)}}
        for axis in np.eye(3)
    ]
    topic.group("quaternion.to_rotation", "eq-half", "definition", fine, half, flags=("pi",))


def _quaternion(phi: Array, share: Any) -> list[Any]:
    x = vector(phi)
    angle = mpmath.sqrt(sum(v * v for v in x))
    return [mpmath.cos(angle * share), *(v / angle * mpmath.sin(angle * share) for v in x)]


def _rotation(q: Array) -> Any:
    """Exp of the rotation vector of a rounded quaternion, brought to length 1."""
    w, *v = vector(q)
    sine = mpmath.sqrt(sum(x * x for x in v))
    angle = 2 * mpmath.atan2(sine, w)
    return expm(hat([angle * x / sine for x in v]))


def _to_rotation(phi: Array, sign: float = 1.0) -> dict[str, Any]:
    q = sign * np.array(floats(_quaternion(phi, mpf(1) / 2)))
    R = _rotation(q)
    mistakes = {"conjugated": {"R": floats(R.T)}} if _tells(phi) else {}
    return {"inputs": {"q": q}, "expected": {"R": floats(R)}, "mistakes": mistakes}


def _from_rotation(phi: Array) -> dict[str, Any]:
    R = floats(expm(hat(vector(phi))))
    q = np.array(floats(_quaternion(phi, mpf(1) / 2)))
    mistakes: dict[str, Any] = {}
    if _tells(phi):
        mistakes["conjugated"] = {"q": q * np.array([1.0, -1.0, -1.0, -1.0])}
        mistakes["whole-angle"] = {"q": floats(_quaternion(phi, mpf(1)))}
    return {"inputs": {"R": R}, "expected": {"q": q}, "accept": [{"q": -q}], "mistakes": mistakes}


def _tells(phi: Array) -> bool:
    """Whether turning the other way is another rotation."""
    angle = float(np.linalg.norm(phi))
    return angle > 1e-6 and abs(angle - np.pi) > 1e-2


def _half_turn(axis: Array) -> dict[str, Any]:
    R = 2 * np.outer(axis, axis) - np.eye(3)
    q = np.concatenate([[0.0], axis])
    identity = {"identity-near-a-half-turn": {"q": [1.0, 0.0, 0.0, 0.0]}}
    return {"inputs": {"R": R}, "expected": {"q": q}, "accept": [{"q": -q}], "mistakes": identity}
