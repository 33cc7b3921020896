"""Covariances that B leaves out or leaves open: the noise of U (B10) and the cross blocks (B17, B19)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vslam_ref.filters import vehicle
from vslam_ref.filters.carleman_ekf import LiftedCarlemanEkf, Variant, lift, moments
from vslam_ref.filters.ekf_slam import EkfSlam

EPS = np.finfo(float).eps
WHEELBASE, DT = 1.0, 0.1
CONTROL, COV_U = np.array([1.2, 0.25]), np.diag([0.2**2, 0.05**2])
STEP = 1e-30  # complex step: the derivative is exact to rounding


def complex_jacobian(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Jacobian (m, n) of a function of n complex numbers."""
    return np.stack([function(at + 1j * STEP * e).imag / STEP for e in np.eye(len(at))], 1)


def lifted_control(control: np.ndarray) -> np.ndarray:
    """B6: U = (u1, u2, u3) of speed and steering angle."""
    v, phi = control
    alpha = v * DT * np.tan(phi) / WHEELBASE
    return np.stack([v * DT, np.sin(alpha), np.cos(alpha)])


def joint_lift(state: np.ndarray) -> np.ndarray:
    """B14 and B15 from their definition: pose and landmarks (3 + 2 n) to (11 + 6 n)."""
    x, y, s, c = state[0], state[1], np.sin(state[2]), np.cos(state[2])
    out = [x, y, s, c, s * s, c * c, x * s, x * c, y * s, y * c, s * c]
    for X, Y in state[3:].reshape(-1, 2):
        out += [X, Y, s * X, c * X, s * Y, c * Y]
    return np.stack(out)


def test_noise_of_the_lifted_control_comes_from_two_numbers() -> None:
    G = complex_jacobian(lifted_control, CONTROL)
    increment = vehicle.ackermann_increment(CONTROL[None], COV_U, WHEELBASE, DT)
    factor = moments.control_moments(increment, "first_order").factor[0, :3]  # of u1, u2, u3
    Q_U = factor @ factor.T
    assert lift.MONOMIALS[1:4] == ("u1", "u2", "u3")
    assert np.abs(Q_U - G @ COV_U @ G.T).max() < 16 * EPS * np.abs(Q_U).max()
    assert np.linalg.matrix_rank(Q_U) == 2
    # Along the radius of the circle there is no noise; three independent noises would have some.
    radius = np.array([0.0, *lifted_control(CONTROL)[1:]])
    independent = np.diag(np.diag(Q_U))
    assert radius @ Q_U @ radius < 16 * EPS * np.abs(Q_U).max()
    assert radius @ independent @ radius > 1e6 * EPS * np.abs(Q_U).max()


def covariance_and_its_oracle(variant: Variant) -> tuple[np.ndarray, np.ndarray]:
    """The lifted filter's covariance after five steps, and the EKF's lifted by the Jacobian.

    Before a known landmark is seen again the lifted mean is the lift of the EKF's mean, and then the
    lifted transition F obeys F J(x) = J(x') F_x: the two covariances are one, all blocks of it.
    """
    mean, cov = np.array([[1.0, -2.0, 0.6]]), np.diag([0.2, 0.1, 0.02])
    ekf, lifted = EkfSlam(mean, cov), LiftedCarlemanEkf(mean, cov, variant=variant)
    for slam in (ekf, lifted):
        slam.update([0, 1], np.array([[[3.0, 1.0], [2.0, -4.0]]]), np.diag([0.01, 0.02]))
        for _ in range(5):
            slam.predict(vehicle.ackermann_increment(CONTROL[None], COV_U, WHEELBASE, DT))
    state, P = ekf.blocks.full()
    J = complex_jacobian(joint_lift, state[0])
    z, P_lifted = lifted.state()
    # Five steps of sums of at most five products of numbers up to 30, errors carried on: 5 * 5 * 30 eps.
    assert np.abs(z[0] - joint_lift(state[0])).max() < 5 * 5 * 30 * EPS
    return P_lifted[0], J @ P[0] @ J.T


def test_vehicle_and_features_share_the_noise_of_the_controls() -> None:
    P, oracle = covariance_and_its_oracle(Variant())
    # Products of 23 x 23 matrices over five steps, entries up to 20.
    assert np.abs(P - oracle).max() < 23 * 5 * 20 * EPS


def test_the_printed_covariances_lack_the_cross_blocks() -> None:
    P, oracle = covariance_and_its_oracle(Variant(cross_noise=False))
    wrong = np.abs(P - oracle) > 1e-6
    blocks = [slice(0, 11), slice(11, 17), slice(17, 23)]
    for i, a in enumerate(blocks):
        for j, b in enumerate(blocks):
            assert wrong[a, b].any() == (i != j)
