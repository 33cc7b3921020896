"""The lifted covariance is singular by construction; rounding must not make it indefinite.

**Which directions are null.**  P starts as the covariance of three numbers, so it lives on the tangent
space of the manifold of lifted poses: rank 3 + 2 n of 11 + 6 n.  With first-order noise predictions keep it
there, for M(U) maps the manifold into itself.  Updates leave the manifold and fill the other directions
with second-order terms, all but one: z5 + z6 = 1 is kept by M(U), by the noise and by every new landmark,
so (0, 0, 0, 0, 1, 1, 0, ...) stays a null vector for ever.

**How negative lambda_min may get.**  In exact arithmetic one measurement period is

    P <- A (M P M^T + N N^T) A^T + K cov_z K^T,        A = I - K H,

whatever symmetric P is (P - G^T G is the same matrix), so nothing but rounding makes P indefinite.  An
inner product of l terms is off by l eps times the product of absolute values, and for such a P
|| |P| ||_2 <= trace P <= D lambda_max: that is where D enters.  Per period of ten steps of 0.1 m, for which
|| |M| ||_2 = 2.28, in units of D eps lambda_max:

    M P, then (M P) M^T    2 * 11 terms, * || |M| ||^2 = 5.2    115
    N N^T                  20 columns                           20
    H P, solve, G^T G, -   4 + 2 m + 2 m + 1, m <= 4            21
                                                          k1 = 156

Errors of U periods add up at worst: k = k1 U.  (What is carried on by A M is multiplied like P itself.)
Measured: 0.03 D eps lambda_max, and no growth in 10^4 periods, because noise refills what rounding took.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf
from vslam_ref.filters.observability import lift_tangent

EPS = float(np.finfo(np.float64).eps)
K1 = 156
COV_U, COV_Z = np.diag([0.02**2, 0.01**2]), 0.01 * np.eye(2)


def periods(slam: Any, count: int, landmarks: int = 8) -> Any:
    """Drive in a circle, ten steps of 0.1 m then a sighting; yield after each period, with the estimate."""
    rng = np.random.default_rng(0)
    world = rng.uniform(-8, 8, (landmarks, 2))
    x, u = np.array([0.0, -5.0, 0.0]), np.array([0.1, 0.02])
    for _ in range(count):
        for _ in range(10):
            x = vehicle.propagate(x, u)
            noisy = u + np.array([0.02, 0.01]) * rng.standard_normal(2)
            slam.predict(vehicle.Increment(noisy[:1], noisy[1:], COV_U[None]))
        r = observation.vehicle_from_world(x, world)
        ids = np.flatnonzero(np.hypot(*r.T) < 6)
        slam.update(ids, (r[ids] + 0.1 * rng.standard_normal((len(ids), 2)))[None], COV_Z)
        yield slam


def check(slam: Any, done: int, largest: float) -> float:
    """Both assertions of this file at one moment; the largest eigenvalue so far."""
    z, P = (part[0] for part in slam.state())
    values = np.linalg.eigvalsh(P)
    largest = max(largest, values[-1])
    unit = len(P) * EPS * largest
    assert values[0] >= -K1 * done * unit
    null = np.zeros(len(P))
    null[4:6] = 1.0
    assert np.abs(P @ null).max() <= K1 * done * unit
    # one step multiplies w by u2^2 + u3^2 = 1 + 3 eps and sums two rounded rows of four terms
    assert abs(z[4] + z[5] - 1) <= 10 * done * 10 * EPS
    return largest


def test_lambda_min_over_two_thousand_steps() -> None:
    slam, largest = LiftedCarlemanEkf([0, -5, 0], np.diag([1, 1, 0.03]), capacity=8), 0.0
    for done, _ in enumerate(periods(slam, 200), 1):
        if done % 20 == 0:
            largest = check(slam, done, largest)
    # not even one period's worth, after two hundred: errors do not pile up
    assert np.linalg.eigvalsh(slam.state()[1][0])[0] > -slam.size * EPS * largest


@pytest.mark.slow
def test_lambda_min_over_a_hundred_thousand_steps() -> None:
    slam, largest = LiftedCarlemanEkf([0, -5, 0], np.diag([1, 1, 0.03]), capacity=8), 0.0
    for done, _ in enumerate(periods(slam, 10_000), 1):
        if done % 500 == 0:
            largest = check(slam, done, largest)
            assert np.linalg.eigvalsh(slam.state()[1][0])[0] > -slam.size * EPS * largest


def test_a_lost_cross_block_is_seen() -> None:
    """The bound has teeth: a filter that moves the vehicle's block but not the cross blocks breaks it."""

    class Forgetful(LiftedCarlemanEkf):
        def _apply_accumulated(self) -> None:
            cross = self._P[:, :11, 11 : self.size].copy()
            super()._apply_accumulated()
            self._P[:, :11, 11 : self.size] = cross
            self._P[:, 11 : self.size, :11] = cross.swapaxes(1, 2)

    slam = Forgetful([0, -5, 0], np.diag([1, 1, 0.03]), capacity=8)

    def run() -> None:
        for done, _ in enumerate(periods(slam, 20), 1):
            check(slam, done, 0.0)

    with pytest.raises((AssertionError, np.linalg.LinAlgError)):
        run()


def complement(J: np.ndarray) -> np.ndarray:
    return np.linalg.svd(J)[0][:, J.shape[1] :]


def test_before_any_update_the_null_space_is_that_of_the_manifold() -> None:
    """Rank 3 + 2 n: landmarks of one first sighting, then predictions only."""
    slam = LiftedCarlemanEkf([1.0, -2.0, 0.4], np.diag([1, 1, 0.03]))
    slam.update([0, 1], [[[2.0, 1.0], [3.0, -1.5]]], COV_Z)
    for _ in range(25):
        slam.predict(vehicle.Increment(np.array([0.1]), np.array([0.02]), COV_U[None]))
    z, P = (part[0] for part in slam.state())
    pose, places = slam.pose().mean[0], slam.landmarks().mean[0]
    values = np.linalg.eigvalsh(P)
    rounding = K1 * len(P) * EPS * values[-1]
    assert (values > rounding).sum() == 3 + 2 * 2
    assert len(z) == 11 + 6 * 2
    assert np.abs(P @ complement(lift_tangent(pose, places))).max() < rounding


def test_updates_leave_the_manifold_but_for_w() -> None:
    slam = LiftedCarlemanEkf([0, -5, 0], np.diag([1, 1, 0.03]), capacity=8)
    for _ in periods(slam, 30):
        pass
    _, P = (part[0] for part in slam.state())
    n = (len(P) - 11) // 6
    values, vectors = np.linalg.eigh(P)
    rounding = K1 * 30 * len(P) * EPS * values[-1]
    assert (values > rounding).sum() > 3 + 2 * n
    null = vectors[:, values <= rounding]
    w = np.zeros(len(P))
    w[4:6] = np.sqrt(0.5)
    assert abs(np.linalg.norm(null.T @ w) - 1) < 1e-6


@pytest.mark.parametrize("start", ["first_order", "gaussian"])
def test_w_is_a_null_vector_from_the_start(start: str) -> None:
    slam = LiftedCarlemanEkf([1.0, -2.0, 0.4], np.diag([1, 1, 0.3]), start=start)
    z, P = (part[0] for part in slam.state())
    assert abs(z[4] + z[5] - 1) < 4 * EPS
    assert np.abs(P[4] + P[5]).max() < 16 * EPS
