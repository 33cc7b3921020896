"""Landmarks on moving things allowed, or forbidden: one run in a bare room with carts.

A cart that stands is as static as a wall, for a scan.  So every landmark is followed: on whose corner was
it set (by the truth at that scan), did that thing move away later, could the robot see that it did, and
was the landmark withdrawn?
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2, so2
from vslam_ref.grids import MapConfig
from vslam_ref.grids.landmarks import LandmarkConfig
from vslam_ref.systems.grid_slam import GridSlam, GridSlamConfig
from vslam_ref.worlds import floor_plan
from vslam_ref.worlds.floor_plan import CrowdConfig, FloorPlanConfig, LaserConfig, Recording

MODES = ("forbidden", "allowed", "odometry")
MOVED = 0.25
"""Metres by which a corner must have moved for its landmark to be wrong."""
LOOKED = 10
"""Scans in which beams went through the place where the corner was: from then on it should be found out."""


@dataclass(frozen=True)
class ChoiceConfig:
    """The runs."""

    runs: int = field(
        default=20, metadata={"reason": "errors differ by a factor between runs: intervals are given"}
    )
    seed: int = field(default=44, metadata={"reason": "any; fixed for repeatability"})
    world: FloorPlanConfig = field(
        default_factory=lambda: FloorPlanConfig(
            plan="depot", carts=5, crowd=CrowdConfig(density=0.02), laser=LaserConfig(beams=541)
        ),
        metadata={"reason": "twelve corners that stay, twenty that do not, and few people to hide them"},
    )
    slam: GridSlamConfig = field(
        default_factory=lambda: GridSlamConfig(match=False, map=MapConfig(d_memory="text")),
        metadata={"reason": "landmarks alone: scan matching would hide what they do"},
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if self.runs < 2 or self.world.carts < 1:
            raise ValueError(f"runs={self.runs}, carts={self.world.carts}: need at least 2 and 1")


class Run(NamedTuple):
    """What one run gave, for the three modes.

    Attributes
    ----------
    rmse : ndarray, shape (3,)
        Position error, root mean square over the run, metres.
    chosen, on_things : ndarray, shape (3,)
        Landmarks chosen; of these, on corners of things that move some time.
    wrong, found_out : ndarray, shape (3,)
        Landmarks whose corner moved away before the robot's eyes; of these, withdrawn.
    good_lost : ndarray, shape (3,)
        Landmarks on what never moves that were withdrawn.
    """

    rmse: Array
    chosen: Array
    on_things: Array
    wrong: Array
    found_out: Array
    good_lost: Array


def corner_owner(recording: Recording, k: int, xy: Array) -> tuple[int, int]:
    """Row of the segment with an end nearest to ``xy`` (true world, scan k), and which end (0, 1)."""
    ends = recording.segments[k].reshape(-1, 2, 2)
    d = np.hypot(ends[..., 0] - xy[0], ends[..., 1] - xy[1])
    row, end = np.unravel_index(int(np.argmin(d)), d.shape)
    return int(row), int(end)


def seen_to_be_gone(recording: Recording, born: int, row: int, end: int) -> bool:
    """Whether the corner moved away, and beams then went through its old place in ``LOOKED`` scans."""
    ends = recording.segments[born:, row].reshape(-1, 2, 2)[:, end]
    moved = np.hypot(*(ends - ends[0]).T) > MOVED
    looked = 0
    for k in born + np.flatnonzero(moved):
        seen = se2.act(se2.inverse(recording.T_world_robot[k]), ends[0])
        distance, bearing = np.hypot(*seen), np.arctan2(seen[1], seen[0])
        off = np.abs(so2.wrap(recording.angles - bearing))
        i = int(np.argmin(off))
        looked += bool(off[i] < 0.01 and distance < 8.0 and recording.exact_ranges[k, i] > distance + MOVED)
    return looked >= LOOKED


def follow(recording: Recording, config: GridSlamConfig) -> tuple[float, list[float]]:
    """Position error of one mode, and the counts of :class:`Run` in its order."""
    slam = GridSlam(recording.T_world_robot[0], config)
    off, birth = np.empty(len(recording)), {}
    for k in range(len(recording)):
        step = slam.step(recording.increment(k), recording.scan(k))
        off[k] = np.hypot(*(step.T_world_robot - recording.T_world_robot[k])[:2])
        for number in step.chosen:
            place = slam.places()[[m.id for m in slam.landmarks.active].index(number)]
            # where the robot sees it, put into the true world
            seen = se2.act(se2.inverse(step.T_world_robot), place)
            birth[int(number)] = (k, *corner_owner(recording, k, se2.act(recording.T_world_robot[k], seen)))
    fixed = len(recording.plan.fixed)
    counts = [float(len(birth)), 0.0, 0.0, 0.0, 0.0]
    for mark in slam.landmarks.landmarks:
        born, row, end = birth[mark.id]
        withdrawn = mark.withdrawn is not None
        if row < fixed:
            counts[4] += withdrawn
            continue
        counts[1] += 1
        if seen_to_be_gone(recording, born, row, end):
            counts[2] += 1
            counts[3] += withdrawn
    return float(np.sqrt(np.mean(off**2))), counts


def simulate(config: ChoiceConfig, point: None, seed: np.random.SeedSequence) -> Run:
    """One run, all modes on the same recording."""
    recording = floor_plan.simulate(config.world, np.random.default_rng(seed))
    allowed = LandmarkConfig(static_only=False, withdraw=False)
    modes = (
        config.slam,
        dataclasses.replace(config.slam, choice=allowed),
        dataclasses.replace(config.slam, landmarks=False),
    )
    done = [follow(recording, mode) for mode in modes]
    rmse, counts = np.array([r for r, _ in done]), np.array([c for _, c in done]).T
    return Run(rmse, *counts)
