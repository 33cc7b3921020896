"""A§4.3 says two things twice: D with memory or without, high where S is free or where it is undetermined.

The four readings draw the same recordings of an office with people; S is the same for all of them, since it
does not look at D.  D is compared with what moves, cell by cell and scan by scan, as in ``grids-separation``.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.framework.statistics import interval_of_means, null_rate
from vslam_ref.experiments.grids.counting import CellCounts, SeparationConfig, measure, precision_recall
from vslam_ref.grids.inverse_sensor import Where
from vslam_ref.grids.map_config import Memory
from vslam_ref.worlds import floor_plan
from vslam_ref.worlds.floor_plan import CrowdConfig, FloorPlanConfig, LaserConfig

if TYPE_CHECKING:
    from matplotlib.figure import Figure


READINGS: tuple[tuple[Memory, Where], ...] = (
    ("text", "free"),
    ("formula", "free"),
    ("text", "unknown"),
    ("formula", "unknown"),
)
"""(d_memory, d_high_where), the best first."""


@dataclass(frozen=True)
class ReadingsConfig:
    """The runs."""

    runs: int = field(default=6, metadata={"reason": "shares differ by a point or two between runs"})
    seed: int = field(default=43, metadata={"reason": "any; fixed for repeatability"})
    count: SeparationConfig = field(
        default_factory=lambda: SeparationConfig(
            world=FloorPlanConfig(crowd=CrowdConfig(density=0.1), laser=LaserConfig(beams=541), duration=40.0)
        ),
        metadata={"reason": "counted as in grids-separation; half its crowd, so that floor is seen"},
    )

    def __post_init__(self) -> None:
        """Refuse studies that mean nothing."""
        if self.runs < 2:
            raise ValueError(f"runs={self.runs}: need at least 2")


def simulate(config: ReadingsConfig, point: None, seed: np.random.SeedSequence) -> CellCounts:
    """One recording, drawn by all four readings: ``static`` (4, 4) of S, ``moving`` (4, 4) of D."""
    count = config.count
    recording = floor_plan.simulate(count.world, np.random.default_rng(seed))
    runs = []
    for memory, where in READINGS:
        changed = dataclasses.replace(count.map, d_memory=memory, d_high_where=where)
        runs.append(measure(recording, dataclasses.replace(count, map=changed)))
    return CellCounts(
        np.stack([r.static[0] for r in runs]), np.stack([r.moving for r in runs]), runs[0].on_people
    )


def series(study: Study[CellCounts]) -> dict[str, object]:
    """Means over the runs, by reading."""
    return {
        "readings": [f"{memory}-{where}" for memory, where in READINGS],
        "precision_recall": precision_recall(study.data.moving).mean(axis=0),
        "f1": f1(study.data.moving).mean(axis=0),
    }


def f1(moving: Array) -> Array:
    """Harmonic mean of precision and recall of D, (runs, 4)."""
    both = precision_recall(moving)
    total = both.sum(axis=-1)
    return np.where(total > 0, 2 * both.prod(axis=-1) / np.maximum(total, 1e-300), 0.0)


def claims(study: Study[CellCounts]) -> list[Claim]:
    """Judge what A says of D, and what the readings have in common."""
    values, recall = f1(study.data.moving), precision_recall(study.data.moving)[..., 1]
    return [
        _undetermined(recall[:, _column("text", "unknown")], study.rng(1)),
        _free(values, study),
        _no_memory(values, study.rng(4)),
        _late(recall, study.rng(5)),
        _same_s(study.data.static),
    ]


def _column(memory: Memory, where: Where) -> int:
    return READINGS.index((memory, where))


def _undetermined(recall: Array, rng: np.random.Generator) -> Claim:
    """The sentence at the end of A§4.3, as it is printed."""
    return judged(
        "high-where-undetermined",
        "A§4.3",
        "D is high where something moves if it is high only where S_{t-1} is undetermined",
        "recall of moving cells, mean over runs >= 0.5 (ci: of this mean, over whole runs)",
        recall.mean() >= 0.5,
        f"Read so, D finds {recall.mean():.0%} of the cells that move; at least half are asked for",
        {"recall": float(recall.mean()), "least": float(recall.min()), "most": float(recall.max())},
        ci=interval_of_means(recall, rng),
        share=float(np.mean(recall >= 0.5)),
    )


def _free(values: Array, study: Study[CellCounts]) -> Claim:
    """What A must have meant."""
    pairs = [(_column(m, "free"), _column(m, "unknown")) for m in ("text", "formula")]
    gains = [values[:, better] - values[:, worse] for better, worse in pairs]
    lower = min((interval_of_means(g, study.rng(2 + k)) for k, g in enumerate(gains)), key=lambda i: i[0])
    means = {f"{m}-{w}": float(values[:, i].mean()) for i, (m, w) in enumerate(READINGS)}
    return judged(
        "high-where-free",
        "A§4.3, errata",
        "D is nearer to what moves if it is high where S_{t-1} is free, with memory and without",
        "F1 of free minus F1 of undetermined, same runs: both 95 % whole-run intervals > 0 "
        "(ci: the lower one's)",
        lower[0] > 0,
        f"D's F1 is {means['text-free']:.2f} where S is free against {means['text-unknown']:.2f} where it is "
        f"undetermined, and with memory {means['formula-free']:.2f} against "
        f"{means['formula-unknown']:.2f}; the "
        f"smaller gain lies {between(lower)} (95 %)",
        means,
        ci=lower,
        null_rate=null_rate(len(values)),
        share=float(np.mean([np.mean(gain > 0) for gain in gains])),
    )


def _no_memory(values: Array, rng: np.random.Generator) -> Claim:
    """A's sentence against A's formula."""
    text, formula = values[:, _column("text", "free")], values[:, _column("formula", "free")]
    interval = interval_of_means(text - formula, rng)
    return judged(
        "d-needs-no-memory",
        "A§4.3",
        "D is nearer to what moves without D_{t-1}, as the text says, than with it, as the formula says",
        "F1 of text minus F1 of formula, both high where free, same runs: 95 % whole-run interval > 0",
        interval[0] > 0,
        f"D's F1 is {text.mean():.3f} without memory and {formula.mean():.3f} with it; the gain lies "
        f"{between(interval)} (95 %)",
        {"text": float(text.mean()), "formula": float(formula.mean())},
        ci=interval,
        null_rate=null_rate(len(text)),
        share=float(np.mean(text > formula)),
    )


def _late(recall: Array, rng: np.random.Generator) -> Claim:
    """Why: the memory of misses outweighs a hit."""
    text, formula = recall[:, _column("text", "free")], recall[:, _column("formula", "free")]
    interval = interval_of_means(text - formula, rng)
    return judged(
        "memory-is-late",
        "A§4.3, errata",
        "With D_{t-1} a cell that was seen free is decided at its second hit, and a walker has left by then",
        "recall of text minus recall of formula, same runs: 95 % whole-run interval > 0.1",
        interval[0] > 0.1,
        f"Without memory D finds {text.mean():.0%} of the cells that move, with it {formula.mean():.0%}; the "
        f"difference lies between {interval[0]:.0%} and {interval[1]:.0%} (95 %), and 10 % are asked for",
        {"text": float(text.mean()), "formula": float(formula.mean())},
        ci=interval,
        share=float(np.mean(text - formula > 0.1)),
    )


def _same_s(static: Array) -> Claim:
    """S does not look at D."""
    spread = np.ptp(static, axis=1).max(axis=-1)
    return judged(
        "s-is-the-same",
        "A§4.2",
        "All four readings draw the same static map",
        "counts of S are equal, in every run",
        not spread.any(),
        f"Counts of S differ by at most {spread.max():.0f} cells between the readings",
        {"largest_difference": float(spread.max())},
        share=float(np.mean(spread == 0)),
    )


def figure(study: Study[CellCounts]) -> Figure:
    """Precision and recall of D for the four readings."""
    from vslam_ref.plot.grids import readings_figure

    names = [f"D memory: {memory}, high where S {where}" for memory, where in READINGS]
    return readings_figure(names, precision_recall(study.data.moving))


EXPERIMENT = Experiment(
    id="grids-readings",
    title="The four readings of the dynamic grid",
    source="A, section 4.3",
    config_type=ReadingsConfig,
    simulate=simulate,
    series=series,
    arrays=lambda study: {"static": study.data.static, "moving": study.data.moving},
    claims=claims,
    figure=figure,
    about={
        "static": "cells of S: decided and right, decided, asked for, asked for and decided; "
        "(runs, reading, count)",
        "moving": "the same counts for D; (runs, reading, count)",
    },
    quick={"runs": 2, "count.world.duration": 12.0},
)
