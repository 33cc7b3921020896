"""Filters as other programs have them: yaw rate, additive noise, and a gate."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import exact_ekf
from generator.building import Topic, tolerance
from generator.exact_arrays import Big, big, block_diagonal, doubles, inverse, jacobian, stack
from generator.exact_ekf import moved, rotation, seen, wrapped
from generator.world import covariance, state

ORACLE = "definition in 50 digits, Jacobians by difference quotients"


def additive(topic: Topic, rng: np.random.Generator) -> None:
    """Noise of the pose itself, added after the motion."""
    rule, cases = (
        tolerance(2e-14, "sums of 7 x 7 products at most, each rounded by eps: 49 eps = 1.1e-14"),
        [],
    )
    for n in (0, 0, 0, 1, 2):
        x, P = state(rng, n)
        control = np.round([rng.uniform(0.5, 4.0), rng.uniform(-0.6, 0.6)], 3)
        inputs = {
            **{"x": x, "P": P, "control": control, "cov_pose": covariance(rng, np.array([0.2, 0.1, 0.05]))},
            **{"wheelbase": 1.7, "dt": 0.25},
        }
        still = exact_ekf.predict(*map(big, (x, P, control, np.zeros((2, 2)))), mpf(1.7), mpf(0.25))
        after, turned = still[1].copy(), still[1].copy()
        after[:3, :3] = after[:3, :3] + big(inputs["cov_pose"])
        R = block_diagonal([rotation(mpf(float(x[2]))), big([[1.0]])])
        turned[:3, :3] = turned[:3, :3] + R @ big(inputs["cov_pose"]) @ R.T
        mean = doubles(still[0])
        wrong = {"pose-noise-turned": {"x": mean, "P": doubles(turned)}}
        cases.append({"inputs": inputs, "expected": {"x": mean, "P": doubles(after)}, "mistakes": wrong})
    topic.group("ekf.predict_additive", "eq-predict", ORACLE, rule, cases)


def gates(topic: Topic, rng: np.random.Generator) -> None:
    """Squared Mahalanobis distance of a sighting from each landmark of a map."""
    rule, cases = tolerance(1e-12, "an inverse of S of condition below 120, and sums of 9 x 9 products"), []
    for k in range(6):
        x, P = state(rng, 3)
        cov_z = covariance(rng, np.array([0.1, 0.15]))
        at, pose = big(x), seen(big(x), k % 3)
        z = np.round(np.array(doubles(pose)) + rng.uniform(-1, 1, 2), 3)
        H = jacobian(lambda y, i=k % 3: seen(y, i), at)  # type: ignore[misc]
        nu, noise = big(z) - pose, big(cov_z)
        S = H @ big(P) @ H.T + noise
        right, alone = nu @ inverse(S) @ nu, nu @ inverse(noise) @ nu
        wrong = {"noise-alone": alone, "distance-not-squared": mpmath.sqrt(right)}
        inputs = {"x": x, "P": P, "id": k % 3, "z": z, "cov_z": cov_z}
        mistakes = {note: {"value": float(v)} for note, v in wrong.items()}
        cases.append({"inputs": inputs, "expected": {"value": float(right)}, "mistakes": mistakes})
    topic.group("ekf.gate", "eq-innovation", ORACLE, rule, cases)


def yaw_rates(topic: Topic, rng: np.random.Generator) -> None:
    """Speed and yaw rate, by the step of B4 and along the exact arc; straight, at rest, on the spot."""
    rule = tolerance(1e-14, "a dozen operations on numbers of the pose's size", absolute=1e-14)
    controls = [
        *np.round(np.stack([rng.uniform(-3, 3, 6), rng.uniform(-1.5, 1.5, 6)], 1), 3).tolist(),
        *([2.0, 0.0], [0.0, 1.0], [0.0, 0.0], [1.5, 1e-9], [1.5, 1e-5], [1.0, 1e-3], [2.0, 30.0]),
    ]
    steps, arcs = [], []
    for v, omega in controls:
        x = np.round([*rng.uniform(-20, 20, 2), rng.uniform(-3.1, 3.1)], 3)
        inputs = {"x": x, "control": [v, omega], "dt": 0.25}
        pose, ds, turn = big(x), mpf(v) * mpf(0.25), mpf(omega) * mpf(0.25)
        step, arc = wrapped(moved(pose, stack([ds, turn]))), wrapped(_arc(pose, ds, turn))
        turned = wrapped(moved(stack([*pose[:2], pose[2] + turn]), stack([ds, mpf(0)])))
        far = max(abs(a - b) for a, b in zip(step, arc, strict=True)) > 1e-6
        for out, right, note, other in (
            (steps, step, "exact-arc", arc),
            (arcs, arc, "ahead-then-turn", step),
        ):
            case: dict[str, Any] = {"inputs": inputs, "expected": {"x": doubles(right)}}
            wrong = {note: {"x": doubles(other)}, "turn-then-ahead": {"x": doubles(turned)}}
            out.append({**case, "mistakes": wrong} if far else case)
    topic.group("vehicle.yaw_rate", "eq-increment", ORACLE, rule, steps)
    topic.group("vehicle.velocity_arc", "eq-increment", ORACLE, rule, arcs)


def _arc(x: Big, ds: Any, turn: Any) -> Big:
    """The mean of the directions on the way, by its power series: no division by the turn."""
    along, across = mpf(0), mpf(0)
    for k in range(80):
        term = turn**k / mpmath.factorial(k + 1)
        sign = (-1) ** (k // 2)
        along, across = (along + sign * term, across) if k % 2 == 0 else (along, across + sign * term)
    return stack([*(x[:2] + rotation(x[2]) @ stack([ds * along, ds * across])), x[2] + turn])
