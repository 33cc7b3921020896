"""The floor plan's world: its truth, its people, its noises, and the worlds that cannot be."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest

from vslam_ref.filters import vehicle
from vslam_ref.geometry import se2
from vslam_ref.worlds.floor_plan import (
    Box,
    CrowdConfig,
    FloorPlanConfig,
    LaserConfig,
    Recording,
    RobotConfig,
    cell_truth,
    cover,
    hall,
    office,
    seen_cells,
    simulate,
    turned,
)
from vslam_ref.worlds.floor_plan.crowd import Crowd, crosses
from vslam_ref.worlds.floor_plan.plan import schedule
from vslam_ref.worlds.floor_plan.robot import drive, measure, true_increments


def test_beams_end_on_cells_that_the_truth_calls_covered(office_run: Recording) -> None:
    cells = cover(office_run)
    for k in (0, 20, 45, 69):
        truth, seen = cell_truth(office_run, k, cells), seen_cells(office_run, k, cells)
        assert (truth.static | truth.moving)[seen.ended].all()
        assert seen.ended.sum() > 50


def test_no_beam_goes_through_a_disc(office_run: Recording) -> None:
    """A cell that lies inside a leg is never crossed: legs are 14 cm, so at a finer raster some do."""
    cells = cover(office_run, resolution=0.02)
    for k in (10, 60):
        discs = office_run.discs[k]
        seen = seen_cells(office_run, k, cells)
        row, column = np.nonzero(seen.crossed)
        middle = np.array(cells.origin_xy) + 0.02 * (np.stack([column, row], 1) + 0.5)
        gap = np.hypot(*(middle[:, None] - discs[:, :2]).transpose(2, 0, 1)) - discs[:, 2]
        # a crossed cell's middle may lie inside of the rim by half its diagonal
        assert gap.min() > -0.01 * np.sqrt(2) - 1e-9


def test_the_density_is_the_share_of_floor_under_bodies() -> None:
    plan = office()
    floor = 14 * 10  # rooms and corridor fill the outline
    furniture = sum(np.prod(box.size) for box in plan.furniture + plan.things)
    assert plan.free_area == pytest.approx(floor - furniture, rel=1e-12)
    crowd = Crowd(plan, CrowdConfig(density=0.3), 0.0, np.random.default_rng(1))
    assert len(crowd) * np.pi * 0.25**2 / plan.free_area == pytest.approx(
        0.3, abs=0.5 * np.pi * 0.25**2 / plan.free_area
    )


def test_people_stay_on_the_floor_and_off_the_robot(office_run: Recording) -> None:
    people, poses = office_run.people, office_run.T_world_robot
    assert ((people > 0.05) & (people < [14.05, 10.05])).all()
    assert np.hypot(*(people - poses[:, None, :2]).transpose(2, 0, 1)).min() > 0.55 - 1e-9
    # no one walks through a wall that does not move between two scans
    fixed = office_run.plan.fixed
    through = [crosses(a, b, fixed).sum() for a, b in itertools.pairwise(people)]
    assert sum(through) <= 1, "the robot may push someone through; nothing else may"


def test_legs_stay_inside_the_body(office_run: Recording) -> None:
    legs = office_run.discs.reshape(len(office_run), -1, 2, 3)
    reach = np.hypot(*(legs[..., :2] - office_run.people[:, :, None]).transpose(3, 0, 1, 2)) + legs[..., 2]
    assert reach.max() <= 0.25 + 1e-12


def test_moving_means_a_changed_pose_within_the_memory() -> None:
    """The hall's box moves from 3 s to 5 s; with T = 2 s it counts as moving on (3, 7)."""
    config = FloorPlanConfig(plan="hall", crowd=CrowdConfig(density=0.0), memory=2.0)
    recording = simulate(config, np.random.default_rng(5))
    box = recording.moving[:, -1]
    t = recording.times
    np.testing.assert_array_equal(box, (t > 3.0) & (t < 7.0))
    assert not recording.moving[:, 0].any(), "walls never move"
    cells = cover(recording)
    k = int(np.flatnonzero(t > 4.0)[0])
    corners = recording.plan.things[0].corners(t[k])
    along = np.linspace(0.01, 0.99, 30)[:, None]
    sides = corners[:, None] + along * (np.roll(corners, -1, axis=0) - corners)[:, None]
    column, row = np.floor((sides.reshape(-1, 2) - cells.origin_xy) / 0.1).astype(int).T
    moving = cell_truth(recording, k, cells).moving
    assert moving[row, column].all()
    assert moving.sum() < 30, "the outline of a box of 0.4 m, and nothing else"
    later = int(np.flatnonzero(t > 7.01)[0])
    assert not cell_truth(recording, later, cells).moving.any()


def test_a_person_who_stands_is_static_after_the_memory() -> None:
    crowd = CrowdConfig(density=0.05, speed=1e-3, speed_spread=0.0, push=0.0)
    config = FloorPlanConfig(plan="hall", crowd=crowd, memory=1.0, duration=3.0)
    recording = simulate(config, np.random.default_rng(2))
    people = recording.people.shape[1]
    assert people > 5
    assert not recording.moving[0, -people:].any(), "nobody shifted by 5 cm in the last second"


def test_truth_and_noise_of_the_odometry() -> None:
    """10000 steps: mean 0 and the declared variances within four standard errors, sqrt(2/n) for variances."""
    config, n = RobotConfig(), 10_000
    true = np.tile([0.1, 0.05], (n, 1))
    noisy = measure(true, config, np.random.default_rng(4))
    z = (noisy.increment - true) / np.sqrt(np.diagonal(noisy.cov, axis1=1, axis2=2))
    assert np.abs(z.mean(axis=0)).max() < 4 / np.sqrt(n)
    assert np.abs((z**2).mean(axis=0) - 1).max() < 4 * np.sqrt(2 / n)
    expected = [0.05**2 * 0.1, 0.05**2 * 0.05 + 0.03**2 * 0.1]
    np.testing.assert_allclose(np.diag(noisy.cov[0]), expected, rtol=1e-12)


def test_the_route_is_driven_exactly() -> None:
    plan = office()
    start, increments = true_increments(plan.route, RobotConfig())
    poses = drive(start, increments)
    np.testing.assert_allclose(poses[-1, :2], plan.route[-1], atol=1e-9)
    for point in plan.route:
        assert np.hypot(*(poses[:, :2] - point).T).min() < 1e-9
    assert np.abs(increments[:, 0]).max() <= 0.1 + 1e-12
    np.testing.assert_allclose(vehicle.propagate(poses[3], increments[3]), poses[4])


def test_range_noise_and_dropouts(hall_run: Recording) -> None:
    """The range error is N(0, sigma), dropouts are as frequent as declared; four standard errors each."""
    laser = hall_run.config.laser
    lost = np.isnan(hall_run.ranges)
    n = hall_run.ranges.size
    assert abs(lost.mean() - laser.dropout) < 4 * np.sqrt(laser.dropout / n)
    good = np.isfinite(hall_run.ranges)
    z = (hall_run.ranges - hall_run.exact_ranges)[good] / laser.sigma
    assert abs(z.mean()) < 4 / np.sqrt(good.sum())
    assert abs((z**2).mean() - 1) < 4 * np.sqrt(2 / good.sum())


def test_beyond_the_maximum_range_nothing_returns() -> None:
    laser = LaserConfig(max_range=2.0, dropout=0.0)
    config = FloorPlanConfig(plan="hall", crowd=CrowdConfig(density=0.0), laser=laser)
    recording = simulate(config, np.random.default_rng(1))
    assert np.isinf(recording.ranges[0]).any()
    assert recording.exact_ranges[np.isfinite(recording.exact_ranges)].max() <= 2.0
    np.testing.assert_array_equal(recording.owner == -1, np.isinf(recording.exact_ranges))
    # a beam that meets nothing crosses its last cell, too
    cells, pose = cover(recording), recording.T_world_robot[0]
    seen, free = seen_cells(recording, 0, cells), np.isinf(recording.exact_ranges[0])
    angles = pose[2] + recording.angles[free]
    last = pose[:2] + (2.0 - 1e-9) * np.stack([np.cos(angles), np.sin(angles)], 1)
    column, row = np.floor((last - cells.origin_xy) / 0.1).astype(int).T
    assert free.sum() > 50
    assert seen.crossed[row, column].all()


def test_the_same_seed_gives_the_same_world_and_another_laser_the_same_people() -> None:
    config = FloorPlanConfig(crowd=CrowdConfig(density=0.1), duration=2.0)
    a, b = (simulate(config, np.random.default_rng(7)) for _ in range(2))
    np.testing.assert_array_equal(a.ranges, b.ranges)
    np.testing.assert_array_equal(a.odometry.increment, b.odometry.increment)
    finer = dataclasses.replace(config, laser=LaserConfig(beams=91))
    np.testing.assert_array_equal(simulate(finer, np.random.default_rng(7)).people, a.people)


def test_a_turned_world_gives_the_same_ranges(office_run: Recording) -> None:
    """Cast again in the turned world: the ranges are those of before."""
    from vslam_ref.worlds.floor_plan import cast

    moved, k = turned(office_run, 0.7), 40
    angles = moved.T_world_robot[k, 2] + moved.angles
    again = cast(moved.T_world_robot[k, :2], angles, moved.segments[k], moved.discs[k]).range
    near = np.isfinite(moved.exact_ranges[k])
    # a rim that a beam grazes turns rounding into its square root
    off = np.abs(again[near] - moved.exact_ranges[k, near])
    assert np.quantile(off, 0.95) < 1e-12
    assert off.max() < 1e-6


def test_carts_keep_off_the_route_and_each_other() -> None:
    config = FloorPlanConfig(
        plan="depot", carts=5, crowd=CrowdConfig(density=0.0), laser=LaserConfig(beams=3)
    )
    recording = simulate(config, np.random.default_rng(11))
    carts = recording.plan.things
    assert len(carts) == 5
    for t in np.linspace(0.0, 60.0, 40):
        middles = np.array([cart.T_world_box.at(t)[:2] for cart in carts])
        apart = np.hypot(*(middles[:, None] - middles).transpose(2, 0, 1)) + 9 * np.eye(5)
        assert apart.min() > np.hypot(0.8, 0.5)  # circles around two carts do not meet
    with pytest.raises(ValueError, match="no free straight line"):
        simulate(dataclasses.replace(config, carts=60), np.random.default_rng(1))


def test_doors_and_boxes_follow_their_schedules() -> None:
    plan = office()
    door = plan.doors[0]
    np.testing.assert_allclose(door.segment(0.0), [3.05, 4.05, 3.05, 3.05], atol=1e-12)
    np.testing.assert_allclose(door.segment(99.0), [3.05, 4.05, 4.05, 4.05], atol=1e-12)
    assert door.open(0.0)
    assert not door.open(99.0)
    half = door.segment(31.0)  # swings from 30 s to 32 s
    np.testing.assert_allclose(half[2:], [3.05 + np.sqrt(0.5), 4.05 - np.sqrt(0.5)], atol=1e-12)
    box = Box((2.0, 1.0), schedule([0.0], [[1.0, 2.0, np.pi / 2]]))
    np.testing.assert_allclose(
        np.sort(box.corners(0.0), axis=0)[[0, -1]], [[0.5, 1.0], [1.5, 3.0]], atol=1e-12
    )
    assert np.hypot(*(box.segments(5.0)[:, 2:] - box.segments(5.0)[:, :2]).T) == pytest.approx([2, 1, 2, 1])


def test_a_wall_in_the_way_is_refused() -> None:
    plan = hall()
    blocked = dataclasses.replace(plan, route=np.array([[1.0, 1.0], [4.3, 3.3]]))
    with pytest.raises(ValueError, match=r"route: at .* from a wall"):
        simulate(FloorPlanConfig(plan="hall"), np.random.default_rng(0), blocked)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: CrowdConfig(density=0.6), "density=0.6"),
        (lambda: CrowdConfig(density=float("nan")), "density=nan"),
        (lambda: CrowdConfig(pause_most=float("nan")), "pause_most=nan"),
        (lambda: RobotConfig(turn_rate=float("inf")), "turn_rate=inf"),
        (lambda: FloorPlanConfig(memory=float("nan")), "memory=nan"),
        (lambda: CrowdConfig(leg_swing=0.3), "legs must stay inside"),
        (lambda: CrowdConfig(step=0.0), "finite numbers > 0"),
        (lambda: LaserConfig(beams=1), "beams=1"),
        (lambda: LaserConfig(max_range=float("inf")), "max_range=inf"),
        (lambda: LaserConfig(field_of_view=7.0), "2 pi"),
        (lambda: RobotConfig(speed=0.0), "numbers > 0"),
        (lambda: RobotConfig(drift_ds=-1.0), ">= 0"),
        (lambda: FloorPlanConfig(memory=0.0), "memory > 0"),
        (lambda: schedule([0.0, 0.0], [1.0, 2.0]), "increasing"),
        (lambda: true_increments([[0.0, 0.0], [0.0, 0.0]], RobotConfig()), "route"),
        (lambda: simulate(FloorPlanConfig(plan="cave"), np.random.default_rng(0)), "plan 'cave'"),  # type: ignore[arg-type]
    ],
)
def test_worlds_that_cannot_be_are_refused(make: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        make()  # type: ignore[operator]


def test_every_number_has_a_reason() -> None:
    from vslam_ref.support.config import without_reason

    assert without_reason(FloorPlanConfig()) == []


def test_poses_and_segments_share_one_world(hall_run: Recording) -> None:
    """A beam's end, put into the world by the true pose, lies on a wall."""
    k = 4
    angles = hall_run.angles
    ends = se2.act(
        hall_run.T_world_robot[k],
        hall_run.exact_ranges[k][:, None] * np.stack([np.cos(angles), np.sin(angles)], 1),
    )
    on = (np.abs(ends[:, :1] - [0.05, 6.05]) < 1e-9).any(axis=1) | (
        np.abs(ends[:, 1:] - [0.05, 5.05]) < 1e-9
    ).any(axis=1)
    on_wall = hall_run.owner[k] == 0
    assert on[on_wall].mean() > 0.7  # the others lie on the pillar


def test_rasters_and_floors_that_cannot_be_are_refused(hall_run: Recording) -> None:
    from vslam_ref.worlds.floor_plan import disc_cells

    for resolution in (0.0, -0.1, float("nan")):
        with pytest.raises(ValueError, match="resolution="):
            cover(hall_run, resolution=resolution)
    with pytest.raises(ValueError, match="discs"):
        disc_cells(cover(hall_run), [[np.nan, 0.0, 1.0]])
    full = dataclasses.replace(hall(), zones=np.array([[4.1, 3.1, 4.5, 3.5]]))  # the pillar fills it
    with pytest.raises(ValueError, match="free area"):
        Crowd(full, CrowdConfig(), 0.0, np.random.default_rng(1))
    ledge = dataclasses.replace(hall(), furniture=(), things=(), zones=np.array([[0.05, 0.05, 6.05, 0.1]]))
    with pytest.raises(ValueError, match="find no place"):
        Crowd(ledge, CrowdConfig(density=0.5), 0.0, np.random.default_rng(1))
