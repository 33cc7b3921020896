"""Errors of trajectories: alignment by Horn's quaternions, all else from its definition, in 50 digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import similarity
from generator.building import Topic, tolerance
from generator.exact import floats, matrix, vector
from generator.groups import SE3, Array, motion
from generator.scale import median
from generator.similarity import Similarity

TOPIC, CHAPTER = "trajectory", 23

NOTES = {
    "not-aligned": ("you compare without alignment", "|estimate - truth|"),
    "aligned-at-the-start": (
        "you align the first positions only, not the whole path by least squares",
        "estimate - estimate_0 + truth_0",
    ),
    "scale-fixed": ("your alignment is rigid although the scale is free", "se3 for sim3"),
    "scale-freed": ("your alignment scales although it must be rigid", "sim3 for se3"),
    "scale-inverted": (
        "your scale is that of the truth in units of the estimate's inverse: it is upside down",
        "1/scale",
    ),
    "truth-aligned": (
        "you bring the truth to the estimate: the errors are in the estimate's unit",
        "|S truth - estimate|",
    ),
    "upper-median": ("of an even number you take the upper one of the middle two", "sorted[n / 2]"),
    "divided-by-n-minus-1": ("your root mean square divides by N - 1", "(sum e^2 / (N - 1))^(1/2)"),
    "mean-for-root-mean-square": ("your root mean square is the mean", "mean e"),
    "in-the-world": (
        "you compare steps in the world's axes: they must be turned into the body's, T_k^-1 T_k+1",
        "t_k+1 - t_k",
    ),
    "radians": ("your angle is in radians; degrees are asked for", "angle"),
    "right-for-left": ("your relative pose is T_k+1 T_k^-1", "T_k+1 T_k^-1"),
    "other-side": (
        "you put the true step's inverse on the other side: the error is then seen from the next pose",
        "(A'^-1 B') (A^-1 B)^-1",
    ),
    "right-for-left-other-side": (
        "your steps are T_k+1 T_k^-1, and the true one's inverse stands on the right: all in the world",
        "(B' A'^-1) (B A^-1)^-1",
    ),
    "absolute": ("you compare poses, not steps", "A^-1 A'"),
    "half-angle": ("your angle is that of the quaternion's w, half of the rotation's", "acos w"),
    "accumulated-on-the-left": (
        "you put each new step on the left: a step T_(k-1)_k follows on the right of T_0_(k-1)",
        "T <- step T, for T <- T step",
    ),
    "element-wise": ("you multiply entry by entry: * between arrays for @", "T * step"),
}


def build(rng: np.random.Generator) -> Topic:
    """ATE, RPE, and chains of steps."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    reason = (
        "errors of a tenth of a metre, from positions of some ten metres: 100 eps, and the alignment's gap"
    )
    rule = tolerance(1e-11, reason, float32=1e-2)
    oracle = "Horn's quaternion and definitions, 50 digits"
    for mode in ("none", "se3", "sim3"):
        for flag in ("odd", "even"):
            cases = [_ate(rng, mode, 2 * int(rng.integers(3, 6)) + (flag == "odd")) for _ in range(6)]
            topic.group("trajectory.ate", "eq-ate", oracle, rule, cases, flags=(mode, flag))
    reason = "four rotation matrices rounded to eps move an angle by 4 eps rad = 5e-14 degrees; else as above"
    rule = tolerance(1e-11, reason, absolute=1e-13, float32=1e-2)
    for flag, turn in (("generic", 0.1), ("small_angle", 1e-6), ("large_errors", 1.5)):
        cases = [_rpe(rng, turn, int(rng.integers(4, 7))) for _ in range(8)]
        flags = () if flag == "generic" else (flag,)
        topic.group("trajectory.rpe", "eq-rpe", "definition, 50 digits", rule, cases, flags=flags)
    fine = tolerance(1e-14, "a few matrix products")
    topic.group("trajectory.chain", "eq-rpe", "50-digit products", fine, [_chain(rng) for _ in range(10)])
    return topic


def _path(rng: np.random.Generator, n: int) -> Array:
    """Positions of a smooth bend, some metres long."""
    s = np.linspace(0.0, 3.0, n)
    bend = np.stack([3 * np.sin(s), 2 * np.cos(1.3 * s), 0.7 * np.sin(2 * s + 1)], 1)
    return np.asarray(bend * rng.uniform(0.5, 3.0) + rng.uniform(-3, 3, 3))


def _ate(rng: np.random.Generator, mode: str, n: int) -> dict[str, Any]:
    truth = _path(rng, n)
    estimate = truth + 0.1 * rng.standard_normal((n, 3))
    if mode != "none":
        T, s = motion(rng), float(rng.uniform(0.4, 2.5)) if mode == "sim3" else 1.0
        estimate = s * estimate @ T[:3, :3].T + T[:3, 3]
    S = _alignment(estimate, truth, mode)
    right = _summary(_errors(S, estimate, truth), S.scale)
    wrong: dict[str, Any] = {}
    if mode != "none":
        still = Similarity(mpf(1), mpmath.eye(3), [mpf(0)] * 3)
        wrong["not-aligned"] = _summary(_errors(still, estimate, truth), right["scale"])
        start = Similarity(mpf(1), mpmath.eye(3), [mpf(v) for v in truth[0] - estimate[0]])
        wrong["aligned-at-the-start"] = _summary(_errors(start, estimate, truth), right["scale"])
    if mode == "sim3":
        fixed = _alignment(estimate, truth, "se3")
        wrong["scale-fixed"] = _summary(_errors(fixed, estimate, truth), mpf(1))
        wrong["scale-inverted"] = {**right, "scale": 1 / right["scale"]}
        back = _alignment(truth, estimate, "sim3")
        wrong["truth-aligned"] = _summary(_errors(back, truth, estimate), back.scale)
    if mode == "se3":
        free = _alignment(estimate, truth, "sim3")
        wrong["scale-freed"] = _summary(_errors(free, estimate, truth), free.scale)
    e = _errors(S, estimate, truth)
    total = sum(v * v for v in e)
    wrong["divided-by-n-minus-1"] = {**right, "rmse": mpmath.sqrt(total / (n - 1))}
    wrong["mean-for-root-mean-square"] = {**right, "rmse": right["mean"]}
    if n % 2 == 0:
        wrong["upper-median"] = {**right, "median": sorted(e)[n // 2]}
    inputs = {"estimate": estimate, "truth": truth, "align": mode}
    return _case(inputs, right, wrong)


def _alignment(estimate: Array, truth: Array, mode: str) -> Similarity:
    if mode == "none":
        return Similarity(mpf(1), mpmath.eye(3), [mpf(0)] * 3)
    return similarity.align(estimate, truth, with_scale=mode == "sim3")


def _errors(S: Similarity, estimate: Array, truth: Array) -> list[Any]:
    pairs = zip(similarity.rows(estimate), similarity.rows(truth), strict=True)
    return [mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(S.act(x), y, strict=True))) for x, y in pairs]


def _summary(e: list[Any], scale: Any) -> dict[str, Any]:
    return {
        "rmse": mpmath.sqrt(sum(v * v for v in e) / len(e)),
        "mean": sum(e) / len(e),
        "median": median(e),
        "max": max(e),
        "scale": scale,
    }


def _rpe(rng: np.random.Generator, turn: float, n: int) -> dict[str, Any]:
    """Poses along a bend; every estimated one is off by a small motion of its own."""
    truth, estimate = [], []
    for p in _path(rng, n):
        T = motion(rng)
        T[:3, 3] = p
        off = np.concatenate([0.1 * rng.standard_normal(3), turn * rng.standard_normal(3) / np.sqrt(3)])
        truth.append(T)
        estimate.append(np.array(floats(matrix(T) * SE3.exp(vector(off)))))
    A, B = np.stack(truth), np.stack(estimate)
    rests = [_rest(A, B, k) for k in range(n - 1)]
    right = _rms([R[0:3, 3] for R in rests], [_angle(R) for R in rests])
    inverses = [[matrix(T) ** -1 for T in path] for path in (A, B)]
    steps = [
        [matrix(path[k + 1]) * inv[k] for k in range(n - 1)]
        for path, inv in zip((A, B), inverses, strict=True)
    ]
    other = [a**-1 * b for a, b in zip(*steps, strict=True)]
    beside = [b * a**-1 for a, b in zip(*steps, strict=True)]
    own = [inv[k] * matrix(B[k]) for inv in inverses[:1] for k in range(n)]
    turned = [_step(B, k) * _step(A, k) ** -1 for k in range(n - 1)]
    moved = [_moved(B, k) - _moved(A, k) for k in range(n - 1)]
    angles = [_angle(R) for R in rests]
    wrong = {
        "in-the-world": _rms(moved, angles),
        "radians": {**right, "rot_rmse_deg": right["rot_rmse_deg"] * mpmath.pi / 180},
        "half-angle": {**right, "rot_rmse_deg": right["rot_rmse_deg"] / 2},
        "right-for-left": _rms([R[0:3, 3] for R in other], [_angle(R) for R in other]),
        "right-for-left-other-side": _rms([R[0:3, 3] for R in beside], [_angle(R) for R in beside]),
        "other-side": _rms([R[0:3, 3] for R in turned], angles),
        "absolute": _rms([R[0:3, 3] for R in own], [_angle(R) for R in own]),
        "mean-for-root-mean-square": {
            "trans_rmse": sum(mpmath.norm(R[0:3, 3]) for R in rests) / len(rests),
            "rot_rmse_deg": mpmath.degrees(sum(angles) / len(angles)),
        },
    }
    return _case({"estimate": B, "truth": A}, right, wrong)


def _rest(A: Array, B: Array, k: int) -> Any:
    """(A_k^-1 A_k+1)^-1 (B_k^-1 B_k+1)."""
    return _step(A, k) ** -1 * _step(B, k)


def _step(path: Array, k: int) -> Any:
    """T_k^-1 T_k+1."""
    return matrix(path[k]) ** -1 * matrix(path[k + 1])


def _moved(path: Array, k: int) -> Any:
    return mpmath.matrix(vector(path[k + 1, :3, 3])) - mpmath.matrix(vector(path[k, :3, 3]))


def _angle(R: Any) -> Any:
    sine = mpmath.sqrt((R[2, 1] - R[1, 2]) ** 2 + (R[0, 2] - R[2, 0]) ** 2 + (R[1, 0] - R[0, 1]) ** 2)
    return mpmath.atan2(sine, R[0, 0] + R[1, 1] + R[2, 2] - 1)


def _rms(shifts: list[Any], angles: list[Any]) -> dict[str, Any]:
    n = len(shifts)
    return {
        "trans_rmse": mpmath.sqrt(sum(mpmath.norm(t) ** 2 for t in shifts) / n),
        "rot_rmse_deg": mpmath.degrees(mpmath.sqrt(sum(a * a for a in angles) / n)),
    }


def _chain(rng: np.random.Generator) -> dict[str, Any]:
    steps = np.stack([motion(rng) for _ in range(int(rng.integers(2, 5)))])

    def chain(join: Any) -> list[Any]:
        poses = [mpmath.eye(4)]
        for step in steps:
            poses.append(join(poses[-1], matrix(step)))
        return poses

    wrong = {
        "accumulated-on-the-left": {"T": chain(lambda T, step: step * T)},
        "element-wise": {"T": chain(lambda T, s: _entries(T, s))},
    }
    return _case({"steps": steps}, {"T": chain(lambda T, step: T * step)}, wrong)


def _entries(a: Any, b: Any) -> Any:
    return mpmath.matrix([[a[i, j] * b[i, j] for j in range(4)] for i in range(4)])


def _case(inputs: dict[str, Any], right: dict[str, Any], wrong: dict[str, Any]) -> dict[str, Any]:
    mistakes = {note: {key: floats(v) for key, v in answer.items()} for note, answer in wrong.items()}
    return {"inputs": inputs, "expected": {k: floats(v) for k, v in right.items()}, "mistakes": mistakes}
