"""A walk round a building that comes back: the loop is found, verified, closed; a look-alike is not."""

from __future__ import annotations

import importlib.util
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.features.orb import OrbFeatures
from vslam_ref.features.vocabulary import train
from vslam_ref.geometry import se3, sim3, so3
from vslam_ref.systems.orbslam import spanning_tree
from vslam_ref.systems.orbslam.loops import CandidatesByWords, LoopCloser, LoopSettings
from vslam_ref.systems.orbslam.loops.consistency import Consistency
from vslam_ref.systems.orbslam.loops.join import join, rescaled
from vslam_ref.systems.orbslam.loops.verify import camera_at, matched, verify
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.visual_map.telling import Pose


def load() -> ModuleType:
    path = Path(__file__).with_name("drawn_building.py")
    spec = importlib.util.spec_from_file_location("drawn_building", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    import sys

    sys.modules["drawn_building"] = module  # a dataclass looks its module up
    spec.loader.exec_module(module)
    return module


BUILDING = load()
FEW = LoopSettings(theta_min=50)
"""A hundred points in a picture: fewer in common than ORB-SLAM's threshold asks for."""


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def walked(walk: Any, candidates: Callable[..., list[int]], **settings: Any) -> LoopCloser:
    """The closer, after it has seen all keyframes one after the other."""
    loops = LoopSettings(**{"theta_min": 50, "apart": 100} | settings)
    closer = LoopCloser(candidates, rng(), Settings(loops=loops))
    for kf in range(len(walk.true)):
        closer(walk.map, kf)
    return closer


@pytest.mark.parametrize("seed", [1, 2])
def test_the_loop_is_closed_and_the_drift_is_gone(seed: int) -> None:
    walk = BUILDING.draw_walk(seed)
    before, points = walk.ate(), int(walk.map.alive.sum())
    first = next(kf for kf in range(len(walk.true)) if walk.revisits(kf))
    closer = walked(walk, lambda _, kf: walk.revisits(kf))
    assert len(closer.closed) == 1
    assert closer.closed[0].current == first + 2  # three in a row
    assert walk.map.loop_edges == [(closer.closed[0].candidate, closer.closed[0].current)]
    assert not closer.rejected
    assert closer.counts()["loops"] == 1
    assert closer.counts()["essential_edges"] > len(walk.true)
    # features are exact, so that the adjustment of everything ends at the truth, as near as its rule for the
    # end lets it: a step that no pixel shows (1e-2 of the scale of the errors, 0.5 px, over 300 px a radian)
    assert before > 0.25
    assert walk.ate() < 0.5 * 1e-2 / 300 * 10
    assert int(walk.map.alive.sum()) < points - 50


def test_without_the_adjustment_the_correction_alone_takes_most_of_the_drift() -> None:
    walk = BUILDING.draw_walk(3)
    before = walk.ate()
    closer = walked(walk, lambda _, kf: walk.revisits(kf), last_steps=0)
    assert walk.ate() < 0.1 * before
    # the unit of each keyframe had grown, and comes back to that of the first one, which is held: as well as
    # a keyframe has one unit, for its points are the means of those of ten keyframes
    current = closer.closed[0].current
    assert closer.joined is not None
    np.testing.assert_allclose(closer.joined.scale[: current + 1] * walk.scale[: current + 1], 1.0, rtol=0.05)
    assert walk.scale[current] > 1.2


def test_points_of_both_visits_become_one() -> None:
    walk = BUILDING.draw_walk(4)
    closer = walked(walk, lambda _, kf: walk.revisits(kf))
    verdict = closer.closed[0]
    true = walk.shows[verdict.current]
    shown = walk.map.point_of(verdict.current)
    # each feature's point is seen by features of the same true point only
    seen = walk.map.sightings
    for feature in np.flatnonzero(shown >= 0):
        rows = np.flatnonzero(seen["on"] & (seen["point"] == shown[feature]))
        starts = walk.map.keyframes["start"][seen["kf"][rows]]
        assert {
            int(walk.shows[k][r - s]) for k, r, s in zip(seen["kf"][rows], rows, starts, strict=True)
        } == {int(true[feature])}
    # and the place of the first visit is in the picture of the second
    assert walk.map.covisible(verdict.current)[verdict.candidate] >= 40


def test_a_look_alike_is_rejected_counted_and_leaves_the_map_as_it_was() -> None:
    walk = BUILDING.draw_walk(1, laps=0.8, look_alike=True)  # it never comes back
    T, X = walk.map.T_kf_world.tobytes(), walk.map.X_world.tobytes()

    def alike(_: object, kf: int) -> list[int]:
        counts = [len(matched(walk.map, kf, k, FEW).current) for k in range(max(kf - 14, 0))]
        return [int(np.argmax(counts))] if counts and max(counts) >= 20 else []

    closer = walked(walk, alike)
    assert closer.closed == []
    # the third side is ten keyframes long and looks like the first one: all but the first two are judged
    assert closer.rejected.keys() == {"no similarity"}
    assert closer.rejected["no similarity"] >= 5
    assert (walk.map.T_kf_world.tobytes(), walk.map.X_world.tobytes()) == (T, X)


def test_a_side_that_is_a_copy_of_another_is_told_by_the_turn_it_asks_for() -> None:
    """Every point agrees; but two sides ahead the path has turned by 180 degrees, and drift by none."""
    walk = BUILDING.draw_walk(1, laps=0.8, twin=True)
    closer = walked(walk, lambda _, kf: [max(kf - 28, 0)])
    assert closer.closed == []
    assert closer.rejected["implausible turn"] >= 3
    fooled = walked(BUILDING.draw_walk(1, laps=0.8, twin=True), lambda _, kf: [max(kf - 28, 0)], turn=180.0)
    assert len(fooled.closed) == 1


def test_a_walk_with_look_alikes_closes_the_true_loop_only() -> None:
    walk = BUILDING.draw_walk(1, look_alike=True)
    closer = walked(walk, lambda _, kf: [max(kf - 28, 0), *walk.revisits(kf)])
    assert len(closer.closed) == 1
    assert closer.closed[0].candidate < 14
    assert sum(closer.rejected.values()) >= 5
    assert walk.ate() < 1e-3


def test_poses_kept_beside_the_map_get_its_new_lengths() -> None:
    poses = {7: Pose(7, 1, se3.exp([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]), None), 9: Pose(9, 0, np.eye(4), None)}
    found = rescaled(poses, np.array([1.0, 0.5]))
    np.testing.assert_array_equal(found[7].T_cam_kf[:3, 3], 0.5 * poses[7].T_cam_kf[:3, 3])
    np.testing.assert_array_equal(found[7].T_cam_kf[:3, :3], poses[7].T_cam_kf[:3, :3])
    np.testing.assert_array_equal(found[9].T_cam_kf, np.eye(4))


def test_the_similarity_is_the_true_one() -> None:
    walk = BUILDING.draw_walk(2)
    current = len(walk.true) - 1
    candidate = walk.revisits(current)[0]
    found = verify(walk.map, current, candidate, rng(), FEW)
    assert found.reason == ""
    true = se3.compose(walk.true[candidate], se3.inverse(walk.true[current]))
    S = found.S_candidate_current
    ratio = walk.scale[candidate] / walk.scale[current]
    # units differ by 0.4 per cent a step, and a point is the mean of those of ten keyframes
    assert sim3.scale(S) == pytest.approx(ratio, rel=0.02)
    assert np.linalg.norm(so3.log(sim3.rotation(S) @ true[:3, :3].T)) < np.deg2rad(1.0)
    np.testing.assert_allclose(S[:3, 3], walk.scale[candidate] * true[:3, 3], atol=0.03)
    # the camera on the candidate's side sees the candidate's points where the similarity puts them
    X = rng(3).normal(size=(5, 3)) + [0, 0, 4]
    X_world = se3.act(se3.inverse(walk.map.T_kf_world[candidate]), X)
    there, camera = sim3.act(sim3.inverse(S), X), camera_at(S, walk.map, candidate)
    np.testing.assert_allclose(sim3.scale(S) * there, se3.act(camera, X_world), atol=1e-12)


def test_guided_search_finds_what_matching_alone_missed() -> None:
    """Descriptors differ by 3 % of their bits in each picture, 15 bits: only few pairs are within 12."""
    walk = BUILDING.draw_walk(2)
    current = len(walk.true) - 4
    candidate = walk.revisits(current)[0] + 2  # a metre ahead: it matters on which side the camera stands
    strict = LoopSettings(theta_min=50, bits=12, least_points=20)
    found = verify(walk.map, current, candidate, rng(), strict)
    assert found.reason == ""
    common = len(np.intersect1d(walk.shows[current], walk.shows[candidate]))
    assert found.matches < 0.5 * common
    assert found.inliers > 1.5 * found.matches
    assert found.inliers > 0.6 * common


@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        ({"least_matches": 1000}, "few matches"),
        ({"least_inliers": 1000}, "few inliers"),
        ({"least_points": 1000}, "few points"),
    ],
)
def test_every_bar_has_its_reason(setting: dict[str, int], reason: str) -> None:
    walk = BUILDING.draw_walk(1)
    closer = walked(walk, lambda _, kf: walk.revisits(kf), **setting)
    assert closer.closed == []
    assert set(closer.rejected) == {reason}


def test_culled_keyframes_go_with_their_parents() -> None:
    """Where a keyframe stood beside its parent is kept in the parent's unit, which the closing changes."""
    walk = BUILDING.draw_walk(1)
    for kf in (20, 21, 30, 45):
        spanning_tree.cull_keyframe(walk.map, kf)
    assert walk.map.culled == 4
    before = walk.ate()
    walked(walk, lambda _, kf: [k for k in walk.revisits(kf) if walk.map.keyframes["alive"][k]])
    # a culled keyframe's step to its parent drifted by half a per cent, 4 mm of 0.7 m and two at most
    assert before > 0.25
    assert walk.ate() < 0.01


def test_a_second_loop_waits_and_what_is_near_is_no_candidate() -> None:
    walk = BUILDING.draw_walk(1)
    asked: Counter[int] = Counter()

    def eager(_: object, kf: int) -> list[int]:
        asked[kf] += 1
        return [kf, max(kf - 1, 0), *walk.revisits(kf)]

    closer = walked(walk, eager, apart=100)
    assert len(closer.closed) == 1
    assert set(asked.values()) == {1}  # asked for every keyframe, so that it can remember each
    assert closer.closed[0].candidate < 14
    assert not closer.rejected  # neighbours were never judged


def test_the_same_walk_and_seed_give_the_same_bytes() -> None:
    maps = []
    for _ in range(2):
        walk = BUILDING.draw_walk(2)
        walked(walk, lambda _, kf, walk=walk: walk.revisits(kf), last_steps=0)
        maps.append(walk.map.T_kf_world.tobytes() + walk.map.X_world.tobytes())
    assert maps[0] == maps[1]


def test_words_propose_the_place_of_the_first_lap() -> None:
    walk = BUILDING.draw_walk(1, laps=1.15)
    features = [walk.map.features(kf) for kf in range(len(walk.true))]
    sightings = walk.map.sightings
    vocabulary = train(
        [sightings["descriptor"][walk.map.features(kf)] for kf in range(0, 50, 3)],
        branching=10,
        levels=3,
        rng=rng(),
    )
    words = CandidatesByWords(vocabulary)
    for kf in range(1, len(walk.true)):  # the first one is remembered though nobody asked for it
        found = words(walk.map, kf)
        assert (walk.map.covisible(kf)[found] < 15).all()
        assert all(k < kf for k in found)
    for kf in (0, 7, 30):
        like = OrbFeatures(*[None] * 4, walk.map.sightings["descriptor"][features[kf]])  # type: ignore[arg-type]
        assert words.alike(walk.map, like, 3)[0] == kf
        assert len(words.alike(walk.map, like, 3)) == 3
    closer = walked(walk, CandidatesByWords(vocabulary))
    assert len(closer.closed) == 1
    assert closer.closed[0].candidate < 12
    assert closer.closed[0].current <= 60
    assert walk.ate() < 1e-3


class Groups:
    """Keyframes that share points: those that differ by less than three."""

    def covisible(self, kf: int) -> np.ndarray:
        number = np.arange(100)
        return np.where((np.abs(number - kf) < 3) & (number != kf), 20, 0)


def test_three_in_a_row_that_touch_are_believed() -> None:
    state, touching = Consistency(), Groups()
    assert state.take(touching, [10, 50], 3, 15) == []  # type: ignore[arg-type]
    assert state.take(touching, [12], 3, 15) == []  # type: ignore[arg-type]
    assert state.take(touching, [50, 15], 3, 15) == [15]  # type: ignore[arg-type]
    assert state.take(touching, [52], 3, 15) == []  # type: ignore[arg-type]
    assert state.take(touching, [], 3, 15) == []  # type: ignore[arg-type]
    assert state.take(touching, [52], 3, 15) == []  # type: ignore[arg-type]
    assert state.take(touching, [52], 2, 15) == [52]  # type: ignore[arg-type]
    assert state.take(touching, [52], 2, 21) == [52]  # itself, again
    assert state.take(touching, [53], 2, 21) == []  # nobody shares as many as 21  # type: ignore[arg-type]
    state.forget()
    assert state.take(touching, [52], 2, 15) == []  # type: ignore[arg-type]


def test_a_loop_twice_joined_adds_no_second_edge() -> None:
    walk = BUILDING.draw_walk(1)
    current = len(walk.true) - 1
    verdict = verify(walk.map, current, walk.revisits(current)[0], rng(), FEW)
    done = join(walk.map, verdict, FEW)
    assert done.edges > len(walk.true) - 1
    assert done.fused > 150
    # points look as they do from where the keyframes are now
    alive, table = np.flatnonzero(walk.map.alive), walk.map.points
    told = table["normal"][alive].copy(), table["distance_range"][alive].copy()
    walk.map.refresh(alive)
    np.testing.assert_array_equal(told[0], table["normal"][alive])
    np.testing.assert_array_equal(told[1], table["distance_range"][alive])
    assert verify(walk.map, current, verdict.candidate, rng(), FEW).reason == "few matches"  # nothing is left


@pytest.mark.parametrize(("field", "value"), [("ratio", 1.5), ("draws", 0), ("bits", -1), ("steps", np.nan)])
def test_settings_that_mean_nothing_are_refused(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=field):
        LoopSettings(**{field: value})  # type: ignore[arg-type]
