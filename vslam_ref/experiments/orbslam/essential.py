"""How many edges does a closing need?  From the tree to the whole covisibility graph: cost against accuracy.

A says of the graph that is optimised that it makes ORB-SLAM as efficient as possible while it stays robust.
A drive through a simulated town, of the size of KITTI 00, is closed along graphs that grow: spanning tree and
loop edges alone, then more and more of the pairs with common points, at last all.  Every graph is solved
twice: with its true loops, and with a false one among them.  The edges are measured in the map itself, as
ORB-SLAM does; the information of each is the identity.

Robust is read in three ways (the error becomes smaller in every run; as small as with all edges; also with a
false loop), efficient in two (less work than all edges; nothing with less work is as good).  The rules were
fixed before the run; the margin of 10 % is a choice, about the least difference that anyone would mind.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.posegraph import Options, PoseGraph, solve_graph
from vslam_ref.estimation.posegraph.pattern import make_pattern
from vslam_ref.experiments.framework import Claim, Experiment, Study, between, judged
from vslam_ref.experiments.framework.statistics import interval_of_means, null_rate
from vslam_ref.geometry import se3, sim3
from vslam_ref.geometry.alignment import align
from vslam_ref.systems.orbslam.essential_graph import THETA_MIN, essential_edges
from vslam_ref.worlds.town import TownConfig, TownMap, make_town

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A, section 3.1"
TREE_ONLY = 1e6
"""Common points that no pair has."""
MARGIN = 1.1
"""Ratio of errors up to which two graphs are called equally accurate."""


@dataclass(frozen=True)
class EssentialConfig:
    """Drives, and the graphs along which they are closed."""

    runs: int = field(
        default=20, metadata={"reason": "drives; ratios of errors to some per cent", "unit": ""}
    )
    seed: int = field(default=14, metadata={"reason": "root of all randomness", "unit": ""})
    keyframes: int = field(default=1136, metadata={"reason": "as many as KITTI 00 gives", "unit": ""})
    corners: int = field(default=5, metadata={"reason": "of the town, each way: 360 m", "unit": ""})
    loops: int = field(default=40, metadata={"reason": "as many as KITTI 00 gives", "unit": ""})
    steps: int = field(
        default=20, metadata={"reason": "of a descent, at most: as ORB-SLAM takes", "unit": ""}
    )
    least_shared: tuple[float, ...] = field(
        default=(TREE_ONLY, 200.0, 100.0, 50.0, 15.0, 1.0),
        metadata={"reason": "tree alone, around ORB-SLAM's 100, covisibility from 15, all", "unit": "points"},
    )

    def __post_init__(self) -> None:
        """Refuse graphs that mean nothing."""
        if self.runs < 2 or len(self.least_shared) < 3:
            raise ValueError("need runs >= 2 and least_shared of three or more thresholds")
        if (np.diff(self.least_shared) >= 0).any() or THETA_MIN not in self.least_shared[1:-1]:
            raise ValueError(
                f"least_shared={self.least_shared}: must fall, with {THETA_MIN} between its ends"
            )
        self.town()

    def town(self) -> TownConfig:
        """Return the town."""
        return TownConfig(keyframes=self.keyframes, corners=self.corners, loops=self.loops)

    @property
    def essential(self) -> int:
        """Place of ORB-SLAM's threshold among the graphs."""
        return self.least_shared.index(THETA_MIN)


class EssentialRun(NamedTuple):
    """One drive closed along one graph, or many: (graphs, runs).

    Attributes
    ----------
    before, after, misled : ndarray
        ATE, metres, after alignment with scale: as mapped, closed, and closed with a false loop.
    edges, steps : ndarray
        Of the graph, loops apart; steps tried.
    work : ndarray
        Multiplications of all steps: factors, and the sums of the blocks.
    seconds : ndarray
        CPU time of the descent, this machine's.
    """

    before: Array
    after: Array
    misled: Array
    edges: Array
    steps: Array
    work: Array
    seconds: Array


Runs = Study[EssentialRun]


def simulate(config: EssentialConfig, least_shared: float, seed: np.random.SeedSequence) -> EssentialRun:
    """One drive, closed along one graph; the same drives for every graph."""
    rng = np.random.default_rng(seed)
    town = make_town(rng, config.town())
    false = false_loop(town, rng)
    graph, options = graph_of(town, least_shared), Options(max_iterations=config.steps)
    began = time.thread_time()
    found = solve_graph(graph, options=options)
    seconds = time.thread_time() - began
    misled = solve_graph(graph_of(town, least_shared, false), options=options)
    steps = len(found.history)
    values = [
        error(town, graph.T_world),
        error(town, found.graph.T_world),
        error(town, misled.graph.T_world),
        len(graph.tail) - len(town.loops),
        steps,
        steps * products(graph),
        seconds,
    ]
    return EssentialRun(*(np.array(float(value)) for value in values))


def graph_of(town: TownMap, least_shared: float, false: tuple[IntArray, Array] | None = None) -> PoseGraph:
    """Pose graph of a map over its essential edges, with its loops and perhaps a ``false`` one."""
    edges = essential_edges(town.shared, town.parent, theta_min=least_shared)
    X = se3.inverse(town.T_kf_world)
    loops, S = town.loops, town.S_loop
    if false is not None:
        loops, S = np.concatenate([loops, false[0][None]]), np.concatenate([S, false[1][None]])
    measured = np.concatenate([sim3.between(X[edges.tail], X[edges.head]), S])
    tail, head = (np.concatenate([ends, loops[:, k]]) for k, ends in enumerate((edges.tail, edges.head)))
    return PoseGraph("sim3", X, tail, head, measured, np.broadcast_to(np.eye(7), (len(measured), 7, 7)))


def false_loop(town: TownMap, rng: np.random.Generator) -> tuple[IntArray, Array]:
    """Two places of the drive that only look alike: what a true loop measured, between any two keyframes."""
    ends = np.sort(rng.choice(len(town.true), 2, replace=False))
    if not len(town.loops):
        raise ValueError("the drive comes back to no place: need more keyframes, or fewer corners")
    return ends.astype(np.int64), town.S_loop[int(rng.integers(len(town.S_loop)))]


def error(town: TownMap, T_world_kf: Array) -> float:
    """ATE of keyframes, metres, after alignment with scale."""
    true = se3.inverse(town.true)[:, :3, 3]
    return align(T_world_kf[:, :3, 3], true, with_scale=True).rmse


def products(graph: PoseGraph) -> float:
    """Multiplications of one step: of the factor, block by block, and of the four blocks of every edge."""
    d = graph.information.shape[-1]
    pattern = make_pattern(graph.sizes[0], graph.tail, graph.head, graph.fixed, d)
    return float(d**3 * (pattern.ordering.products + 4 * len(graph.tail)))


def claims(study: Runs) -> list[Claim]:
    """Judge whether the essential graph is robust, and as efficient as possible."""
    essential, whole = "The essential graph", "as the whole covisibility graph"
    return [
        _closes(study),
        _no_worse(
            study, study.data.after, 1, "as-accurate-as-all-edges",
            f"{essential} is as accurate {whole}", "With the true loops",
        ),
        _no_worse(
            study, study.data.misled, 2, "bears-a-false-loop-as-well",
            f"{essential} bears a false loop as well {whole}", "With a false loop among the true ones",
        ),
        _cheaper(study),
        _nothing_cheaper(study),
    ]  # fmt: skip


def _closes(study: Runs) -> Claim:
    k, data = study.config.essential, study.data
    ratio = data.after[k] / data.before[k]
    return judged(
        "closes-the-loops",
        SOURCE,
        "Closed along the essential graph, a map has far less error than before",
        "in every drive at most half the ATE of before",
        bool((ratio <= 0.5).all()),
        f"The ATE falls from {np.median(data.before[k]):.2f} m to {np.median(data.after[k]):.2f} m in the "
        f"median, to {ratio.max():.2f} of itself in the worst of {len(ratio)} drives",
        {"before": float(np.median(data.before[k])), "after": float(np.median(data.after[k]))},
        share=float((ratio <= 0.5).mean()),
    )


def _no_worse(study: Runs, ate: Array, draw: int, id: str, text: str, words: str) -> Claim:
    """Whether the essential graph's errors are at most ``MARGIN`` times those with all edges."""
    k = study.config.essential
    gain = np.log(ate[k] / ate[-1])
    ends = np.exp(interval_of_means(gain, study.rng(draw)))
    return judged(
        id,
        SOURCE,
        text,
        "mean ratio of both ATE (of logarithms, over drives): upper end of its 95 % interval below "
        f"{MARGIN:g}",
        bool(ends[1] < MARGIN),
        f"{words}, its ATE is {np.exp(gain.mean()):.2f} times that with all edges; the ratio lies, with "
        f"95 %, {between(list(ends))} (medians {np.median(ate[k]):.2f} m and {np.median(ate[-1]):.2f} m, "
        f"{np.median(study.data.before[k]):.2f} m before)",
        {"essential": float(np.median(ate[k])), "all": float(np.median(ate[-1]))},
        ci=list(ends),
        null_rate=null_rate(len(gain)),
    )


def _cheaper(study: Runs) -> Claim:
    k, data = study.config.essential, study.data
    ratio, seconds = data.work[-1] / data.work[k], data.seconds[-1] / data.seconds[k]
    return judged(
        "cheaper-than-all-edges",
        SOURCE,
        "Closing along the essential graph takes less work than along the whole covisibility graph",
        "in every drive fewer multiplications",
        bool((ratio > 1.0).all()),
        f"All edges take {np.median(ratio):.1f} times the multiplications of the essential graph in the "
        f"median, {ratio.min():.1f} times at least ({np.median(seconds):.1f} times the CPU time here)",
        {"ratio": float(np.median(ratio)), "edges": float(np.median(data.edges[k]))},
        share=float((ratio > 1.0).mean()),
    )


def _nothing_cheaper(study: Runs) -> Claim:
    k, data = study.config.essential, study.data
    loss = np.log(data.after[0] / data.after[k])
    ends = np.exp(interval_of_means(loss, study.rng(3)))
    work = float(np.median(data.work[0] / data.work[k]))
    return judged(
        "nothing-cheaper-is-as-accurate",
        SOURCE,
        "No graph that takes less work is as accurate: the essential graph is as efficient as possible",
        "mean ratio of the ATE with tree and loop edges alone to that of the essential graph (of logarithms, "
        f"over drives): lower end of its 95 % interval above {MARGIN:g}",
        bool(ends[0] > MARGIN),
        f"Tree and loop edges alone take {work:.2f} times the multiplications, and their ATE is "
        f"{np.exp(loss.mean()):.2f} times that of the essential graph; the ratio lies, with 95 %, "
        f"{between(list(ends))}",
        {"tree": float(np.median(data.after[0])), "essential": float(np.median(data.after[k])), "work": work},
        ci=list(ends),
        null_rate=null_rate(len(loss)),
    )


def series(study: Runs) -> dict[str, object]:
    """Medians of each graph."""
    data = study.data
    told = {name: np.median(getattr(data, name), axis=1) for name in EssentialRun._fields}
    return {"least_shared": list(study.config.least_shared), **told}


def figure(study: Runs) -> Figure:
    """Error and work over the edges."""
    from vslam_ref.plot.orbslam_essential import essential_figure

    data = study.data
    return essential_figure(
        study.config.least_shared, data.edges, data.after, data.misled, data.before, data.work / data.work[0]
    )


def points(config: EssentialConfig) -> tuple[float, ...]:
    """Return the thresholds."""
    return config.least_shared


EXPERIMENT = Experiment(
    id="orbslam-essential",
    title="How many edges a closing needs: from the tree to all common points",
    source="A, section 3.1",
    config_type=EssentialConfig,
    simulate=simulate,
    series=series,
    claims=claims,
    figure=figure,
    points=points,
    about={
        "before": "ATE as mapped, metres; (graphs, runs)",
        "after": "ATE after the closing, metres; (graphs, runs)",
        "misled": "ATE after the closing with a false loop, metres; (graphs, runs)",
        "edges": "edges of the graph without the loops, a count; (graphs, runs)",
        "steps": "steps tried, a count; (graphs, runs)",
        "work": "multiplications of all steps, a count; (graphs, runs)",
        "seconds": "CPU seconds of the descent, this machine's; (graphs, runs)",
    },
    quick={"runs": 6, "keyframes": 200, "corners": 2, "loops": 10, "least_shared": (TREE_ONLY, 100.0, 1.0)},
)
