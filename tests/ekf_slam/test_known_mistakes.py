"""Mistakes of other teaching code: the oracle that accepts our filter rejects each of them.

Each is a change of the book's text.  ``test_book`` accepts a difference of 1e-9;
every mistake must show by more than 1e-5, ten thousand times that.
"""

from __future__ import annotations

import inspect
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.filters import book, vehicle
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.testing import check_jacobian

SEEN = 1e-5


MISTAKES = {
    "G^T P G for G P G^T": [("F @ b.P @ F.T + G", "F.T @ b.P @ F + G")],
    "sine and cosine swapped in F": [("= -ds * s, ds * c", "= -ds * c, ds * s")],
    "process noise used as sensor noise": [
        ("block_diag(*cov_z)", "np.kron(np.eye(len(ids)), 1e-3 * np.array([[1.0, 0.3], [0.3, 0.5]]))")
    ],
    "a new landmark with covariance I and no cross terms": [
        ("np.block([[b.P, b.P @ G.T], [G @ b.P, own]])", "block_diag(b.P, np.eye(2))")
    ],
    "a new landmark without cross terms": [
        ("np.block([[b.P, b.P @ G.T], [G @ b.P, own]])", "block_diag(b.P, own)")
    ],
    "* between arrays": [("F @ b.P @ F.T + G", "F * b.P * F.T + G")],
    # value and Jacobian alike, so that no check of Jacobians sees it
    "R (l - p) for R^T (l - p)": [
        ("r = R.T @ (", "r = R @ ("), ("= -R.T, R.T", "= -R, R"), ("= r[1], -r[0]", "= -r[1], r[0]")
    ],
}  # fmt: skip


@pytest.mark.parametrize("mistake", [None, *MISTAKES])
def test_the_oracle_tells_the_mistake(
    new_drive: Any, book_filter: Any, relative_difference: Any, mistake: Any
) -> None:
    drive, source = new_drive(steps=25), inspect.getsource(book)
    for right, wrong in MISTAKES.get(mistake, []):
        assert right in source
        source = source.replace(right, wrong)
    module = ModuleType(book.__name__)
    exec(source, vars(module))
    slam, one = EkfSlam(drive.mean, drive.cov), book_filter(drive.mean[0], drive.cov, module)
    drive.feed(slam)
    off = relative_difference(slam, *one.feed(drive).belief)
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
