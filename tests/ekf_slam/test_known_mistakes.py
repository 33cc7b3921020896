"""Mistakes of other teaching code: the oracle that accepts our filter rejects each of them.

Each class below is the textbook filter with one mistake.  ``test_oracles`` accepts a difference of 1e-9;
every mistake must show by more than 1e-5, ten thousand times that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.filters import vehicle
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.testing import check_jacobian

SEEN = 1e-5


def transposed_sandwich(book: Any) -> Any:
    """G^T P G for G P G^T."""
    book.motion_covariance = lambda F, P: F.T @ P @ F
    return book


def swapped_sine_and_cosine(book: Any) -> Any:
    """-ds cos, ds sin in the motion Jacobian."""
    right = book.motion_jacobians

    def wrong(u: np.ndarray) -> Any:
        F, G = right(u)
        F[0, 2], F[1, 2] = -F[1, 2], -F[0, 2]
        return F, G

    book.motion_jacobians = wrong
    return book


def process_noise_as_sensor_noise(book: Any) -> Any:
    right = book.update
    book.update = lambda ids, z, cov_z: right(ids, z, 1e-3 * np.array([[1.0, 0.3], [0.3, 0.5]]))
    return book


def identity_covariance(book: Any) -> Any:
    """A new landmark with covariance I and no cross terms."""

    def augment(i: int, z: np.ndarray, cov_z: np.ndarray) -> None:
        book.x = np.concatenate([book.x, book.place(book.x[:3], z)])
        n = len(book.P)
        book.P = np.block([[book.P, np.zeros((n, 2))], [np.zeros((2, n)), np.eye(2)]])
        book.ids.append(i)

    book.augment = augment
    return book


def no_cross_terms(book: Any) -> Any:
    """A new landmark with its own right covariance, and no cross terms."""
    right = book.augment

    def augment(i: int, z: np.ndarray, cov_z: np.ndarray) -> None:
        right(i, z, cov_z)
        book.P[-2:, :-2] = 0.0
        book.P[:-2, -2:] = 0.0

    book.augment = augment
    return book


def elementwise_product(book: Any) -> Any:
    """F * P * F^T, as ``*`` does between arrays."""
    book.motion_covariance = lambda F, P: F * P * F.T
    return book


def rotation_not_transposed(book: Any) -> Any:
    """R (l - p) for R^T (l - p), in value and Jacobian alike: no Jacobian check sees it."""

    def see(x: np.ndarray, at: int) -> np.ndarray:
        dx, dy, c, s = x[at] - x[0], x[at + 1] - x[1], np.cos(x[2]), np.sin(x[2])
        return np.stack([c * dx - s * dy, c * dy + s * dx])

    book.see = see
    return book


MISTAKES = [
    transposed_sandwich,
    swapped_sine_and_cosine,
    process_noise_as_sensor_noise,
    identity_covariance,
    no_cross_terms,
    elementwise_product,
    rotation_not_transposed,
]


@pytest.mark.parametrize("mistake", [None, *MISTAKES])
def test_the_oracle_tells_the_mistake(
    new_drive: Any, textbook: Any, relative_difference: Any, mistake: Any
) -> None:
    drive = new_drive(steps=25)
    slam, book = EkfSlam(drive.mean, drive.cov), textbook(drive.mean[0], drive.cov)
    if mistake is not None:
        book = mistake(book)
    for step in drive.steps:
        slam.predict(step.increment)
        book.predict(np.array([step.increment.ds[0], step.increment.dalpha[0]]), step.increment.cov[0])
        if len(step.ids):
            slam.update(step.ids, step.z, drive.cov_z)
            book.update(step.ids.tolist(), step.z[0], drive.cov_z)
    off = relative_difference(slam, book.x, book.P, book.ids)
    assert off < 1e-9 if mistake is None else off > SEEN


def test_swapped_sine_and_cosine_fail_the_jacobian_check() -> None:
    pose, u = np.array([1.0, 2.0, 0.6]), np.array([0.3, 0.05])
    J = vehicle.propagate_with_jacobians(pose, u).J_pose
    check_jacobian(lambda p: vehicle.propagate(p, u), pose, J)
    J[0, 2], J[1, 2] = -J[1, 2], -J[0, 2]
    with pytest.raises(AssertionError, match=r"entry \[\d, 2\]"):
        check_jacobian(lambda p: vehicle.propagate(p, u), pose, J)


def test_front_wheel_turns_by_sin_g_over_wb_not_by_the_sine_of_g_over_wb() -> None:
    """Oracle: geometry.  A bicycle that keeps G turns about one point; the front wheel's circle has radius
    WB / sin(G), so an arc of length s turns it by s sin(G) / WB.  The other form gives another radius."""
    wheelbase, G, s = 4.0, 0.5, 1e-3
    poses = [np.zeros(3)]
    for _ in range(3):
        poses.append(vehicle.front_wheel_step(poses[-1], [1.0, G], wheelbase, s))
    a, b, c = (complex(*p[:2]) for p in poses[:3])
    # circumradius of three points; the polygon's is the circle's to (s/R)^2
    area = abs(((b - a).conjugate() * (c - a)).imag) / 2
    radius = abs(b - a) * abs(c - b) * abs(c - a) / (4 * area)
    assert abs(radius - wheelbase / np.sin(G)) < radius * (s / radius) ** 2 * 10 + 1e-6
    wrong = s / (s * np.sin(G / wheelbase))
    assert abs(wrong - radius) > 0.03 * radius


def test_front_and_rear_wheel_models_are_one_vehicle() -> None:
    """Front speed V, rear speed V cos(G): in the limit of small steps the two axles stay WB apart."""
    wheelbase, V, G, dt = 2.0, 1.0, 0.4, 1e-4
    rear = np.array([0.3, -0.2, 0.7])
    ahead = wheelbase * np.array([np.cos(0.7), np.sin(0.7)])
    front = np.array([*(rear[:2] + ahead), 0.7])
    for _ in range(2000):
        rear = vehicle.propagate(rear, vehicle.ackermann([V * np.cos(G), G], wheelbase, dt))
        front = vehicle.front_wheel_step(front, [V, G], wheelbase, dt)
    gap = front[:2] - rear[:2]
    # Euler's local error dt^2 (rate V/R = 0.2, speed 1) / 2 over 2000 steps of 1e-4 s: below 1e-5
    assert abs(front[2] - rear[2]) < 1e-12
    assert np.abs(gap - wheelbase * np.array([np.cos(rear[2]), np.sin(rear[2])])).max() < 1e-4
