"""EKF-SLAM: a prediction, an update, a new landmark, and whole runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import ekf_others, ekf_sizes, exact_ekf
from generator.building import Topic, tolerance
from generator.exact_arrays import Big, big, doubles, stack
from generator.exact_ekf import ideal_run
from generator.world import covariance, drive, drive_truth, state, told
from vslam_ref.arrays import Array

TOPIC, CHAPTER = "ekf", 15
DEFINITION = "definition in 50 digits, Jacobians by difference quotients"
PREDICTED = "sums of 7 x 7 products at most, each rounded by eps: 49 eps = 1.1e-14"
UPDATED = "sums of 9 x 9 products behind an inverse of S of condition below 120: 9720 eps = 2.2e-12"
BIG_MAP = "sums of 17 x 17 products at most, each rounded by eps: 289 eps = 6.4e-14"
BIG_UPDATE = "sums of 17 x 17 products behind an inverse of S of condition below 300: 87000 eps = 2e-11"

NOTES = {
    "gtpg": ("your predict computes G^T P G", "P <- F^T P F + G cov_u G^T"),
    "sin-cos-swapped": (
        "sine and cosine are swapped in your Jacobian of the motion in the heading",
        "F[0, 2] = -ds cos(theta), F[1, 2] = ds sin(theta)",
    ),
    "cross-not-moved": (
        "your predict moves the pose's covariance only; the cross covariances with the map stay behind",
        "P_pm unchanged for F P_pm",
    ),
    "cov-u-as-increment": (
        "you add the control's covariance as if it were that of distance and turn",
        "G cov_u G^T, G the derivative in (ds, dalpha) for that in (v, steering)",
    ),
    "no-process-noise": ("your predict adds no noise", "P <- F P F^T"),
    "heading-not-wrapped": ("your heading leaves (-pi, pi]", "theta, not wrapped"),
    "innovation-sign": (
        "your innovation has the wrong sign: predicted minus measured, added",
        "x <- x + K (h(x) - z)",
    ),
    "global-measurement": (
        "you take the measurement for global axes, as B20 is printed: it is in the vehicle's axes",
        "h = landmark - position, not turned",
    ),
    "transposed-rotation": (
        "your h turns by theta where it has to turn back",
        "h = R(theta) (landmark - position)",
    ),
    "heading-column-sign": (
        "the heading's column of your measurement Jacobian has the wrong sign",
        "dh/dtheta = (-h2, h1)",
    ),
    "one-at-a-time": (
        "you update with one landmark after the other and linearise anew: a right filter, but another one;"
        " all sightings at once were asked for",
        "an update for each row of z",
    ),
    "pose-only": ("your update corrects the pose and leaves the map as it was", "x_m, P_pm, P_mm unchanged"),
    "identity-landmark": (
        "your new landmark has identity covariance and no cross covariances",
        "P = [[P, 0], [0, I]]",
    ),
    "no-cross-covariance": (
        "your new landmark has no cross covariances: what it shares with the pose is lost",
        "P = [[P, 0], [0, G_x P G_x^T + G_z cov_z G_z^T]]",
    ),
    "cross-with-pose-only": (
        "your new landmark is correlated with the pose, but not with the other landmarks",
        "rows G_x P_pp, and 0 for G_x P_pm",
    ),
    "noise-not-turned": (
        "your new landmark has the measurement's covariance in the vehicle's axes; it has to be turned",
        "G_x P G_x^T + cov_z",
    ),
    "sensor-noise-only": (
        "your new landmark has the measurement's covariance only; the pose's is missing",
        "R cov_z R^T",
    ),
    "placed-unrotated": ("your new landmark is placed without turning the measurement", "position + z"),
    "naive-polar": (
        "you convert range and bearing without the correction of bias; its covariance is that of first order",
        "z = r (cos b, sin b), cov = R diag(sigma_range^2, r^2 sigma_bearing^2) R^T",
    ),
    "pose-noise-turned": ("you turn the pose's noise by the heading; it is given in the world", "R Q R^T"),
    "noise-alone": ("your distance leaves out the state's covariance", "e^T cov_z^-1 e"),
    "distance-not-squared": ("your distance is the root of what was asked for", "(e^T S^-1 e)^(1/2)"),
    "process-noise-as-sensor-noise": (
        "your update uses the control's covariance where the sensor's belongs",
        "S = H P H^T + cov_u",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of EKF-SLAM."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    _predictions(topic, rng)
    _updates(topic, rng)
    _new_landmarks(topic, rng)
    _polar(topic, rng)
    _traces(topic, rng)
    ekf_sizes.predictions(topic, rng, tolerance(6e-14, BIG_MAP))
    ekf_sizes.updates(topic, rng, tolerance(2e-11, BIG_UPDATE))
    ekf_sizes.new_landmarks(topic, rng, tolerance(6e-14, BIG_MAP))
    ekf_others.additive(topic, rng)
    ekf_others.gates(topic, rng)
    return topic


# -- prediction ------------------------------------------------------------------------------------


def _predictions(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(2e-14, PREDICTED)
    regimes: dict[str, tuple[int, Callable[[], dict[str, Any]]]] = {
        "": (18, lambda: _motion(rng, 0)),
        "map": (10, lambda: _motion(rng, 2)),
        "near_pi": (8, lambda: _across_pi(rng)),
        "straight": (6, lambda: _motion(rng, 0, steering=0.0)),
        "reverse": (6, lambda: _motion(rng, 0, speed=-1.5)),
        "singular": (6, lambda: {**_motion(rng, 0), "P": np.diag([0.0, 0.04, 0.0])}),
    }
    for flag, (count, draw) in regimes.items():
        cases = [_predict(draw(), k) for k in range(count)]
        topic.group("ekf.predict", "eq-predict", DEFINITION, rule, cases, flags=flag)


def _motion(
    rng: np.random.Generator, n: int, speed: float | None = None, steering: float | None = None
) -> dict[str, Any]:
    x, P = state(rng, n)
    control = np.round([rng.uniform(0.5, 4.0), rng.uniform(0.1, 0.6) * rng.choice([-1, 1])], 3)
    control = np.array([control[0] if speed is None else speed, control[1] if steering is None else steering])
    cov_u = covariance(rng, np.array([0.3, 0.05]))
    sizes = {"wheelbase": round(rng.uniform(0.8, 3.0), 2), "dt": float(rng.choice([0.1, 0.5]))}
    return {"x": x, "P": P, "control": control, "cov_u": cov_u, **sizes}


def _across_pi(rng: np.random.Generator) -> dict[str, Any]:
    inputs = _motion(rng, 0, speed=3.0)
    inputs["x"][2] = np.sign(inputs["control"][1]) * 3.1414
    return inputs


def _predict(inputs: dict[str, Any], k: int) -> dict[str, Any]:
    args = [big(inputs[k]) for k in ("x", "P", "control", "cov_u")] + [
        mpf(inputs[k]) for k in ("wheelbase", "dt")
    ]
    names = ["gtpg", "sin-cos-swapped", "cov-u-as-increment", "no-process-noise"]
    if len(inputs["x"]) > 3:
        names = ["gtpg", "cross-not-moved", "sin-cos-swapped"]
    if abs(inputs["x"][2]) > 3.1:
        names = ["heading-not-wrapped"]
    return case(inputs, lambda wrong: exact_ekf.predict(*args, wrong=wrong), some(names, k))


def case(
    inputs: dict[str, Any],
    answer: Callable[[str], tuple[Big, Big]],
    names: list[str],
    outputs: tuple[str, str] = ("x", "P"),
) -> dict[str, Any]:
    """A case with those wrong answers that differ from the right one."""
    right = answer("")
    mistakes = {}
    for name in names:
        wrong = answer(name)
        if _far(wrong, right):
            mistakes[name] = dict(zip(outputs, map(doubles, wrong), strict=True))
    out = {"inputs": inputs, "expected": dict(zip(outputs, map(doubles, right), strict=True))}
    return {**out, "mistakes": mistakes} if mistakes else out


def asked(
    inputs: dict[str, Any],
    function: Callable[..., tuple[Big, Big]],
    names: list[str],
    outputs: tuple[str, str] = ("x", "P"),
) -> dict[str, Any]:
    """A case whose answers ``function`` makes of the inputs, in their order and in 50 digits; ids stay."""
    args = [v if isinstance(v, list) else big(v) if np.ndim(v) else mpf(v) for v in inputs.values()]
    return case(inputs, lambda wrong: function(*args, wrong=wrong), names, outputs)


def some(names: list[str], k: int, count: int = 2) -> list[str]:
    """Some of the mistakes, others for every case: each whole answer is long."""
    return [names[(count * k + j) % len(names)] for j in range(min(count, len(names)))]


def _far(wrong: tuple[Big, Big], right: tuple[Big, Big]) -> bool:
    """Whether two answers differ by more than a millionth of their largest entry."""
    return any(
        max(abs(v) for v in (a - b).ravel()) > mpf("1e-6") * max(abs(v) for v in b.ravel())
        for a, b in zip(wrong, right, strict=True)
    )


# -- update ----------------------------------------------------------------------------------------


def _updates(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(2.5e-12, UPDATED)
    regimes: dict[str, tuple[int, Callable[[], dict[str, Any]]]] = {
        "": (12, lambda: _sighting(rng, 1, [0])),
        "several": (8, lambda: _sighting(rng, 3, [2, 0])),
        "near_pi": (6, lambda: _sighting_across_pi(rng)),
        "precise": (5, lambda: {**_sighting(rng, 1, [0]), "cov_z": np.diag([1e-4, 2e-4])}),
    }
    for flag, (count, draw) in regimes.items():
        cases = [_update(draw(), k) for k in range(count)]
        topic.group("ekf.update", "eq-gain", DEFINITION, rule, cases, flags=flag)


def _sighting(rng: np.random.Generator, n: int, ids: list[int]) -> dict[str, Any]:
    x, P = state(rng, n)
    cov_z = covariance(rng, np.array([0.1, 0.15]))
    error = rng.standard_normal((len(ids), 2)) * 0.2
    z = np.round(np.array([told(x, x[3 + 2 * i : 5 + 2 * i]) for i in ids]) + error, 3)
    return {"x": x, "P": P, "ids": ids, "z": z, "cov_z": cov_z}


def _sighting_across_pi(rng: np.random.Generator) -> dict[str, Any]:
    """The heading is estimated just below pi, and its variance is large: the update takes it across."""
    while True:
        inputs = _sighting(rng, 1, [0])
        inputs["x"][2] = 3.1412 * rng.choice([-1, 1])
        inputs["z"] = np.round(told(inputs["x"], inputs["x"][3:]) + rng.uniform(-0.5, 0.5, 2), 3)[None]
        x, P, z, cov_z = (big(inputs[k]) for k in ("x", "P", "z", "cov_z"))
        plain, _ = exact_ekf.update(x, P, inputs["ids"], z, cov_z, wrong="heading-not-wrapped")
        if abs(plain[2]) > mpmath.pi:
            return inputs


def _update(inputs: dict[str, Any], k: int) -> dict[str, Any]:
    args = [big(inputs["x"]), big(inputs["P"]), inputs["ids"], big(inputs["z"]), big(inputs["cov_z"])]
    names = ["innovation-sign", "global-measurement", "transposed-rotation", "heading-column-sign"]
    names.append("pose-only")
    if len(inputs["ids"]) > 1:
        names = ["one-at-a-time"]
    if abs(inputs["x"][2]) > 3.1:
        names = ["heading-not-wrapped"]
    return case(inputs, lambda wrong: exact_ekf.update(*args, wrong=wrong), some(names, k))


# -- new landmarks ---------------------------------------------------------------------------------


def _new_landmarks(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(2e-14, PREDICTED)
    for flag, count, n in (("", 12, 0), ("map", 8, 2), ("certain", 5, 0)):
        cases = []
        for k in range(count):
            x, P = state(rng, n)
            P = P if flag != "certain" else np.zeros_like(P)
            z = np.round(rng.uniform(-8, 8, 2), 3)
            inputs = {"x": x, "P": P, "z": z, "cov_z": covariance(rng, np.array([0.1, 0.3]))}
            cases.append(_augment(inputs, k))
        topic.group("ekf.augment", "eq-augment", DEFINITION, rule, cases, flags=flag)


def _augment(inputs: dict[str, Any], k: int) -> dict[str, Any]:
    args = [big(inputs[k]) for k in ("x", "P", "z", "cov_z")]
    names = ["identity-landmark", "no-cross-covariance", "noise-not-turned", "placed-unrotated"]
    names.append("sensor-noise-only")
    if len(inputs["x"]) > 3:
        names = ["identity-landmark", "no-cross-covariance", "cross-with-pose-only"]
        return case(inputs, lambda wrong: exact_ekf.augment(*args, wrong=wrong), some(names, k, 1))
    return case(inputs, lambda wrong: exact_ekf.augment(*args, wrong=wrong), some(names, k))


# -- range and bearing -----------------------------------------------------------------------------


def _polar(topic: Topic, rng: np.random.Generator) -> None:
    reason = "the variance across is a difference of exponentials near 1: relative to the larger variance"
    rule = tolerance(1e-12, reason)
    cases = [
        _from_polar(
            np.round([rng.uniform(1, 30), rng.uniform(-3, 3)], 3),
            round(rng.uniform(0.02, 0.3), 3),
            round(rng.uniform(0.005, 0.05), 4),
        )
        for _ in range(15)
    ]
    topic.group("ekf.from_polar", "eq-b20", "definition, 50 digits", rule, cases)
    refused = ([0.05, 0.3], 0.1, 0.01), ([20.0, 0.3], 0.1, 0.15), ([-4.0, 0.3], 0.1, 0.01)
    names = ("polar", "sigma_range", "sigma_bearing")
    rows = [dict(zip(names, row, strict=True)) for row in refused]
    cases = [{"inputs": row, "expected": {}, "result": "invalid"} for row in rows]
    topic.group("ekf.from_polar", "eq-b20", "definition", rule, cases, flags=("degenerate",))


def _from_polar(polar: Array, sigma_range: float, sigma_bearing: float) -> dict[str, Any]:
    def answer(wrong: str) -> tuple[Big, Big]:
        r, b = big(polar)
        s, v = mpf(sigma_range) ** 2, mpf(sigma_bearing) ** 2
        e = mpmath.exp
        grown, along = e(v / 2), s * (1 + e(2 * v)) / 2 - r**2 * (e(v) - 1) ** 2 / 2
        across = (r**2 - s) * (e(2 * v) - 1) / 2
        if wrong:
            grown, along, across = mpf(1), s, r**2 * v
        R = exact_ekf.rotation(b)
        return grown * r * R[:, 0], R @ np.diag(stack([along, across])) @ R.T

    inputs = {"polar": polar, "sigma_range": sigma_range, "sigma_bearing": sigma_bearing}
    return case(inputs, answer, ["naive-polar"], ("z", "cov"))


# -- runs ------------------------------------------------------------------------------------------


def _traces(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-12, "24 steps of sums of 13 x 13 products, each rounded by eps: 4056 eps = 9e-13")
    oracle = "straight-line filter in 50 digits, Jacobians by difference quotients"
    cases = [_trace(drive(rng, steps, landmarks)) for steps, landmarks in ((20, 4), (24, 3))]
    topic.group("ekf.trace", "eq-gain", oracle, rule, cases)
    cases = [_trace(drive(rng, 6, 2), ["process-noise-as-sensor-noise", "gtpg", "no-cross-covariance"])]
    topic.group("ekf.trace", "eq-gain", oracle, rule, cases, flags=("short",))
    cases = []
    for steps, landmarks, every in ((10, 2, 1), (15, 3, 4)):
        run = drive(rng, steps, landmarks, every)
        cases.append(trace_case({**run, **drive_truth(run)}, ideal_run, []))
    topic.group("ekf.ideal_trace", "eq-predict", oracle, rule, cases)


def exact_inputs(inputs: dict[str, Any]) -> dict[str, Any]:
    """Inputs of a run in 50 digits."""
    sightings = [[(i, big(z)) for i, z in zip(s["ids"], s["z"], strict=True)] for s in inputs["sightings"]]
    rest = {k: big(v) if np.ndim(v) else mpf(v) for k, v in inputs.items() if k != "sightings"}
    return {**rest, "sightings": sightings}


def _trace(inputs: dict[str, Any], names: list[str] | None = None) -> dict[str, Any]:
    return trace_case(inputs, exact_ekf.run, names or [])


def trace_case(inputs: dict[str, Any], run: Callable[..., Any], names: list[str]) -> dict[str, Any]:
    """A run, and runs with wrong formulas."""

    def steps(wrong: str) -> dict[str, Any]:
        found = run(exact_inputs(inputs), wrong=wrong) if wrong else run(exact_inputs(inputs))
        return {"steps": [{"x": doubles(x), "P": doubles(P)} for x, P in found]}

    out: dict[str, Any] = {"inputs": inputs, "expected": steps("")}
    return {**out, "mistakes": {name: steps(name) for name in names}} if names else out
