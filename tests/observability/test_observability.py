"""Nullity of the linearised system along short real runs: truth 3, EKF 2, lifted 3 (and 10 + 4 n)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.filters import observability, observation, vehicle
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.observability import LinearisedRun, RunStep
from vslam_ref.testing import check_jacobian

COV_U = np.diag([1e-3, 1e-3])
COV_Z = np.diag([0.01, 0.01])
START = np.array([1.0, -2.0, 0.6])


def drive(noise: float, landmarks: int = 4, steps: int = 30, late: bool = True) -> Any:
    """True poses, landmarks, steps; noise scales what is drawn.  The last landmark is seen late."""
    rng = np.random.default_rng(11)
    places = rng.uniform(-6, 6, (landmarks, 2))
    poses, out = [START], []
    for k in range(steps):
        u = np.array([0.4, 0.15])
        poses.append(vehicle.propagate(poses[-1], u))
        measured = u + noise * rng.multivariate_normal([0, 0], COV_U)
        ids = np.arange(landmarks - (late and k < steps // 2)) if k % 3 == 0 else np.array([], dtype=int)
        z = observation.vehicle_from_world(poses[-1], places[ids])
        z = z + noise * rng.multivariate_normal([0, 0], COV_Z, len(ids))
        out.append(RunStep(vehicle.Increment(measured[:1], measured[1:], COV_U[None]), ids, z[None], COV_Z))
    return np.array(poses), places, out


def rigid_motions(pose: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Derivative (3 + 2 n, 3) of vehicle and landmarks under a motion of the whole world, by hand."""
    N = np.zeros((3 + 2 * len(places), 3))
    N[:2, :2], N[2, 2], N[:2, 2] = np.eye(2), 1.0, [-pose[1], pose[0]]
    for i, (x, y) in enumerate(places):
        N[3 + 2 * i : 5 + 2 * i, :2], N[3 + 2 * i : 5 + 2 * i, 2] = np.eye(2), [-y, x]
    return N


def angle_between(A: np.ndarray, B: np.ndarray) -> float:
    """Sine of the largest principal angle between two column spaces of the same dimension."""
    A, B = np.linalg.qr(A)[0], np.linalg.qr(B)[0]
    return float(np.linalg.norm(B - A @ (A.T @ B), 2))


def nullity_of(run: LinearisedRun, columns: np.ndarray | None = None) -> observability.Nullity:
    matrix = observability.observability_matrix(run)
    return observability.nullity(matrix if columns is None else matrix @ columns, len(run.transitions))


def test_truth_has_the_three_rigid_motions() -> None:
    poses, places, steps = drive(noise=1.0)
    found = nullity_of(observability.linearise_truth(poses, places, [s.ids for s in steps]))
    assert found.nullity == 3
    # a basis from the SVD turns by threshold / gap
    gap = found.singular_values[-4]
    assert angle_between(rigid_motions(poses[0], places), found.basis) < 10 * found.threshold / gap
    assert gap > 1e6 * found.threshold


def test_ekf_loses_the_heading() -> None:
    """The two translations stay, and what is lost is the rotation: it is seen by the wrong Jacobians."""
    poses, places, steps = drive(noise=1.0)
    slam = EkfSlam(START + [0.5, -0.3, 0.1], np.diag([0.3, 0.3, 0.02]))
    run = observability.linearise_ekf(slam, steps, len(places))
    found = nullity_of(run)
    assert found.nullity == 2
    assert found.singular_values[-3] > 1e6 * found.threshold
    motions = rigid_motions(poses[0], places)
    assert angle_between(motions[:, :2], found.basis) < 10 * found.threshold / found.singular_values[-3]


def test_ekf_keeps_the_heading_when_nothing_moves_its_estimate() -> None:
    """Without noise, from the true start: estimates are the truth, and so is the nullity."""
    _, places, steps = drive(noise=0.0)
    run = observability.linearise_ekf(EkfSlam(START, np.diag([0.3, 0.3, 0.02])), steps, len(places))
    # rounding moves the estimate by 1e-14 m or so between updates: count with that, not with eps
    matrix = observability.observability_matrix(run)
    assert int((np.linalg.svd(matrix)[1] > 1e-10).sum()) == matrix.shape[1] - 3


def test_ekf_that_starts_wrong_but_has_no_noise_keeps_it_too() -> None:
    """A start error alone is a rigid motion of everything: consistent Jacobians, nullity 3."""
    _, places, steps = drive(noise=0.0)
    slam = EkfSlam(START + [0.5, -0.3, 0.7], np.diag([0.3, 0.3, 0.5]))
    matrix = observability.observability_matrix(observability.linearise_ekf(slam, steps, len(places)))
    assert int((np.linalg.svd(matrix)[1] > 1e-10).sum()) == matrix.shape[1] - 3


@pytest.mark.parametrize("control", ["first_order", "gaussian"])
@pytest.mark.parametrize("at_truth", [True, False])
def test_lifted_filter_has_the_three_rigid_motions_at_any_estimate(control: str, at_truth: bool) -> None:
    """The run is noisy; the tangent space is that of the true start, or of a quite different one."""
    _, places, steps = drive(noise=1.0)
    pose = START
    if not at_truth:
        rng = np.random.default_rng(2)
        pose, places = START + [3.0, 2.0, -1.3], places + rng.normal(0, 2, places.shape)
    run = observability.linearise_lifted(steps, len(places), control)
    found = nullity_of(run, observability.lift_tangent(pose, places))
    assert found.nullity == 3
    gap = found.singular_values[-4]
    assert angle_between(rigid_motions(pose, places), found.basis) < 10 * found.threshold / gap


@pytest.mark.parametrize("landmarks", [1, 2, 4])
def test_lifted_filter_sees_r_and_w_only(landmarks: int) -> None:
    """In all 11 + 6 n states the nullity is 10 + 4 n: what is seen is r_i (2 each) and w = z5 + z6."""
    _, _, steps = drive(noise=1.0, landmarks=landmarks, late=False)
    run = observability.linearise_lifted(steps, landmarks)
    found = nullity_of(run)
    assert found.nullity == 10 + 4 * landmarks
    T = np.zeros((2 * landmarks + 1, 11 + 6 * landmarks))
    T[0, 4] = T[0, 5] = 1.0
    for i in range(landmarks):
        at = 11 + 6 * i
        T[1 + 2 * i, [at + 3, at + 4, 7, 8]] = [1, 1, -1, -1]
        T[2 + 2 * i, [at + 5, at + 2, 6, 9]] = [1, -1, 1, -1]
    assert np.abs(T @ found.basis).max() < 100 * found.threshold


def test_a_landmark_never_seen_adds_its_own_directions() -> None:
    poses, places, steps = drive(noise=1.0)
    ids = [np.asarray(s.ids)[np.asarray(s.ids) != 1] for s in steps]
    assert nullity_of(observability.linearise_truth(poses, places, ids)).nullity == 3 + 2


def test_lift_tangent_is_the_derivative_of_the_lift() -> None:
    places = np.array([[4.0, -1.5], [0.3, 7.0]])

    def lifted(v: np.ndarray) -> np.ndarray:
        x, y, s, c = v[0], v[1], np.sin(v[2]), np.cos(v[2])
        rows = [x, y, s, c, s * s, c * c, x * s, x * c, y * s, y * c, s * c]
        for a, b in v[3:].reshape(-1, 2):
            rows += [a, b, s * a, c * a, s * b, c * b]
        return np.array(rows)

    at = np.concatenate([START, places.ravel()])
    check = check_jacobian(lifted, at, observability.lift_tangent(START, places))
    assert check.method == "complex"


def test_ekf_jacobians_are_those_the_filter_used() -> None:
    """Replay: with the recorded F and H a plain covariance recursion gives the filter's own covariance.

    A new landmark enters the replay with a variance of 1e6 and its first sighting as an update: as the
    prior grows, that is the augmentation; the difference left is of order cov^2 / 1e6.
    """
    _, places, steps = drive(noise=1.0, steps=12, late=False)
    P0 = np.diag([0.3, 0.3, 0.02])
    slam = EkfSlam(START, P0)
    run = observability.linearise_ekf(slam, steps, len(places))
    P = np.diag([0.3, 0.3, 0.02, *[1e6] * (2 * len(places))])
    for step, F, H in zip(steps, run.transitions, run.measurements, strict=True):
        # cos and sin of the heading F was taken at, from F itself
        ds = step.increment.ds[0]
        G = np.zeros((len(P), 2))
        G[:3] = [[F[1, 2] / ds, 0], [-F[0, 2] / ds, 0], [0, 1]]
        P = F @ P @ F.T + G @ COV_U @ G.T
        if len(H):
            S = H @ P @ H.T + 0.01 * np.eye(len(H))
            K = np.linalg.solve(S, H @ P).T
            I_KH = np.eye(len(P)) - K @ H
            P = I_KH @ P @ I_KH.T + 0.01 * K @ K.T
    assert np.abs(P - slam.blocks.full()[1][0]).max() < 1e-5


def test_bad_input_is_refused() -> None:
    with pytest.raises(ValueError, match="need as many"):
        observability.observability_matrix(LinearisedRun((np.eye(3),), ()))
