"""The runner on simulated logs: round trip, consistency, gate, time steps, and its parts."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from vslam_ref.datasets import mrclam
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.vehicle import Increment
from vslam_ref.metrics.alignment import align_rigid
from vslam_ref.systems.slam_log import (
    FILTERS,
    RobotCalibration,
    RunSettings,
    SlamLog,
    build_timeline,
    place,
    run_log,
    summary,
)
from vslam_ref.systems.slam_log.runner import Build, iekf_first_order

CERTAIN = RunSettings(start_sigma_position=0.0, start_sigma_heading=0.0)


@pytest.mark.parametrize("name", ["ekf", "ekf-anchored", iekf_first_order])
def test_a_noise_free_log_gives_back_its_world(
    make_world: Callable[..., object], calibration: RobotCalibration, name: str | Build
) -> None:
    """Every filter whose mean is the motion itself, reader included.  (Exact moments shorten a mean.)

    The converted measurement stretches ranges by exp(sigma_b^2 / 2) = 1.0002, 1 mm at 5 m; the rest is
    printed digits.
    """
    world = make_world("clean", None)
    log = mrclam.read_log(world.folder, 1)
    truth = mrclam.read_truth(world.folder, 1, log)
    got = summary(run_log(log, calibration, name, CERTAIN), truth)
    assert got["landmarks"] == 6
    assert got["rejected"] == 0
    for key in ("rmse_position_m", "rmse_position_unaligned_m", "rmse_heading_rad", "landmark_rmse_m"):
        assert got[key] < 2e-3, key


def test_the_filters_are_consistent_in_a_world_of_their_own_noises(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Final pose NEES of 20 runs: chi-squared, 60 degrees of freedom in sum; 1 false alarm in 1000."""
    stats = pytest.importorskip("scipy.stats")
    finals: dict[str, list[float]] = {name: [] for name in FILTERS}
    for seed in range(20):
        world = make_world(f"w{seed}", calibration, seed, seconds=20.0)
        log = mrclam.read_log(world.folder, 1)
        truth = mrclam.read_truth(world.folder, 1, log)
        for name in FILTERS:
            run = run_log(log, calibration, name, replace(CERTAIN, record_period=0.5, gate=50.0))
            placed = place(run, truth, aligned=False)
            assert placed is not None
            # the first record has no covariance at all
            e, P = placed.errors[-1], placed.covs[-1]
            finals[name].append(float(e @ np.linalg.solve(P, e)))
    low, high = stats.chi2.ppf([0.0005, 0.9995], 60) / 20
    for name, values in finals.items():
        assert low < np.mean(values) < high, name


def test_wrong_sightings_are_counted_and_do_no_harm(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    world = make_world("w", calibration, 3)
    path = world.folder / "Robot1_Measurement.dat"
    lines = path.read_text().splitlines()
    for k in (40, 80, 90):
        time, code, r, b = lines[k].split()
        lines[k] = f"{time} {code} {float(r) + 2.0} {b}"
    path.write_text("\n".join(lines))
    log = mrclam.read_log(world.folder, 1)
    truth = mrclam.read_truth(world.folder, 1, log)
    for name in FILTERS:
        run = run_log(log, calibration, name, CERTAIN)
        wrong = run.seen.innovation[~run.seen.accepted]
        # 3 wrong ones; of some 200 good ones, 0.2 are expected to be lost: more than 3 has probability 1e-4
        assert 3 <= run.rejected <= 6
        assert np.sum(np.hypot(*wrong.T) > 1.0) == 3
        assert summary(run, truth)["rmse_position_m"] < 0.3


def test_a_rejected_sighting_leaves_the_filter_as_it_was(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    world = make_world("w", calibration, 4)
    log = mrclam.read_log(world.folder, 1)
    first = next(s for s in log.sightings if len(s.ids))
    seen_again = next(s for s in log.sightings if s.time > first.time and first.ids[0] in s.ids)
    at = seen_again.ids.tolist().index(int(first.ids[0]))
    polar = seen_again.polar.copy()
    polar[at, 0] += 3.0
    changed = log._replace(
        sightings=tuple(s._replace(polar=polar) if s is seen_again else s for s in log.sightings)
    )
    without = log._replace(
        sightings=tuple(
            s._replace(ids=np.delete(s.ids, at), polar=np.delete(s.polar, at, 0)) if s is seen_again else s
            for s in log.sightings
        )
    )
    a, b = (run_log(x, calibration, "ekf", CERTAIN) for x in (changed, without))
    np.testing.assert_array_equal(a.T_run_vehicle, b.T_run_vehicle)
    np.testing.assert_array_equal(a.covs, b.covs)


@pytest.mark.parametrize("name", list(FILTERS))
def test_a_deep_copy_of_a_filter_goes_its_own_way(name: str) -> None:
    """The gate tries updates on copies: a copy must share nothing, and must keep working."""
    mean, cov = np.zeros(3), np.diag([0.1, 0.1, 0.01])
    step = Increment(np.array([0.2]), np.array([0.1]), np.diag([1e-3, 1e-3])[None])
    z = np.array([[[2.0, 0.5]]])
    one, two = FILTERS[name](mean, cov, 4), FILTERS[name](mean, cov, 4)
    for f in (one, two):
        f.update([1], z, 0.01 * np.eye(2))
        f.predict(step)
    twin = copy.deepcopy(one)
    for f in (twin, two):
        f.update([1, 2], np.concatenate([z - 0.1, z + 1.0], 1), 0.01 * np.eye(2))
        f.predict(step)
    before = FILTERS[name](mean, cov, 4)
    before.update([1], z, 0.01 * np.eye(2))
    before.predict(step)
    for got, wanted in ((twin, two), (one, before)):
        np.testing.assert_array_equal(got.pose().mean, wanted.pose().mean)
        np.testing.assert_array_equal(got.pose().cov, wanted.pose().cov)
        np.testing.assert_array_equal(got.landmarks().mean, wanted.landmarks().mean)


def test_the_timeline_keeps_way_turn_and_variance_whatever_the_step(calibration: RobotCalibration) -> None:
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.0, 0.1, 300))
    times[100] = times[99]  # two stamps at one time: an interval of no length
    log = SlamLog("x", "differential", np.nan, 0.0, times, rng.uniform(-1, 1, (300, 2)), (), {})
    gains = replace(calibration, distance_gain=1.1, turn_gain=0.9, drift=0.05)
    dt = np.diff(times)
    ds = 1.1 * log.controls[:-1, 0] * dt
    da = 0.9 * log.controls[:-1, 1] * dt + 0.05 * ds
    records = np.linspace(times[0], times[-1], 40)
    for max_step in (0.0, 0.03, 0.5):
        line = build_timeline(log, gains, records, max_step)
        np.testing.assert_allclose(line.increments.sum(0), [ds.sum(), da.sum()], atol=1e-12)
        wanted = [np.sum(0.02**2 * np.abs(ds)), np.sum(0.02**2 * np.abs(da) + 0.02**2 * np.abs(ds))]
        np.testing.assert_allclose(np.einsum("kii->i", line.cov), wanted, rtol=1e-12)
        np.testing.assert_array_equal(line.times[line.record_at], records)


def test_longer_steps_change_the_trajectory_by_little(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Summing to 0.1 s turns a step by at most 0.3 rad/s x 0.1 s / 2 sideways: ds x 0.015, 0.75 mm a step.

    Sightings every 0.5 s keep what has gathered to some steps of it.
    """
    world = make_world("w", calibration, 6)
    log = mrclam.read_log(world.folder, 1)
    fine = run_log(log, calibration, "ekf", CERTAIN)
    coarse = run_log(log, calibration, "ekf", replace(CERTAIN, max_step=0.1))
    assert np.abs(fine.T_run_vehicle - coarse.T_run_vehicle).max() < 0.02


def test_a_sighting_is_used_when_it_was_taken(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """A log whose sightings are stamped 0.3 s late is made good by the delay, and only by it."""
    world = make_world("w", None)
    log = mrclam.read_log(world.folder, 1)
    truth = mrclam.read_truth(world.folder, 1, log)
    late = log._replace(sightings=tuple(s._replace(time=s.time + 0.3) for s in log.sightings))
    aware = summary(run_log(late, replace(calibration, sighting_delay=0.3), "ekf", CERTAIN), truth)
    unaware = summary(run_log(late, calibration, "ekf", CERTAIN), truth)
    assert aware["rmse_position_m"] < 2e-3
    assert unaware["rmse_position_m"] > 0.05


def test_truth_of_an_antenna_ahead_is_compared_with_the_antenna(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Truth moved 2 m ahead and 0.5 m to the left of the vehicle: with the lever nothing changes."""
    world = make_world("w", None)
    log = mrclam.read_log(world.folder, 1)
    truth = mrclam.read_truth(world.folder, 1, log)
    lever = np.array([2.0, 0.5])
    c, s = np.cos(truth.T_world_vehicle[:, 2]), np.sin(truth.T_world_vehicle[:, 2])
    ahead = truth.T_world_vehicle.copy()
    ahead[:, 0] += c * lever[0] - s * lever[1]
    ahead[:, 1] += s * lever[0] + c * lever[1]
    run = run_log(log, calibration, "ekf", CERTAIN)
    levered = summary(run, truth._replace(T_world_vehicle=ahead, lever=lever))
    plain = summary(run, truth._replace(T_world_vehicle=ahead))
    assert levered["rmse_position_m"] < 3e-3
    assert levered["rmse_position_unaligned_m"] < 5e-3
    assert plain["rmse_position_m"] > 0.5


def test_bad_settings_and_logs_are_refused(calibration: RobotCalibration) -> None:
    empty = SlamLog("x", "differential", np.nan, 0.0, np.arange(3.0), np.zeros((3, 2)), (), {})
    with pytest.raises(ValueError, match="no sighting"):
        run_log(empty, calibration, "ekf")
    with pytest.raises(ValueError, match="unknown filter 'ukf'; known: ekf, iekf, ekf-anchored"):
        run_log(empty, calibration, "ukf")
    with pytest.raises(ValueError, match="sigma_range=0"):
        replace(calibration, sigma_range=0.0)
    with pytest.raises(ValueError, match="unknown value 'sigma_rang'"):
        RobotCalibration.from_mapping({"sigma_rang": 1})
    with pytest.raises(ValueError, match="gate=-1"):
        RunSettings(gate=-1.0)


def test_alignment_finds_the_motion_that_was_applied() -> None:
    rng = np.random.default_rng(7)
    points = rng.normal(size=(50, 2))
    c, s = np.cos(2.5), np.sin(2.5)
    moved = points @ np.array([[c, s], [-s, c]]) + [3.0, -1.0]
    np.testing.assert_allclose(align_rigid(points, moved), [3.0, -1.0, 2.5], atol=1e-14)
    with pytest.raises(ValueError, match="need"):
        align_rigid(points[:1], moved[:1])


def test_the_filter_class_may_be_given(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    world = make_world("w", None, seconds=20.0)
    log = mrclam.read_log(world.folder, 1)
    by_name, by_class = run_log(log, calibration, "ekf"), run_log(log, calibration, EkfSlam)
    np.testing.assert_array_equal(by_name.T_run_vehicle, by_class.T_run_vehicle)
