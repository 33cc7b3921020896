"""A gate leaves out, run by run, what lies too far from the prediction, and changes nothing else.

A run that passes takes the same step as without a gate, to the last bit; one that does not stays where it
was, but for the noise that the reduced filter had not given to its map yet: 1e-12 covers that rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam, IdealEkf, Truth
from vslam_ref.filters.vehicle import Increment

ROUNDING = 1e-12
POSES = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.1]])
TRUTH = Truth(POSES, np.array([[3.0, 1.0], [2.0, -1.0]]))
MAKERS: dict[str, Callable[[Any, Any], Any]] = {
    "ekf": EkfSlam,
    "anchored": AnchoredEkf,
    "ideal": lambda mean, cov: IdealEkf(mean, cov, TRUTH),
    "lifted": lambda mean, cov: carleman_ekf(mean, cov, form="lifted"),
    "reduced": lambda mean, cov: carleman_ekf(mean, cov, form="reduced"),
    "reduced-map": lambda mean, cov: carleman_ekf(mean, cov, form="reduced-map"),
}
COV_Z = 0.01 * np.eye(2)


def started(make: Callable[[Any, Any], Any]) -> Any:
    """Three runs with two landmarks in the map, after a prediction."""
    slam = make(np.zeros((3, 3)), 0.01 * np.eye(3))
    slam.update([0, 1], np.tile(TRUTH.landmarks, (3, 1, 1)), COV_Z)
    slam.predict(Increment(np.full(3, 0.5), np.full(3, 0.1), np.tile(0.001 * np.eye(2), (3, 1, 1))))
    return slam


@pytest.mark.parametrize("name", MAKERS)
def test_each_run_has_its_own_gate(name: str) -> None:
    gated, plain, before = (started(MAKERS[name]) for _ in range(3))
    seen = gated.innovation([0, 1], np.zeros((3, 2, 2)), COV_Z)
    z = -seen.innovation.reshape(3, 2, 2)  # exactly what is predicted
    z[1] += 5.0  # fifty standard deviations of the sensor
    asked = gated.innovation([0, 1], z, COV_Z)
    nis = np.einsum("bi,bij,bj->b", asked.innovation, np.linalg.inv(asked.S), asked.innovation)
    assert nis[1] > 30 > 1 > max(nis[0], nis[2])
    used, all_used = gated.update([0, 1], z, COV_Z, gate=30.0), plain.update([0, 1], z, COV_Z)
    for a, b in zip(used, all_used, strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b, c in zip(gated.pose(), plain.pose(), before.pose(), strict=True):
        np.testing.assert_array_equal(a[[0, 2]], b[[0, 2]])
        assert np.abs(a[1] - c[1]).max() < ROUNDING
        assert np.abs(b[1] - c[1]).max() > 1e-4


@pytest.mark.parametrize("name", MAKERS)
def test_landmarks_of_a_rejected_run_stay_and_new_ones_enter(name: str) -> None:
    gated, before = started(MAKERS[name]), started(MAKERS[name])
    z = np.full((3, 2, 2), 9.0)
    if name == "ideal":
        z, ids = z[:, :1], [0]  # its truth knows two landmarks only
    else:
        ids = [0, 7]
    assert gated.update(ids, z, COV_Z, gate=1.0) is not None
    if name != "reduced":  # which carries no map
        here, there = before.landmarks(), gated.landmarks()
        assert there.ids.tolist() == ([0, 1] if name == "ideal" else [0, 1, 7])
        assert np.abs(here.mean - there.mean[:, :2]).max() < ROUNDING
        assert np.abs(here.cov - there.cov[:, :2]).max() < ROUNDING
