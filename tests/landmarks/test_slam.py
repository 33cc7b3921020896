"""The whole loop: pose, S, D and landmarks, from a known start."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.experiments.grids.following import localise
from vslam_ref.filters.vehicle import Increment
from vslam_ref.grids import LogOddsGrid, MapConfig, Scan
from vslam_ref.grids.landmarks import LandmarkConfig, MatchConfig, distance_field
from vslam_ref.systems.grid_slam import GridSlam, GridSlamConfig, on_moving
from vslam_ref.worlds.floor_plan import cast

from .conftest import HallRun


def rmse(run: HallRun, poses: np.ndarray) -> float:
    return float(np.sqrt(((poses - run.recording.T_world_robot)[:, :2] ** 2).sum(axis=1).mean()))


def test_the_robot_knows_where_it_is(hall: HallRun) -> None:
    """A fifth of a cell with walls in sight all the time; the odometry alone is off by half a cell."""
    assert rmse(hall, hall.poses) < 0.02
    blind, _, _ = localise(hall.recording, GridSlamConfig(match=False, landmarks=False))
    assert rmse(hall, blind) > 0.05


def test_beams_on_moving_things_are_those_on_free_floor_away_from_walls(
    make_grid: Callable[..., LogOddsGrid],
) -> None:
    """A wall in column 20 (x = 2.05), free floor elsewhere, unknown in column 40."""
    grid = make_grid([(r, 20) for r in range(64)])
    grid.log_odds[:, 40] = 0.0
    field = distance_field(grid)
    x = np.array([2.05, 2.15, 2.25, 1.85, 3.05, 4.05, 99.0])
    found = on_moving(np.stack([x, np.full(len(x), 3.05)], 1), grid, field)
    assert found.tolist() == [False, False, True, True, True, False, False]


def test_least_squares_need_moving_beams_left_out() -> None:
    """Known floor, then people 0.4 m before one wall: without them in the match the pose stays right.

    Left in, half of the wall's beams are 0.4 m from it, and least squares give way by centimetres.  A plain
    grid knows nothing of motion, and does so with either setting.
    """
    angles = np.deg2rad(np.arange(-180.0, 180.0, 1.0))
    walls = np.array([[0, 0, 5.1, 0], [5.1, 0, 5.1, 4.1], [5.1, 4.1, 0, 4.1], [0, 4.1, 0, 0]])
    room = cast(np.array([2.31, 2.47]), angles, walls, []).range
    people = room.copy()
    ahead = np.flatnonzero(np.abs(angles) < 0.5)[::2]  # the wall x = 5.1: the robot moves ahead only
    people[ahead] -= 0.4 / np.cos(angles[ahead])
    still = Increment(np.zeros(1), np.zeros(1), np.diag([0.05, 0.02])[None] ** 2)
    off = {}
    for leave_out, separate in ((False, True), (True, True), (False, False), (True, False)):
        config = GridSlamConfig(
            landmarks=False,
            leave_out_moving=leave_out,
            separate=separate,
            map=MapConfig(d_memory="text"),
            matching=MatchConfig(cut=np.inf, search_cut=np.inf),
        )
        slam = GridSlam([2.31, 2.47, 0.0], config)
        for k in range(12):
            slam.step(still if k else None, Scan(angles, room, 10.0, 0.2 * k))
        known = slam.T_world_robot
        for k in range(12, 15):
            slam.step(still, Scan(angles, people, 10.0, 0.2 * k))
        off[leave_out, separate] = float(np.hypot(*(slam.T_world_robot - known)[:2]))
    assert off[True, True] < 0.005
    assert off[False, True] > 0.02
    assert off[True, False] == off[False, False] > 0.02


def test_landmarks_alone_beat_the_odometry(hall: HallRun) -> None:
    poses, _, slam = localise(hall.recording, GridSlamConfig(match=False, map=MapConfig(d_memory="text")))
    blind, _, _ = localise(hall.recording, GridSlamConfig(match=False, landmarks=False))
    assert rmse(hall, poses) < 0.5 * rmse(hall, blind)
    assert len(slam.landmarks.active) >= 4


def test_landmarks_on_walls_lie_on_corners(hall: HallRun) -> None:
    """Filter's places against the plan: within 5 cm, the pose's error and a corner's sigma together."""
    corners = hall.recording.segments[-1].reshape(-1, 2)
    off = np.hypot(*(hall.slam.places()[:, None] - corners).transpose(2, 0, 1)).min(axis=1)
    assert len(off) >= 4
    assert off.max() < 0.05


def test_a_landmark_on_the_box_is_found_out(hall: HallRun) -> None:
    """The box stands until 3 s and is carried away before the robot's eyes: its landmarks go."""
    box = hall.recording.plan.things[0].corners(0.0)
    on_box = []
    b = hall.slam.filter.blocks
    for mark in hall.slam.landmarks.landmarks:
        column = int(b.columns(np.array([mark.id]))[0])
        place = b.x_m[0, column : column + 2]
        if np.hypot(*(box - place).T).min() < 0.1 and mark.born < 15:
            on_box.append(mark)
    assert on_box, "while it stood the box was as static as a wall"
    assert all(m.withdrawn is not None for m in on_box)
    assert all(m.withdrawn < 15 + 25 for m in on_box if m.withdrawn is not None), "within five seconds"


def test_without_withdrawal_it_stays(hall: HallRun) -> None:
    config = GridSlamConfig(choice=LandmarkConfig(withdraw=False), map=MapConfig(d_memory="text"))
    _, _, slam = localise(hall.recording, config)
    assert all(m.withdrawn is None for m in slam.landmarks.landmarks)
    assert len(slam.landmarks.active) > len(hall.slam.landmarks.active)


def test_no_two_look_alikes_stand_near_each_other(hall: HallRun) -> None:
    places, active = hall.slam.places(), hall.slam.landmarks.active
    for i, a in enumerate(active):
        for j, b in enumerate(active[:i]):
            if a.convex == b.convex and abs(np.angle(np.exp(1j * (a.bisector - b.bisector)))) < 0.4:
                assert np.hypot(*(places[i] - places[j])) > 0.5


def test_the_same_input_gives_the_same_bytes(hall: HallRun) -> None:
    again, _, _ = localise(hall.recording, hall.slam.config)
    np.testing.assert_array_equal(again, hall.poses)


def test_a_plain_grid_can_take_the_place_of_s(hall: HallRun) -> None:
    poses, _, slam = localise(hall.recording, GridSlamConfig(separate=False))
    assert rmse(hall, poses) < 0.03
    assert slam.static().log_odds.shape == slam.maps.lattice.shape


def bad_steps() -> list[tuple[Increment | None, Scan, str]]:
    beams, ranges = np.linspace(-1, 1, 50), np.full(50, 2.0)
    good = Scan(beams, ranges, 10.0, 1.0)
    one = np.ones(1)
    return [
        (None, Scan(beams, ranges[1:], 10.0, 1.0), "one range per beam"),
        (None, Scan(np.full(50, np.nan), ranges, 10.0, 1.0), "finite"),
        (None, Scan(beams, ranges, 0.0, 1.0), "max_range"),
        (None, Scan(beams, ranges, 10.0, np.nan), "time"),
        (Increment(np.ones(2), one, np.eye(2)[None]), good, "batch of one run"),
        (Increment(np.array([np.nan]), one, np.eye(2)[None]), good, "finite"),
    ]


@pytest.mark.parametrize(("increment", "scan", "words"), bad_steps())
def test_bad_input_is_refused_and_changes_nothing(
    increment: Increment | None, scan: Scan, words: str
) -> None:
    slam = GridSlam([0.0, 0.0, 0.0])
    beams = np.linspace(-1, 1, 50)
    slam.step(None, Scan(beams, np.full(50, 3.0), 10.0, 0.0))
    pose, layers = slam.T_world_robot, {k: v.copy() for k, v in slam.maps.layers.items()}
    cov = slam.filter.blocks.P_pp.copy()
    with pytest.raises(ValueError, match=words):
        slam.step(increment, scan)
    np.testing.assert_array_equal(slam.T_world_robot, pose)
    np.testing.assert_array_equal(slam.filter.blocks.P_pp, cov)
    for name, layer in layers.items():
        np.testing.assert_array_equal(slam.maps.layers[name], layer)
    assert slam.scans == 1


def test_scans_without_a_reading_only_drift() -> None:
    slam = GridSlam([1.0, 2.0, 0.5])
    empty = Scan(np.linspace(-1, 1, 50), np.full(50, np.nan), 10.0, 0.0)
    slam.step(None, empty)
    step = slam.step(
        Increment(np.array([0.1]), np.array([0.0]), 1e-4 * np.eye(2)[None]), empty._replace(time=0.2)
    )
    np.testing.assert_allclose(step.T_world_robot, [1.0 + 0.1 * np.cos(0.5), 2.0 + 0.1 * np.sin(0.5), 0.5])
    assert step.match is not None
    assert step.match.reason == "too few points on the map"


@pytest.mark.parametrize("start", [[0.0, 0.0], [0.0, np.inf, 0.0]])
def test_starts_that_mean_nothing_are_refused(start: list[float]) -> None:
    with pytest.raises(ValueError, match="start"):
        GridSlam(start)
    with pytest.raises(ValueError, match="sigmas"):
        GridSlam([0.0, 0.0, 0.0], start_sigma=(0.0, 1.0))


def test_the_first_increment_is_none(hall: HallRun) -> None:
    assert hall.recording.increment(0) is None
    assert hall.recording.scan(3).time == pytest.approx(0.6)


def test_following_a_recording_is_step_after_step(hall: HallRun) -> None:
    """The same increments and scans, put together from the recording's arrays by hand."""
    first = 15
    slam = GridSlam(hall.recording.T_world_robot[0], hall.slam.config)
    poses = slam.follow(itertools.islice(hall.recording.way(), first))
    np.testing.assert_array_equal(poses, hall.poses[:first])
    for k, (increment, scan) in enumerate(itertools.islice(hall.recording.way(), first)):
        assert scan.time == hall.recording.times[k]
        np.testing.assert_array_equal(scan.ranges, hall.recording.ranges[k])
        assert (increment is None) == (k == 0)
        if increment is not None:
            moved = [float(increment.ds[0]), float(increment.dalpha[0])]
            assert moved == hall.recording.odometry.increment[k - 1].tolist()
            np.testing.assert_array_equal(increment.cov[0], hall.recording.odometry.cov[k - 1])


def test_the_gate_counts_the_pose_and_the_landmark_together() -> None:
    """Robot and landmark lost together by a metre: a corner 0.3 m beside the landmark is not this landmark.

    Without the cross terms the gate would be 4 m wide and take it.  Counted from the filter's own full
    covariance: S = J P J^T + cov_z by brute force.
    """
    from vslam_ref.filters import observation
    from vslam_ref.grids.landmarks import ScanCorners
    from vslam_ref.grids.landmarks.landmark_map import Landmark

    slam = GridSlam([0.0, 0.0, 0.0], start_sigma=(1.0, 1e-3))
    z, cov_z = np.array([2.0, 0.5]), 1e-4 * np.eye(2)
    slam.filter.update(np.array([0]), z[None, None], cov_z)
    slam.landmarks.landmarks.append(Landmark(0, 0.3, np.pi / 2, True, np.array([1.1, -0.5]), born=0))
    J = observation.vehicle_from_world_with_jacobians(slam.T_world_robot, slam.places()[0])
    _, P = (a[0] for a in slam.filter.blocks.full())
    H = np.hstack([J.J_pose, J.J_landmark])
    S = H @ P @ H.T + cov_z
    assert np.sqrt(S.max()) < 0.05
    for step, expected in ((2.9, 0), (3.2, -1)):  # sigmas; the gate is 3.03
        way = np.linalg.cholesky(S) @ [step, 0.0]
        corner = ScanCorners(
            (z + way)[None],
            cov_z[None],
            np.array([0.3]),
            np.array([np.pi / 2]),
            np.array([True]),
            np.zeros((1, 2)),
        )
        trial = GridSlam([0.0, 0.0, 0.0], start_sigma=(1.0, 1e-3))
        trial.filter.update(np.array([0]), z[None, None], cov_z)
        trial.landmarks.landmarks.append(Landmark(0, 0.3, np.pi / 2, True, np.array([1.1, -0.5]), born=0))
        assert trial._use(corner).tolist() == [expected]


def test_with_landmarks_alone_the_filter_is_honest() -> None:
    """NEES of the pose at the last scan of 16 runs in the hall: chi^2 with 48 degrees, two-sided, 0.1 %.

    The lower side is left open to a factor of 2: corners are declared with a floor of 1 cm, and these
    walls are straight.
    """
    from scipy.stats import chi2

    from vslam_ref.geometry import so2
    from vslam_ref.worlds.floor_plan import CrowdConfig, FloorPlanConfig, simulate

    world = FloorPlanConfig(plan="hall", crowd=CrowdConfig(density=0.0))
    total = 0.0
    for seed in range(16):
        recording = simulate(world, np.random.default_rng(seed))
        config = GridSlamConfig(match=False, map=MapConfig(d_memory="text"))
        slam = GridSlam(recording.T_world_robot[0], config)
        for k in range(len(recording)):
            step = slam.step(recording.increment(k), recording.scan(k))
        e = step.T_world_robot - recording.T_world_robot[-1]
        e[2] = so2.wrap(e[2])
        total += float(e @ np.linalg.solve(step.cov, e))
    low, high = chi2.ppf([0.0005, 0.9995], 48)
    assert low / 2 < total < high
