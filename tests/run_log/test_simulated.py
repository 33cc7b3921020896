"""A simulated log is what a calibration says: corrections undo it, and its noises have their sizes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import mrclam
from vslam_ref.systems.slam_log import LogTruth, RobotCalibration, SlamLog, simulated
from vslam_ref.systems.slam_log.timeline import control_increments, increment_variances
from vslam_ref.worlds.figure_eight import Eight, EightConfig, drive, scatter

ODD = RobotCalibration(
    distance_gain=0.9, turn_gain=1.2, drift=-0.05, sighting_delay=0.2, sensor_ahead=0.3, bearing_offset=0.02,
    range_offset=-0.04, range_cosine=0.9, sigma_distance=0.05, sigma_turn=0.1, sigma_drift=0.03,
    sigma_range=0.02, sigma_bearing=0.01,
)  # fmt: skip


@pytest.fixture(scope="module")
def world() -> Eight:
    return drive(EightConfig(seconds=60.0), scatter(12, np.random.default_rng(0)))


def test_corrections_of_the_filters_undo_a_log_without_noise(world: Eight) -> None:
    """Rounding only: steps between stamps of 60 s (7e-15 s, at 0.56 m/s); a dozen operations on metres."""
    log, truth = simulated.log(world, ODD)
    np.testing.assert_allclose(control_increments(log, ODD), (world.controls * 0.05)[:-1], rtol=0, atol=4e-15)
    assert len(log.sightings) > 50
    for seen in log.sightings:
        pose = world.poses[round((seen.time - ODD.sighting_delay) / 0.05)]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        relative = (truth.landmarks[seen.ids - 6] - pose[:2]) @ np.array([[c, -s], [s, c]]) - [0.3, 0.0]
        polar = np.stack([np.hypot(*relative.T), np.arctan2(relative[:, 1], relative[:, 0])], -1)
        np.testing.assert_allclose(ODD.correct(seen.polar), polar, rtol=0, atol=1e-14)


def test_noises_have_the_sizes_that_are_given(world: Eight) -> None:
    """Sums of squares are chi-square: mean n, variance 2 n; 5 deviations."""
    log, _ = simulated.log(world, ODD, np.random.default_rng(1))
    clean, _ = simulated.log(world, ODD)
    true = (world.controls * 0.05)[:-1]
    whitened = (control_increments(log, ODD) - true) / np.sqrt(increment_variances(true, ODD))
    off = [
        ODD.correct(a.polar) - ODD.correct(b.polar)
        for a, b in zip(log.sightings, clean.sightings, strict=True)
    ]
    seen = np.concatenate(off) / [ODD.sigma_range, ODD.sigma_bearing]
    for errors in (*whitened.T, *seen.T):
        assert abs(np.sum(errors**2) - len(errors)) < 5 * np.sqrt(2 * len(errors))


def test_what_is_written_is_read(world: Eight, tmp_path: Path) -> None:
    """Times to the rounding of the clock (1000 s: 1e-13 s), all else to the last bit."""
    log, truth = simulated.log(world, ODD, np.random.default_rng(1))
    mrclam.write(tmp_path, 1, log, truth)
    again = mrclam.read_log(tmp_path, 1)
    known = mrclam.read_truth(tmp_path, 1, again)
    np.testing.assert_array_equal(again.controls, log.controls)
    np.testing.assert_allclose(again.times, log.times, rtol=0, atol=4e-13)
    assert len(again.sightings) == len(log.sightings)
    for a, b in zip(again.sightings, log.sightings, strict=True):
        np.testing.assert_array_equal(a.ids, b.ids)
        np.testing.assert_array_equal(a.polar, b.polar)
        assert abs(a.time - b.time) < 4e-13
    np.testing.assert_array_equal(known.landmarks, truth.landmarks)
    np.testing.assert_array_equal(known.T_world_vehicle[:, :2], truth.T_world_vehicle[:, :2])
    assert np.abs(np.sin(known.T_world_vehicle[:, 2] - truth.T_world_vehicle[:, 2])).max() < 1e-14


def test_the_format_has_no_place_for_other_drives_and_robots(world: Eight, tmp_path: Path) -> None:
    log, truth = simulated.log(world, ODD)
    bad: list[tuple[int, SlamLog, LogTruth]] = [
        (1, log._replace(drive="ackermann"), truth),
        (6, log, truth),
        (1, log, truth._replace(ids=truth.ids - 2)),
    ]
    for robot, one, other in bad:
        with pytest.raises(ValueError, match="MRCLAM has robots 1 to 5"):
            mrclam.write(tmp_path, robot, one, other)
    assert list(tmp_path.iterdir()) == []
