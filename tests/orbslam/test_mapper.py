"""Local mapping on drawn maps: points are where they were drawn, and wrong ones are refused."""

from __future__ import annotations

import numpy as np

from vslam_ref.geometry import se3
from vslam_ref.systems.orbslam.mapper import cull, new_points
from vslam_ref.systems.orbslam.mapper.fuse import fuse_with_neighbours
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.orbslam.spanning_tree import link

S = Settings()


def freed(draw_map, seed: int = 0):
    """A map whose points 20 to 59 are taken away again; the same descriptors show them everywhere."""
    made = draw_map(keyframes=4, points=60, share=1.0, seed=seed).map
    table = made.sightings
    for k in range(1, 4):
        table["descriptor"][made.features(k)][:60] = table["descriptor"][made.features(0)][:60]
    table["level"][:] = 0
    X = made.X_world.copy()
    made.remove_points(np.arange(20, 60))
    made.refresh(np.arange(20))
    return made, X


def test_new_points_lie_where_they_were_drawn(draw_map) -> None:
    made, X = freed(draw_map)
    numbers = new_points.new_points(made, 3, S.mapper, S.features)
    assert len(numbers) == 40
    assert made.times_seen()[numbers].tolist() == [2] * 40
    order = made.point_of(3)[:60]
    np.testing.assert_allclose(made.X_world[order[20:]], X[20:], atol=1e-6)  # exact pixels


def test_a_wrong_match_off_the_curve_makes_no_point(draw_map) -> None:
    """Two descriptors are exchanged in all keyframes but the newest: neither lies on the other's curve."""
    made, _ = freed(draw_map)
    for k in range(3):
        rows = made.features(k).start + np.array([30, 41])
        made.sightings["descriptor"][rows] = made.sightings["descriptor"][rows[::-1]]
    numbers = new_points.new_points(made, 3, S.mapper, S.features)
    shown = made.point_of(3)
    assert shown[30] < 0
    assert shown[41] < 0
    assert len(numbers) == 38


def test_octaves_that_contradict_the_distances_make_no_point(draw_map) -> None:
    made, _ = freed(draw_map)
    made.sightings["level"][made.features(3).start + 30] = 5  # 1.2^5 coarser, from about the same distance
    new_points.new_points(made, 3, S.mapper, S.features)
    assert made.point_of(3)[30] < 0
    assert made.point_of(3)[31] >= 0


def test_octaves_follow_the_distances(draw_map) -> None:
    """From 1.7 times as far, a point is found three octaves finer, 1.2^3 = 1.73, and not three coarser."""
    made, X = freed(draw_map)
    made.T_kf_world[3] = se3.compose(se3.exp([0.0, 0, 2.0, 0, 0, 0]), made.T_kf_world[3])
    made.sightings["uv"][made.features(3)][:60] = made.camera.pixel_from_world(made.T_kf_world[3], X).uv
    for k in range(3):
        made.sightings["level"][made.features(k).start + 30] = 3
    made.sightings["level"][made.features(3).start + 31] = 3
    new_points.new_points(made, 3, S.mapper, S.features)
    assert made.point_of(3)[30] >= 0
    assert made.point_of(3)[31] < 0


def test_points_without_parallax_are_refused(draw_map) -> None:
    made, _ = freed(draw_map)
    made.T_kf_world[3] = se3.compose(se3.exp([1e-4, 0, 0, 0, 0, 0]), made.T_kf_world[2])
    uv = made.camera.pixel_from_world(made.T_kf_world[3], made.X_world[:60]).uv
    made.sightings["uv"][made.features(3)][:60] = uv
    made.T_kf_world[:3] = made.T_kf_world[2]
    assert len(new_points.new_points(made, 3, S.mapper, S.features)) == 0


def test_points_made_twice_become_one_and_are_found_elsewhere(draw_map) -> None:
    """Keyframe 3 sees ten points under numbers of their own, and keyframe 2 has lost ten others."""
    made, _ = freed(draw_map)
    made.take_back(made.features(3).start + np.arange(10))
    made.take_back(made.features(2).start + np.arange(10, 20))
    twice = made.add_points(made.X_world[:10], 3)
    made.see(3, np.arange(10), twice)
    for k in range(4):
        link(made, k)
    made.refresh(np.arange(len(made.points)))
    seen, fused = fuse_with_neighbours(made, 3, S.mapper, S.features)
    assert fused == 10
    assert seen == 10
    assert (made.times_seen()[:20] == 4).all()
    assert made.current(twice).tolist() == list(range(10))


def test_a_keyframe_that_adds_nothing_is_culled(draw_map) -> None:
    made, _ = draw_map(keyframes=6, points=40, share=1.0)
    made.sightings["level"][:] = 0
    for k in range(6):
        link(made, k)
    assert cull.cull_redundant(made, 5, S.mapper) == 3  # then only two others see each point
    assert {0, 5} <= set(made.used_keyframes().tolist())
    made.sightings["level"][made.features(made.used_keyframes()[1])] = 0
    assert cull.cull_redundant(made, 5, S.mapper) == 0
