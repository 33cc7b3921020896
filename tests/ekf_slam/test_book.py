"""The book's EKF-SLAM, one run in whole matrices, and the fast one take the same steps.

Tolerance 1e-9 relative, as in ``test_oracles``.  Every sign of the book that is changed shows by 1e-5: ten
thousand times as much.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref.filters import book, vehicle
from vslam_ref.filters.ekf_slam import EkfSlam

TOLERANCE, SEEN = 1e-9, 1e-5


@pytest.mark.parametrize("seed", [3, 4, 5, 6])
def test_the_book_and_the_fast_filter_take_the_same_steps(
    new_drive: Any, book_filter: Any, relative_difference: Any, seed: int
) -> None:
    """A batch of three runs is three runs of the book."""
    drive = new_drive(seed=seed, batch=3, steps=80 + 40 * (seed % 2))
    slam, books = EkfSlam(drive.mean, drive.cov), [book_filter(mean, drive.cov) for mean in drive.mean]
    for step in drive.steps:
        slam.predict(step.increment)
        if len(step.ids):
            slam.update(step.ids, step.z, drive.cov_z)
        for b, one in enumerate(books):
            one.predict(step.increment, b)
            one.update(step.ids, step.z[b], drive.cov_z)
    for b, one in enumerate(books):
        assert relative_difference(slam, *one.belief, run=b) < TOLERANCE


def test_innovations_are_the_books(new_drive: Any, book_filter: Any) -> None:
    drive = new_drive(steps=40)
    slam, one = EkfSlam(drive.mean, drive.cov), book_filter(drive.mean[0], drive.cov)
    compared = 0
    for step in drive.steps:
        slam.predict(step.increment)
        one.predict(step.increment)
        if len(step.ids):
            known = [j for j, i in enumerate(step.ids) if i in one.belief.ids]
            ids, covs = step.ids[known].tolist(), np.tile(drive.cov_z, (len(known), 1, 1))
            nu, S, _ = book.innovation(one.belief, ids, step.z[0, known], covs) if known else (None,) * 3
            seen = slam.update(step.ids, step.z, drive.cov_z)
            one.update(step.ids, step.z[0], drive.cov_z)
            assert (seen is None) == (nu is None)
            if seen is not None:
                assert np.abs(seen.innovation[0] - nu).max() < TOLERANCE
                assert np.abs(seen.S[0] - S).max() < TOLERANCE
                compared += 1
    assert compared > 5


def test_each_landmark_may_have_its_own_noise(
    new_drive: Any, book_filter: Any, relative_difference: Any
) -> None:
    """One (m, 2, 2) covariance for m landmarks equals updates one by one with theirs.

    With the heading known H is constant, so that joint and single updates agree exactly.
    """
    drive = new_drive(steps=5)
    ids, z = drive.steps[-1].ids, drive.steps[-1].z
    covs, P0 = np.array([np.diag([0.01 * (k + 1), 0.02]) for k in range(len(ids))]), np.diag([1.0, 1.0, 0.0])
    slam, one = EkfSlam(drive.mean, P0), book_filter(drive.mean[0], P0)
    for shift in (0.0, 0.1):
        slam.update(ids, z + shift, covs)
        for j, i in enumerate(ids):
            one.update([i], z[0, j : j + 1] + shift, covs[j : j + 1])
    assert len(ids) > 2
    assert relative_difference(slam, *one.belief) < TOLERANCE


@settings(max_examples=50, deadline=None)
@given(v=st.floats(-3, 3), phi=st.floats(-1, 1), rho=st.floats(-0.9, 0.9), L=st.floats(0.5, 4))
def test_the_books_car_is_the_fast_one(v: float, phi: float, rho: float, L: float) -> None:
    """Five products of numbers below 10 and one tangent: a hundred eps of the size, 1e-13."""
    cov_u = np.array([[0.04, rho * 0.01], [rho * 0.01, 0.0025]])
    ds, dalpha, Q = book.drive(v, phi, cov_u, L, 0.1)
    fast = vehicle.ackermann_increment([[v, phi]], cov_u, L, 0.1)
    assert abs(fast.ds[0] - ds) < 1e-13
    assert abs(fast.dalpha[0] - dalpha) < 1e-13
    assert np.abs(fast.cov[0] - Q).max() < 1e-13


def test_every_changed_sign_shows(
    new_drive: Any, book_filter: Any, relative_difference: Any, flips: Any
) -> None:
    drive = new_drive(steps=25)
    slam = EkfSlam(drive.mean, drive.cov)
    drive.feed(slam)
    control = np.array([1.2, 0.6]), np.array([[0.04, 0.003], [0.003, 0.2]]), 2.0, 0.1
    increment = vehicle.ackermann_increment(control[0][None], *control[1:])
    missed, tried = [], 0
    for line, module in flips(book):
        tried += 1
        try:
            one = book_filter(drive.mean[0], drive.cov, module).feed(drive)
            ds, dalpha, Q = module.drive(*control[0], *control[1:])
            off = relative_difference(slam, *one.belief)
            off = max(off, abs(ds - increment.ds[0]), abs(dalpha - increment.dalpha[0]))
            off = max(off, np.abs(Q - increment.cov[0]).max())
        except (ValueError, IndexError, np.linalg.LinAlgError):
            continue  # shapes that do not fit: it shows
        missed += [line] if not off > SEEN else []
    assert tried > 20
    assert not missed
