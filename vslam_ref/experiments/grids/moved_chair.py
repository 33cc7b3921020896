"""A chair is carried across a room and put down on once-free floor; it is watched becoming static, or not.

The table of the book says of a cell that S calls free and that is hit: something moves there.  So does every
later hit, and S never learns.  The ageing variant, ``settle_seconds``, forgets that the floor was free.

What is counted are the cells in which beams without noise end on the chair, at every scan.  Noise puts some
ends into neighbours, so not all of them are decided in one scan; the question is which of the two maps holds
the chair, and "most of it" is more than half.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.grids import LogOddsGrid, MapConfig, StaticDynamicMap
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS
from vslam_ref.worlds import floor_plan
from vslam_ref.worlds.floor_plan import (
    Box,
    FloorPlan,
    FloorPlanConfig,
    LaserConfig,
    Recording,
    cell_truth,
    cover,
    hall,
    seen_cells,
)
from vslam_ref.worlds.floor_plan.plan import schedule

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FROM, TO = (4.65, 1.25), (2.65, 3.85)
"""Middle of the chair before and after, metres."""
SLACK = 3.0
"""Seconds after which what must have happened has happened: three hits, or eleven misses, and a look."""


@dataclass(frozen=True)
class ChairConfig:
    """The room and the runs."""

    runs: int = field(default=10, metadata={"reason": "people walk before the chair differently in each"})
    seed: int = field(default=41, metadata={"reason": "any; fixed for repeatability"})
    lift: float = field(default=8.0, metadata={"reason": "by then the floor was seen free", "unit": "s"})
    put_down: float = field(default=12.0, metadata={"reason": "3.3 m at walking pace", "unit": "s"})
    watch: float = field(default=60.0, metadata={"reason": "a minute is for ever, for a robot", "unit": "s"})
    settle: float = field(default=10.0, metadata={"reason": "T of the world's truth", "unit": "s"})
    density: float = field(default=0.03, metadata={"reason": "five people in the room"})
    world: FloorPlanConfig = field(
        default_factory=lambda: FloorPlanConfig(laser=LaserConfig(beams=541)),
        metadata={"reason": "a beam every half degree: every cell of the chair's near side is hit"},
    )

    def __post_init__(self) -> None:
        """Refuse times that are out of order."""
        if not 0 < self.lift < self.put_down or self.runs < 2:
            raise ValueError(f"lift={self.lift}, put_down={self.put_down}, runs={self.runs}: out of order")
        if not 0 < self.settle < self.watch - SLACK:
            raise ValueError(
                f"settle={self.settle} s: must be less than watch={self.watch} s, with {SLACK} s"
            )


VARIANTS = ("printed", "ageing")


class Run(NamedTuple):
    """One run, printed and ageing.

    Attributes
    ----------
    static, dynamic : ndarray, shape (2, n)
        Share of the chair's cells that are hit now which S decides static, and D decides moving; NaN where
        the chair is not seen.
    old_place : ndarray, shape (2, n)
        Share of the cells of the chair's first place, of those that beams cross now, still static in S.
    false : ndarray, shape (2,)
        At the end: share of decided cells of S that no static thing covers, of those that were ever seen.
    """

    static: Array
    dynamic: Array
    old_place: Array
    false: Array


def plan(config: ChairConfig) -> FloorPlan:
    """The hall with the chair; the robot drives to and fro for as long as is watched."""
    way = schedule([config.lift, config.put_down], [[*FROM, 0.0], [*TO, 0.0]])
    legs = np.array([[1.0, 1.0], [2.2, 1.0], [2.2, 2.0], [2.2, 1.0]])
    rounds = 2 + int((config.put_down + config.watch) / 8.0)
    return dataclasses.replace(hall(), things=(Box((0.4, 0.4), way),), route=np.tile(legs, (rounds, 1)))


def record(config: ChairConfig, seed: np.random.SeedSequence) -> Recording:
    """One recording."""
    crowd = dataclasses.replace(config.world.crowd, density=config.density)
    end = config.put_down + config.watch
    world = dataclasses.replace(config.world, crowd=crowd, duration=end)
    return floor_plan.simulate(world, np.random.default_rng(seed), plan(config))


def maps(config: ChairConfig) -> tuple[StaticDynamicMap, StaticDynamicMap]:
    """The two maps: nothing but settling differs."""
    base = MapConfig(settle_seconds=None)
    return StaticDynamicMap(base), StaticDynamicMap(dataclasses.replace(base, settle_seconds=config.settle))


def simulate(config: ChairConfig, point: None, seed: np.random.SeedSequence) -> Run:
    """One recording, drawn by both variants."""
    recording = record(config, seed)
    cells, both = cover(recording), maps(config)
    middles = _middles(cells.shape, cells.origin_xy, cells.resolution)
    on_old = (np.abs(middles - np.array(FROM)) < 0.25).all(axis=-1)
    on_new = (np.abs(middles - np.array(TO)) < 0.25).all(axis=-1)
    n = len(recording)
    static, dynamic, old = (np.full((2, n), np.nan) for _ in range(3))
    ever = np.zeros(cells.shape, dtype=bool)
    for k in range(n):
        seen = seen_cells(recording, k, cells)
        ever |= seen.crossed | seen.ended
        hit = seen.ended & on_new if recording.times[k] >= config.put_down else np.zeros_like(on_new)
        through = seen.crossed & ~seen.ended & on_old
        for v, grid in enumerate(both):
            grid.update(recording.T_world_robot[k], recording.scan(k))
            s, d = _decided(grid.static(), middles), _decided(grid.dynamic(), middles)
            if hit.any():
                static[v, k], dynamic[v, k] = s[hit].mean(), d[hit].mean()
            if through.any():
                old[v, k] = s[through].mean()
    truth = cell_truth(recording, n - 1, cells)
    false = []
    for grid in both:
        s = _decided(grid.static(), middles) & ever
        false.append(float((s & ~truth.static).sum() / max(int(s.sum()), 1)))
    return Run(static, dynamic, old, np.array(false))


def _middles(shape: tuple[int, int], origin: tuple[float, float], resolution: float) -> Array:
    """World coordinates (rows, columns, 2) of the cells' middles."""
    x = origin[0] + (np.arange(shape[1]) + 0.5) * resolution
    y = origin[1] + (np.arange(shape[0]) + 0.5) * resolution
    return np.stack(np.meshgrid(x, y), axis=-1)


def _decided(grid: LogOddsGrid, middles: Array) -> BoolArray:
    decided: BoolArray = grid.at(middles.reshape(-1, 2)).reshape(middles.shape[:2]) > DECIDED_LOG_ODDS
    return decided


def since(study: Study[Run]) -> Array:
    """Seconds (n,) since the chair was put down, of every scan."""
    config = study.config
    scans = config.world.robot.scan_period * np.arange(study.data.static.shape[-1])
    return np.asarray(scans - config.put_down)


def series(study: Study[Run]) -> dict[str, Array]:
    """Means over the runs, over time."""
    names = ("static", "dynamic", "old_place")
    return {"since_put_down": since(study)} | {n: _mean(getattr(study.data, n)) for n in names}


def _mean(values: Array) -> Array:
    """Mean (2, n) over runs (runs, 2, n) in which the chair is seen; NaN where it is in none."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=0)
    mean: Array = np.where(known.any(axis=0), total / np.maximum(known.sum(axis=0), 1), np.nan)
    return mean


def shares(study: Study[Run], name: str, variant: str, after: float, until: float = np.inf) -> Array:
    """Mean share (runs,) of a variant over the scans between two times since the chair was put down."""
    within = (since(study) >= after) & (since(study) <= until)
    part = getattr(study.data, name)[:, VARIANTS.index(variant)][:, within]
    known = np.isfinite(part)
    sums = np.where(known, part, 0.0).sum(axis=1)
    return np.where(known.any(axis=1), sums / np.maximum(known.sum(axis=1), 1), np.nan)


def claims(study: Study[Run]) -> list[Claim]:
    """Judge both variants."""
    return [_for_ever(study), _settles(study), _leaves(study), _walkers(study)]


def _judge(
    id: str, text: str, rule: str, holds: BoolArray, found: str, measured: dict[str, float], source: str
) -> Claim:
    """A claim that must hold in every run; NaN compares as false, so a chair that nobody saw fails it."""
    found = f"{found}; it holds in {int(holds.sum())} of {len(holds)} runs"
    return judged(
        id, source, text, rule, bool(holds.all()), found, measured,
        share=float(holds.mean()),
    )  # fmt: skip


def _for_ever(study: Study[Run]) -> Claim:
    last = study.config.watch - SLACK
    d, s = (shares(study, name, "printed", last) for name in ("dynamic", "static"))
    return _judge(
        "dynamic-for-ever",
        "Under the table, a chair put down on once-free floor is dynamic for ever",
        f"in every run, over the last {SLACK:g} s of the watch: share of its cells in D > 0.5 and in S < 0.5",
        (d > 0.5) & (s < 0.5),
        f"When the chair has stood for {last:g} s, D holds {d.mean():.0%} of its cells and S {s.mean():.0%}",
        {"dynamic": float(d.mean()), "static": float(s.mean())},
        "A§4.2-4.3, errata",
    )


def _settles(study: Study[Run]) -> Claim:
    settle = study.config.settle
    d, s = (shares(study, name, "ageing", settle + SLACK) for name in ("dynamic", "static"))
    before = shares(study, "dynamic", "ageing", 1.0, settle - 1.0)
    return _judge(
        "ageing-mends-it",
        "With ageing it is dynamic at first, and static once it has stood there for T seconds",
        f"in every run: share in D > 0.5 until 1 s before T; after T + {SLACK:g} s in S > 0.5 and in D < 0.5",
        (before > 0.5) & (s > 0.5) & (d < 0.5),
        f"With ageing D holds {before.mean():.0%} of the chair's cells in the first {settle:g} s; after "
        "that S holds "
        f"{s.mean():.0%} and D {d.mean():.0%}",
        {"dynamic_before": float(before.mean()), "dynamic": float(d.mean()), "static": float(s.mean())},
        "ageing variant",
    )


def _leaves(study: Study[Run]) -> Claim:
    """The other half of the move."""
    away = study.config.put_down - study.config.lift
    old = np.stack([shares(study, "old_place", v, SLACK - away + 1.0) for v in VARIANTS])
    return _judge(
        "leaves-its-old-place",
        "S lets go of the place from which the chair was taken, under both",
        f"in every run and both variants: share still static < 0.05 from {SLACK + 1:g} s after it was lifted",
        np.array((old < 0.05).all(axis=0), dtype=np.bool_),
        f"From {SLACK + 1:g} s after the chair was lifted S holds {old[0].mean():.1%} of its old place "
        "under the "
        f"table and {old[1].mean():.1%} with ageing; 5 % are allowed",
        {v: float(o.mean()) for v, o in zip(VARIANTS, old, strict=True)},
        "A§4.2",
    )


def _walkers(study: Study[Run]) -> Claim:
    """The price of ageing."""
    printed, ageing = study.data.false.T
    return _judge(
        "ageing-takes-in-no-walkers",
        "Ageing puts no more moving things into S than the table does",
        "in every run: share of S that nothing static covers is at most 0.02 larger than without ageing",
        np.array(ageing - printed <= 0.02, ndmin=1),
        f"Of S {printed.mean():.1%} are covered by nothing static under the table and {ageing.mean():.1%} "
        "with "
        "ageing; 2 points more are allowed",
        {"printed": float(printed.mean()), "ageing": float(ageing.mean())},
        "ageing variant",
    )


def figure(study: Study[Run]) -> Figure:
    """Shares of the chair in S and in D over time."""
    from vslam_ref.plot.grids import chair_figure

    static, dynamic = _mean(study.data.static), _mean(study.data.dynamic)
    return chair_figure(since(study), static, dynamic, VARIANTS, study.config.settle)


EXPERIMENT = Experiment(
    id="grids-moved-chair",
    title="A chair that is moved, with and without ageing",
    source="A, sections 4.2 and 4.3",
    config_type=ChairConfig,
    simulate=simulate,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "static": "share of the chair's cells, of those hit now, that S holds; (runs, printed/ageing, scans)",
        "dynamic": "share of the same cells that D holds; (runs, printed/ageing, scans)",
        "old_place": "share of the chair's first place, crossed now, still in S; (runs, variant, scans)",
        "false": "share of S at the end that no static thing covers; (runs, printed/ageing)",
    },
    quick={"runs": 2, "watch": 18.0, "settle": 6.0},
)
