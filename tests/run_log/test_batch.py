"""The batch solution: exact on clean logs, better than the filters on noisy ones, gains found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("scipy.sparse", reason="sparse normal equations")

from vslam_ref.datasets import mrclam
from vslam_ref.experiments.slam_log import compare
from vslam_ref.filters import vehicle
from vslam_ref.metrics.alignment import align_rigid
from vslam_ref.systems.slam_log import (
    RobotCalibration,
    RunSettings,
    SlamLog,
    build_timeline,
    identify,
    run_log,
    summary,
)
from vslam_ref.systems.slam_log.batch import STEPS, _Problem, solve_batch
from vslam_ref.systems.slam_log.preintegration import dead_reckoning, preintegrate

CERTAIN = RunSettings(start_sigma_position=0.0, start_sigma_heading=0.0)


def read(
    make_world: Callable[..., object], calibration: RobotCalibration | None, seed: int = 0
) -> tuple[SlamLog, object]:
    log = mrclam.read_log(make_world(f"b{seed}", calibration, seed).folder, 1)
    return log, mrclam.read_truth(make_world(f"b{seed}", calibration, seed).folder, 1, log)


def test_preintegrated_covariance_is_that_of_sampled_noise(calibration: RobotCalibration) -> None:
    """4000 draws: a variance's relative error is sqrt(2/4000) = 2 %; 10 % is 4.5 of them."""
    rng = np.random.default_rng(1)
    times = np.arange(0.0, 6.01, 0.1)
    controls = np.column_stack([np.full(61, 0.7), 0.5 * np.sin(times)])
    log = SlamLog("x", "differential", np.nan, 0.0, times, controls, (), {})
    line = build_timeline(log, calibration, times[[10, 55]])
    got = preintegrate(line, line.record_at)
    steps = slice(line.record_at[0], line.record_at[1])
    inc = line.increments[steps]
    sd = np.sqrt(np.einsum("kii->ki", line.cov[steps]))
    ends = np.zeros((4000, 3))
    for k in range(len(inc)):
        noisy = inc[k] + sd[k] * rng.standard_normal((4000, 2))
        # half turn, move, half turn: the middle heading of dead reckoning
        ends = vehicle.propagate(ends, np.column_stack([np.zeros(4000), np.full(4000, inc[k, 1] / 2)]))
        ends = vehicle.propagate(ends, np.column_stack([noisy[:, 0], noisy[:, 1] - inc[k, 1] / 2]))
    wanted = np.cov(ends.T)
    scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    assert np.abs((got.cov[0] - wanted) / scale).max() < 0.1
    np.testing.assert_allclose(got.mean[0], ends.mean(0), atol=5 * np.sqrt(np.diag(wanted)).max() / 60)


def test_dead_reckoning_moves_along_the_middle_heading() -> None:
    circle = dead_reckoning(np.tile([2 * np.pi / 100, 2 * np.pi / 100], (100, 1)))
    np.testing.assert_allclose(circle[-1, :2], 0.0, atol=1e-13)
    assert circle[50, 1] == pytest.approx(2 * np.pi / 100 / np.sin(np.pi / 100), rel=1e-12)


def test_the_jacobian_is_that_of_the_residuals(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Central differences, step 1e-6: rounding of 1e-16 / 1e-6, times the whitening of up to 1e4."""
    log, _ = read(make_world, calibration)
    log = log._replace(sightings=log.sightings[:6])
    problem = _Problem(log, ("turn_gain", "sensor_ahead"))
    rng = np.random.default_rng(2)
    poses, marks = rng.normal(size=(6, 3)), 5 + rng.normal(size=(len(problem.ids), 2))
    root = np.ones(len(problem.node))
    J = problem.jacobian(poses, marks, calibration, root).toarray()

    def residuals(x: np.ndarray) -> np.ndarray:
        moved = poses.copy()
        moved[1:] = x[:15].reshape(-1, 3)
        values = dict(zip(problem.free, x[15 + marks.size :], strict=True))
        o, s = problem.residuals(
            moved, x[15 : 15 + marks.size].reshape(-1, 2), replace(calibration, **values)
        )
        return np.concatenate([o.ravel(), s.ravel()])

    x = np.concatenate([poses[1:].ravel(), marks.ravel(), [1.0, 0.0]])
    for k in range(len(x)):
        d = np.zeros(len(x))
        d[k] = 1e-6
        numeric = (residuals(x + d) - residuals(x - d)) / 2e-6
        np.testing.assert_allclose(J[:, k], numeric, atol=1e-4 * max(1.0, np.abs(numeric).max()))


def test_the_batch_is_at_least_as_likely_as_the_filters_and_as_accurate(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Mean over 5 worlds: smoothing cannot lose to filtering beyond chance."""
    gains = []
    for seed in range(5):
        log, truth = read(make_world, calibration, seed)
        start = run_log(log, calibration, "ekf", CERTAIN)
        batch = solve_batch(log, calibration, start)
        assert batch.converged
        run = compare.as_run(batch, log, start.times)
        gains.append(summary(start, truth)["rmse_position_m"] - summary(run, truth)["rmse_position_m"])
    assert np.mean(gains) > 0


def test_batch_poses_stand_at_the_sightings(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    log, _ = read(make_world, calibration)
    start = run_log(log, calibration, "ekf", replace(CERTAIN, record_period=0.5))
    batch = solve_batch(log, calibration, start)
    run = compare.as_run(batch, log, start.times)
    at = np.isin(run.times.round(6), batch.times.round(6))
    there = np.isin(batch.times.round(6), run.times.round(6))
    assert at.sum() > 50
    np.testing.assert_allclose(run.T_run_vehicle[at][:, :2], batch.poses[there][:, :2], atol=1e-9)


def test_gains_and_offsets_are_found_without_truth(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Distort a log by known gains: each is found again within 4 of its own standard errors."""
    log, _ = read(make_world, calibration, 11)
    wrong = {"distance_gain": 1.05, "turn_gain": 0.96, "drift": 0.03, "bearing_offset": 0.02}
    controls = log.controls.copy()
    controls[:, 1] = (controls[:, 1] - 0.03 * controls[:, 0]) / 0.96
    controls[:, 0] /= 1.05
    sightings = tuple(s._replace(polar=s.polar + [0.0, 0.02]) for s in log.sightings)
    distorted = log._replace(controls=controls, sightings=sightings)
    start = run_log(distorted, calibration, "ekf", replace(CERTAIN, gate=1e3))
    batch = solve_batch(distorted, calibration, start, tuple(wrong))
    error = np.sqrt(np.diag(batch.free_cov))
    for name, sigma in zip(batch.free, error, strict=True):
        assert abs(getattr(batch.calibration, name) - wrong[name]) < 4 * sigma, name
        assert sigma < 0.02, name
    values, cov = identify.pooled_gains([batch, batch])
    np.testing.assert_allclose(values, [getattr(batch.calibration, n) for n in batch.free], rtol=1e-9)
    np.testing.assert_allclose(cov, batch.free_cov / 2, rtol=1e-6)


@pytest.mark.slow
def test_the_likeliest_noises_are_those_of_the_world(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """Sensor noises of a log within 4 standard errors: about 1 / sqrt(2 x 400 sightings) = 3.5 % each."""
    log, _ = read(make_world, calibration, 12)
    start = replace(calibration, sigma_range=0.1, sigma_bearing=0.01, sigma_turn=0.04)
    found, likelihood = identify.most_likely([log], start, {})
    assert found.sigma_range == pytest.approx(0.05, rel=0.14)
    assert found.sigma_bearing == pytest.approx(0.02, rel=0.14)
    assert likelihood > identify.log_likelihood(run_log(log, start, "ekf"), identify.field_area(log))


def test_every_unknown_has_a_step() -> None:
    for names in identify.FREE.values():
        assert set(names) <= set(STEPS)


def test_alignment_of_the_batch_is_not_its_start(
    make_world: Callable[..., object], calibration: RobotCalibration
) -> None:
    """The first pose is held at the filter's start: the origin of the run's frame.

    The world moves, then turns; the batch takes the middle heading: half a step's turn, 0.0075 rad, apart.
    """
    log, truth = read(make_world, None)
    start = run_log(log, calibration, "ekf", CERTAIN)
    batch = solve_batch(log, calibration, start)
    T = align_rigid(batch.landmarks, truth.landmarks)  # type: ignore[attr-defined]
    np.testing.assert_allclose(T, [0.3, -0.2, 0.4], atol=0.0075)
