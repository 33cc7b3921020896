"""Where the model is linear, EKF-SLAM is the Kalman filter, and its NEES must be chi-squared.

The world: the start heading is known exactly and the turns are free of noise.  Then the heading's
variance stays zero, F and H are constants of the course, and all errors are Gaussian with the
covariance the filter says.  Each band is two-sided with false-alarm rate 1e-4 per test; the seeds are
fixed, so a test that passes keeps passing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam
from vslam_ref.filters.vehicle import Increment
from vslam_ref.testing import assert_consistent

RUNS = 400
LANDMARKS = np.array([[4.0, 1.0], [-2.0, 3.0], [1.0, -4.0]])
COV_Z = np.array([[0.02, 0.005], [0.005, 0.03]])


def linear_world(
    slam_type: Any, *, cov: np.ndarray, sigma: float = 0.1, claimed: float = 1.0
) -> tuple[Any, Any]:
    """Run M linear worlds; ``claimed`` scales the covariances the filter is told."""
    rng = np.random.default_rng(7)
    truth = np.array([0.0, 0.0, 0.4])
    mean = truth + rng.multivariate_normal(np.zeros(3), cov, RUNS)
    slam = slam_type(mean, cov)
    told = np.tile(np.diag([claimed * sigma**2, 0.0]), (RUNS, 1, 1))
    for k in range(40):
        ds, turn = 0.3, 0.1
        truth = truth + [ds * np.cos(truth[2]), ds * np.sin(truth[2]), 0.0]
        truth[2] += turn
        measured = ds + sigma * rng.standard_normal(RUNS)
        slam.predict(Increment(measured, np.full(RUNS, turn), told))
        if k % 3 == 0:
            ids = np.arange(1 + (k > 10) + (k > 20))  # landmarks come one after the other
            zc = (LANDMARKS[ids] - truth[:2]) @ np.array([1, 1j]) * np.exp(-1j * truth[2])
            z = np.stack([zc.real, zc.imag], -1) + rng.multivariate_normal([0, 0], COV_Z, (RUNS, len(ids)))
            slam.update(ids, z, claimed * COV_Z)
    return slam, truth


KNOWN_HEADING = np.array([[0.3, 0.1, 0.0], [0.1, 0.2, 0.0], [0.0, 0.0, 0.0]])


def nees(error: np.ndarray, P: np.ndarray) -> np.ndarray:
    return np.einsum("bi,bi->b", error, np.linalg.solve(P, error[:, :, None])[:, :, 0])


def joint_error(slam: EkfSlam, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors and covariance of position and all landmarks; the heading is known and left out."""
    mean, P = slam.blocks.full()
    keep = np.r_[0, 1, 3 : mean.shape[1]]
    return mean[:, keep] - np.concatenate([truth[:2], LANDMARKS.ravel()]), P[:, keep[:, None], keep]


def test_joint_nees_of_a_linear_world_lies_in_its_band() -> None:
    slam, truth = linear_world(EkfSlam, cov=KNOWN_HEADING)
    assert_consistent(nees(*joint_error(slam, truth)), dof=8, false_alarm=1e-4)


def test_heading_known_stays_known() -> None:
    slam, truth = linear_world(EkfSlam, cov=KNOWN_HEADING)
    pose = slam.pose()
    assert np.all(pose.cov[:, 2] == 0.0)
    assert np.abs(np.exp(1j * pose.mean[:, 2]) - np.exp(1j * truth[2])).max() < 40 * np.finfo(float).eps * 4


@pytest.mark.parametrize("claimed", [0.8, 1.25])
def test_wrong_noise_leaves_the_band_on_its_side(claimed: float) -> None:
    slam, truth = linear_world(EkfSlam, cov=KNOWN_HEADING, claimed=claimed)
    with pytest.raises(AssertionError, match="outside") as told:
        assert_consistent(nees(*joint_error(slam, truth)), dof=8, false_alarm=1e-4)
    mean = float(str(told.value).split()[2])
    assert (mean > 8) == (claimed < 1)


def test_innovations_of_a_linear_world_are_white_with_covariance_s() -> None:
    """One more sighting of all three landmarks: its NIS is chi2(6)."""
    slam, truth = linear_world(EkfSlam, cov=KNOWN_HEADING)
    zc = (LANDMARKS - truth[:2]) @ np.array([1, 1j]) * np.exp(-1j * truth[2])
    rng = np.random.default_rng(8)
    z = np.stack([zc.real, zc.imag], -1) + rng.multivariate_normal([0, 0], COV_Z, (RUNS, 3))
    seen = slam.update([0, 1, 2], z, COV_Z)
    assert seen is not None
    assert_consistent(nees(seen.innovation, seen.S), dof=6, false_alarm=1e-4)


def test_anchored_ekf_of_a_linear_world_lies_in_its_band() -> None:
    """With a start that is turned by 0.4, so that both factors of the composition are rotated."""
    slam, truth = linear_world(AnchoredEkf, cov=KNOWN_HEADING)
    pose, found = slam.pose(), slam.landmarks()
    assert_consistent(nees(pose.mean[:, :2] - truth[:2], pose.cov[:, :2, :2]), dof=2, false_alarm=1e-4)
    for i in range(3):
        assert_consistent(nees(found.mean[:, i] - LANDMARKS[i], found.cov[:, i]), dof=2, false_alarm=1e-4)


def test_in_a_linear_world_anchored_and_plain_are_one_filter() -> None:
    """No linearisation, no difference: what tells the two apart in general is linearisation alone.

    Tolerance: 40 steps on 9 states of metres below 10: 40 * 9 * 10 * eps = 8e-13.
    """
    plain, _ = linear_world(EkfSlam, cov=KNOWN_HEADING)
    anchored, _ = linear_world(AnchoredEkf, cov=KNOWN_HEADING)
    a, b = plain.pose(), anchored.pose()
    assert np.abs(a.mean - b.mean).max() < 8e-13
    assert np.abs(a.cov - b.cov).max() < 8e-13
