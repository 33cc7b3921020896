"""What the chapter reads, in plain loops, is what the mapper runs."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from vslam_ref.estimation.bundle.local import local_problem
from vslam_ref.estimation.triangulation import triangulate
from vslam_ref.features import finest_from_level, level_from_finest
from vslam_ref.features.templates import cut
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole
from vslam_ref.geometry.multiview import Views
from vslam_ref.systems.ptam import policy
from vslam_ref.systems.ptam.look import peaks, prepare
from vslam_ref.systems.ptam.mapper import book, curve_search, new_points
from vslam_ref.systems.ptam.mapper.associate import seldom_found
from vslam_ref.systems.ptam.settings import FeatureSettings, Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.visual_map import VisualMap, local_active, neighbours
from vslam_ref.systems.visual_map.adjusting import as_problem

CAMERAS = [Pinhole(200.0, 190.0, 99.5, 74.5), Fov(200.0, 190.0, 99.5, 74.5, 0.9)]
T_B_A = se3.exp([-0.3, 0.05, 0.1, 0.05, -0.1, 0.08])


@pytest.mark.parametrize("camera", CAMERAS)
def test_distances_and_depths(camera: Camera) -> None:
    """The same numbers but for rounding: some 100 eps, over the parallax squared."""
    rng = np.random.default_rng(0)
    a = curve_search.with_bearings(camera, rng.integers(10, 140, (15, 2)), 0)
    b = curve_search.with_bearings(camera, rng.integers(10, 140, (15, 2)), 0)
    distance = np.array([book.curve_distance(camera, a.bearing[k], b.xy[k], T_B_A) for k in range(15)])
    for limit in (0.5 * distance, 2.0 * distance):
        close = [
            curve_search._near_curve(a.only(np.array([k])), b.only(np.array([k])), T_B_A, limit[k], -np.inf)
            for k in range(15)
        ]
        in_front = curve_search.ray_depths(a.bearing, b.bearing, T_B_A)[:, 1] > 0
        assert [len(c[0]) for c in close] == (in_front & (limit > distance)).astype(int).tolist()
    depths = [book.ray_depths(p, q, T_B_A) for p, q in zip(a.bearing, b.bearing, strict=True)]
    np.testing.assert_allclose(curve_search.ray_depths(a.bearing, b.bearing, T_B_A), depths, rtol=1e-9)


@pytest.mark.parametrize("search_back", [True, False])
def test_the_same_matches(search_back: bool, wall: Any, settings: Settings) -> None:
    """Corners of one level of two painted pictures, there and back; places equal bit by bit."""
    f, s, level = settings.features, settings.mapper, 1
    sides = []
    for picture, T in zip(wall.pictures, wall.T_cam_world, strict=True):
        found = curve_search.with_bearings(wall.camera, peaks(picture, level, f), level)
        sides.append(new_points.Side(0, level, picture.levels[level], picture.corners[level], found, T))
    xy = sides[0].peaks.xy
    xy = xy[cut(sides[0].image, xy).inside][::4]
    one_way = new_points.match(wall.camera, xy, *sides, 0.3, replace(s, search_back=search_back), f)
    a, b = (book.Side(level, side.image, [(int(x), int(y)) for x, y in side.peaks.xy]) for side in sides)
    T_b_a, gates = wall.T_cam_world[1], book.Gates(s.epipolar, 0.3, f.limit, s.back)
    rows = []
    for row, (x, y) in enumerate(xy):
        number = book.best_on_curve(wall.camera, (x, y), a, b, T_b_a, gates)
        if number < 0:
            continue
        if search_back and not book.comes_back(wall.camera, (x, y), b.corners[number], a, b, T_b_a, gates):
            continue
        rows.append(row)
        if row in one_way.row:
            start = finest_from_level(np.array(b.corners[number], float), level)
            end = one_way.uv_b[np.flatnonzero(one_way.row == row)[0]]
            assert np.hypot(*(end - start)) <= 6.0 * 2**level  # the refinement began at the same corner
    kept = set(one_way.row.tolist())
    assert kept <= set(rows)
    assert len(kept) >= 0.8 * len(rows) > 2  # what is lost, the sub-pixel refinement refused


@pytest.mark.parametrize("camera", CAMERAS)
def test_points_and_the_sigma_of_their_depth(camera: Camera) -> None:
    rng = np.random.default_rng(1)
    X = np.column_stack([rng.uniform(-0.5, 0.5, (12, 2)), rng.uniform(2.0, 4.0, 12)])
    views = Views(camera, np.stack([se3.identity(), T_B_A]))
    uv = views.project(X).uv + rng.normal(0, 0.2, (12, 2, 2))
    fast = triangulate(views, uv, sigma_px=0.2)  # ends within 1e-8 sigma of the depth: 5e-10
    assert fast.ok.all()
    for k in range(12):
        slow = book.triangulate(camera, uv[k, 0], uv[k, 1], T_B_A, 0.2)
        np.testing.assert_allclose(slow.X_a, fast.X_world[k], rtol=0, atol=1e-9)
        a = camera.unproject(uv[k, 0]).bearing
        assert slow.depth_sigma == pytest.approx(np.sqrt(a @ fast.cov_X[k] @ a), rel=1e-6)


@pytest.mark.parametrize("angle", [0.02, 0.1, 0.6])
def test_the_closed_form_of_the_sigma(angle: float) -> None:
    """Both cameras look straight at the point: a pixel is 1/f radians in both, exact to first order."""
    camera, r_a, r_b = Pinhole(300.0, 300.0, 160.0, 120.0), 3.0, 2.5
    turn = se3.exp([0, 0, 0, 0, angle, 0.0])[:3, :3]
    T_b_a = se3.from_rt(turn, np.array([0, 0, r_b]) - turn @ [0, 0, r_a])
    centre = np.array([160.0, 120.0])
    found = book.triangulate(camera, centre, centre, T_b_a, 0.7)
    np.testing.assert_allclose(found.X_a, [0, 0, r_a], atol=1e-9)
    eps = 0.7 / 300.0
    assert book.depth_sigma(np.array([r_a, r_b]), angle, eps, eps) == pytest.approx(
        found.depth_sigma, rel=1e-6
    )


def a_map(seed: int = 0) -> VisualMap:
    """Seven keyframes without pictures that see 40 points, each with a probability of its own."""
    rng = np.random.default_rng(seed)
    made = VisualMap(CAMERAS[0], (150, 200), levels=1)
    blank = SimpleNamespace(number=0, levels=(np.zeros((150, 200), np.uint8),), corners=(), small=None)
    for _ in range(7):
        made.add_keyframe(np.eye(4), blank)  # type: ignore[arg-type]
    X = np.column_stack([rng.uniform(-0.3, 0.3, (40, 2)), np.full(40, 2.0)])
    numbers = made.add_points(X, 0, 0, np.full((40, 2), 50.0))
    for kf in range(1, 7):
        some = numbers[rng.random(40) < 0.1 + 0.1 * kf]
        made.observe(kf, some, 0, np.full((len(some), 2), 50.0))
    made.take_back(np.flatnonzero(rng.random(len(made.sightings)) < 0.2))
    return made


def seen_in(visual_map: VisualMap) -> book.Seen:
    return {kf: set(visual_map.measured_in(kf).tolist()) for kf in range(len(visual_map.keyframes))}


@pytest.mark.parametrize("seed", range(4))
def test_neighbours_and_the_part_that_is_adjusted(seed: int) -> None:
    visual_map = a_map(seed)
    seen = seen_in(visual_map)
    for kf, count in itertools.product(range(7), (1, 3, 6)):
        assert neighbours(visual_map, kf, count).tolist() == book.neighbours(seen, kf, count)
    whole = as_problem(visual_map)
    fast = local_problem(whole.problem, local_active(visual_map, 6, 2))
    slow = book.local_part(seen, 6, 2)
    assert set(fast.active.tolist()) == slow.active
    assert set(fast.ring.tolist()) == slow.ring
    assert set(whole.points[fast.points].tolist()) == slow.points


def test_who_dies() -> None:
    visual_map = a_map()
    rng = np.random.default_rng(3)
    tried, found = visual_map.points["tried"], visual_map.points["found"]
    tried[:] = rng.integers(0, 20, 40)
    found[:] = rng.integers(0, 6, 40)
    expected = [k for k in range(40) if visual_map.alive[k] and book.dies(tried[k], found[k], 8, 0.25)]
    assert seldom_found(visual_map, 8, 0.25).tolist() == expected
    assert 0 < len(expected) < visual_map.alive.sum()


@pytest.mark.parametrize("level", [0, 1, 2, 3])
def test_free_corners(level: int) -> None:
    """Points at whole pixels of every level; 6, 8 from one is 10 exactly, and that is far enough in both."""
    rng = np.random.default_rng(level)
    visual_map = VisualMap(CAMERAS[0], (480, 640), 4)
    visual_map.add_keyframe(np.eye(4), prepare(0, np.zeros((480, 640), np.uint8), FeatureSettings()))
    at = rng.integers(0, 4, 60)
    xy_level = np.stack([rng.integers(2, 75, 60), rng.integers(2, 55, 60)], 1)
    uv = np.stack([finest_from_level(xy, k) for xy, k in zip(xy_level.astype(float), at, strict=True)])
    for k in range(4):
        visual_map.add_points(np.ones((np.sum(at == k), 3)), 0, k, uv[at == k])
    seen = [(level_from_finest(place, level), int(k)) for place, k in zip(uv, at, strict=True)]
    steps = np.array([[0, 0], [6, 8], [9, 0], [10, 0], [0, -7]])
    middles = np.concatenate([xy_level[at == level], np.rint([place for place, _ in seen[:20]]).astype(int)])
    xy = (middles[:, None] + steps).reshape(-1, 2)
    fast = new_points.free(visual_map, 0, xy, level, 10.0)
    assert fast.tolist() == [book.is_free((int(x), int(y)), level, seen, 10.0) for x, y in xy]
    assert 0 < fast.sum() < len(fast)


def test_fine_points_leave_room_for_coarse_ones() -> None:
    """A picture full of points of the finest level blocks its own level, and no coarser one."""
    visual_map = VisualMap(Pinhole(500.0, 500.0, 319.5, 239.5), (480, 640), 4)
    grey = np.zeros((480, 640), np.uint8)
    visual_map.add_keyframe(np.eye(4), prepare(0, grey, FeatureSettings()))
    uv = np.stack(np.meshgrid(np.arange(8.0, 640, 8), np.arange(8.0, 480, 8)), -1).reshape(-1, 2)
    visual_map.add_points(np.ones((len(uv), 3)), 0, 0, uv)
    asked = {0: [320, 240], 1: [160, 120], 3: [40, 30]}
    free = {
        level: bool(new_points.free(visual_map, 0, np.array([xy]), level, 10.0)[0])
        for level, xy in asked.items()
    }
    assert free == {0: False, 1: True, 3: True}
    visual_map.add_points(np.ones((1, 3)), 0, 1, np.array([[320.0, 240.0]]))
    # a point of level 1 takes room on its own level and the finer one, not on coarser ones
    assert not new_points.free(visual_map, 0, np.array([[160, 120]]), 1, 10.0)[0]
    assert new_points.free(visual_map, 0, np.array([[80, 60]]), 2, 10.0)[0]


@pytest.mark.parametrize("seed", range(3))
def test_the_policy(seed: int, monkeypatch: pytest.MonkeyPatch, settings: Settings) -> None:
    """A hundred pictures with all kinds of counts: the same answers, picture by picture."""
    rng = np.random.default_rng(seed)
    fast, since, best = policy.KeyframePolicy(settings.keyframe), 0, 0
    answers = []
    for _ in range(100):
        inliers, sigma = (
            int(rng.choice([30, 60, 110, 150, 190, 200])),
            float(rng.choice([0.5, 2.0], p=[0.9, 0.1])),
        )
        away = float(rng.choice([0.01, 0.05, 0.2], p=[0.5, 0.4, 0.1]))
        monkeypatch.setattr(policy, "distance", lambda *_, away=away: away)
        tracked: Any = SimpleNamespace(
            quality=Quality.GOOD, fine=SimpleNamespace(inliers=inliers), pose=SimpleNamespace(sigma=sigma)
        )
        since, best = since + 1, max(best, inliers)
        now = book.Now(since, inliers, best, sigma, away)
        answers.append(fast.wants(a_map, tracked))  # type: ignore[arg-type]
        assert answers[-1] == book.wants_keyframe(now, settings.keyframe)
        if answers[-1]:
            fast.taken()
            since = best = 0
    assert 5 < sum(answers) < 50
