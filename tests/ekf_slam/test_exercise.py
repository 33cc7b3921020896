"""Exercise 15.1: a landmark enters the state with everything that its error shares with the others.

Oracle: the definition.  The new landmark is g(x, z) = position + Rot(heading) z; its Jacobians are taken
numerically here, so no formula of the chapter is used.
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

EXERCISE = "15_new_landmark"

COV_Z = np.array([[0.09, 0.01], [0.01, 0.01]])  # worse ahead than sideways: a forgotten turn shows
Z = np.array([4.0, -1.5])
TOLERANCE = 1e-9  # central differences with step 1e-5: truncation about 1e-10, rounding 1e-11
State = tuple[np.ndarray, np.ndarray]


def state(landmarks: int, seed: int = 15) -> State:
    rng = np.random.default_rng(seed)
    root = rng.normal(0.0, 0.3, (3 + 2 * landmarks, 3 + 2 * landmarks))
    return np.concatenate([[2.0, -1.0, 2.2], rng.uniform(-9, 9, 2 * landmarks)]), root @ root.T


def place(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    c, s = np.cos(x[2]), np.sin(x[2])
    return np.array([x[0] + c * z[0] - s * z[1], x[1] + s * z[0] + c * z[1]])


def measure(x: np.ndarray, landmark: np.ndarray) -> np.ndarray:
    c, s = np.cos(x[2]), np.sin(x[2])
    d = landmark - x[:2]
    return np.array([c * d[0] + s * d[1], c * d[1] - s * d[0]])


def slope(function, at: np.ndarray, h: float = 1e-5) -> np.ndarray:
    columns = [(function(at + h * e) - function(at - h * e)) / (2 * h) for e in np.eye(len(at))]
    return np.stack(columns, 1)


def wanted(mean: np.ndarray, cov: np.ndarray) -> np.ndarray:
    """Covariance of (old state, g): J blkdiag(cov, COV_Z) J^T."""
    n = len(mean)
    J = np.zeros((n + 2, n + 2))
    J[:n, :n] = np.eye(n)
    J[n:, :n] = slope(lambda x: place(x, Z), mean)
    J[n:, n:] = slope(lambda z: place(mean, z), Z)
    both = np.zeros((n + 2, n + 2))
    both[:n, :n], both[n:, n:] = cov, COV_Z
    return J @ both @ J.T


@pytest.fixture(params=[0, 3], ids=["empty map", "three landmarks"])
def before(request: pytest.FixtureRequest) -> State:
    return state(request.param)


@pytest.fixture
def after(answer: ModuleType, before: State) -> State:
    mean, cov = answer.augment(before[0].copy(), before[1].copy(), Z.copy(), COV_Z.copy())
    n = len(before[0]) + 2
    assert np.shape(mean) == (n,), (
        f"the mean has shape {np.shape(mean)}, need {(n,)}: old state, then x and y"
    )
    assert np.shape(cov) == (n, n), f"the covariance has shape {np.shape(cov)}, need {(n, n)}"
    return np.asarray(mean), np.asarray(cov)


def test_the_landmark_stands_where_it_was_seen(before: State, after: State) -> None:
    assert np.array_equal(after[0][:-2], before[0]), (
        "the old state must not change: nothing was learnt about it"
    )
    found, right = after[0][-2:], place(before[0], Z)
    c, s = np.cos(before[0][2]), np.sin(before[0][2])
    transposed = before[0][:2] + np.array([[c, s], [-s, c]]) @ Z
    assert not np.allclose(found, transposed), "z is turned the wrong way: use R(heading), not its transpose"
    assert not np.allclose(found, right - before[0][:2]), "the vehicle's position is missing"
    assert np.allclose(found, right, atol=1e-12), f"landmark at {found}, must be at {right}"


def test_the_old_covariance_stays(before: State, after: State) -> None:
    assert np.array_equal(after[1][:-2, :-2], before[1]), "the old covariance must not change"


def test_the_landmarks_own_covariance(before: State, after: State) -> None:
    own, right = after[1][-2:, -2:], wanted(*before)[-2:, -2:]
    c, s = np.cos(before[0][2]), np.sin(before[0][2])
    R = np.array([[c, -s], [s, c]])
    assert not np.allclose(own, np.eye(2)), "an identity covariance is a guess; the filter knows better"
    assert not np.allclose(own, R @ COV_Z @ R.T), "the pose's own uncertainty is missing: G_p P_pp G_p^T"
    assert not np.allclose(own, right - R @ COV_Z @ R.T), "the sensor's noise is missing: G_z cov_z G_z^T"
    untouched = "cov_z belongs to the vehicle's axes: turn it into the world's, R cov_z R^T"
    assert not np.allclose(own, right - R @ COV_Z @ R.T + COV_Z), untouched
    assert np.allclose(own, right, atol=TOLERANCE), f"own covariance\n{own}\nmust be\n{right}"


def test_the_landmark_shares_the_vehicles_error(before: State, after: State) -> None:
    cross, right = after[1][-2:, :3], wanted(*before)[-2:, :3]
    assert np.any(cross != 0.0), (
        "no cross covariance with the vehicle: the filter will never correct both at once"
    )
    assert np.allclose(cross, right, atol=TOLERANCE), (
        f"cross covariance with the pose\n{cross}\nmust be\n{right}"
    )


def test_the_landmark_shares_the_other_landmarks_errors(before: State, after: State) -> None:
    cross, right = after[1][-2:, 3:-2], wanted(*before)[-2:, 3:-2]
    if right.size:
        told = "no cross covariance with the other landmarks: they were placed from the same uncertain car"
        assert np.any(cross != 0.0), told
    assert np.allclose(cross, right, atol=TOLERANCE), (
        f"cross covariance with the map\n{cross}\nmust be\n{right}"
    )


def test_the_covariance_is_one(after: State) -> None:
    cov = after[1]
    assert np.allclose(cov, cov.T, atol=1e-12), "a covariance is symmetric: fill both off-diagonal blocks"
    least = np.linalg.eigvalsh(cov).min()
    assert least > 0.0, f"smallest eigenvalue {least:.3g}: a cross block does not fit to the others"


def test_a_second_look_disagrees_by_the_sensors_noise_only(after: State) -> None:
    """The car has not moved: its error cancels, and S is twice cov_z."""
    mean, cov = after
    H = slope(lambda x: measure(x, x[-2:]), mean)
    S = H @ cov @ H.T + COV_Z
    told = "look again at once: the pose error must cancel, S = 2 cov_z; is a cross block wrong?"
    assert np.allclose(S, 2 * COV_Z, atol=1e-7), f"{told}\nS =\n{S}"


def test_what_is_given_is_left_alone(answer: ModuleType) -> None:
    mean, cov = state(1)
    kept = mean.copy(), cov.copy()
    answer.augment(mean, cov, Z, COV_Z)
    assert np.array_equal(mean, kept[0]), "the arguments must not be changed: copy before you write"
    assert np.array_equal(cov, kept[1]), "the arguments must not be changed: copy before you write"
