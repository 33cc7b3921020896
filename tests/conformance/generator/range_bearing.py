"""EKF-SLAM's update by range and bearing as they are, the bearing's innovation across its seam, too."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np

from generator.building import Topic, tolerance
from generator.exact_arrays import Big, big, block_diagonal, doubles, inverse, jacobian, stack, wrap
from generator.exact_ekf import seen, wrapped
from generator.world import covariance, state

TOPIC, CHAPTER = "range_bearing", 15
ORACLE = "definition in 50 digits, Jacobians by difference quotients"
UPDATED = "sums of 9 x 9 products behind an inverse of S of condition below 500: 40000 eps = 1e-11"


NOTES = {
    "bearing-not-wrapped": (
        "your innovation of the bearing is not brought home: behind the vehicle it is off by a turn",
        "b - atan2(h2, h1)",
    ),
    "bearing-sign": ("the bearing's row of your measurement Jacobian has the wrong sign", "-db/dx"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    polar_updates(topic, rng)
    return topic


def polar_updates(topic: Topic, rng: np.random.Generator) -> None:
    """Range and bearing of landmarks of the map, the bearing's innovation across its seam, too."""
    rule = tolerance(1e-11, UPDATED)
    for flag, n, ids in (("", 1, [0]), ("each", 3, [1]), ("all", 3, [2, 0, 1]), ("none", 1, [])):
        cases = [_polar(rng, n, ids) for _ in range(1 if flag == "none" else 4)]
        topic.group("range_bearing.update", "eq-gain", ORACLE, rule, cases, flags=flag)
    cases = [_polar(rng, 2, [0], behind=side) for side in (1.0, -1.0, 1.0, -1.0)]
    topic.group("range_bearing.update", "eq-gain", ORACLE, rule, cases, flags="across_the_seam")


def _model(x: Big, slot: int) -> Big:
    d = seen(x, slot)
    return stack([mpmath.sqrt(d @ d), mpmath.atan2(d[1], d[0])])


def _polar(rng: np.random.Generator, n: int, ids: list[int], behind: float = 0.0) -> dict[str, Any]:
    x, P = state(rng, n)
    if (
        behind
    ):  # the landmark stands behind: its bearing is predicted on one side of the seam, seen on the other
        c, s = np.cos(x[2]), np.sin(x[2])
        x[3:5] = np.round(x[:2] + 5.0 * np.array([-c - 0.01 * behind * s, -s + 0.01 * behind * c]), 6)
    cov = covariance(rng, np.array([0.1, 0.03]))
    at = [np.array(doubles(_model(big(x), i))) for i in ids]
    off = (
        rng.standard_normal((len(ids), 2)) * [0.1, 0.03] if not behind else np.array([[0.1, 0.04 * -behind]])
    )
    polar = np.round(np.reshape(at, (-1, 2)) + (off if ids else 0), 4)
    if behind:
        polar[:, 1] = np.round(np.arctan2(np.sin(polar[:, 1]), np.cos(polar[:, 1])), 4)
        polar[0, 1] = -behind * abs(polar[0, 1]) if polar[0, 1] * behind > 0 else polar[0, 1]
    inputs = {"x": x, "P": P, "ids": ids, "polar": polar, "cov": cov}
    right = _updated(inputs)
    case: dict[str, Any] = {"inputs": inputs, "expected": right}
    wrong = _updated(inputs, wrong="bearing-not-wrapped")
    if behind and np.abs(np.array(wrong["x"]) - right["x"]).max() > 1e-3:
        case["mistakes"] = {"bearing-not-wrapped": wrong}
    if ids and not behind:
        case["mistakes"] = {"bearing-sign": _updated(inputs, wrong="bearing-sign")}
    return case


def _updated(inputs: dict[str, Any], wrong: str = "") -> dict[str, Any]:
    x, P, cov, ids = big(inputs["x"]), big(inputs["P"]), big(inputs["cov"]), inputs["ids"]
    if not ids:
        return {"x": doubles(x), "P": doubles(P)}
    H = np.concatenate([jacobian(lambda y, i=i: _model(y, i), x) for i in ids])  # type: ignore[misc]
    nu = np.concatenate([big(row) - _model(x, i) for i, row in zip(ids, inputs["polar"], strict=True)])
    if wrong != "bearing-not-wrapped":
        nu[1::2] = [wrap(v) for v in nu[1::2]]
    if wrong == "bearing-sign":
        H[1::2] = -H[1::2]
    S = H @ P @ H.T + block_diagonal([cov] * len(ids))
    K = P @ H.T @ inverse(S)
    return {"x": doubles(wrapped(x + K @ nu)), "P": doubles(P - K @ S @ K.T)}
