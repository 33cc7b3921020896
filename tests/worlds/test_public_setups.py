"""The circle and the waypoint course: closed forms, and the front wheel against the rear axle."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.filters import vehicle
from vslam_ref.worlds import circle, waypoint_course
from vslam_ref.worlds.circle import CircleConfig, make_circle
from vslam_ref.worlds.vehicle_field import draw_noise
from vslam_ref.worlds.waypoint_course import WaypointConfig, make_waypoint_course, rear_axle_control

EPS = float(np.finfo(float).eps)


@pytest.fixture(scope="module")
def ring() -> circle.Circle:
    return make_circle(CircleConfig())


@pytest.fixture(scope="module")
def road() -> waypoint_course.WaypointCourse:
    return make_waypoint_course(WaypointConfig(), np.random.default_rng(0))


def test_the_circle_is_a_regular_polygon(ring: circle.Circle) -> None:
    """Oracle: the geometric sum of v dt exp(i k omega dt); 1.5 degrees a second close after 240 s."""
    turn = np.exp(1j * np.deg2rad(1.5))
    k = np.arange(2500)
    places = 0.25 * (turn**k - 1) / (turn - 1)
    assert (
        np.abs(ring.T_world_vehicle[:, 0] + 1j * ring.T_world_vehicle[:, 1] - places).max() < 2500 * EPS * 20
    )
    assert np.abs(ring.T_world_vehicle[240, :2]).max() < 240 * EPS * 20
    assert len(ring.times) == 2500


def test_landmarks_of_the_circle_are_evenly_spaced(ring: circle.Circle) -> None:
    centre = np.array([0.0, 0.25 / np.deg2rad(1.5)])
    d = ring.landmarks - centre
    assert np.hypot(*d.T) == pytest.approx(np.full(20, centre[1] + 3.0))
    angles = np.sort(np.arctan2(d[:, 1], d[:, 0]))
    assert np.diff(angles) == pytest.approx(np.full(19, 2 * np.pi / 20))
    assert ring.sightings[0].step == 1


def test_published_noises() -> None:
    """Wheels that err by 5 % of 0.25 m/s on an axle of 0.5 m: v is their mean, omega their difference."""
    wheel = 0.05 * 0.25
    J = np.array([[0.5, 0.5], [-2.0, 2.0]])
    assert J @ (wheel**2 * np.eye(2)) @ J.T == pytest.approx(CircleConfig().cov_u)


@pytest.mark.parametrize("name", ["ring", "road"])
def test_sightings_are_exact_and_complete(name: str, request: pytest.FixtureRequest) -> None:
    """Complex numbers as the oracle; every landmark in range, and none beyond."""
    world = request.getfixturevalue(name)
    places = world.landmarks @ np.array([1, 1j])
    by_step = {s.step: s for s in world.sightings}
    every = 1 if name == "ring" else 8
    for step in range(every, len(world.T_world_vehicle), every * 50):
        x, y, theta = world.T_world_vehicle[step]
        z = (places - (x + 1j * y)) * np.exp(-1j * theta)
        if step not in by_step:
            assert name == "road"
            assert not np.any((abs(z) < 30) & (abs(z) > 1) & (z.real > 0))
            continue
        if name == "ring":
            seen = np.flatnonzero(abs(z) < 5)
            measured = by_step[step].z @ np.array([1, 1j])
        else:
            seen = np.flatnonzero((abs(z) < 30) & (abs(z) > 1) & (z.real > 0))
            r, b = by_step[step].z.T
            measured = r * np.exp(1j * b)
        assert by_step[step].ids.tolist() == seen.tolist()
        assert np.abs(measured - z[seen]).max() < 64 * EPS * 100


def test_the_course_passes_its_waypoints_within_the_limits(road: waypoint_course.WaypointCourse) -> None:
    c = road.config
    for point in np.array(c.waypoints).reshape(-1, 2):
        away = np.hypot(*(road.T_world_vehicle[:, :2] - point).T)
        assert away.min() <= c.near
    steer = road.controls[:, 1]
    assert np.abs(steer).max() <= np.deg2rad(30) + EPS
    assert np.abs(np.diff(steer)).max() <= np.deg2rad(20) * 0.025 * (1 + 1e-9)
    assert 360 < np.hypot(*np.diff(road.T_world_vehicle[:, :2], axis=0).T).sum() / 2 < 400


def test_the_course_obeys_the_front_wheel_written_out(road: waypoint_course.WaypointCourse) -> None:
    (x, y, theta), (V, G) = road.T_world_vehicle[:-1].T, road.controls.T
    moved = x + 1j * y + 0.025 * V * np.cos(G) * np.exp(1j * theta)
    assert (
        np.abs(moved - (road.T_world_vehicle[1:, 0] + 1j * road.T_world_vehicle[1:, 1])).max()
        < 16 * EPS * 100
    )
    turned = np.exp(1j * (theta + 0.025 * V * np.sin(G) / 4.0))
    assert np.abs(turned - np.exp(1j * road.T_world_vehicle[1:, 2])).max() < 16 * EPS


def test_rear_axle_and_front_wheel_move_alike() -> None:
    """Bailey's front wheel and our rear axle: the same turn, the same places to second order in dt."""
    L, control, pose = 4.0, np.array([3.0, 0.3]), np.array([1.0, 2.0, 0.7])
    rear = rear_axle_control(control, np.zeros((2, 2))).control

    def front(p: np.ndarray) -> np.ndarray:
        return p + np.array([L * np.cos(p[2]), L * np.sin(p[2]), 0.0])

    gaps = []
    for dt in (0.02, 0.01):
        ours = front(vehicle.propagate(pose, vehicle.ackermann(rear, L, dt)))
        bailey = vehicle.front_wheel_step(front(pose), control, L, dt)
        assert ours[2] == pytest.approx(bailey[2], abs=4 * EPS)
        gaps.append(np.abs(ours - bailey)[:2].max())
    assert gaps[0] / gaps[1] == pytest.approx(4.0, rel=0.02)


def test_covariance_of_the_rear_axle_control() -> None:
    """Central differences of (V cos G, G); step 1e-6, so an error of 1e-10 or so."""
    u, cov = np.array([3.0, -0.4]), np.array([[0.09, 0.001], [0.001, 0.0027]])
    h = 1e-6
    columns = [
        (rear_axle_control(u + d, cov).control - rear_axle_control(u - d, cov).control) / (2 * h)
        for d in h * np.eye(2)
    ]
    J = np.stack(columns, -1)
    assert rear_axle_control(u, cov).cov == pytest.approx(J @ cov @ J.T, abs=1e-9)


def test_noises_are_the_same_in_any_batch(road: waypoint_course.WaypointCourse) -> None:
    children = np.random.SeedSequence(1).spawn(2)
    both = draw_noise(road, [np.random.default_rng(c) for c in children])
    second = draw_noise(road, [np.random.default_rng(children[1])])
    assert np.array_equal(both.controls[1], second.controls[0])
    assert np.array_equal(both.sightings[3][1], second.sightings[3][0])


def test_worlds_that_cannot_be_are_refused() -> None:
    with pytest.raises(ValueError, match="must be > 0"):
        CircleConfig(turn_rate=0.0)
    with pytest.raises(ValueError, match="must be >= 0"):
        CircleConfig(sigma_v=-1.0)
    with pytest.raises(ValueError, match="three points"):
        WaypointConfig(waypoints=(0.0, 1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="pi / 2"):
        WaypointConfig(max_steer=1.6)
    tight = dataclasses.replace(WaypointConfig(), waypoints=(20.0, 0.0, 20.0, 5.0, 0.0, 5.0))
    with pytest.raises(ValueError, match="never reached"):
        make_waypoint_course(tight, np.random.default_rng(0))
