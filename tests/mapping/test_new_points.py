"""New points lie where the scene is; candidates are free and spread; partners have a base line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.features import level_sigma
from vslam_ref.geometry import se3
from vslam_ref.systems.ptam.look import spread
from vslam_ref.systems.ptam.mapper import associate, new_points
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.visual_map import Looks, VisualMap


@pytest.fixture
def pair(wall: Any) -> VisualMap:
    """Keyframe 0, then keyframe 1 which sees six points with it."""
    made = VisualMap(wall.camera, wall.pictures[0].levels[0].shape)
    for T, picture in zip(wall.T_cam_world, wall.pictures, strict=True):
        made.add_keyframe(T, picture)
    uv = np.array([[60.0, 40.0], [140, 40], [60, 110], [140, 110], [100, 75], [90, 60]])
    X = wall.truth(uv)
    numbers = made.add_points(X, 0, 0, uv)
    made.observe(1, numbers, 0, wall.camera.project(se3.act(wall.T_cam_world[1], X)).uv)
    return made


def test_new_points_lie_on_the_wall(wall: Any, pair: VisualMap, settings: Settings) -> None:
    """Their depth within what the parallax allows.

    Base line 0.17, distance 2, f = 200: one pixel moves a point by r^2 / (f B) = 0.12 at r = 2.
    Refinement is good to 0.2 px of the level; nine of ten must lie within three of their own sigma of that
    size, and none a quarter of its depth away, as a wrong match would.
    """
    numbers = new_points.new_points(pair, 1, wall.pictures[1], settings.mapper, settings.features)
    assert len(numbers) > 60
    assert pair.alive[numbers].all()
    assert (pair.points["source_kf"][numbers] == 1).all()
    X = pair.X_world[numbers]
    ray = X / np.linalg.norm(X, axis=1)[:, None]
    normal = np.array([0.15, 0.1, 0.98])
    true = 2.0 / (ray @ normal)
    off = np.linalg.norm(X, axis=1) - true
    sigma = 0.2 * level_sigma(pair.points["source_level"][numbers]) * true**2 / (200 * 0.16)
    assert np.mean(np.abs(off) < 3 * sigma) > 0.9
    assert np.abs(off / true).max() < 0.25
    both = [set(pair.measured_in(kf).tolist()) for kf in (0, 1)]
    assert set(numbers.tolist()) <= both[0] & both[1]


def test_no_new_point_beside_a_known_one(wall: Any, pair: VisualMap, settings: Settings) -> None:
    numbers = new_points.new_points(pair, 1, wall.pictures[1], settings.mapper, settings.features)
    seen = pair.sightings
    known = (seen["kf"] == 1) & (seen["point"] < 6)
    old, old_level = seen["uv"][known], seen["level"][known]
    new, level = pair.points["source_uv"][numbers], pair.points["source_level"][numbers]
    alike = (old_level == level[:, None]) | (old_level == level[:, None] + 1)  # its own and the next one
    away = np.where(alike, np.hypot(*(new[:, None] - old).transpose(2, 0, 1)), np.inf).min(1)
    assert (away >= settings.mapper.spacing * level_sigma(pair.points["source_level"][numbers]) - 1e-9).all()
    again = new_points.new_points(pair, 1, wall.pictures[1], settings.mapper, settings.features)
    assert len(again) < 0.5 * len(numbers)


def test_a_corner_becomes_one_point_though_two_neighbours_show_it(
    wall: Any, pair: VisualMap, settings: Settings
) -> None:
    """Keyframe 2 is keyframe 0 once more: what was found in the one is not asked of the other."""
    kf = pair.add_keyframe(wall.T_cam_world[0], wall.pictures[0])
    pair.observe(kf, np.arange(6), 0, pair.points["source_uv"][:6].copy())
    assert len(new_points.partners(pair, 1, settings.mapper.partners)) == 2
    numbers = new_points.new_points(pair, 1, wall.pictures[1], settings.mapper, settings.features)
    places = [tuple(row) for row in pair.points["source_uv"][numbers].tolist()]
    assert len(set(places)) == len(places) > 60


def test_without_a_base_line_there_are_no_points(wall: Any, settings: Settings) -> None:
    """The same picture twice from the same place: every ray is parallel to its partner."""
    made = VisualMap(wall.camera, wall.pictures[0].levels[0].shape)
    for _ in range(2):
        made.add_keyframe(se3.identity(), wall.pictures[0])
    uv = np.array([[60.0, 40.0], [140, 40]])
    made.observe(1, made.add_points(wall.truth(uv), 0, 0, uv), 0, uv)
    assert len(new_points.new_points(made, 1, wall.pictures[0], settings.mapper, settings.features)) == 0


def test_spread_takes_the_strongest_of_every_cell_first() -> None:
    """Nine points in one cell, stronger than a tenth far away: the tenth is second of six."""
    xy = np.concatenate([np.stack([np.arange(9), np.arange(9)], 1) + 2, [[150, 100]]])
    assert spread(xy, (120, 160), 6).tolist() == [0, 1, 2, 3, 4, 9]  # cells of 98 pixels
    assert spread(xy, (120, 160), 50).tolist() == list(range(10))
    assert spread(xy[:0], (120, 160), 5).tolist() == []


def test_partners_have_a_base_line(wall: Any, pair: VisualMap) -> None:
    """Of keyframes that share enough points the nearest; one at the same place comes last."""
    T_new = pair.T_kf_world[1]
    for shift in (0.0, 0.5):
        kf = pair.add_keyframe(
            se3.compose(se3.from_rt(np.eye(3), np.array([-shift, 0, 0])), T_new), wall.pictures[1]
        )
        pair.observe(kf, np.arange(6), 0, np.full((6, 2), 50.0))
    assert new_points.partners(pair, 1, 3).tolist() == [0, 3, 2]
    lonely = pair.add_keyframe(T_new, wall.pictures[1])
    pair.observe(lonely, np.array([0]), 0, np.full((1, 2), 50.0))
    assert lonely not in new_points.partners(pair, 1, 9)  # it shares one of six: less than 0.3


def test_looking_again_finds_what_a_keyframe_should_see(wall: Any, settings: Settings) -> None:
    """Points of keyframe 0 are found in keyframe 1 to half a pixel of their level, once only."""
    made = VisualMap(wall.camera, wall.pictures[0].levels[0].shape)
    for T, picture in zip(wall.T_cam_world, wall.pictures, strict=True):
        made.add_keyframe(T, picture)
    xy = wall.pictures[0].corners[0].xy
    xy = xy[(xy > 30).all(1) & (xy < [170, 120]).all(1)][::8].astype(float)
    numbers = made.add_points(wall.truth(xy), 0, 0, xy)
    found = associate.look_again(made, 1, wall.pictures[1], numbers, 4.0, Looks())
    assert len(found) > 0.8 * len(numbers)
    seen = made.sightings
    rows = seen["kf"] == 1
    true = wall.camera.project(se3.act(wall.T_cam_world[1], made.X_world[seen["point"][rows]])).uv
    assert np.median(np.hypot(*(seen["uv"][rows] - true).T)) < 0.25
    rest = associate.look_again(made, 1, wall.pictures[1], numbers, 4.0, Looks())
    assert not set(rest.tolist()) & set(found.tolist())
    elsewhere = associate.look_in_neighbours(made, np.array([0, 1]), numbers, 4.0, Looks())
    assert elsewhere == 0  # all that can be found was found


def test_seldom_found(pair: VisualMap) -> None:
    """Eight tries, a quarter: 1 of 8 dies, 2 of 8 lives, 0 of 7 may still prove itself."""
    pair.points["tried"][:] = [8, 8, 7, 20, 20, 0]
    pair.points["found"][:] = [1, 2, 0, 4, 5, 0]
    assert associate.seldom_found(pair, 8, 0.25).tolist() == [0, 3]
    pair.remove(np.array([3]))
    assert associate.seldom_found(pair, 8, 0.25).tolist() == [0]
