"""Range and bearing: the Jacobian by differences, the seam of the bearing, several sightings and none."""

from __future__ import annotations

import numpy as np

from vslam_ref.filters.polar_update import predicted_polar, update_polar
from vslam_ref.testing import check_jacobian

X = np.array([1.0, -2.0, 0.7, 4.0, 1.0, -3.0, 2.5])
P = 0.04 * np.eye(7) + 0.01


def test_the_jacobian_is_that_of_range_and_bearing() -> None:
    for slot in (0, 1):
        _, H = predicted_polar(X, slot)
        check_jacobian(lambda x, slot=slot: predicted_polar(x, slot)[0], X, H, method="central")


def test_a_bearing_across_the_seam_moves_the_state_a_little() -> None:
    """The landmark lies behind: predicted just below pi, seen just above -pi."""
    x = np.array([0.0, 0.0, 0.0, -4.0, 0.01])
    covariance = np.diag([0.01, 0.01, 0.01, 0.01, 0.01])
    after, _ = update_polar(x, covariance, [0], [[4.0, -np.pi + 0.005]], np.diag([0.01, 0.001]))
    assert np.abs(after - x).max() < 0.02


def test_two_sightings_are_one_update_and_none_is_none() -> None:
    """All at once, where the model is linear enough, is nearly one after the other."""
    z = np.array([predicted_polar(X, i)[0] for i in (0, 1)]) + 1e-6
    cov = np.diag([0.01, 0.001])
    both = update_polar(X, P, [0, 1], z, cov)
    first = update_polar(X, P, [0], z[:1], cov)
    second = update_polar(first.x, first.P, [1], z[1:], cov)
    assert np.abs(both.x - second.x).max() < 1e-9
    assert np.abs(both.P - second.P).max() < 1e-6
    still = update_polar(X, P, [], np.zeros((0, 2)), cov)
    assert np.array_equal(still.x, X)
    assert np.array_equal(still.P, P)
