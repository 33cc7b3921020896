"""The anchored and the ideal EKF, the order of landmarks, room for more of them, and bad input."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam, IdealEkf, Truth
from vslam_ref.filters.vehicle import Increment
from vslam_ref.geometry import se2

EPS = np.finfo(float).eps
SIZE = 3e3  # steps x states of the drives below, on metres up to 10: rounding stays below SIZE * 10 * eps


def largest(a: Any, b: Any) -> float:
    p, q = a.pose(), b.pose()
    d = p.mean - q.mean
    d[:, 2] = np.angle(np.exp(1j * d[:, 2]))
    return float(max(np.abs(d).max(), np.abs(p.cov - q.cov).max()))


# --- anchored -----------------------------------------------------------------------------------------


def test_anchored_is_the_ekf_when_the_start_is_known(new_drive: Any) -> None:
    """P0 = 0 at a turned, shifted start: only the frame differs, and EKF-SLAM does not feel the frame."""
    drive = new_drive(batch=2, steps=80)
    mean = np.array([3.0, -2.0, 2.5])
    plain, anchored = (
        EkfSlam(mean + np.zeros((2, 3)), np.zeros((3, 3))),
        AnchoredEkf(mean + np.zeros((2, 3)), np.zeros((3, 3))),
    )
    for slam in (plain, anchored):
        drive.feed(slam)
    assert largest(plain, anchored) < SIZE * 10 * EPS
    a, b = plain.landmarks(), anchored.landmarks()
    assert a.ids.tolist() == b.ids.tolist()
    assert np.abs(a.mean - b.mean).max() < SIZE * 10 * EPS
    assert np.abs(a.cov - b.cov).max() < SIZE * 10 * EPS


def test_anchored_differs_from_the_ekf_when_the_start_is_uncertain(new_drive: Any) -> None:
    drive = new_drive(batch=2, steps=80)
    plain, anchored = EkfSlam(drive.mean, drive.cov), AnchoredEkf(drive.mean, drive.cov)
    for slam in (plain, anchored):
        drive.feed(slam)
    assert largest(plain, anchored) > 1e-4


def test_anchored_composes_start_and_motion_to_first_order() -> None:
    """Oracle: Monte Carlo of T_start T_local with small covariances; 4 sigma of a variance estimate."""
    rng = np.random.default_rng(5)
    cov = 1e-4 * np.array([[2.0, 0.5, 0.3], [0.5, 1.0, -0.2], [0.3, -0.2, 0.6]])
    start, cov_u = np.array([1.0, 2.0, 0.8]), 1e-4 * np.array([[1.0, 0.4], [0.4, 0.7]])
    slam = AnchoredEkf(start, cov)
    samples = start + rng.multivariate_normal(np.zeros(3), cov, 200_000)
    for _ in range(3):
        slam.predict(Increment(np.array([1.0]), np.array([0.4]), cov_u[None]))
        u = np.array([1.0, 0.4]) + rng.multivariate_normal([0, 0], cov_u, len(samples))
        samples = samples + np.stack(
            [u[:, 0] * np.cos(samples[:, 2]), u[:, 0] * np.sin(samples[:, 2]), u[:, 1]], -1
        )
    found, expected = slam.pose().cov[0], np.cov(samples.T)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # sampling error of a covariance: scale * sqrt(2 / 200000) = 0.3 %, four of them; second order: 0.1 %
    assert (np.abs(found - expected) / scale).max() < 4 * np.sqrt(2 / 200_000) + 1e-3


# --- ideal --------------------------------------------------------------------------------------------


def test_ideal_ekf_without_noise_is_the_ekf(new_drive: Any) -> None:
    """When every measurement and increment is exact, estimate and truth are the same place."""
    drive = new_drive(steps=60)
    exact, plain = [], EkfSlam(drive.truth[0], drive.cov)
    ideal = IdealEkf(drive.truth[0], drive.cov, Truth(drive.truth, drive.landmarks))
    for k, step in enumerate(drive.steps):
        inc = Increment(np.array([0.3]), np.array([0.05]), step.increment.cov)
        x = drive.truth[k + 1]
        zc = (drive.landmarks[step.ids] - x[:2]) @ np.array([1, 1j]) * np.exp(-1j * x[2])
        for slam in (plain, ideal):
            slam.predict(inc)
            if len(step.ids):
                slam.update(step.ids, np.stack([zc.real, zc.imag], -1)[None], drive.cov_z)
        exact.append(largest(plain, ideal))
    assert max(exact) < SIZE * 10 * EPS


def test_ideal_ekf_takes_its_covariance_from_the_truth_alone(new_drive: Any) -> None:
    """Two runs with other noises have the same covariance, to the last bit; a plain EKF's differ."""
    drive = new_drive(batch=2, steps=60)
    ideal = IdealEkf(drive.mean, drive.cov, Truth(drive.truth, drive.landmarks))
    plain = EkfSlam(drive.mean, drive.cov)
    for slam in (ideal, plain):
        drive.feed(slam)
    assert np.abs(np.diff(ideal.blocks.full()[1], axis=0)).max() < SIZE * EPS
    assert np.abs(np.diff(plain.blocks.full()[1], axis=0)).max() > 1e-5


def test_ideal_ekf_without_unobservable_gain(new_drive: Any) -> None:
    """Jacobians at truth know that no relative measurement tells the global heading: its variance stays."""
    drive = new_drive(steps=200)
    no_noise = np.zeros((1, 2, 2))
    headings = {}
    ideal = IdealEkf(drive.mean, drive.cov, Truth(drive.truth, drive.landmarks))
    for name, slam in (("ideal", ideal), ("plain", EkfSlam(drive.mean, drive.cov))):
        for step in drive.steps:
            slam.predict(Increment(step.increment.ds, step.increment.dalpha, no_noise))
            if len(step.ids):
                slam.update(step.ids, step.z, drive.cov_z)
        headings[name] = slam.pose().cov[0, 2, 2]
    assert abs(headings["ideal"] - drive.cov[2, 2]) < 1e-9
    assert headings["plain"] < 0.9 * drive.cov[2, 2]


# --- landmarks: order and room ------------------------------------------------------------------------


def test_the_order_of_a_sighting_does_not_matter(new_drive: Any) -> None:
    drive = new_drive(steps=60)
    a, b = EkfSlam(drive.mean, drive.cov), EkfSlam(drive.mean, drive.cov)
    drive.feed(a)
    drive._replace(steps=[s._replace(ids=s.ids[::-1], z=s.z[:, ::-1]) for s in drive.steps]).feed(b)
    assert largest(a, b) < SIZE * 10 * EPS
    p, q = a.landmarks(), b.landmarks()
    order = [q.ids.tolist().index(i) for i in p.ids]
    assert p.ids.tolist() != q.ids.tolist()
    assert np.abs(p.mean - q.mean[:, order]).max() < SIZE * 10 * EPS
    assert np.abs(p.cov - q.cov[:, order]).max() < SIZE * 10 * EPS


@pytest.mark.parametrize("capacity", [0, 1, 3])
def test_growing_beyond_the_capacity_changes_nothing(new_drive: Any, capacity: int) -> None:
    drive = new_drive(steps=60)
    roomy, tight = (
        EkfSlam(drive.mean, drive.cov, capacity=50),
        EkfSlam(drive.mean, drive.cov, capacity=capacity),
    )
    drive.feed(roomy)
    drive.feed(tight)
    for x, y in zip(roomy.blocks.full(), tight.blocks.full(), strict=True):
        assert x.shape == y.shape
        assert np.abs(x - y).max() < SIZE * EPS
    assert tight.blocks.ids.tolist() == roomy.blocks.ids.tolist()


def test_output_is_a_copy(new_drive: Any) -> None:
    drive = new_drive(steps=10)
    slam = EkfSlam(drive.mean, drive.cov)
    drive.feed(slam)
    for estimate in (slam.pose(), slam.landmarks()):
        before = slam.blocks.full()
        for part in estimate:
            part[:] = 7
        assert all(np.array_equal(x, y) for x, y in zip(before, slam.blocks.full(), strict=True))


# --- bad input ----------------------------------------------------------------------------------------

SOUND = np.eye(3)


@pytest.mark.parametrize(
    ("mean", "cov", "told"),
    [
        ([0, 0], SOUND, r"need \(B, 3\)"),
        ([[[0, 0, 0]]], SOUND, r"need \(B, 3\)"),
        ([0, 0, 0], np.eye(4), r"need \(B, 3\)"),
        ([0, 0, np.nan], SOUND, "finite"),
        ([0, 0, 0], np.diag([1, 1, np.inf]), "finite"),
        ([0, 0, 0], np.diag([1, 1, -0.1]), "semi-definite"),
        ([0, 0, 0], [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]], "symmetric"),
    ],
)
@pytest.mark.parametrize("slam_type", [EkfSlam, AnchoredEkf])
def test_bad_start_is_refused(slam_type: Any, mean: Any, cov: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        slam_type(mean, cov)


@pytest.mark.parametrize(
    ("ids", "z", "told"),
    [
        ([0, 1], [[[1.0, 2.0]]], r"need \(m,\) and \(1, m, 2\)"),
        ([0], [[1.0, 2.0]], r"need \(m,\) and \(1, m, 2\)"),
        ([0], [[[1.0, np.nan]]], "finite"),
        ([4, 4], [[[1.0, 2.0], [1.0, 2.0]]], "each must appear once"),
    ],
)
def test_bad_measurement_is_refused_and_changes_nothing(ids: Any, z: Any, told: str) -> None:
    slam = EkfSlam([0, 0, 0], SOUND)
    slam.update([9], [[[2.0, 1.0]]], np.eye(2))
    before = slam.blocks.full()
    with pytest.raises(ValueError, match=told):
        slam.update(ids, z, np.eye(2))
    assert all(np.array_equal(x, y) for x, y in zip(before, slam.blocks.full(), strict=True))


def test_a_known_landmark_twice_in_one_sighting_is_refused() -> None:
    slam = EkfSlam([0, 0, 0], SOUND)
    slam.update([9], [[[2.0, 1.0]]], np.eye(2))
    with pytest.raises(ValueError, match="each must appear once"):
        slam.update([9, 9], [[[2.0, 1.0], [2.0, 1.0]]], np.eye(2))


@pytest.mark.parametrize("cov_z", [1.0, np.eye(3), np.tile(np.eye(2), (2, 1, 1)), np.diag([1.0, np.nan])])
def test_bad_measurement_covariance_is_refused(cov_z: Any) -> None:
    with pytest.raises(ValueError, match=r"covariance"):
        EkfSlam([0, 0, 0], SOUND).update([9], [[[2.0, 1.0]]], cov_z)


def test_start_batch_shares_one_covariance() -> None:
    slam = EkfSlam(np.zeros((4, 3)), SOUND)
    assert slam.pose().cov.shape == (4, 3, 3)
    assert np.array_equal(se2.identity((4,)), slam.pose().mean)
