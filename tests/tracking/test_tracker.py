"""Pictures to poses: near the truth, with a guess and without one; what is remembered."""

from __future__ import annotations

from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.systems.ptam.look import prepare
from vslam_ref.systems.ptam.settings import Settings, TrackerSettings
from vslam_ref.systems.ptam.tracker.coarse_fine import coarse
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.ptam.tracker.tracker import Tracker
from vslam_ref.systems.visual_map import Looks, visible

NEAR = 5e-4
"""Metres and radians.  A picture of 160 pixels, f = 128: 0.2 px of a place, over the root of 100 places,
is 0.02 px, 1.6e-4 radians, at 0.6 metres 1e-4 metres; times three, since some motions look alike."""


def tracker(desk: Any, k: int, velocity: Array | None = None) -> Tracker:
    """A tracker that was right in picture k."""
    v = np.zeros(6) if velocity is None else velocity
    made = Tracker(Settings(), np.random.default_rng(0), DecayingVelocity(v, 1.0, 1.0), desk.pose(k))
    made.last = desk.pictures.get(k)
    return made


def off(T: Array, truth: Array) -> float:
    return float(np.abs(se3.log(se3.compose(T, se3.inverse(truth)))).max())


def test_from_the_velocity(desk: Any) -> None:
    """Picture 9 from picture 8, and the velocity that is remembered is the newest."""
    v = se3.log(desk.pose(8) @ se3.inverse(desk.pose(7)))
    one = tracker(desk, 8, v)
    found = one.track(desk.map, desk.pictures[9])
    assert (found.way, found.quality) == ("velocity", Quality.GOOD)
    assert off(found.T_cam_world, desk.pose(9)) < NEAR
    expected = se3.log(found.T_cam_world @ se3.inverse(desk.pose(8)))
    assert np.abs(one.motion.velocity - expected).max() < 1e-15
    np.testing.assert_array_equal(one.T_last, found.T_cam_world)


def test_a_velocity_is_a_better_guess_than_none(desk: Any) -> None:
    """Over the scene's own motion: where constant velocity puts the pose, against where it was."""
    T = desk.scene.T_cam_world
    still = [off(T[k], T[k - 1]) for k in range(2, 10)]
    going = [
        off(T[k], DecayingVelocity(np.zeros(6), 1.0, 1.0).update(T[k - 2], T[k - 1]).predict(T[k - 1]))
        for k in range(2, 10)
    ]
    assert np.median(going) < 0.5 * np.median(still)


def test_the_coarse_points_are_of_the_coarse_levels(desk: Any) -> None:
    seen = visible(desk.map, desk.pose(9))
    large = np.count_nonzero(seen.level >= 2)
    settings = TrackerSettings(coarse_points=large + 5)
    first = coarse(
        desk.map, desk.pictures[9], desk.pose(9), 10.0, settings, Looks(), np.random.default_rng(0)
    )
    assert np.count_nonzero(first.seen.level >= 2) == large
    assert np.count_nonzero(first.seen.level == 1) == 5


def test_a_blank_picture_is_lost_and_the_next_is_found_again(desk: Any) -> None:
    """Nothing is remembered of a lost picture but that it was lost; the way back is without a velocity."""
    one = tracker(desk, 6, np.full(6, 1e-3))
    blank = prepare(7, np.full((120, 160), 90, np.uint8), Settings().features)
    gone = one.track(desk.map, blank)
    assert gone.quality is Quality.LOST
    assert one.lost == 1
    np.testing.assert_array_equal(one.T_last, desk.pose(6))
    back = one.track(desk.map, desk.pictures[9])
    assert back.way == "relocalised"
    assert off(back.T_cam_world, desk.pose(9)) < NEAR
    assert (one.lost, one.motion.velocity.tolist()) == (0, [0.0] * 6)


def test_a_guess_that_is_far_off_is_not_the_end(desk: Any) -> None:
    """0.5 radians off: no point is where it is looked for, so patches are followed."""
    one = tracker(desk, 6, np.array([0, 0, 0, 0, 0.5, 0]))
    found = one.track(desk.map, desk.pictures[9])
    assert found.way != "velocity"
    assert found.quality is not Quality.LOST
    assert off(found.T_cam_world, desk.pose(9)) < NEAR


def test_the_same_seed_gives_the_same_bytes(desk: Any) -> None:
    a, b = (tracker(desk, 6).track(desk.map, desk.pictures[9]) for _ in range(2))
    assert a.T_cam_world.tobytes() == b.T_cam_world.tobytes()
