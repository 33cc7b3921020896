"""Where a pose graph is begun, and where it ends: odometry and chordal start under growing noise.

A robot goes round a block on a ramp; all noises grow together, from those of a good sensor to turns that are
off by half a radian in two steps.  Each graph is solved from its odometry, from the chordal start and from
the true poses.  The lowest chi² of the three is the *best known* minimum: nobody proves that it is the lowest
of all.  Thresholds were fixed on a pilot of twenty graphs with other seeds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.posegraph import chordal_start, odometry_start, solve_graph
from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.framework.statistics import interval_of_means
from vslam_ref.worlds.rounds import make_rounds

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STARTS = ("odometry", "chordal", "truth")
SAME = 1e-6
"""Relative difference of chi² up to which minima are the same."""
SOURCE = "chapter 13"


@dataclass(frozen=True)
class StartsConfig:
    """Graphs, and their noise."""

    runs: int = field(default=100, metadata={"reason": "graphs at each noise; shares to 5 %", "unit": ""})
    seed: int = field(default=13, metadata={"reason": "root of all randomness", "unit": ""})
    space: Literal["se2", "se3"] = field(
        default="se3", metadata={"reason": "where rotations are hard", "unit": ""}
    )
    noises: tuple[float, ...] = field(
        default=(1.0, 8.0, 16.0, 24.0, 32.0),
        metadata={"reason": "from a good sensor to 18 degrees a step", "unit": "0.05 m and 0.01 rad"},
    )
    rounds: int = field(default=3, metadata={"reason": "each place seen three times", "unit": ""})
    per_round: int = field(default=20, metadata={"reason": "60 poses: seconds for 500 graphs", "unit": ""})

    def __post_init__(self) -> None:
        """Refuse graphs that mean nothing."""
        if self.runs < 2 or self.rounds < 2 or self.per_round < 8:
            raise ValueError("need runs >= 2, rounds >= 2 and per_round >= 8")
        if len(self.noises) < 2 or min(self.noises) <= 0 or (np.diff(self.noises) <= 0).any():
            raise ValueError("need two or more noises above 0 that grow")


class StartRuns(NamedTuple):
    """One graph, or many; the last axis is ``STARTS``.

    Attributes
    ----------
    begun, ended : ndarray, shape (noises, runs, 3)
        chi² at the start and where it ended.
    steps : ndarray, shape (noises, runs, 3)
        Steps tried.
    """

    begun: Array
    ended: Array
    steps: Array


Runs = Study[StartRuns]


def simulate(config: StartsConfig, noise: float, seed: np.random.SeedSequence) -> StartRuns:
    """One graph, solved from three starts."""
    made = make_rounds(
        config.space,
        np.random.default_rng(seed),
        rounds=config.rounds,
        per_round=config.per_round,
        noise=noise,
    )
    graph = made.graph
    found = [solve_graph(graph.at(T)) for T in (odometry_start(graph), chordal_start(graph), made.true)]
    return StartRuns(
        np.array([one.initial_chi2 for one in found]),
        np.array([one.chi2 for one in found]),
        np.array([float(len(one.history)) for one in found]),
    )


def best(data: StartRuns) -> BoolArray:
    """Which ended in the best known minimum, (noises, runs, 3)."""
    least = data.ended.min(axis=-1, keepdims=True)
    found: BoolArray = data.ended <= least * (1.0 + SAME)
    return found


def claims(study: Runs) -> list[Claim]:
    """Judge where the start matters."""
    return [_any(study), _nearer(study), _more(study), _always(study)]


def _any(study: Runs) -> Claim:
    there = best(study.data)[0, :, :2]
    noise, good = study.config.noises[0], np.logical_and(there[:, 0], there[:, 1])
    return judged(
        "with-little-noise-any-start-will-do",
        SOURCE,
        "With the noise of a good sensor, odometry and chordal start end in the same minimum",
        f"at the least noise, in every graph: chi² within {SAME:g} of the best known from both starts",
        bool(good.all()),
        f"At {noise:g} times the noise of a good sensor both starts end in the best known minimum in "
        f"{int(good.sum())} of {len(good)} graphs",
        {"shares": there.mean(axis=0).tolist()},
        share=float(good.mean()),
    )


def _nearer(study: Runs) -> Claim:
    begun = study.data.begun
    lower = begun[..., 1] < begun[..., 0]
    ratio = float(np.median(begun[..., 1] / begun[..., 0]))
    return judged(
        "chordal-begins-lower",
        SOURCE,
        "The chordal start, which hears the loops, begins at a lower chi² than the odometry",
        "in every graph of every noise",
        bool(lower.all()),
        f"The chordal start begins lower in {int(lower.sum())} of {lower.size} graphs, with a chi² of "
        f"{ratio:.2g} of that of the odometry in the median",
        {"median_ratio": ratio},
        share=float(lower.mean()),
    )


def _more(study: Runs) -> Claim:
    there = best(study.data)[-1].astype(np.float64)
    gain = there[:, 1] - there[:, 0]
    interval = interval_of_means(gain, study.rng(1))
    return judged(
        "chordal-bears-more-noise",
        SOURCE,
        "Under heavy noise the chordal start ends in the best known minimum more often than the odometry",
        "at the largest noise: share of the chordal start less that of the odometry, 95 % interval over "
        "graphs above 0",
        interval[0] > 0.0,
        f"At {study.config.noises[-1]:g} times the noise the chordal start ends in the best known minimum in "
        f"{there[:, 1].mean():.2f} of the graphs, the odometry in {there[:, 0].mean():.2f}; the difference "
        f"lies, with 95 %, {between(interval)}",
        {"chordal": float(there[:, 1].mean()), "odometry": float(there[:, 0].mean())},
        ci=interval,
        null_rate=0.025,
    )


def _always(study: Runs) -> Claim:
    there = best(study.data)[..., 1]
    shares = there.mean(axis=1)
    whole = [n for n, share in zip(study.config.noises, shares, strict=True) if share == 1.0]
    upto = f"it does in every graph up to {max(whole):g} times the noise" if whole else "it never does in all"
    return judged(
        "chordal-always-ends-at-the-best",
        SOURCE,
        "The chordal start ends in the best known minimum, whatever the noise",
        "in every graph of every noise",
        bool(there.all()),
        f"The chordal start ends there in {int(there.sum())} of {there.size} graphs; {upto}",
        {"shares": shares.tolist()},
        share=float(there.mean()),
    )


def series(study: Runs) -> dict[str, object]:
    """Shares, steps and starts, by noise."""
    return {
        "noises": list(study.config.noises),
        "starts": list(STARTS),
        "share_best": best(study.data).mean(axis=1),
        "median_begun": np.median(study.data.begun, axis=1),
        "mean_steps": study.data.steps.mean(axis=1),
    }


def figure(study: Runs) -> Figure:
    """Share of graphs that end in the best known minimum, and chi² at the start."""
    from vslam_ref.plot.posegraph_starts import starts_figure

    told = series(study)
    return starts_figure(
        np.array(study.config.noises),
        STARTS,
        np.asarray(told["share_best"]),
        np.asarray(told["median_begun"]),
        np.median(study.data.ended.min(axis=-1), axis=1),
    )


def points(config: StartsConfig) -> tuple[float, ...]:
    """Return the noises."""
    return config.noises


EXPERIMENT = Experiment(
    id="posegraph-starts",
    title="Where a pose graph is begun, and where it ends",
    source="chapter 13",
    config_type=StartsConfig,
    simulate=simulate,
    series=series,
    claims=claims,
    figure=figure,
    points=points,
    about={
        "begun": "chi² at the start, no unit; (noises, runs, odometry/chordal/truth)",
        "ended": "chi² at the end, no unit; (noises, runs, odometry/chordal/truth)",
        "steps": "steps tried, a count; (noises, runs, odometry/chordal/truth)",
    },
    quick={"runs": 12},
)
