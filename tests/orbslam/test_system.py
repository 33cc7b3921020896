"""The system over a small film: every picture tracked, the map thinned out, a lost camera found again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.datasets.vocabulary_files import shipped_vocabulary
from vslam_ref.geometry import camera_pose
from vslam_ref.geometry.alignment import align
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.orbslam import OrbSlam, Settings, start
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.loops import CandidatesByWords, LoopCloser, LoopSettings
from vslam_ref.systems.orbslam.mapper import mapper
from vslam_ref.systems.orbslam.settings import FeatureSettings, TrackerSettings
from vslam_ref.systems.visual_map.chosen_start import ChosenStart
from vslam_ref.systems.visual_map.telling import Attempt, PictureOutcome, Quality
from vslam_ref.worlds.rendered import scene

FRAMES, EVERY = 40, 4


class Film(NamedTuple):
    pictures: list[np.ndarray]
    camera: Camera
    T_cam_world: np.ndarray


class Run(NamedTuple):
    system: OrbSlam
    outcomes: list[PictureOutcome]
    called: list[int]


@dataclass
class NotedCloser(LoopCloser):
    """Notes the keyframes that it is called for."""

    called: list[int] = field(default_factory=list)

    def __call__(self, feature_map: FeatureMap, kf: int) -> np.ndarray | None:
        self.called.append(kf)
        return super().__call__(feature_map, kf)


LARGEST_SHARE = 0.009
"""Of the path: what the system is to reach on the recorded drive."""


def share_of_path(film: Film, system: OrbSlam) -> float:
    """Root mean square distance of the camera's centres after a similarity, over the length of the path."""
    numbers, T = system.trajectory()
    rows = numbers < FRAMES
    centres = camera_pose.centre_from_pose(T[rows])
    truth = camera_pose.centre_from_pose(film.T_cam_world[numbers[rows]])
    left = np.linalg.norm(align(centres, truth, with_scale=True).act(centres) - truth, axis=1)
    length = np.linalg.norm(np.diff(truth, axis=0), axis=1).sum()
    return float(np.sqrt(np.mean(left**2)) / length)


@pytest.fixture(scope="module")
def film() -> Film:
    """Five seconds over a desk, every fourth picture, 320 x 240."""
    world = scene("desk", 3, size=(320, 240), frames=EVERY * FRAMES)
    pictures = [world.frame(k) for k in range(0, EVERY * FRAMES, EVERY)]
    return Film(pictures, world.camera, world.T_cam_world[::EVERY])


@pytest.fixture(scope="module")
def desk(film: Film) -> Run:
    """The film once, then three blank pictures and one from the middle of the film."""
    words = shipped_vocabulary()
    closer = NotedCloser(CandidatesByWords(words), np.random.default_rng(0))
    system = OrbSlam(film.camera, vocabulary=words, close_loops=closer)
    blank = [np.full_like(film.pictures[0], 120)] * 3
    shown = [*film.pictures, *blank, film.pictures[20]]
    return Run(system, [system.step(k, grey) for k, grey in enumerate(shown)], closer.called)


def test_every_picture_has_a_pose_those_before_the_start_too(film: Film, desk: Run) -> None:
    numbers, _ = desk.system.trajectory()
    assert numbers.tolist() == [*range(FRAMES), FRAMES + 3]
    assert desk.system.started_at is not None
    assert desk.system.started_at[0] == 0
    assert share_of_path(film, desk.system) < LARGEST_SHARE


def test_adjustments_make_the_path_better(film: Film, desk: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """What tracking and triangulation alone reach is worse by a third at least."""

    def nothing(*_: object, **__: object) -> None:
        return None

    for module, name in ((mapper, "adjust_local"), (start, "adjust_all")):
        monkeypatch.setattr(module, name, nothing)
    system = OrbSlam(film.camera)
    for k, grey in enumerate(film.pictures):
        system.step(k, grey)
    assert share_of_path(film, desk.system) < 0.75 * share_of_path(film, system)


def test_each_keyframe_is_handed_on_and_the_map_is_thinned_out(desk: Run) -> None:
    feature_map = desk.system.map
    assert feature_map is not None
    mapped = [o.mapped.kf for o in desk.outcomes if o.mapped is not None]
    assert desk.called == mapped == list(range(2, 2 + len(mapped)))
    assert sum(o.mapped.new for o in desk.outcomes if o.mapped) > 100
    assert sum(o.mapped.unproven for o in desk.outcomes if o.mapped) > 0
    assert sum(o.mapped.fused for o in desk.outcomes if o.mapped) > 0
    counts = desk.system.counts()
    assert counts["culled_keyframes"] == sum(o.mapped.culled for o in desk.outcomes if o.mapped)
    assert counts["loops"] == 0
    seen = feature_map.times_seen()
    assert (seen[feature_map.alive] >= 2).all()
    assert (seen[~feature_map.alive] == 0).all()


def test_blank_pictures_alone_are_lost_and_the_next_one_is_found_again(desk: Run) -> None:
    states = [o.tracked.quality for o in desk.outcomes[FRAMES:] if o.tracked is not None]
    assert states[:3] == [Quality.LOST] * 3
    assert desk.outcomes[-1].tracked.way == "relocalised"
    _, T = desk.system.trajectory()
    # the same picture, seen against a map that has changed since: within the map's own error
    assert np.abs(camera_pose.centre_from_pose(T[-1]) - camera_pose.centre_from_pose(T[20])).max() < 0.02


def test_without_relocalisation_it_stays_lost(film: Film) -> None:
    system = OrbSlam(
        film.camera,
        Settings(tracker=TrackerSettings(relocalise=False)),
    )
    for k in range(20):
        system.step(k, film.pictures[k])
    assert system.map is not None
    blank = np.full_like(film.pictures[0], 120)
    outcomes = [system.step(20, blank), system.step(21, film.pictures[19])]
    assert [o.tracked.quality for o in outcomes] == [Quality.LOST] * 2


def test_loops_are_looked_for_with_a_vocabulary_unless_they_are_left_out(film: Film) -> None:
    words = shipped_vocabulary()
    left_out = Settings(loops=LoopSettings(close=False))
    assert OrbSlam(film.camera).close_loops is None
    assert OrbSlam(film.camera, left_out, vocabulary=words).close_loops is None
    wanted = Settings(seed=3, loops=LoopSettings(apart=7))
    closer = OrbSlam(film.camera, wanted, vocabulary=words).close_loops
    assert closer is not None
    assert closer.loops.apart == 7


@pytest.mark.parametrize("close", [True, False])
def test_the_same_pictures_give_the_same_bytes(film: Film, desk: Run, close: bool) -> None:
    """Whether loops are looked for or not, where there is none."""
    again = OrbSlam(film.camera, Settings(loops=LoopSettings(close=close)), vocabulary=shipped_vocabulary())
    for k in range(18):
        again.step(k, film.pictures[k])
    live = [desk.system.poses[k].live for k in range(18)]
    assert [None if p is None else p.tobytes() for p in live] == [
        None if again.poses[k].live is None else again.poses[k].live.tobytes() for k in range(18)
    ]
    assert sum(p is not None for p in live) > 5


def test_a_local_map_of_covisible_keyframes_tracks_as_well(film: Film) -> None:
    tracker = TrackerSettings(local_map="covisible", local_keyframes=6)
    system = OrbSlam(film.camera, Settings(tracker=tracker))
    outcomes = [system.step(k, film.pictures[k]) for k in range(25)]
    qualities = {o.tracked.quality for o in outcomes if o.tracked is not None}
    assert qualities == {Quality.GOOD}


def test_a_bare_scene_says_why_it_does_not_start(film: Film) -> None:
    system = OrbSlam(film.camera)
    bare = np.full((240, 320), 90, np.uint8)
    bare[100:110, 100:120] = 200
    said = {system.step(k, bare).waiting for k in range(3)}
    assert all("features in a picture: need 100" in words for words in said)
    assert system.map is None
    system.finish()
    assert system.trajectory()[1].shape == (0, 4, 4)


def test_a_camera_that_rests_or_turns_does_not_start(film: Film) -> None:
    system = OrbSlam(film.camera)
    said = [system.step(k, film.pictures[0]).waiting for k in range(3)]
    assert said == ["the first picture", *["the features have moved 0.00 px: need 8"] * 2]


def test_a_chosen_start_is_tried_once(film: Film) -> None:
    system = OrbSlam(film.camera, chosen=ChosenStart(3, 14))
    outcomes = [system.step(k, film.pictures[k]) for k in range(16)]
    tried = [o for o in outcomes if o.attempt is not None]
    assert [o.number for o in tried] == [14]
    assert isinstance(tried[0].attempt, Attempt)
    assert system.started_at == (3, 14)
    assert sorted(system.poses) == list(range(3, 16))


def test_pictures_of_another_size_are_refused(film: Film) -> None:
    system = OrbSlam(film.camera)
    system.step(0, film.pictures[0])
    with pytest.raises(ValueError, match=r"picture 1 has shape \(120, 320\): the ones before had"):
        system.step(1, film.pictures[0][:120])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"features": FeatureSettings(scale=3.0)}, "features: scale is 3"),
        ({"tracker": TrackerSettings(local_map="near")}, "tracker.local_map='near': need whole or covisible"),
        ({"tracker": TrackerSettings(radius=-1.0)}, "tracker.radius=-1: need 0 or more"),
        ({"last_steps": float("nan")}, "last_steps=nan: need 0 or more"),
    ],
)
def test_settings_that_mean_nothing_are_refused(words: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Settings(**words)
