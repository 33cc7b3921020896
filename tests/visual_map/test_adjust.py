"""Adjustment of a map: back to the truth, wrong sightings out, the rest of the map left alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.estimation.bundle import Options, Robust
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.visual_map import VisualMap, adjust, adjust_with_camera, local_active
from vslam_ref.systems.visual_map.visual_map import slopes

MakeMap = Callable[..., VisualMap]
TUKEY = Robust(tuned("tukey", 2), "adaptive", 0.4)
TIGHT = Options(cost=1e-14, scale=1e-6, max_iterations=60)


def perturb(visual_map: VisualMap, size: float, keyframes: list[int]) -> None:
    """Move some keyframes and all points a little."""
    rng = np.random.default_rng(5)
    for kf in keyframes:
        visual_map.T_kf_world[kf] = se3.compose(se3.exp(rng.normal(0, size, 6)), visual_map.T_kf_world[kf])
    visual_map.X_world[:] += rng.normal(0, size, visual_map.X_world.shape)


def distance_but_for_scale(visual_map: VisualMap, truth: VisualMap) -> float:
    """Largest distance of points from the truth, after scaling about the first camera, which stays."""
    centre = camera_pose.centre_from_pose(truth.T_kf_world[0])
    a, b = visual_map.X_world - centre, truth.X_world - centre
    scale = np.sum(a * b) / np.sum(a * a)
    return float(np.abs(scale * a - b).max())


def test_a_perturbed_exact_map_returns(make_map: MakeMap) -> None:
    """Up to the scale, which nothing measures; the end of the descent leaves 1e-6 of the depth."""
    truth, visual_map = make_map(), make_map()
    perturb(visual_map, 0.01, [1, 2, 3, 4])
    assert distance_but_for_scale(visual_map, truth) > 0.01
    done = adjust(visual_map, TUKEY, options=TIGHT)
    assert done.taken_back == 0
    assert visual_map.alive.all()
    assert distance_but_for_scale(visual_map, truth) < 1e-5
    np.testing.assert_array_equal(visual_map.T_kf_world[0], truth.T_kf_world[0])


@pytest.mark.parametrize("source", [True, False])
def test_wrong_sightings_are_taken_back_and_the_right_points_die(source: bool, make_map: MakeMap) -> None:
    """Sightings moved by 15 px: if it is the source, the point dies; else it lives without that one."""
    truth, visual_map = make_map(keyframes=6), make_map(keyframes=6)
    seen = visual_map.sightings
    count = np.bincount(seen["point"])
    is_source = seen["kf"] == visual_map.points["source_kf"][seen["point"]]
    rows = np.flatnonzero((is_source == source) & (count[seen["point"]] >= 5))
    _, first = np.unique(seen["point"][rows], return_index=True)
    bad = rows[first][:4]
    seen["uv"][bad] += np.array([9.0, -12.0])
    done = adjust(visual_map, TUKEY, options=TIGHT)
    assert not seen["on"][bad].any()
    assert done.taken_back == len(bad)
    assert done.died.tolist() == (sorted(seen["point"][bad].tolist()) if source else [])
    living = visual_map.alive
    left = np.abs(visual_map.X_world - truth.X_world)[living].max()
    assert left < 1e-4 or distance_but_for_scale(visual_map, truth) < 1e-4


def test_a_local_adjustment_leaves_the_others_alone(make_map: MakeMap) -> None:
    truth, visual_map = make_map(keyframes=7, points=90), make_map(keyframes=7, points=90)
    active = local_active(visual_map, 6, 2)
    assert 6 in active
    assert 0 not in active
    assert len(active) == 3
    touched = np.isin(visual_map.sightings["kf"], active)
    points = np.unique(visual_map.sightings["point"][touched])
    rest = np.setdiff1d(np.arange(len(visual_map.points)), points)
    perturb(visual_map, 0.005, active.tolist())
    visual_map.X_world[rest] = truth.X_world[rest] + 0.001  # wrong, and nobody's business here
    adjust(visual_map, TUKEY, active=active, options=TIGHT)
    others = np.setdiff1d(np.arange(7), active)
    np.testing.assert_array_equal(visual_map.T_kf_world[others], truth.T_kf_world[others])
    np.testing.assert_array_equal(visual_map.X_world[rest], truth.X_world[rest] + 0.001)
    assert np.abs(visual_map.X_world - truth.X_world)[points].max() < 1e-5  # the ring holds the scale, too
    assert np.abs(visual_map.T_kf_world - truth.T_kf_world).max() < 1e-5


def test_with_the_camera_free_an_exact_map_gets_its_camera_back(make_map: MakeMap) -> None:
    """Sightings without error, a wrong camera: poses, points, camera and slopes fit again, to 1e-6."""
    visual_map = make_map(7, 80)
    true = visual_map.camera
    wrong = Pinhole(1.02 * true.fx, 0.99 * true.fy, true.cx + 1.0, true.cy - 1.5)
    visual_map.change_camera(wrong)
    source = visual_map.points["source_uv"]
    np.testing.assert_array_equal(visual_map.points["slope"], slopes(wrong, source))
    adjust(visual_map, Robust(), options=TIGHT)  # the world bends itself to the wrong camera
    found = adjust_with_camera(
        visual_map, wrong, ("fx", "fy", "cx", "cy"), Robust(), most_shift_px=5.0, options=Options(cost=1e-12)
    )
    assert found.reason == ""
    np.testing.assert_allclose(visual_map.camera.params, true.params, rtol=1e-6)
    seen = visual_map.sightings
    at = true.pixel_from_world(visual_map.T_kf_world[seen["kf"]], visual_map.X_world[seen["point"]])
    assert np.abs(at.uv - seen["uv"])[seen["on"]].max() < 1e-3
    np.testing.assert_allclose(visual_map.points["slope"], slopes(true, source), atol=1e-8)


def test_a_camera_that_is_not_found_changes_nothing(make_map: MakeMap) -> None:
    visual_map = make_map(7, 80)
    before = visual_map.T_kf_world.copy(), visual_map.X_world.copy(), visual_map.camera
    visual_map.sightings["uv"][:] += np.random.default_rng(0).normal(0, 0.3, visual_map.sightings["uv"].shape)
    found = adjust_with_camera(visual_map, visual_map.camera, ("fx", "cx"), Robust(), most_shift_px=1e-6)
    assert found.reason == "the views determine no intrinsic"
    assert np.array_equal(visual_map.T_kf_world, before[0])
    assert np.array_equal(visual_map.X_world, before[1])
    assert visual_map.camera is before[2]
