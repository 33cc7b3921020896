"""The reduced filter of 4 + 2n states: a prediction and whole runs."""

from __future__ import annotations

import numpy as np

from generator import exact_lift
from generator.building import Topic, tolerance
from generator.draws import digits
from generator.ekf import asked, some, trace_case
from generator.lift import gaussian_tolerance
from generator.world import covariance, drive, increment, random_pose

TOPIC, CHAPTER = "reduced", 16
DEFINITION = "definition in 50 digits, Jacobians by difference quotients"

NOTES = {
    "gtpg": ("your predict computes M^T P M", "P <- M^T P M + J_U Q_U J_U^T"),
    "no-common-noise": (
        "your noise enters the diagonal blocks only, which is all that B17 and B19 print",
        "J_U Q_U J_U^T without its cross blocks",
    ),
    "first-order": (
        "your moments are those of first order; the exact ones of a Gaussian were asked for",
        "(x, y, sin, cos) of the mean, J P J^T",
    ),
    "product-of-means": (
        "you put products of means where the means of products belong",
        "E[u1] E[u3] for E[u1 u3]",
    ),
    "landmarks-turn-left": (
        "your landmarks turn with the vehicle, to the left; seen from it they turn to the right",
        "R(dalpha) (r - (ds, 0))",
    ),
    "turn-before-drive": (
        "your vehicle turns before it drives, in the landmarks' rows",
        "R(dalpha)^T r - (ds, 0)",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of the reduced filter."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _reduced(topic, rng)
    _traces(topic, rng)
    _gaussian(topic, rng)
    return topic


def _reduced(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(3e-14, "sums of 10 x 10 products at most, each rounded by eps: 100 eps = 2.2e-14")
    of_map = ["landmarks-turn-left", "turn-before-drive", "no-common-noise", "gtpg"]
    for flag, count, n in (("", 10, 1), ("several", 6, 3), ("no_map", 6, 0)):
        cases = []
        for k in range(count):
            x, _ = random_pose(rng)
            m = np.round([*x[:2], np.sin(x[2]), np.cos(x[2]), *rng.uniform(-9, 9, 2 * n)], 4)
            P = covariance(rng, np.array([0.3, 0.25, 0.1, 0.1, *[0.4] * (2 * n)]))
            moved, cov = increment(rng)
            inputs = {"m": m, "P": P, "increment": moved, "cov": cov}
            names = some(of_map, k, 1) if n else ["gtpg"]
            cases.append(asked(inputs, exact_lift.reduced_predict, names, ("m", "P")))
        label = "eq-reduced-filter"
        topic.group("reduced.predict", label, DEFINITION, rule, cases, flags=flag)


def _traces(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-12, "40 steps of sums of 10 x 10 products, each rounded by eps: 4000 eps = 9e-13")
    runs = [drive(rng, steps, landmarks) for steps, landmarks in ((20, 3), (30, 2), (40, 2))]
    cases = [trace_case(inputs, exact_lift.run, []) for inputs in runs]
    oracle = "straight-line filter of all 11 + 6n states in 50 digits, its matrices by computer algebra"
    topic.group("reduced.trace", "eq-reduction", oracle, rule, cases)
    cases = [trace_case(drive(rng, 20, 3, every=5), exact_lift.run, [])]
    cases += [trace_case(drive(rng, 38, 2, every=19), exact_lift.run, [])]
    topic.group("reduced.trace", "eq-reduction", oracle, rule, cases, flags=("sparse",))


def _gaussian(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "derivatives of the moment generating function by computer algebra, 50 digits"
    for flag, scale in (("", 1.0), ("small_noise", 1e-4)):
        rule = gaussian_tolerance(flag)
        starts, steps = [], []
        for k in range(8):
            x, _ = random_pose(rng)
            P = digits(covariance(rng, np.array([0.3, 0.25, 0.4])) * scale**2)
            names = ["first-order"] if not flag else []
            starts.append(asked({"x": x, "P": P}, exact_lift.reduced_start, names, ("m", "P")))
            n = k % 3
            m = np.round([*x[:2], np.sin(x[2]), np.cos(x[2]), *rng.uniform(-9, 9, 2 * n)], 4)
            P = covariance(rng, np.array([0.3, 0.25, 0.1, 0.1, *[0.4] * (2 * n)]))
            moved, cov = increment(rng)
            cov = digits(9 * cov * scale**2)
            names = ["product-of-means"] if not flag and n else []
            inputs = {"m": m, "P": P, "increment": moved, "cov": cov}
            steps.append(asked(inputs, exact_lift.reduced_gaussian, names, ("m", "P")))
        flags = (flag,) if flag else ()
        topic.group("reduced.start", "eq-gaussian-moments", oracle, rule, starts, flags=flags)
        topic.group("reduced.gaussian_predict", "eq-gaussian-moments", oracle, rule, steps, flags=flags)
