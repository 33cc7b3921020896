"""EKF-SLAM in 50 digits, straight from its definition, and the ways in which it is done wrong.

State (x, y, theta, x1, y1, x2, y2, ...).  Every Jacobian is a difference quotient of the model, never a
formula.  ``wrong`` is the id of a note: what a program computes that makes this mistake.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np

from generator.exact_arrays import (
    Big,
    block_diagonal,
    eye,
    inverse,
    jacobian,
    stack,
    wrap,
    zeros,
)


def rotation(angle: Any) -> Big:
    """Rotation matrix of the plane."""
    c, s = mpmath.cos(angle), mpmath.sin(angle)
    return np.array([[c, -s], [s, c]], dtype=object)


def increment(control: Big, wheelbase: Any, dt: Any) -> Big:
    """Distance and turn of a rear-axle Ackermann vehicle."""
    speed, steering = control
    return stack([speed * dt, speed * dt * mpmath.tan(steering) / wheelbase])


def moved(x: Big, inc: Big) -> Big:
    """B4: ahead along the old heading, then the turn; landmarks stay.  The heading is not wrapped."""
    ds, dalpha = inc
    pose = [x[0] + ds * mpmath.cos(x[2]), x[1] + ds * mpmath.sin(x[2]), x[2] + dalpha]
    return stack([*pose, *x[3:]])


def seen(x: Big, slot: int, *, wrong: str = "") -> Big:
    """Place of a landmark in the axes of the vehicle."""
    d = x[3 + 2 * slot : 5 + 2 * slot] - x[:2]
    if wrong == "global-measurement":
        return d
    return (rotation(x[2]) if wrong == "transposed-rotation" else rotation(x[2]).T) @ d


def wrapped(x: Big) -> Big:
    """State with its heading in (-pi, pi]."""
    return stack([x[0], x[1], wrap(x[2]), *x[3:]])


def predict(
    x: Big, P: Big, control: Big, cov_u: Big, wheelbase: Any, dt: Any, *, wrong: str = ""
) -> tuple[Big, Big]:
    """Mean and covariance after one control."""
    inc = increment(control, wheelbase, dt)
    F = jacobian(lambda y: moved(y, inc), x)
    G = jacobian(lambda u: moved(x, increment(u, wheelbase, dt)), control)
    if wrong == "sin-cos-swapped":
        F[0, 2], F[1, 2] = -inc[0] * mpmath.cos(x[2]), inc[0] * mpmath.sin(x[2])
    if wrong == "cov-u-as-increment":
        G = jacobian(lambda d: moved(x, d), inc)
    noise = zeros(*P.shape) if wrong == "no-process-noise" else G @ cov_u @ G.T
    after = F.T @ P @ F + noise if wrong == "gtpg" else F @ P @ F.T + noise
    if wrong == "cross-not-moved":
        after[:3, 3:], after[3:, :3] = P[:3, 3:], P[3:, :3]
    mean = moved(x, inc)
    return (mean if wrong == "heading-not-wrapped" else wrapped(mean)), after


def update(x: Big, P: Big, slots: Sequence[int], z: Big, cov_z: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Mean and covariance after some landmarks of the map were seen, all at once."""
    if wrong == "one-at-a-time":
        for slot, row in zip(slots, z, strict=True):
            x, P = update(x, P, [slot], row.reshape(1, 2), cov_z)
        return x, P

    def h(y: Big) -> Big:
        return np.concatenate([seen(y, slot, wrong=wrong) for slot in slots])

    H = jacobian(h, x)
    if wrong == "heading-column-sign":
        H[:, 2] = -H[:, 2]
    innovation = z.reshape(-1) - h(x)
    S = H @ P @ H.T + block_diagonal([cov_z] * len(slots))
    K = P @ H.T @ inverse(S)
    step = K @ innovation
    after = x - step if wrong == "innovation-sign" else x + step
    kept = P - K @ S @ K.T
    if wrong == "pose-only":
        after, kept = stack([*after[:3], *x[3:]]), _pose_only(P, kept)
    return (after if wrong == "heading-not-wrapped" else wrapped(after)), kept


def _pose_only(P: Big, kept: Big) -> Big:
    """The old covariance with the new one of the pose."""
    out = P.copy()
    out[:3, :3] = kept[:3, :3]
    return out


def augment(x: Big, P: Big, z: Big, cov_z: Big, *, wrong: str = "") -> tuple[Big, Big]:
    """Mean and covariance with one landmark more."""

    def place(y: Big, w: Big) -> Big:
        return y[:2] + (w if wrong == "placed-unrotated" else rotation(y[2]) @ w)

    G_x, G_z = jacobian(lambda y: place(y, z), x), jacobian(lambda w: place(x, w), z)
    if wrong == "noise-not-turned":
        G_z = eye(2)
    own, cross = G_x @ P @ G_x.T + G_z @ cov_z @ G_z.T, G_x @ P
    if wrong == "identity-landmark":
        own = eye(2)
    if wrong in ("identity-landmark", "no-cross-covariance"):
        cross = zeros(*cross.shape)
    if wrong == "cross-with-pose-only":
        cross[:, 3:] = zeros(2, len(x) - 3)
    if wrong == "sensor-noise-only":
        own = G_z @ cov_z @ G_z.T
    grown = np.block([[P, cross.T], [cross, own]])
    return np.concatenate([x, place(x, z)]), grown


def ideal_run(inputs: dict[str, Any]) -> list[tuple[Big, Big]]:
    """A run with every Jacobian at the truth; pose and its covariance."""
    x, P, cov_u, cov_z = (inputs[key] for key in ("x", "P", "cov_u", "cov_z"))
    truth, places = inputs["truth"], inputs["landmarks"]
    slots: dict[int, int] = {}
    steps = []
    for k, (control, sighting) in enumerate(zip(inputs["controls"], inputs["sightings"], strict=True)):
        here, there = truth[k], truth[k + 1]
        inc = increment(control, inputs["wheelbase"], inputs["dt"])
        D = jacobian(lambda u: increment(u, inputs["wheelbase"], inputs["dt"]), control)
        ahead = stack([mpmath.cos(here[2]), mpmath.sin(here[2])])
        true_inc = stack([(there - here)[:2] @ ahead, inc[1]])
        at = np.concatenate([here, x[3:]])
        F = jacobian(lambda y, d=true_inc: moved(y, d), at)  # type: ignore[misc]
        G = jacobian(lambda d, y=at: moved(y, d), true_inc)  # type: ignore[misc]
        x, P = wrapped(moved(x, inc)), F @ P @ F.T + G @ D @ cov_u @ D.T @ G.T
        ids = sorted(slots, key=lambda i: slots[i])
        at = np.concatenate([there, *(places[i] for i in ids)])
        x, P = _ideal_update(x, P, at, [(slots[i], z) for i, z in sighting if i in slots], cov_z)
        for i, z in [(i, z) for i, z in sighting if i not in slots]:
            slots[i] = len(slots)
            x, P = _ideal_augment(x, P, there, places[i], z, cov_z)
        steps.append((x[:3], P[:3, :3]))
    return steps


def _ideal_update(x: Big, P: Big, at: Big, known: list[tuple[int, Big]], cov_z: Big) -> tuple[Big, Big]:
    if not known:
        return x, P

    def h(y: Big) -> Big:
        return np.concatenate([seen(y, slot) for slot, _ in known])

    H, nu = jacobian(h, at), np.concatenate([z for _, z in known]) - h(x)
    S = H @ P @ H.T + block_diagonal([cov_z] * len(known))
    K = P @ H.T @ inverse(S)
    return wrapped(x + K @ nu), P - K @ S @ K.T


def _ideal_augment(x: Big, P: Big, pose: Big, place: Big, z: Big, cov_z: Big) -> tuple[Big, Big]:
    def placed(y: Big, w: Big) -> Big:
        return y[:2] + rotation(y[2]) @ w

    relative = rotation(pose[2]).T @ (place - pose[:2])
    G_x, G_z = zeros(2, len(x)), jacobian(lambda w: placed(pose, w), relative)
    G_x[:, :3] = jacobian(lambda y: placed(y, relative), pose)
    cross = G_x @ P
    own = cross @ G_x.T + G_z @ cov_z @ G_z.T
    return np.concatenate([x, placed(x, z)]), np.block([[P, cross.T], [cross, own]])


def anchored_run(inputs: dict[str, Any], *, wrong: str = "") -> list[tuple[Big, Big]]:
    """A run in the frame of its start, composed with the uncertain start."""
    start, P0 = inputs["x"], inputs["P"]
    local = run({**inputs, "x": zeros(3), "P": zeros(3, 3)})

    def composed(a: Big, b: Big) -> Big:
        return stack([*(a[:2] + rotation(a[2]) @ b[:2]), a[2] + b[2]])

    steps = []
    for x, P in local:
        pose, own = x[:3], P[:3, :3]
        J_start = jacobian(lambda a, b=pose: composed(a, b), start)  # type: ignore[misc]
        J_pose = jacobian(lambda b: composed(start, b), pose)
        from_start = P0 if wrong == "start-not-carried" else J_start @ P0 @ J_start.T
        added = own if wrong == "own-not-turned" else J_pose @ own @ J_pose.T
        steps.append((wrapped(composed(start, pose)), from_start + added))
    return steps


def run(inputs: dict[str, Any], *, wrong: str = "") -> list[tuple[Big, Big]]:
    """A whole run: for every control predict, update with what is known, add what is new, in order."""
    x, P, steps = inputs["x"], inputs["P"], []
    slots: dict[int, int] = {}
    cov_z = inputs["cov_u"] if wrong == "process-noise-as-sensor-noise" else inputs["cov_z"]
    for control, sighting in zip(inputs["controls"], inputs["sightings"], strict=True):
        x, P = predict(x, P, control, inputs["cov_u"], inputs["wheelbase"], inputs["dt"], wrong=wrong)
        known = [(slots[i], z) for i, z in sighting if i in slots]
        if known:
            z = np.array([z for _, z in known], dtype=object)
            x, P = update(x, P, [slot for slot, _ in known], z, cov_z, wrong=wrong)
        for i, z in sighting:
            if i not in slots:
                slots[i] = len(slots)
                x, P = augment(x, P, z, cov_z, wrong=wrong)
        steps.append((x, P))
    return steps
