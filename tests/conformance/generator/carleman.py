"""The lifted filter B16-B28: single steps and whole runs."""

from __future__ import annotations

import numpy as np

from generator import exact_lift
from generator.building import Topic, tolerance
from generator.ekf import asked, some, trace_case
from generator.world import covariance, drive, increment, lifted_state

TOPIC, CHAPTER = "carleman", 16
LIFTED = "sums of 23 x 23 products at most, each rounded by eps: 529 eps = 1.2e-13"
ALGEBRA = "products expanded by computer algebra, evaluated in 50 digits"

NOTES = {
    "gtpg": ("your predict computes M^T P M", "P <- M^T P M + J_U Q_U J_U^T"),
    "b18-as-printed": (
        "the last row of a landmark's prediction is that of B18 as printed, with a plus",
        "z6 u3 + z5 u2",
    ),
    "no-common-noise": (
        "your noise enters the diagonal blocks only, which is all that B17 and B19 print",
        "J_U Q_U J_U^T without its cross blocks",
    ),
    "no-cross-blocks": (
        "your predict keeps the diagonal blocks of B17 and B19 only; there is nothing between them",
        "P = diag(P_R, P_1, P_2, ...)",
    ),
    "three-noises": (
        "you give U three independent noises; it has two, B10 does not say so",
        "Q_U = diag(cov_U)",
    ),
    "control-sin-cos-swapped": ("sine and cosine are swapped in your U", "U = (ds, cos, sin)"),
    "no-control-noise": ("your predict adds no noise", "P <- M P M^T"),
    "innovation-sign": ("your innovation has the wrong sign", "Z <- Z + K (H Z - z)"),
    "global-measurement": (
        "you take the measurement for global axes, as B20 is printed: it is in the vehicle's axes",
        "H Z = (z_i1 - z1, z_i2 - z2)",
    ),
    "heading-renormalised": (
        "you normalise (sin, cos) after the update; the filter of the paper does not",
        "(z3, z4)/|(z3, z4)|",
    ),
    "b26-as-printed": (
        "the fifth row of your new landmark is that of B26 as printed, with a minus",
        "x_new z5 - y_new z11 + z9",
    ),
    "identity-landmark": (
        "your new landmark has identity covariance and no cross covariances",
        "P = [[P, 0], [0, I]]",
    ),
    "no-cross-covariance": (
        "your new landmark has no cross covariances: what it shares with the pose is lost",
        "P = [[P, 0], [0, G_3 P G_3^T + G_new cov_z G_new^T]]",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of the lifted filter."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _predictions(topic, rng)
    _updates(topic, rng)
    _new_landmarks(topic, rng)
    _traces(topic, rng)
    return topic


def _predictions(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(2e-13, LIFTED)
    of_vehicle = ["gtpg", "three-noises", "control-sin-cos-swapped", "no-control-noise"]
    of_map = ["b18-as-printed", "no-common-noise", "no-cross-blocks", "gtpg"]
    regimes: tuple[tuple[tuple[str, ...], int, int, list[str]], ...] = (
        ((), 8, 0, of_vehicle),
        (("off_lift",), 5, 0, []),
        (("map",), 4, 1, of_map),
        (("map", "several"), 1, 2, []),
    )
    for flags, count, n, names in regimes:
        cases = []
        for k in range(count):
            Z, P = lifted_state(rng, n, off=flags != ())
            moved, cov = increment(rng)
            inputs = {"Z": Z, "P": P, "increment": moved, "cov": cov}
            cases.append(asked(inputs, exact_lift.predict, some(names, k, 1) if names else [], ("Z", "P")))
        label = "eq-cross-blocks" if "map" in flags else "eq-b17"
        topic.group("carleman.predict", label, ALGEBRA, rule, cases, flags=flags)


def _updates(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(5e-13, "sums of 23 x 23 products and an inverse of S of condition below 3: 1587 eps")
    for flag, count, n, ids in (("", 5, 1, [0]), ("several", 1, 2, [1, 0])):
        cases = []
        for k in range(count):
            Z, P = lifted_state(rng, n, off=True)
            H = np.array(exact_lift.sight(), dtype=np.float64)
            at = [[*range(11), *range(11 + 6 * i, 17 + 6 * i)] for i in ids]
            z = np.round([H @ Z[columns] + 0.2 * rng.standard_normal(2) for columns in at], 3)
            inputs = {"Z": Z, "P": P, "ids": ids, "z": z, "cov_z": covariance(rng, np.array([0.1, 0.15]))}
            names = ["innovation-sign", "global-measurement", "heading-renormalised"]
            cases.append(
                asked(inputs, exact_lift.update, some(names, k, 1) if not flag and k < 3 else [], ("Z", "P"))
            )
        topic.group("carleman.update", "eq-b22", ALGEBRA, rule, cases, flags=flag)


def _new_landmarks(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(2e-13, LIFTED)
    for flag, count, n in (("", 7, 0), ("map", 2, 1)):
        cases = []
        for k in range(count):
            Z, P = lifted_state(rng, n, off=True)
            z, cov_z = np.round(rng.uniform(-8, 8, 2), 3), covariance(rng, np.array([0.1, 0.3]))
            names = ["b26-as-printed", "identity-landmark", "no-cross-covariance"]
            names = some(names, k, 1) if not flag else []
            cases.append(
                asked({"Z": Z, "P": P, "z": z, "cov_z": cov_z}, exact_lift.augment, names, ("Z", "P"))
            )
        topic.group("carleman.augment", "eq-b28", ALGEBRA, rule, cases, flags=flag)


def _traces(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(5e-12, "24 steps of sums of 29 x 29 products, each rounded by eps: 2e4 eps")
    runs = [drive(rng, steps, landmarks) for steps, landmarks in ((20, 2), (24, 3))]
    mistakes = ["b18-as-printed", "b26-as-printed", "no-common-noise", "three-noises"]
    cases = [trace_case(inputs, exact_lift.run, mistakes if k == 0 else []) for k, inputs in enumerate(runs)]
    oracle = "straight-line lifted filter in 50 digits, its matrices by computer algebra"
    topic.group("carleman.trace", "eq-b17", oracle, rule, cases)
    cases = [trace_case(drive(rng, 16, 3, every=5), exact_lift.run, [])]
    topic.group("carleman.trace", "eq-cross-blocks", oracle, rule, cases, flags=("sparse",))
