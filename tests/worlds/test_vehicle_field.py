"""The vehicle field: a course that closes, draws that do not depend on the batch, and refused configs."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref.worlds import vehicle_field as vf

EPS = float(np.finfo(float).eps)
CONFIG = vf.VehicleFieldConfig()


@pytest.fixture(scope="module")
def world() -> vf.VehicleField:
    return vf.make_field(CONFIG, np.random.default_rng(0))


def test_standard_course_is_the_papers_square(world: vf.VehicleField) -> None:
    """20 m wide in x and in y, 80 s a lap, two laps, about 1 m/s."""
    assert CONFIG.steps == 1600
    assert world.times[-1] == pytest.approx(160.0, abs=1e-9)
    for axis in range(2):
        assert np.ptp(world.T_world_vehicle[:, axis]) == pytest.approx(20.0, abs=1e-9)
        assert world.T_world_vehicle[:, axis].max() == pytest.approx(10.0, abs=1e-9)
    # a square of 80 m with its corners cut by radius 2.5: 80 - (8 - 2 pi) 2.5 = 75.7 m in 80 s
    assert world.controls[0, 0] == pytest.approx((80 - (8 - 2 * np.pi) * 2.5) / 80, rel=0.01)


CONFIGS = st.builds(
    vf.VehicleFieldConfig,
    side=st.floats(5, 50),
    lap_seconds=st.floats(20, 100),
    corner_radius=st.floats(0.5, 2.5),
    dt=st.sampled_from([0.1, 0.25, 0.5]),
    laps=st.integers(1, 2),
    wheelbase=st.floats(0.5, 3),
)


@given(CONFIGS)
@settings(max_examples=25, deadline=None)
def test_every_lap_closes_and_repeats(config: vf.VehicleFieldConfig) -> None:
    poses, controls = vf.course(config)
    lap = 4 * config.quarter_steps
    # one rounding of the position per step, and of the heading, times the distance still to go
    tolerance = config.steps * EPS * 8 * config.side
    assert np.abs(poses[lap, :2] - poses[0, :2]).max() < tolerance
    assert abs(np.sin(poses[lap, 2] - poses[0, 2])) < tolerance
    assert np.ptp(poses[:, 0]) == pytest.approx(config.side, abs=tolerance)
    assert np.ptp(poses[:, 1]) == pytest.approx(config.side, abs=tolerance)
    assert len(poses) == len(controls) + 1 == config.steps + 1
    assert np.all(controls[:, 0] == controls[0, 0])


@given(CONFIGS)
@settings(max_examples=10, deadline=None)
def test_course_obeys_b4_written_out(config: vf.VehicleFieldConfig) -> None:
    """Oracle: B4, not the package's vehicle model."""
    poses, controls = vf.course(config)
    (x, y, theta), (v, phi) = poses[:-1].T, controls.T
    moved = np.stack([x + config.dt * v * np.cos(theta), y + config.dt * v * np.sin(theta)], -1)
    turned = theta + config.dt * v * np.tan(phi) / config.wheelbase
    assert np.abs(moved - poses[1:, :2]).max() < 16 * EPS * config.side
    assert np.abs(np.exp(1j * turned) - np.exp(1j * poses[1:, 2])).max() < 16 * EPS


def test_each_sighting_is_exact_and_complete(world: vf.VehicleField) -> None:
    """Complex numbers as the oracle: (landmark - position) e^{-i theta}; all within range, none beyond."""
    steps = [s.step for s in world.sightings]
    assert all(step % 10 == 0 for step in steps)
    by_step = {s.step: s for s in world.sightings}
    places = world.landmarks @ np.array([1, 1j])
    for step in range(0, CONFIG.steps + 1, 10):
        x, y, theta = world.T_world_vehicle[step]
        r = (places - (x + 1j * y)) * np.exp(-1j * theta)
        near = np.flatnonzero(np.abs(r) <= CONFIG.max_range)
        if not len(near):
            assert step not in by_step
            continue
        assert by_step[step].ids.tolist() == near.tolist()
        assert np.abs(by_step[step].z @ np.array([1, 1j]) - r[near]).max() < 64 * EPS * 20


def test_landmarks_fill_their_square(world: vf.VehicleField) -> None:
    many = vf.make_field(
        dataclasses.replace(CONFIG, landmarks=4000, laps=1), np.random.default_rng(1)
    ).landmarks
    assert world.landmarks.shape == (30, 2)
    assert np.abs(many).max() <= 12.0
    # uniform: mean 0 +- 12 / sqrt(3 N), variance 48; 5 standard errors
    assert np.abs(many.mean(0)).max() < 5 * 12 / np.sqrt(3 * 4000)
    assert np.abs(many.var(0) - 48).max() < 5 * 48 * np.sqrt(0.8 / 4000)


def draws(world: vf.VehicleField, seeds: list[int]) -> vf.Noise:
    return vf.draw_noise(world, [np.random.default_rng(s) for s in seeds])


def test_draws_do_not_depend_on_the_batch(world: vf.VehicleField) -> None:
    """Run 7 is the same bytes alone, in company, and in another order."""
    together, alone, turned = draws(world, [5, 7, 9]), draws(world, [7]), draws(world, [9, 7, 5])
    for a, b, c in zip(
        [together.start, together.controls, *together.sightings],
        [alone.start, alone.controls, *alone.sightings],
        [turned.start, turned.controls, *turned.sightings],
        strict=True,
    ):
        assert np.array_equal(a[1], b[0])
        assert np.array_equal(a, c[::-1])


def test_draws_are_standard_normal_and_of_the_stated_shapes(world: vf.VehicleField) -> None:
    noise = draws(world, list(range(20)))
    assert noise.start.shape == (20, 3)
    assert noise.controls.shape == (20, 1600, 2)
    for s, e in zip(world.sightings, noise.sightings, strict=True):
        assert e.shape == (20, len(s.ids), 2)
    numbers = np.concatenate([noise.controls.ravel(), *[e.ravel() for e in noise.sightings]])
    N = len(numbers)
    # 5 standard errors of mean, variance and fourth moment (3; its variance 96): uniform noise has 1.8
    assert abs(numbers.mean()) < 5 / np.sqrt(N)
    assert abs(numbers.var() - 1) < 5 * np.sqrt(2 / N)
    assert abs((numbers**4).mean() - 3) < 5 * np.sqrt(96 / N)


def test_same_seed_same_world() -> None:
    a, b = (vf.make_field(CONFIG, np.random.default_rng(3)) for _ in range(2))
    assert np.array_equal(a.landmarks, b.landmarks)
    assert np.array_equal(a.T_world_vehicle, b.T_world_vehicle)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        *[
            ({n: v}, f"{n}=.*> 0")
            for n in ("side", "lap_seconds", "dt", "wheelbase", "max_range")
            for v in (0.0, -1.0)
        ],
        ({"sigma_z": 0.0}, "sigma_z"),
        ({"sigma_v": -0.1}, "sigma_v=.*>= 0"),
        ({"sigma_phi": float("nan")}, "sigma_phi"),
        ({"laps": 0}, "laps"),
        ({"landmarks": 0}, "landmarks"),
        ({"corner_radius": 10.1}, "at most half the side"),
        ({"dt": 20.0}, "at least 8 steps"),
        ({"side": float("nan")}, "side"),
    ],
)
def test_bad_config_is_refused(change: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        vf.VehicleFieldConfig(**change)


def test_noise_free_controls_are_allowed() -> None:
    config = vf.VehicleFieldConfig(sigma_v=0.0, sigma_phi=0.0)
    assert np.array_equal(config.cov_u, np.zeros((2, 2)))


def test_every_assumption_has_a_reason() -> None:
    for field in dataclasses.fields(vf.VehicleFieldConfig):
        assert field.metadata.get("reason"), field.name
        assert "unit" in field.metadata, field.name


def test_covariances_are_squares_of_the_sigmas() -> None:
    assert np.allclose(np.diag(CONFIG.cov_u), [0.04, np.deg2rad(3) ** 2], rtol=1e-15)
    assert np.allclose(CONFIG.cov_z, 0.01 * np.eye(2), rtol=1e-15)
