"""Seeded states, covariances and drives for the filters' vectors, in short decimals."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.arrays import Array


def covariance(rng: np.random.Generator, sigmas: Array) -> Array:
    """Symmetric positive definite matrix with standard deviations near ``sigmas``, correlated, 6 decimals.

    The correlation matrix is a mixture of the identity (a half) and a random one, so that no eigenvalue of
    it is below a half, and rounding cannot make it indefinite.
    """
    A = rng.standard_normal((len(sigmas), len(sigmas) + 1))
    C = A @ A.T
    scale = np.sqrt(np.diag(C))
    mixed = 0.5 * np.eye(len(sigmas)) + 0.5 * C / np.outer(scale, scale)
    return np.asarray(np.round(mixed * np.outer(sigmas, sigmas), 6))


def state(rng: np.random.Generator, landmarks: int) -> tuple[Array, Array]:
    """Pose and landmarks (3 + 2n,), and a covariance."""
    pose = [*rng.uniform(-10, 10, 2), rng.uniform(-2.6, 2.6)]
    x = np.round([*pose, *rng.uniform(-15, 15, 2 * landmarks)], 3)
    return x, covariance(rng, np.array([0.3, 0.25, 0.15, *[0.4] * (2 * landmarks)]))


def random_pose(rng: np.random.Generator, flag: str = "") -> tuple[Array, Array]:
    """Pose and its covariance; the heading in a regime."""
    x = np.round([*rng.uniform(-8, 8, 2), rng.uniform(-3, 3)], 3)
    if flag == "near_pi":
        x[2] = rng.choice([-1, 1]) * round(np.pi - rng.uniform(1e-6, 1e-3), 7)
    if flag == "small_angle":
        x[2] = rng.choice([-1, 1]) * float(f"{10.0 ** rng.uniform(-8, -4):.4g}")
    return x, covariance(rng, np.array([0.3, 0.25, 0.1]))


def increment(rng: np.random.Generator) -> tuple[Array, Array]:
    """Distance and turn of a step, and their covariance."""
    ds, turn = rng.uniform(0.1, 1.5), rng.uniform(0.05, 0.8) * rng.choice([-1, 1])
    return np.round([ds, turn], 3), covariance(rng, np.array([0.1, 0.06]))


def lifted_state(rng: np.random.Generator, n: int, off: bool) -> tuple[Array, Array]:
    """Lifted state, on the lift of a pose or as an update leaves it, and a covariance of full rank."""
    x, _ = random_pose(rng)
    s, c = np.sin(x[2]), np.cos(x[2])
    parts = [x[0], x[1], s, c, s * s, c * c, x[0] * s, x[0] * c, x[1] * s, x[1] * c, s * c]
    for X, Y in np.round(rng.uniform(-10, 10, (n, 2)), 2):
        parts += [X, Y, s * X, c * X, s * Y, c * Y]
    Z = np.round(np.array(parts) + off * 0.05 * rng.standard_normal(len(parts)), 5)
    sigmas = [0.3, 0.25, 0.1, 0.1, 0.1, 0.1, 0.3, 0.3, 0.3, 0.3, 0.1, *[0.4] * (6 * n)]
    return Z, covariance(rng, np.array(sigmas))


def told(x: Array, landmark: Array) -> Array:
    """Relative place of a landmark, for making a measurement."""
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.asarray(np.array([[c, s], [-s, c]]) @ (landmark - x[:2]))


def drive(rng: np.random.Generator, steps: int, landmarks: int, every: int = 1) -> dict[str, Any]:
    """Inputs of a run: a bend through posts, of which each comes into sight at its own time.

    With ``every`` more than 1, all posts in a wider reach are seen, but only at every so many steps.
    """
    wheelbase, dt, reach = 1.2, 0.5, 6.0 if every == 1 else 12.0
    truth = np.array([0.4, -0.2, 2.4])
    places = _places(truth, steps, landmarks, wheelbase, dt, rng)
    cov_u, cov_z = covariance(rng, np.array([0.1, 0.03])), covariance(rng, np.array([0.08, 0.12]))
    controls, sightings = [], []
    for k in range(steps):
        control = _control(k)
        truth = _moved(truth, control, wheelbase, dt)
        controls.append(np.round(control + rng.multivariate_normal([0, 0], cov_u), 4))
        near = [i for i, place in enumerate(places) if np.hypot(*(place - truth[:2])) < reach]
        near = [i for i in near if (k + i) % 3] if every == 1 else near if k % every == every - 1 else []
        z = [np.round(told(truth, places[i]) + rng.multivariate_normal([0, 0], cov_z), 4) for i in near]
        sightings.append({"ids": near[::-1], "z": [v.tolist() for v in z[::-1]]})
    start = np.array([0.5, -0.3, 2.35])
    return {
        **{"x": start, "P": covariance(rng, np.array([0.2, 0.2, 0.08])), "wheelbase": wheelbase, "dt": dt},
        **{"controls": np.array(controls), "cov_u": cov_u, "sightings": sightings, "cov_z": cov_z},
    }


def drive_truth(run: dict[str, Any]) -> dict[str, Array]:
    """A truth for a run, near what it measured: poses (K + 1, 3), and landmarks (n, 2) by id."""
    pose = run["x"] - np.array([0.1, -0.1, -0.05])
    poses = [pose]
    places: dict[int, Array] = {}
    for control, seen in zip(run["controls"], run["sightings"], strict=True):
        pose = _moved(pose, control, run["wheelbase"], run["dt"])
        poses.append(pose)
        for i, z in zip(seen["ids"], seen["z"], strict=True):
            c, s = np.cos(pose[2]), np.sin(pose[2])
            places.setdefault(i, pose[:2] + np.array([[c, -s], [s, c]]) @ z + 0.05)
    ids = range(max(places) + 1)
    known = np.array([places.get(i, np.zeros(2)) for i in ids])
    return {"truth": np.round(poses, 6), "landmarks": np.round(known, 6)}


def _control(k: int) -> Array:
    return np.array([1.5, 0.35 * np.cos(0.25 * k) + 0.1])


def _moved(x: Array, control: Array, wheelbase: float, dt: float) -> Array:
    ds = control[0] * dt
    step = [ds * np.cos(x[2]), ds * np.sin(x[2]), ds * np.tan(control[1]) / wheelbase]
    return np.asarray(x + np.array(step))


def _places(
    x: Array, steps: int, landmarks: int, wheelbase: float, dt: float, rng: np.random.Generator
) -> list[Array]:
    """Posts beside the way, one for each stretch of it."""
    out: list[Array] = []
    for k in range(steps):
        x = _moved(x, _control(k), wheelbase, dt)
        if len(out) < landmarks and k >= len(out) * steps // landmarks:
            side = rng.uniform(1.5, 4.0) * rng.choice([-1, 1])
            out.append(np.round(x[:2] + side * np.array([-np.sin(x[2]), np.cos(x[2])]), 2))
    return out
