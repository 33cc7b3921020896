"""The lift of a pose B14, and the pose that a lifted state stands for."""

from __future__ import annotations

from typing import Any

import numpy as np

from generator import exact_lift
from generator.building import Topic, tolerance
from generator.draws import digits
from generator.ekf import asked, some
from generator.exact_arrays import big, doubles
from generator.world import covariance, increment, lifted_state, random_pose

TOPIC, CHAPTER = "lift", 16
DEFINITION = "definition in 50 digits, Jacobians by difference quotients"

NOTES = {
    "no-products": (
        "the covariance of your lift ends with the first four states; the products have one, too",
        "P_Z = 0 outside the first 4 rows and columns",
    ),
    "cos-before-sin": ("your lift has the cosine before the sine", "(x, y, c, s, c^2, s^2, ...)"),
    "first-order": (
        "your moments are those of first order; the exact ones of a Gaussian were asked for",
        "the lift of the mean, J P J^T",
    ),
    "product-of-means": (
        "you put products of means where the means of products belong: z5 + z6 shrinks at every step",
        "E[u2]^2 for E[u2^2]",
    ),
    "atan2-swapped": ("the arguments of your atan2 are swapped", "atan2(c, s)"),
    "length-forgotten": (
        "your heading's variance takes (s, c) for a unit vector",
        "J = (c, -s) for (c, -s)/(s^2 + c^2)",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of lifts."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _lifts(topic, rng)
    _poses(topic, rng)
    _landmarks(topic, rng)
    _gaussian(topic, rng)
    return topic


def _lifts(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-14, "a dozen products", absolute=1e-17)
    for flag, count in (("", 12), ("near_pi", 8), ("small_angle", 8)):
        cases = []
        for k in range(count):
            x, P = random_pose(rng, flag)
            names = some(["no-products", "cos-before-sin"], k, 1) if not flag else []
            cases.append(asked({"x": x, "P": P}, exact_lift.lifted_start, names, ("Z", "P_Z")))
        topic.group("lift.vehicle", "eq-b14", DEFINITION, rule, cases, flags=flag)


def _poses(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-14, "an arc tangent and a quotient", absolute=1e-16)
    for flag, length in (("", 1.0), ("off_lift", 1.2), ("near_pi", 0.9)):
        cases = []
        for k in range(10):
            x, _ = random_pose(rng, flag)
            z = np.round([*x[:2], length * np.sin(x[2]), length * np.cos(x[2])], 6)
            P = covariance(rng, np.array([0.3, 0.25, 0.1, 0.1]))
            names = some(["atan2-swapped", "length-forgotten"], k, 1)
            cases.append(asked({"z": z, "P": P}, exact_lift.pose, names))
        topic.group("lift.pose", "eq-b5", DEFINITION, rule, cases, flags=flag)


def _landmarks(topic: Topic, rng: np.random.Generator) -> None:
    cases = []
    for _ in range(12):
        x, _ = random_pose(rng)
        place = np.round(rng.uniform(-9, 9, 2), 3)
        right = exact_lift.lifted_landmark(big(x), big(place))
        swapped = {"cos-before-sin": {"Z": doubles(right[[0, 1, 3, 2, 5, 4]])}}
        inputs = {"x": x, "landmark": place}
        cases.append({"inputs": inputs, "expected": {"Z": doubles(right)}, "mistakes": swapped})
    rule = tolerance(1e-14, "a sine and a product")
    topic.group("lift.landmark", "eq-b15", "definition in 50 digits", rule, cases)


def gaussian_tolerance(flag: str) -> dict[str, Any]:
    """Tolerance of exact moments."""
    if flag == "small_noise":
        reason = "differences of sines of order sigma = 2e-5 keep eps/sigma; margin 100"
        return tolerance(1e-9, reason, float32=1e-2)
    return tolerance(1e-13, "sums of a few dozen products, each rounded by eps", float32=1e-3)


def _gaussian(topic: Topic, rng: np.random.Generator) -> None:
    """Exact moments; where the variances are small they are differences of nearly equal numbers."""
    oracle = "derivatives of the moment generating function by computer algebra, 50 digits"
    for flag, scale in (("", 1.0), ("small_noise", 1e-4)):
        rule = gaussian_tolerance(flag)
        cases = []
        for _ in range(4):
            x, _ = random_pose(rng)
            P = digits(covariance(rng, np.array([0.3, 0.25, 0.4])) * scale**2)
            names = ["first-order"] if not flag else []
            cases.append(asked({"x": x, "P": P}, exact_lift.gaussian_start, names, ("Z", "P_Z")))
        topic.group("lift.gaussian", "eq-gaussian-moments", oracle, rule, cases, flags=flag)
    for flag, n, count in (("", 0, 4), ("map", 1, 1)):
        cases = []
        for _ in range(count):
            Z, P = lifted_state(rng, n, off=True)
            moved, cov = increment(rng)
            inputs = {"Z": Z, "P": P, "increment": moved, "cov": 9 * cov}
            cases.append(
                asked(inputs, exact_lift.predict_gaussian, ["product-of-means"] if not n else [], ("Z", "P"))
            )
        rule = tolerance(2e-13, "sums of 17 x 17 products at most, each rounded by eps, and their moments")
        topic.group("lift.gaussian_predict", "eq-gaussian-moments", oracle, rule, cases, flags=flag)
