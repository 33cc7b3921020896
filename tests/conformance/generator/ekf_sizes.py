"""EKF-SLAM of every size: 0, 1, 2, 3 and many landmarks, sightings and none, at rest, and on the axes."""

from __future__ import annotations

from typing import Any

import numpy as np

from generator import exact_ekf
from generator.building import Topic
from generator.exact_arrays import big, doubles
from generator.world import covariance, state, told
from vslam_ref.arrays import Array

MANY = 5
ORACLE = "definition in 50 digits, Jacobians by difference quotients"
HEADINGS = (0.0, np.pi / 2, -np.pi / 2, 3.0, -3.1)


def predictions(topic: Topic, rng: np.random.Generator, rule: dict[str, Any]) -> None:
    """Every size of map; at rest, without time, straight and reversed; headings along the axes."""
    cases = [_predict(rng, n) for n in (1, 3, MANY)]
    topic.group("ekf.predict", "eq-predict", ORACLE, rule, cases, flags="any_size")
    still = [_predict(rng, n, control=u) for n in (0, 2) for u in ([0.0, 0.3], [0.0, 0.0], [0.0, -0.6])]
    topic.group("ekf.predict", "eq-predict", ORACLE, rule, still, flags="at_rest")
    sides = [_predict(rng, 1, control=u) for u in ([1e-6, 0.3], [2.0, 1e-7], [-1.0, -0.5], [12.0, 1.2])]
    topic.group("ekf.predict", "eq-predict", ORACLE, rule, sides, flags="any_control")
    cases = [_predict(rng, 1, heading=h) for h in HEADINGS]
    topic.group("ekf.predict", "eq-predict", ORACLE, rule, cases, flags="on_axes")
    sure = [_predict(rng, 2, noise=0.0), _predict(rng, 2, zero=True)]
    topic.group("ekf.predict", "eq-predict", ORACLE, rule, sure, flags="certain")


def updates(topic: Topic, rng: np.random.Generator, rule: dict[str, Any]) -> None:
    """Each landmark of a map alone, all of them, none; headings along the axes; little and much known."""
    for flag, n, rows in (
        ("each", 3, ([0], [1], [2])),
        ("all", 3, ([0, 1, 2], [2, 1, 0])),
        ("many", MANY, (list(range(MANY)), [4, 1, 3])),
        ("none", 2, ([], [])),
    ):
        cases = [_update(rng, n, ids) for ids in rows]
        topic.group("ekf.update", "eq-gain", ORACLE, rule, cases, flags=flag)
    cases = [_update(rng, 2, [1, 0], heading=h) for h in HEADINGS]
    topic.group("ekf.update", "eq-gain", ORACLE, rule, cases, flags="on_axes")
    cases = [_update(rng, 2, [0, 1], grown=g) for g in (1e-6, 1e-3, 30.0)]
    topic.group("ekf.update", "eq-gain", ORACLE, rule, cases, flags="any_certainty")
    exact = [_update(rng, 2, [0, 1], surprise=0.0)]
    topic.group("ekf.update", "eq-gain", ORACLE, rule, exact, flags="no_surprise")


def new_landmarks(topic: Topic, rng: np.random.Generator, rule: dict[str, Any]) -> None:
    """A landmark more for a map of each size; at the vehicle itself; headings along the axes."""
    cases = [_augment(rng, n) for n in (1, 2, MANY)]
    topic.group("ekf.augment", "eq-augment", ORACLE, rule, cases, flags="any_size")
    cases = [
        _augment(rng, 1, z=z) for z in ([0.0, 0.0], [5.0, 0.0], [0.0, -4.0], [1e-6, 2e-6], [300.0, 40.0])
    ]
    topic.group("ekf.augment", "eq-augment", ORACLE, rule, cases, flags="any_place")
    cases = [_augment(rng, 1, heading=h) for h in HEADINGS]
    topic.group("ekf.augment", "eq-augment", ORACLE, rule, cases, flags="on_axes")


def _state(rng: np.random.Generator, n: int, heading: float | None) -> tuple[Array, Array]:
    x, P = state(rng, n)
    x[2] = x[2] if heading is None else heading
    return x, P


def _predict(
    rng: np.random.Generator,
    n: int,
    *,
    control: Any = None,
    heading: float | None = None,
    noise: float = 1.0,
    zero: bool = False,
) -> dict[str, Any]:
    x, P = _state(rng, n, heading)
    u = np.round([rng.uniform(0.5, 4.0), rng.uniform(-0.6, 0.6)], 3) if control is None else control
    inputs = {
        **{"x": x, "P": np.zeros_like(P) if zero else P, "control": np.array(u)},
        **{"cov_u": noise * covariance(rng, np.array([0.3, 0.05])), "wheelbase": 1.7, "dt": 0.25},
    }
    return _case(inputs, exact_ekf.predict(*(big(v) if np.ndim(v) else big([v])[0] for v in inputs.values())))


def _update(
    rng: np.random.Generator,
    n: int,
    ids: list[int],
    *,
    heading: float | None = None,
    grown: float = 1.0,
    surprise: float = 0.2,
) -> dict[str, Any]:
    x, P = _state(rng, n, heading)
    P = np.round(grown * P, 12)
    cov_z = covariance(rng, np.array([0.1, 0.15]))
    error = surprise * rng.standard_normal((len(ids), 2))
    places = [told(x, x[3 + 2 * i : 5 + 2 * i]) for i in ids]
    z = np.round(np.reshape(places, (-1, 2)) + error, 3 if surprise else 12)
    inputs = {"x": x, "P": P, "ids": ids, "z": z, "cov_z": cov_z}
    if not ids:
        return _case(inputs, (big(x), big(P)))
    return _case(inputs, exact_ekf.update(big(x), big(P), ids, big(z), big(cov_z)))


def _augment(
    rng: np.random.Generator, n: int, *, z: Any = None, heading: float | None = None
) -> dict[str, Any]:
    x, P = _state(rng, n, heading)
    at = np.round(rng.uniform(-8, 8, 2), 3) if z is None else np.array(z)
    inputs = {"x": x, "P": P, "z": at, "cov_z": covariance(rng, np.array([0.1, 0.3]))}
    return _case(inputs, exact_ekf.augment(*map(big, inputs.values())))


def _case(inputs: dict[str, Any], found: tuple[Any, Any]) -> dict[str, Any]:
    return {"inputs": inputs, "expected": {"x": doubles(found[0]), "P": doubles(found[1])}}
