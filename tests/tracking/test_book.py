"""What the chapter reads, in plain loops, is what the library runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.estimation.pose_tracking import track_pose
from vslam_ref.features import level_sigma
from vslam_ref.geometry import se3
from vslam_ref.geometry.camera_pose import DecayingVelocity
from vslam_ref.systems.ptam.settings import Settings, TrackerSettings
from vslam_ref.systems.ptam.tracker import book
from vslam_ref.systems.ptam.tracker.coarse_fine import coarse, fine
from vslam_ref.systems.ptam.tracker.tracker import Tracker
from vslam_ref.systems.visual_map import Looks, look, templates, visible
from vslam_ref.systems.visual_map.visibility import sources

V = np.array([0.004, -0.003, 0.005, 0.002, -0.003, 0.004])


@pytest.fixture(scope="module")
def points(desk: Any) -> list[book.Point]:
    """The map's rows as the book has them."""
    m, table = desk.map, desk.map.points
    pyramids = [tuple(m.image(level)[kf] for level in range(4)) for kf in range(2)]
    return [
        book.Point(m.X_world[n], m.T_kf_world[kf], pyramids[kf], int(level), uv)
        for n, (kf, level, uv) in enumerate(
            zip(table["source_kf"], table["source_level"], table["source_uv"], strict=True)
        )
    ]


def on_the_margin(desk: Any, u: np.ndarray, level: int) -> bool:
    """Whether rounding decides that a pixel is in: corners seen from their own keyframe are whole pixels."""
    at, size = book.on_level(u, level), np.array(desk.map.shape[::-1]) / 2**level
    return bool(min(np.abs(at - 5).min(), np.abs(size - 6 - at).min()) < 1e-9)


@pytest.mark.parametrize("k", [0, 9])
def test_visible_points_warps_and_levels(desk: Any, points: list[book.Point], k: int) -> None:
    """Products of three matrices with entries below 200: 1e-10 is some hundred roundings."""
    fast = visible(desk.map, desk.pose(k))
    slow = book.visible(desk.map.camera, points, desk.pose(k), desk.pictures[k])
    fast = fast.only([not on_the_margin(desk, u, n) for u, n in zip(fast.uv, fast.level, strict=True)])
    slow = [s for s in slow if not on_the_margin(desk, s.u, s.level)]
    assert len(slow) == len(fast.point) > 150
    for row, s in enumerate(slow):
        assert s.point is points[fast.point[row]]
        assert np.abs(s.u - fast.uv[row]).max() < 1e-10
        assert np.abs(s.A - fast.A[row]).max() < 1e-10
        assert s.level == fast.level[row]


def test_a_camera_far_closer_looks_on_coarser_levels_and_one_far_away_on_none(
    desk: Any, points: list[book.Point]
) -> None:
    """Both forms where levels differ from those of the sources."""
    levels = set()
    for forward in (0.35, -0.4):
        T = se3.exp([0, 0, -forward, 0, 0, 0.2]) @ desk.pose(0)
        fast = visible(desk.map, T)
        slow = book.visible(desk.map.camera, points, T, desk.pictures[0])
        assert [s.level for s in slow] == fast.level.tolist()
        levels |= set((fast.level - sources(desk.map, fast.point).level).tolist())
    assert len(levels) > 1


def test_templates(desk: Any, points: list[book.Point]) -> None:
    """Equal bytes, but where a grey level falls on a half within rounding: none here."""
    fast = visible(desk.map, desk.pose(9))
    patches = templates(desk.map, sources(desk.map, fast.point), fast.A, fast.level)
    slow = book.visible(desk.map.camera, points, desk.pose(9), desk.pictures[9])
    assert patches.inside.sum() > 100
    for row in np.flatnonzero(patches.inside)[::4]:
        np.testing.assert_array_equal(book.template(slow[row]), patches.patch[row])


def test_found_places(desk: Any, points: list[book.Point]) -> None:
    """Every eighth point, expected where a guess that is a pixel or two off puts it."""
    T = se3.exp(V) @ desk.pose(9)
    fast = visible(desk.map, T)
    inside = templates(desk.map, sources(desk.map, fast.point), fast.A, fast.level).inside
    rows = np.flatnonzero(inside)[::8]
    measured = look(desk.map, fast.only(rows), desk.pictures[9], 10.0)
    slow = book.visible(desk.map.camera, points, T, desk.pictures[9])
    places = [book.find(slow[row], desk.pictures[9], 10.0) for row in rows]
    assert [u is not None for u in places] == measured.ok.tolist()
    assert 10 < measured.ok.sum() < len(rows)
    for u, expected, ok in zip(places, measured.uv, measured.ok, strict=True):
        assert not ok or np.abs(u - expected).max() < 1e-8  # up to ten steps of a contraction, on level 3


def test_pose_from_the_same_matches(desk: Any) -> None:
    """Ten steps each; wrong matches among them."""
    rng = np.random.default_rng(1)
    fast = visible(desk.map, desk.pose(9))
    uv = fast.uv + rng.normal(0, 0.3, fast.uv.shape) * level_sigma(fast.level)[:, None]
    uv[::7] += rng.uniform(-20, 20, uv[::7].shape)
    X = desk.map.X_world[fast.point]
    T = se3.exp(V) @ desk.pose(9)
    found = track_pose(desk.map.camera, X, uv, T, sigma_px=level_sigma(fast.level))
    matches = [book.Match(x, u, float(s)) for x, u, s in zip(X, uv, level_sigma(fast.level), strict=True)]
    for _ in range(10):
        T, _ = book.tukey_step(desk.map.camera, matches, T)
    assert np.abs(T - found.T_cam_world).max() < 1e-10
    _, weights = book.tukey_step(desk.map.camera, matches, T)
    assert np.abs(np.array(weights) - found.weights).max() < 1e-8
    assert np.count_nonzero(found.weights == 0) > 10


@pytest.mark.slow
def test_a_whole_picture(desk: Any, points: list[book.Point]) -> None:
    """Both passes with the same random choice: the same pose, and the same judgement."""
    settings = TrackerSettings()
    T_last, v = desk.pose(8), se3.log(desk.pose(8) @ se3.inverse(desk.pose(7)))
    rng, picture = np.random.default_rng(3), desk.pictures[9]
    first = coarse(desk.map, picture, se3.perturb(T_last, v), 10.0, settings, Looks(), rng)
    second = fine(desk.map, picture, first.pose.T_cam_world, 5.0, settings, Looks(), rng)
    T, quality = book.track(desk.map.camera, points, picture, T_last, v, np.random.default_rng(3))
    assert np.abs(T - second.pose.T_cam_world).max() < 1e-9
    tracker = Tracker(Settings(), np.random.default_rng(3), DecayingVelocity(v, 1.0, 1.0), T_last)
    tracked = tracker.track(desk.map, picture)
    assert tracked.way == "velocity"
    np.testing.assert_array_equal(tracked.T_cam_world, second.pose.T_cam_world)
    assert quality == tracked.quality.value == "good"
