"""Runs in which the camera moves sideways, then turns on an arm: ``ptam-rotation`` simulates them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry import se3
from vslam_ref.geometry.camera_pose import centre_from_pose
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.systems.visual_map import VisualMap
from vslam_ref.worlds.rendered import Effects, RenderedScene, motion, scene

GIVEN_UP = 5
"""Pictures lost in a row, after which the run ends: it looks at what it has never seen."""


@dataclass(frozen=True)
class TurningConfig:
    """The room and the motion."""

    runs: int = assume(6, "rooms", "each takes some 15 seconds an arm; the effect is large")
    seed: int = assume(133, "", "any; fixed for repeatability")
    arms: tuple[float, ...] = assume(
        (0.0, 0.05, 0.1, 0.2, 0.4), "m", "a tripod, a wrist, a hand, a forearm, an outstretched arm"
    )
    aside: float = assume(0.4, "m", "the way that makes the map; walls are 2.5 m away")
    moving: int = assume(60, "pictures", "of that way: 2 s")
    turn: float = assume(120.0, "degrees", "twice the field of view: at the end nothing of the start is seen")
    turning: int = assume(120, "pictures", "of the turn: 1 degree each")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse motions that mean nothing."""
        if self.runs < 1 or min(self.moving, self.turning) < 10 or self.turn <= 0 or self.aside <= 0:
            raise ValueError("need at least one run, 10 pictures of each part, turn and aside above 0")
        if 0.0 not in self.arms or max(self.arms) < 0.2:
            raise ValueError(f"arms={self.arms}: must hold 0, and one of at least 0.2 m")


class TurningRun(NamedTuple):
    """What became of one turn.

    Attributes
    ----------
    lost_at : ndarray
        Degrees turned at the last picture with a pose; NaN if there was one at the end.
    points : ndarray
        Of the map in the end, that no keyframe from before the turn has in its picture.
    keyframes : ndarray
        That the turn added.
    wander : ndarray
        Metres: largest error of the camera's place against where the turn began, where there is a pose.
    share : ndarray
        Of the pictures of the turn, with a pose.
    started : ndarray of bool
        Whether there was a map before the turn.
    alone : ndarray of bool
        Whether the turn alone, without a map before it, made a map.
    reason : ndarray of str
        Why it did not.
    """

    lost_at: Array
    points: IntArray
    keyframes: IntArray
    wander: Array
    share: Array
    started: BoolArray
    alone: BoolArray
    reason: Array


def path(config: TurningConfig, arm: float, shake: Callable[[Array], Array]) -> motion.Path:
    """Sideways before a corner of the room, then a turn to the right about a point behind the lens."""
    moving, turning = config.moving / 30.0, config.turning / 30.0
    ahead, across = np.array([-0.7, 0.7, -0.1]), np.array([0.7, 0.7, 0.0])  # into a corner: it has depth
    last = np.array([0.0, 0.0, 1.5])
    first = last - config.aside * across

    def swing(t: Array) -> Array:
        angle = -np.radians(config.turn) * np.clip((t - moving) / turning, 0.0, 1.0)
        return np.stack([np.zeros_like(angle), angle, np.zeros_like(angle)], -1)

    turned = motion.turning(motion.looking(last, last + ahead), swing, arm)

    def both(t: Array) -> Array:
        t = np.asarray(t, np.float64)
        place = first + np.clip(t / moving, 0.0, 1.0)[..., None] * (last - first)
        sideways = motion.looking(place, place + ahead)
        return np.where((t <= moving)[..., None, None], sideways, turned(t))

    return motion.held(both, shake)


def room(config: TurningConfig, arm: float, seed: np.random.SeedSequence) -> RenderedScene:
    """The pictures: the room of the scene ``rotation``, and a path of its own."""
    things, shaking = (int(s.generate_state(1)[0]) for s in seed.spawn(2))
    made = scene("rotation", things, effects=Effects(noise=config.noise))
    rng = np.random.default_rng(shaking)
    shake = motion.tremor(rng, [0.0, 0.0, 0.0, 0.004, 0.004, 0.004])  # turns only: an arm of 0 stays one
    times = np.arange(config.moving + config.turning) / 30.0
    return replace(made, path=path(config, arm, shake), times=times)


def simulate(config: TurningConfig, arm: float, seed: np.random.SeedSequence) -> TurningRun:
    """Run PTAM over one room with one arm, and over the turn alone."""
    made = room(config, arm, seed)
    system = Ptam(made.camera, Settings())
    for k in range(config.moving):
        system.step(k, made.frame(k))
    alone, reason = _turn_alone(config, made)
    if system.map is None:
        nothing = np.array(np.nan), np.array(0), np.array(0), np.array(np.nan), np.array(0.0)
        return TurningRun(*nothing, np.array(False), np.array(alone), reason)
    before = len(system.map.keyframes)
    scale = _scale(config, made, system)
    poses = _turn(config, made, system)
    last = max(poses, default=-1)
    turned = config.turn * (last + 1) / config.turning
    return TurningRun(
        np.array(np.nan if last == config.turning - 1 else turned),
        np.array(new_ground(system.map, before)),
        np.array(len(system.map.keyframes) - before),
        np.array(_wander(config, made, poses, scale)),
        np.array(len(poses) / config.turning),
        np.array(True),
        np.array(alone),
        reason,
    )


def _scale(config: TurningConfig, made: RenderedScene, system: Ptam) -> float:
    """Metres of one unit of the map, by the first way."""
    numbers, poses = system.trajectory()
    mine = centre_from_pose(poses[[0, -1]])
    true = centre_from_pose(made.T_cam_world[numbers[[0, -1]]])
    return float(np.linalg.norm(true[1] - true[0]) / np.linalg.norm(mine[1] - mine[0]))


def _turn(config: TurningConfig, made: RenderedScene, system: Ptam) -> dict[int, Array]:
    """Poses (4, 4) of the pictures of the turn that have one, by their number from 0."""
    poses: dict[int, Array] = {}
    for k in range(config.turning):
        outcome = system.step(config.moving + k, made.frame(config.moving + k))
        if outcome.tracked is not None and outcome.tracked.quality is not Quality.LOST:
            poses[k] = outcome.tracked.T_cam_world
        elif k - max(poses, default=-1) > GIVEN_UP:
            break
    return poses


def _wander(config: TurningConfig, made: RenderedScene, poses: dict[int, Array], scale: float) -> float:
    """Largest error, metres, of the way since the turn's first pose, seen in that camera's frame."""
    if not poses:
        return np.nan
    first, which = min(poses), sorted(poses)
    mine = se3.compose(poses[first], se3.inverse(np.stack([poses[k] for k in which])))
    true_all = made.T_cam_world[config.moving :]
    true = se3.compose(true_all[first], se3.inverse(true_all[which]))
    return float(np.linalg.norm(scale * mine[:, :3, 3] - true[:, :3, 3], axis=1).max())


def new_ground(visual_map: VisualMap, before: int) -> int:
    """Count points of the map that none of the first ``before`` keyframes has in its picture."""
    X = visual_map.X_world[visual_map.alive]
    seen = visual_map.camera.pixel_from_world(visual_map.T_kf_world[:before, None], X)
    height, width = visual_map.shape
    inside = seen.valid & ((seen.uv > -0.5) & (seen.uv < (width - 0.5, height - 0.5))).all(-1)
    return int((~inside.any(0)).sum())


def _turn_alone(config: TurningConfig, made: RenderedScene) -> tuple[bool, Array]:
    """Whether the turn makes a map by itself, and why not."""
    system, reason = Ptam(made.camera, Settings()), ""
    for k in range(config.moving, config.moving + config.turning // 2):
        outcome = system.step(k, made.frame(k))
        if isinstance(outcome.attempt, str):
            reason = outcome.attempt
        elif outcome.attempt is not None:
            reason = outcome.attempt.reason or reason
    return system.map is not None, np.array(reason, "<U200")
