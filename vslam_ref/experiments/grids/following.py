"""Pose and maps together: separated, in a plain grid, and with perfect knowledge of what moves; one run.

*Separated* means: the robot localises in S, and beams that end on what D takes for moving are left out.
*Plain* is one occupancy grid and all beams.  *Ideal* is a separation without mistakes: the truth says which
beams end on something that moves, and these are left out of the map and of the matching alike.

Each is run with the matcher as it is, and, where asked for, with least squares: nothing is too far to count.

The dynamic map is judged *beam by beam*: does D, at the place where the beam ends by the robot's own
estimate, say that something moves, and did the beam end on something that moves?  This needs no common
frame, so that it stays fair when the pose is off.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry import se2
from vslam_ref.grids import MapConfig, StaticDynamicMap
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS
from vslam_ref.systems.grid_slam import GridSlam, GridSlamConfig
from vslam_ref.worlds import floor_plan
from vslam_ref.worlds.floor_plan import FloorPlanConfig, LaserConfig, LaserScan, Recording

MODES = ("separated", "plain", "ideal")
MATCHERS = ("robust", "squares")
SPOILED = 0.1
"""Metres: the error of the poses at which the dynamic map is judged."""


@dataclass(frozen=True)
class LocalisationConfig:
    """The runs."""

    runs: int = field(
        default=6, metadata={"reason": "errors differ by a factor between runs: intervals are given"}
    )
    seed: int = field(default=20, metadata={"reason": "any; fixed for repeatability"})
    densities: tuple[float, ...] = field(
        default=(0.0, 0.1, 0.2, 0.3, 0.4),
        metadata={"reason": "0 to 40 % of the free floor; the densest is judged"},
    )
    errors: tuple[float, ...] = field(
        default=(0.0, 0.02, 0.05, 0.1, 0.2),
        metadata={"reason": "of the poses from which maps are drawn; 0.1 is judged: a cell", "unit": "m"},
    )
    error_density: float = field(default=0.1, metadata={"reason": "people enough, and walls in sight"})
    lever: float = field(
        default=5.0, metadata={"reason": "an error of 0.1 m turns by 0.1/5: alike on walls 5 m off"}
    )
    turn: float = field(
        default=0.3, metadata={"reason": "rasters in step with walls would place them exactly", "unit": "rad"}
    )
    world: FloorPlanConfig = field(
        default_factory=lambda: FloorPlanConfig(laser=LaserConfig(beams=541)),
        metadata={"reason": "an office; half a degree, as indoor scanners have"},
    )
    slam: GridSlamConfig = field(
        default_factory=lambda: GridSlamConfig(
            landmarks=False, leave_out_moving=True, map=MapConfig(d_memory="text")
        ),
        metadata={
            "reason": "scan matching alone: the map is the one difference; landmarks have their own study"
        },
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if self.runs < 2 or len(self.densities) < 2 or list(self.densities) != sorted(set(self.densities)):
            raise ValueError(
                f"runs={self.runs}, densities={self.densities}: need 2 runs and 2 densities, in order"
            )
        if self.densities[0] != 0.0 or 0.0 not in self.errors or SPOILED not in self.errors:
            raise ValueError(f"densities must begin with 0, errors={self.errors} hold 0 and {SPOILED}")
        if self.lever <= 0:
            raise ValueError(f"lever={self.lever}: need a length > 0")


class Point(NamedTuple):
    """One density; ``spoil``: draw maps from wrong poses too; ``squares``: match with least squares, too."""

    density: float
    spoil: bool
    squares: bool


def points(config: LocalisationConfig) -> list[Point]:
    """All densities, and ``error_density`` for the wrong poses if it is none of them."""
    densest = config.densities[-1]
    found = [Point(d, d == config.error_density, d == densest) for d in config.densities]
    if config.error_density not in config.densities:
        found.append(Point(config.error_density, True, False))
    return found


class Run(NamedTuple):
    """What one run gave.

    Attributes
    ----------
    rmse, final : ndarray, shape (3,)
        Position error over the run (root mean square) and at its end, metres, for the modes.
    squares : ndarray, shape (3,)
        RMSE with least squares; NaN where not asked for.
    beams : ndarray, shape (3,)
        Of the separated mode: beams rightly called moving, called moving, on moving things.
    spoiled : ndarray, shape (errors, 3)
        The same counts for maps drawn from true poses plus errors; zero where not asked for.
    on_people : ndarray, shape ()
        Share of beams that end on a person.
    """

    rmse: Array
    final: Array
    squares: Array
    beams: Array
    spoiled: Array
    on_people: Array


def beam_counts(recording: Recording, k: int, pose: Array, maps: StaticDynamicMap) -> Array:
    """Beams of scan k rightly called moving, called moving, on moving things."""
    r, owner = recording.ranges[k], recording.owner[k]
    used = np.isfinite(r) & (r > 0) & (r < recording.config.laser.max_range) & (owner >= 0)
    angles = recording.angles[used]
    ends = se2.act(pose, r[used, None] * np.stack([np.cos(angles), np.sin(angles)], 1))
    says = maps.dynamic().at(ends) > DECIDED_LOG_ODDS
    moves = recording.moving[k, owner[used]]
    return np.array([(says & moves).sum(), says.sum(), moves.sum()], dtype=np.float64)


def f_score(counts: Array) -> Array:
    """Harmonic mean (...,) of precision and recall, 2 right / (said + there), from counts (..., 3)."""
    right, said, there = np.moveaxis(np.asarray(counts, dtype=np.float64), -1, 0)
    both = said + there
    score: Array = np.where(both > 0, 2 * right / np.maximum(both, 1.0), 1.0)
    return score


def without_moving(recording: Recording, k: int) -> LaserScan:
    """Scan k without the beams that end on something that moves, by the truth."""
    scan, owner = recording.scan(k), recording.owner[k]
    moves = (owner >= 0) & recording.moving[k, np.maximum(owner, 0)]
    return scan._replace(ranges=np.where(moves, np.nan, scan.ranges))


def localise(
    recording: Recording, config: GridSlamConfig, warm_up: int = 25, ideal: bool = False
) -> tuple[Array, Array, GridSlam]:
    """Estimated poses (n, 3), beam counts (3,) of D after ``warm_up`` scans (0 for a plain grid), loop."""
    slam = GridSlam(recording.T_world_robot[0], config)
    poses, beams = np.empty_like(recording.T_world_robot), np.zeros(3)
    for k in range(len(recording)):
        scan = without_moving(recording, k) if ideal else recording.scan(k)
        poses[k] = slam.step(recording.increment(k), scan).T_world_robot
        if isinstance(slam.maps, StaticDynamicMap) and k >= warm_up:
            beams += beam_counts(recording, k, poses[k], slam.maps)
    return poses, beams, slam


def spoiled_counts(
    recording: Recording,
    config: MapConfig,
    sigma: float,
    lever: float,
    rng: np.random.Generator,
    warm_up: int = 25,
) -> Array:
    """Beam counts (3,) of maps drawn from the true poses plus independent errors of ``sigma`` metres."""
    maps, total = StaticDynamicMap(config), np.zeros(3)
    errors = sigma * rng.standard_normal((len(recording), 3)) / [1.0, 1.0, lever]
    for k in range(len(recording)):
        pose = recording.T_world_robot[k] + errors[k]
        maps.update(pose, recording.scan(k))
        if k >= warm_up:
            total += beam_counts(recording, k, pose, maps)
    return total


def position_errors(recording: Recording, poses: Array) -> tuple[float, float]:
    """Root mean square over the run, and at its end, metres."""
    off = np.hypot(*(poses - recording.T_world_robot)[:, :2].T)
    return float(np.sqrt(np.mean(off**2))), float(off[-1])


def simulate(config: LocalisationConfig, point: Point, seed: np.random.SeedSequence) -> Run:
    """One run at one density, all modes on the same recording."""
    crowd = dataclasses.replace(config.world.crowd, density=point.density)
    rng = np.random.default_rng(seed)
    world = dataclasses.replace(config.world, crowd=crowd)
    recording = floor_plan.turned(floor_plan.simulate(world, rng), config.turn)
    errors = np.full((len(MATCHERS), len(MODES), 2), np.nan)
    beams = np.zeros(3)
    for m, matcher in enumerate(MATCHERS if point.squares else MATCHERS[:1]):
        for i, mode in enumerate(MODES):
            poses, counted, _ = localise(
                recording, mode_of(config.slam, matcher, mode), ideal=mode == "ideal"
            )
            errors[m, i] = position_errors(recording, poses)
            if (matcher, mode) == ("robust", "separated"):
                beams = counted
    spoiled = np.zeros((len(config.errors), 3))
    if point.spoil:
        for i, sigma in enumerate(config.errors):
            spoiled[i] = spoiled_counts(recording, config.slam.map, sigma, config.lever, rng)
    rmse, final = errors[0].T
    return Run(rmse, final, errors[1, :, 0], beams, spoiled, np.array(recording.share_on_people))


def mode_of(config: GridSlamConfig, matcher: str, mode: str) -> GridSlamConfig:
    """The loop of a mode; for least squares nothing is too far to count."""
    matching = config.matching
    if matcher == "squares":
        matching = dataclasses.replace(matching, cut=np.inf, search_cut=np.inf)
    return dataclasses.replace(config, separate=mode != "plain", matching=matching)
