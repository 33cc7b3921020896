"""The plain loops and the fast form: the same answers on drawn maps."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.features.orb import OrbFeatures
from vslam_ref.geometry import se3
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.mapper import book as mapping
from vslam_ref.systems.orbslam.mapper import cull, fuse, new_points
from vslam_ref.systems.orbslam.projection import expected, find
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.orbslam.spanning_tree import cull_keyframe, link
from vslam_ref.systems.orbslam.tracker import book as tracking
from vslam_ref.systems.orbslam.tracker.passes import look_for
from vslam_ref.systems.orbslam.tracker.tracker import FeatureTracker
from vslam_ref.systems.visual_map.telling import Quality

from .conftest import CAMERA, SHAPE, Drawn

SIZE = SHAPE[::-1]
S = Settings()


def bits(descriptor: np.ndarray) -> int:
    return int.from_bytes(descriptor.tobytes(), "little")


def as_points(made: FeatureMap) -> list[tracking.MapPoint]:
    table = made.points
    return [
        tracking.MapPoint(X, bits(d), n, float(r[1]))
        for X, d, n, r in zip(
            table["X_world"], table["descriptor"], table["normal"], table["distance_range"], strict=True
        )
    ]


def as_features(features: OrbFeatures) -> list[tracking.Feature]:
    rows = zip(features.uv, features.octave.tolist(), features.descriptor, strict=True)
    return [tracking.Feature(u, octave, bits(d)) for u, octave, d in rows]


def seen_anew(made: FeatureMap, T: np.ndarray, seed: int) -> OrbFeatures:
    """Features of a picture at a pose: some bits of each point's descriptor flip; wrong ones beside them."""
    rng = np.random.default_rng(seed)
    at = expected(made, np.flatnonzero(made.alive), T)
    flips = np.packbits(rng.random((len(at.point), 256)) < 0.12, axis=1)
    descriptor = made.points["descriptor"][at.point] ^ flips
    uv = at.uv + rng.normal(0, 0.4, at.uv.shape) * 1.2 ** at.level[:, None]
    wrong = rng.integers(0, len(at.point), 30)  # half alike, somewhere near
    far = descriptor[wrong] ^ np.packbits(rng.random((30, 256)) < 0.25, axis=1)
    octave = np.concatenate([at.level, np.maximum(at.level[wrong] + rng.integers(-1, 2, 30), 0)])
    uv = np.concatenate([uv, uv[wrong] + rng.normal(0, 5, (30, 2))])
    count = len(uv)
    return OrbFeatures(uv, octave, np.zeros(count), np.ones(count), np.concatenate([descriptor, far]))


T_NEXT = se3.exp([0.12, -0.03, -0.05, -0.02, -0.03, 0.02])


@pytest.mark.parametrize("seed", range(3))
def test_points_are_expected_where_the_book_says(draw_map, seed: int) -> None:
    made = draw_map(points=120, seed=seed).map
    made.points["normal"][:20] = [0.0, -1.0, 0.0]
    made.points["distance_range"][20:30] *= 0.4
    made.points["distance_range"][30:40] *= 5.0
    T = se3.exp([0.3, 0.1, -0.3, 0.05, 0.2, 0.3])
    at = expected(made, np.arange(120), T)
    told = [tracking.expectation(CAMERA, SIZE, p, T) for p in as_points(made)]
    assert at.point.tolist() == [k for k, there in enumerate(told) if there]
    assert 10 < len(at.point) < 100
    there = [e for e in told if e]
    np.testing.assert_allclose(at.uv, [e.u for e in there], atol=1e-10)
    assert at.level.tolist() == [e.octave for e in there]


@pytest.mark.parametrize("radius", [3.0, 12.0])
def test_the_same_features_answer(draw_map, radius: float) -> None:
    made = draw_map(points=120, share=0.9).map
    features = seen_anew(made, T_NEXT, 1)
    T = se3.perturb(T_NEXT, [0.02, 0.01, 0.02, 0.01, -0.01, 0.01])
    at = expected(made, np.arange(120), T)
    found = find(made, at, features, radius=radius, limit=100, ratio=0.8)
    told = tracking.look_for(CAMERA, SIZE, as_points(made), as_features(features), T, radius)
    assert {int(p): int(k) for p, k in zip(at.point, found, strict=True) if k >= 0} == told
    assert len(told) > 20


def test_a_picture_is_tracked_as_the_book_does(draw_map) -> None:
    """Both take ten steps with the same weights: they differ by rounding, times the condition of H, 1e4."""
    made = draw_map(points=100, share=0.9).map
    features = seen_anew(made, T_NEXT, 2)
    T_last, v = se3.exp([0.1, 0, 0, 0, 0, 0]), se3.log(T_NEXT @ se3.exp([-0.11, 0.01, 0, 0, 0, 0]))
    last = set(range(0, 100, 2))
    told = tracking.track(CAMERA, SIZE, as_points(made), last, as_features(features), T_last, v)
    assert told is not None
    tracker = FeatureTracker(S, np.random.default_rng(0), T_last, np.array(sorted(last)))
    tracker.motion = tracker.motion._replace(velocity=v)
    found = tracker._predicted(made, features)
    assert found is not None
    np.testing.assert_allclose(found.T_cam_world, told.T, atol=1e-10)
    weights = dict(zip(found.found.point.tolist(), found.found.pose.weights, strict=True))
    assert weights.keys() == told.weights.keys()
    np.testing.assert_allclose([weights[j] for j in told.weights], list(told.weights.values()), atol=1e-8)
    assert found.found.pose.sigma == pytest.approx(told.sigma, abs=1e-10)
    error = se3.log(found.T_cam_world @ se3.inverse(T_NEXT))
    # chi-square of six degrees of freedom stays below 27.9 with probability 0.9999
    assert error @ np.linalg.solve(found.found.pose.cov_pose, error) < 27.9


def test_both_are_lost_without_features(draw_map) -> None:
    made = draw_map(points=60).map
    features = seen_anew(made, T_NEXT, 3)
    none = OrbFeatures(*(values[:15] for values in features))
    points = as_points(made)
    assert (
        tracking.track(CAMERA, SIZE, points, set(range(60)), as_features(none), T_NEXT, np.zeros(6)) is None
    )
    tracker = FeatureTracker(S, np.random.default_rng(0), T_NEXT, np.arange(60))
    assert tracker._predicted(made, none) is None
    first = look_for(made, np.arange(60), none, T_NEXT, 5.0, S.tracker, S.features)
    assert tracker._quality(first) is Quality.LOST


@pytest.mark.parametrize("seed", range(3))
def test_features_are_matched_along_the_same_curves(draw_map, seed: int) -> None:
    made = draw_map(points=24, share=1.0, seed=seed).map
    made.T_kf_world[4] = se3.compose(se3.exp([0.0, 0, 0, 0, 0, 0.6]), made.T_kf_world[4])  # rolled
    made.sightings["uv"][made.features(4)][:24] = CAMERA.pixel_from_world(made.T_kf_world[4], made.X_world).uv
    made.remove_points(np.arange(24))  # all features are free again, and their descriptors are random
    rng = np.random.default_rng(seed)
    rows = [made.features(k) for k in (1, 4)]
    alike = made.sightings["descriptor"][rows[0]] ^ np.packbits(rng.random((25, 256)) < 0.08, axis=1)
    made.sightings["descriptor"][rows[1]] = alike
    made.sightings["descriptor"][rows[1]][::7] = made.sightings["descriptor"][rows[1]][0]
    a, b = (new_points.free_side(made, k) for k in (1, 4))
    T_b_a = se3.compose(made.T_kf_world[4], se3.inverse(made.T_kf_world[1]))
    octave = made.sightings["level"][rows[0]].tolist()
    corners = [
        [mapping.FreeCorner(u, k, bits(d)) for u, k, d in zip(side.uv, octave, side.descriptor, strict=True)]
        for side in (a, b)
    ]
    i, j = new_points.match(a, b, T_b_a, 1.96, 50)
    told = mapping.matches(CAMERA, *corners, T_b_a, 1.96, 50)
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == told
    assert len(told) > 12


def shown(made: FeatureMap) -> mapping.Sees:
    return {
        k: {f: int(p) for f, p in enumerate(made.point_of(k)) if p >= 0} for k in range(len(made.keyframes))
    }


@pytest.mark.parametrize("seed", range(4))
def test_the_tree_is_the_books(draw_map, seed: int) -> None:
    drawn: Drawn = draw_map(keyframes=8, share=0.3, seed=seed)
    made, sees = drawn
    parent = {}
    for k in range(8):
        link(made, k)
        parent[k] = mapping.parent_of_new(sees, k)
        assert made.keyframes["parent"][k] == parent[k]
    for kf in (1, 4, 2):
        parent = mapping.parents_after_culling(parent, shown(made), kf)
        cull_keyframe(made, kf)
        assert {k: int(made.keyframes["parent"][k]) for k in made.used_keyframes()} == parent


@pytest.mark.parametrize("seed", range(4))
def test_fusing_is_the_books(draw_map, seed: int) -> None:
    """Points are moved onto features that show others, or none: what is found there is fused."""
    made, _ = draw_map(keyframes=5, points=40, share=0.4, seed=seed)
    made.sightings["level"][:] = 0
    made.refresh(np.arange(40))
    kf = 3
    seen = made.point_of(kf)
    strangers = np.setdiff1d(np.arange(40), seen)
    feature = np.random.default_rng(seed).permutation(np.flatnonzero(seen >= 0))[:3]
    told = shown(made)
    done = 0
    for p, f in zip(strangers[:3].tolist(), feature.tolist(), strict=False):
        if made.current([p])[0] != p or made.point_of(kf)[f] != seen[f]:
            continue
        other = int(seen[f])
        made.points["X_world"][p] = made.X_world[other]
        for name in ("normal", "distance_range"):
            made.points[name][p] = made.points[name][other]
        made.points["descriptor"][p] = made.sightings["descriptor"][made.features(kf).start + f]
        told = mapping.fuse(told, kf, f, p)
        fuse.fuse(made, kf, np.array([p]), 3.0, 50)
        assert shown(made) == told
        done += 1
    assert done


@pytest.mark.parametrize("seed", range(3))
def test_keyframes_are_as_redundant_as_the_book_says(draw_map, seed: int) -> None:
    made, sees = draw_map(keyframes=6, share=0.6, seed=seed)
    made.sightings["level"][:] = np.random.default_rng(seed).integers(0, 5, len(made.sightings))
    octaves = {k: dict(enumerate(made.sightings["level"][made.features(k)].tolist())) for k in sees}
    for k in sees:
        told = mapping.redundant_share(sees, octaves, k)
        assert cull.redundant_share(made, k, 3) == pytest.approx(told, abs=1e-15)


def test_young_points_end_as_the_book_says(draw_map) -> None:
    made, _ = draw_map(keyframes=8, points=60, share=0.2, seed=1)
    rng = np.random.default_rng(0)
    table = made.points
    table["born"][:] = rng.integers(2, 8, 60)
    table["tried"][:] = rng.integers(0, 9, 60)
    table["found"][:] = rng.integers(0, 9, 60) * table["tried"] // 9
    seen = made.times_seen()
    told = [
        mapping.unproven(7 - int(born), int(tried), int(found), int(count))
        for born, tried, found, count in zip(table["born"], table["tried"], table["found"], seen, strict=True)
    ]
    assert cull.unproven(made, 7, S.mapper).tolist() == np.flatnonzero(told).tolist()
    assert 5 < sum(told) < 55
    table["born"][:] = 1
    assert len(cull.unproven(made, 3, S.mapper)) == 0
