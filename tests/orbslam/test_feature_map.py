"""The map of features against dictionaries: who sees what, after everything that may happen to it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from vslam_ref.estimation.bundle import Robust
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import camera_pose, se3
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.spanning_tree import children, cull_keyframe, link, settled_poses
from vslam_ref.systems.visual_map import adjust, neighbours


def shown(made: FeatureMap) -> dict[int, dict[int, int]]:
    """What each keyframe sees: feature -> point."""
    return {
        k: {f: int(p) for f, p in enumerate(made.point_of(k)) if p >= 0} for k in range(len(made.keyframes))
    }


def test_what_was_told_is_seen(draw_map):
    made, sees = draw_map()
    assert shown(made) == sees
    assert made.times_seen().tolist() == [
        sum(p in of.values() for of in sees.values()) for p in range(len(made.points))
    ]


def test_covisibility_counts_common_points(draw_map):
    made, sees = draw_map(seed=1)
    cull_keyframe(made, 3)
    sees[3] = {}
    table = [[len(set(a.values()) & set(b.values())) for b in sees.values()] for a in sees.values()]
    assert made.covisibility().tolist() == table
    for k in range(len(sees)):
        alone = table[k].copy()
        alone[k] = 0
        assert made.covisible(k).tolist() == alone
    ranked = sorted((k for k in range(1, 6) if table[0][k]), key=lambda k: -table[0][k])
    assert neighbours(made, 0, 9).tolist() == ranked


def test_a_feature_shows_one_point_and_a_point_is_seen_once(draw_map):
    made, sees = draw_map(points=10, share=1.0)
    made.see(2, [0, 1], [5, 0])
    want = {f: p for f, p in sees[2].items() if f > 1 and p not in (5, 0)} | {0: 5, 1: 0}
    assert shown(made)[2] == want
    assert shown(made)[1] == sees[1]


@pytest.mark.parametrize("seed", range(5))
def test_fused_points_hand_over_their_sightings(draw_map, seed):
    made, sees = draw_map(seed=seed)
    rng = np.random.default_rng(seed)
    old = rng.permutation(40)[:12]
    new = rng.permutation(40)[:12]
    new[0] = old[1]  # a chain
    into = {}

    def last(p):
        while p in into:
            p = into[p]
        return p

    for a, b in zip(old.tolist(), new.tolist(), strict=True):
        a, b = last(a), last(b)
        if a != b:
            into[a] = b
    made.replace(old, new)
    assert made.current(np.arange(40)).tolist() == [last(p) for p in range(40)]
    for k, of in sees.items():
        now = shown(made)[k]
        assert set(now.values()) == {last(p) for p in of.values()}
        assert max(Counter(now.values()).values()) == 1
        kept = {f: p for f, p in of.items() if last(p) == p}
        assert kept.items() <= now.items(), "a point keeps its own sighting"
        assert all(last(of[f]) == p for f, p in now.items())


def test_points_end_with_their_last_sighting_but_one(draw_map):
    made, sees = draw_map(keyframes=3, points=20, share=0.0)
    rows = made.rows_in(1)[:4]
    dead = made.take_back(rows)
    assert dead.tolist() == [sees[1][f] for f in range(4)]
    assert not set(dead.tolist()) & set(made.measured_in(0).tolist())
    assert made.current(dead).tolist() == [-1] * 4


def test_descriptor_is_the_one_most_like_the_others(draw_map):
    made, sees = draw_map(keyframes=7, share=0.8, seed=2)
    table = made.sightings["descriptor"]
    for p in range(len(made.points)):
        at = [made.features(k).start + f for k, of in sees.items() for f, q in of.items() if q == p]
        words = [int.from_bytes(table[i].tobytes(), "little") for i in at]
        medians = [np.median([(a ^ b).bit_count() for b in words]) for a in words]
        assert (made.points["descriptor"][p] == table[at[int(np.argmin(medians))]]).all()


def test_normal_and_distances_follow_the_sightings(draw_map):
    made, sees = draw_map(seed=3)
    centres = camera_pose.centre_from_pose(made.T_kf_world)
    for p in range(len(made.points)):
        rays = [made.X_world[p] - centres[k] for k, of in sees.items() if p in of.values()]
        mean = np.mean([ray / np.linalg.norm(ray) for ray in rays], axis=0)
        np.testing.assert_allclose(made.points["normal"][p], mean / np.linalg.norm(mean), atol=1e-12)
        octave = p % 4  # as feature p of keyframe 0 has it
        far = np.linalg.norm(rays[0]) * 1.2**octave
        np.testing.assert_allclose(made.points["distance_range"][p], [far / 1.2**7, far], rtol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_the_tree_stays_a_tree(draw_map, seed):
    made, sees = draw_map(keyframes=9, share=0.3, seed=seed)
    for k in range(9):
        link(made, k)
        parent = int(made.keyframes["parent"][k])
        common = [len(set(sees[k].values()) & set(sees[j].values())) for j in range(k)]
        assert parent == (-1 if k == 0 else int(np.argmax(common)))
    made.loop_edges.append((2, 7))
    before = settled_poses(made)
    for kf in np.random.default_rng(seed).permutation(9)[:6].tolist():
        cull_keyframe(made, kf)
        used = set(made.used_keyframes().tolist())
        assert {0, 2, 7} <= used
        for k in used - {0}:  # every way leads to the first
            steps = 0
            while k != 0:
                k = int(made.keyframes["parent"][k])
                assert k in used
                steps += 1
                assert steps < 9
        assert sum(len(children(made, k)) for k in used) == len(used) - 1
    assert made.culled == 9 - len(made.used_keyframes()) > 0
    np.testing.assert_allclose(settled_poses(made), before, atol=1e-14)


def test_a_culled_keyframe_goes_with_its_parent(draw_map):
    made, _ = draw_map()
    for k in range(6):
        link(made, k)
    relative = se3.compose(made.T_kf_world[4], se3.inverse(made.T_kf_world[made.keyframes["parent"][4]]))
    cull_keyframe(made, 4)
    made.T_kf_world[:] = se3.compose(made.T_kf_world, se3.exp([0.3, -0.1, 0.2, 0.1, 0.2, -0.1]))
    parent = int(made.keyframes["parent"][4])
    np.testing.assert_allclose(
        settled_poses(made)[4], se3.compose(relative, made.T_kf_world[parent]), atol=1e-14
    )


def test_an_adjustment_passes_over_culled_keyframes(draw_map):
    """The sightings are exact: moved keyframes and points come back, to the gauge's scale."""
    made, _ = draw_map(keyframes=5, points=60, share=0.9)
    for k in range(5):
        link(made, k)
    cull_keyframe(made, 2)
    truth, X = made.T_kf_world.copy(), made.X_world.copy()
    rng = np.random.default_rng(0)
    made.X_world[:] += 0.01 * rng.standard_normal(X.shape)
    for k in (3, 4):
        made.T_kf_world[k] = se3.perturb(truth[k], 0.01 * rng.standard_normal(6))
    adjust(made, Robust(tuned("tukey", 2), "adaptive", 0.4), active=[3, 4], fixed=[0, 1])
    # the last step is below 1e-2 of what half a pixel moves a pose: 0.5 / 150 over the root of 50 points
    np.testing.assert_allclose(made.T_kf_world[[0, 1, 3, 4]], truth[[0, 1, 3, 4]], atol=1e-4)
    assert (made.T_kf_world[2] == truth[2]).all()
