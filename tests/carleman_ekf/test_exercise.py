"""Exercise 16.1: what a car that drives and turns does to landmarks in its axes, and to their covariance.

Three oracles: geometry (places in the world, seen from the moved car), numeric derivatives of that
geometry, and the library's filter, read through its public door.
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.vehicle import Increment

EXERCISE = "16_reduced_prediction"

HEADING, DS, DALPHA = 2.2, 0.7, 0.35
Q = np.array([[0.02, 0.003], [0.003, 0.004]])
SEEN = np.array([[4.0, -1.5], [-2.0, 3.0], [1.0, 6.0]])  # landmarks in the car's axes
LANDMARKS = [slice(4 + 2 * i, 6 + 2 * i) for i in range(len(SEEN))]
EXACT = 1e-12  # a dozen operations on numbers below ten
NUMERIC = 1e-8  # central differences with step 1e-5: truncation 1e-10, rounding 1e-10


def state() -> np.ndarray:
    return np.concatenate([[2.0, -1.0, np.sin(HEADING), np.cos(HEADING)], SEEN.ravel()])


def covariance(seed: int = 16) -> np.ndarray:
    root = np.random.default_rng(seed).normal(0.0, 0.2, (len(state()), len(state())))
    return root @ root.T


def by_geometry(x: np.ndarray, ds: float, dalpha: float) -> np.ndarray:
    """Through the world: place the landmarks, move the car, look again.  The heading vector has length 1."""
    p, h = x[0] + 1j * x[1], x[3] + 1j * x[2]
    world = p + h * (x[4::2] + 1j * x[5::2])
    p, h = p + ds * h, h * np.exp(1j * dalpha)
    seen = (world - p) / h
    return np.concatenate([[p.real, p.imag, h.imag, h.real], np.stack([seen.real, seen.imag], -1).ravel()])


def slope(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, h: float = 1e-5) -> np.ndarray:
    return np.stack([(function(at + h * e) - function(at - h * e)) / (2 * h) for e in np.eye(len(at))], 1)


@pytest.fixture
def moved(answer: ModuleType) -> tuple[np.ndarray, np.ndarray]:
    mean, cov = answer.predict(state(), covariance(), DS, DALPHA, Q.copy())
    n = len(state())
    assert np.shape(mean) == (n,), f"the mean has shape {np.shape(mean)}, need {(n,)}"
    assert np.shape(cov) == (n, n), f"the covariance has shape {np.shape(cov)}, need {(n, n)}"
    return np.asarray(mean), np.asarray(cov)


def test_the_car_first_drives_then_turns(moved: tuple[np.ndarray, np.ndarray]) -> None:
    found, right = moved[0][:4], by_geometry(state(), DS, DALPHA)[:4]
    late = np.array([2.0 + DS * np.cos(HEADING + DALPHA), -1.0 + DS * np.sin(HEADING + DALPHA)])
    assert not np.allclose(found[:2], late), "the car drives along its OLD heading, and turns afterwards"
    swapped = "sin and cos are swapped: the state is x, y, sin, cos"
    assert not np.allclose(found[:2], state()[:2] + DS * state()[2:4]), swapped
    assert not np.allclose(found[2:], right[[3, 2]]), swapped
    assert np.allclose(found[:2], right[:2], atol=EXACT), f"position {found[:2]}, must be {right[:2]}"
    assert np.allclose(found[2:], right[2:], atol=EXACT), f"(sin, cos) {found[2:]}, must be {right[2:]}"


def test_a_landmark_stays_in_the_world(moved: tuple[np.ndarray, np.ndarray]) -> None:
    right = by_geometry(state(), DS, DALPHA)
    c, s = np.cos(DALPHA), np.sin(DALPHA)
    for at, r in zip(LANDMARKS, SEEN, strict=True):
        found, R = moved[0][at], np.array([[c, s], [-s, c]])
        assert not np.allclose(found, r), "a landmark at rest in the world is not at rest in the car's axes"
        assert not np.allclose(found, R.T @ (r - [DS, 0])), "the car turns left, so the landmark turns RIGHT"
        assert not np.allclose(found, R @ r), "the landmark comes nearer by ds: the translation is missing"
        assert not np.allclose(found, R @ r - [DS, 0]), "ds is driven before the turn: turn it, too"
        assert not np.allclose(found, R @ (r + [DS, 0])), (
            "driving ahead brings a landmark ahead nearer, not farther"
        )
        assert np.allclose(found, right[at], atol=EXACT), (
            f"landmark {r} goes to {found}, must go to {right[at]}"
        )


def test_without_noise_the_covariance_is_carried_along(answer: ModuleType) -> None:
    """Sums of columns of F, one at a time; F is linear in the state, on the circle or not."""
    x, none = state(), np.zeros((2, 2))
    F = slope(lambda v: answer.predict(v, covariance(), DS, DALPHA, none)[0], x)
    cov = answer.predict(x, covariance(), DS, DALPHA, none)[1]
    transposed = "F^T P F for F P F^T"
    assert not np.allclose(cov, F.T @ covariance() @ F, atol=NUMERIC), transposed
    told = "the covariance is not F P F^T, with F the derivative of YOUR mean in the state"
    assert np.allclose(cov, F @ covariance() @ F.T, atol=1e-6), told


def noise_part(answer: ModuleType) -> np.ndarray:
    x, zero = state(), np.zeros_like(covariance())
    return np.asarray(answer.predict(x, zero, DS, DALPHA, Q)[1])


def test_the_noise_of_every_block(answer: ModuleType) -> None:
    G = slope(lambda u: by_geometry(state(), *u), np.array([DS, DALPHA]))
    right, found = G @ Q @ G.T, noise_part(answer)
    assert np.any(found != 0.0), "with a certain state the covariance must be that of the increment's noise"
    pose, first = slice(0, 4), LANDMARKS[0]
    for name, at in (("the car", pose), ("a landmark", first)):
        assert np.allclose(found[at, at], right[at, at], atol=NUMERIC), f"the noise of {name} itself is wrong"


def test_car_and_landmarks_share_one_noise(answer: ModuleType) -> None:
    G = slope(lambda u: by_geometry(state(), *u), np.array([DS, DALPHA]))
    right, found = G @ Q @ G.T, noise_part(answer)
    one, two = LANDMARKS[0], LANDMARKS[1]
    told = "the cross block has no share of the noise, as in the printed (B17), (B19); one noise moves both"
    assert np.any(found[:4, one] != 0.0), f"car and landmark: {told}"
    assert np.any(found[one, two] != 0.0), f"two landmarks: {told}"
    assert np.allclose(found, right, atol=NUMERIC), "a cross block of the noise is wrong"


def test_the_noise_is_tangent_to_the_circle(answer: ModuleType) -> None:
    """To first order (sin, cos) may turn, not stretch."""
    h = by_geometry(state(), DS, DALPHA)[2:4]
    stretch = h @ noise_part(answer)[2:4, 2:4] @ h
    told = f"the heading vector stretches, variance {stretch:.3g}: sin and cos have one noise, not two"
    assert abs(stretch) < 1e-15, told


def test_three_steps_are_the_librarys(answer: ModuleType) -> None:
    """Pose by pose(), landmarks by an innovation of a zero measurement: nu = -r, S = P_rr + cov_z."""
    pose, P0, cov_z = np.array([2.0, -1.0, HEADING]), np.diag([0.3, 0.2, 0.02]), np.diag([0.01, 0.02])
    slam = carleman_ekf(pose, P0, form="reduced")
    slam.update(range(len(SEEN)), SEEN[None], cov_z)
    J = np.zeros((4, 3))
    J[0, 0] = J[1, 1] = 1.0
    J[2:, 2] = np.cos(HEADING), -np.sin(HEADING)
    mean, cov = state(), np.zeros((len(state()), len(state())))
    cov[:4, :4] = J @ P0 @ J.T
    cov[4:, 4:] = np.kron(np.eye(len(SEEN)), cov_z)
    for ds, dalpha in ((0.7, 0.35), (0.2, -0.6), (1.1, 0.1)):
        slam.predict(Increment(np.array([ds]), np.array([dalpha]), Q[None]))
        mean, cov = answer.predict(mean, cov, ds, dalpha, Q)
    there = slam.pose()
    assert np.allclose(mean[:2], there.mean[0, :2], atol=1e-11), "positions differ after three steps"
    assert np.allclose(cov[:2, :2], there.cov[0, :2, :2], atol=1e-11), "covariances differ after three steps"
    seen = slam.update(range(len(SEEN)), np.zeros((1, len(SEEN), 2)), cov_z)
    assert seen is not None
    assert np.allclose(mean[4:], -seen.innovation[0], atol=1e-11), "landmarks differ after three steps"
    S = cov[4:, 4:] + np.kron(np.eye(len(SEEN)), cov_z)
    assert np.allclose(S, seen.S[0], atol=1e-11), "the landmarks' covariances differ after three steps"
