"""Figure 2.2: the flow of PTAM, drawn from what the code did.

PTAM runs over the rendered desk, and tells of every picture which stages had a part in it.  The figure shows
the stages of the two pipelines in their order, in how many pictures each took part, and how long it took.
The claims compare with the figure of A: which stages every picture passes, and which only a keyframe.

Implements A fig 2.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam import STAGES
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.worlds.rendered import Effects, scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A, fig 2.2"
TRACKER = ("prepare", "guess", "coarse", "fine", "pose", "recover")
MAPPER = ("look again", "new points", "neighbours", "local", "global")
"""Stages of the two pipelines, in their order; "recover" only where the first passes fail."""
ALWAYS = ("prepare", "coarse", "fine", "pose")
"""Stages that every picture passes that is not lost."""


@dataclass(frozen=True)
class Fig22Config:
    """The pictures."""

    seed: int = assume(22, "", "of the desk; any")
    pictures: int = assume(200, "pictures", "7 s: some twenty keyframes")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse runs that cannot start."""
        if self.pictures < 30:
            raise ValueError(f"pictures={self.pictures}: need at least 30")


class FlowRun(NamedTuple):
    """What happened to the pictures after the start.

    Attributes
    ----------
    took_part : ndarray of bool, shape (n, stages)
        Whether a stage of ``STAGES`` had a part in a picture.
    keyframe, lost : ndarray of bool, shape (n,)
    ms : ndarray, shape (stages,)
        Median CPU milliseconds of a stage where it had a part; this machine's.
    """

    took_part: BoolArray
    keyframe: BoolArray
    lost: BoolArray
    ms: Array


def follow(config: Fig22Config) -> FlowRun:
    """Run over the desk, and note the stages."""
    made = scene("desk", config.seed, frames=config.pictures, effects=Effects(noise=config.noise))
    system = Ptam(made.camera, Settings())
    seconds, keyframe, lost = [], [], []
    for k in range(config.pictures):
        outcome = system.step(k, made.frame(k))
        if outcome.tracked is not None:
            seconds.append([outcome.stages.get(name, np.nan) for name in STAGES])
            keyframe.append(outcome.mapped is not None)
            lost.append(outcome.tracked.quality is Quality.LOST)
    table = np.array(seconds, np.float64).reshape(-1, len(STAGES))
    part = np.isfinite(table)
    ms = np.array(
        [1e3 * np.median(c[p]) if p.any() else np.nan for c, p in zip(table.T, part.T, strict=True)]
    )
    return FlowRun(part, np.array(keyframe, bool), np.array(lost, bool), ms)


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[FlowRun]) -> list[Claim]:
    """Judge the arrows of A's figure."""
    run = study.once
    return [
        _every("tracking-of-every-picture", "A§2.2.1",
               "Every picture is tracked, first with few points, then with many",
               run, ALWAYS, ~run.lost, "pictures that are not lost"),
        _only_keyframes(run),
        _every("local-adjustment-of-every-keyframe", "A§2.2.2.2",
               "A keyframe adds new points, and its neighbourhood is adjusted",
               run, ("new points", "local"), run.keyframe, "keyframes"),
        _global(run),
    ]  # fmt: skip


def _part(run: FlowRun, name: str) -> BoolArray:
    return np.asarray(run.took_part[:, STAGES.index(name)])


def _every(
    id: str, source: str, text: str, run: FlowRun, stages: tuple[str, ...], rows: BoolArray, what: str
) -> Claim:
    share = [float(_part(run, name)[rows].mean()) if rows.any() else 0.0 for name in stages]
    return judged(
        id,
        source,
        text,
        f"each of the stages {', '.join(stages)} takes part in all {what}, and there are some",
        bool(rows.any()) and min(share) == 1.0,
        f"In {int(rows.sum())} {what} the stages {', '.join(stages)} took part in "
        f"{', '.join(f'{s:.0%}' for s in share)}",
        dict(zip(stages, share, strict=True)),
    )


def _only_keyframes(run: FlowRun) -> Claim:
    mapping = np.any([_part(run, name) for name in MAPPER], axis=0)
    stray = int((mapping & ~run.keyframe).sum())
    return judged(
        "mapping-of-keyframes-alone",
        "A§2.2.2",
        "The mapping pipeline works on keyframes alone",
        "no stage of the mapper takes part in a picture that is no keyframe, and one does in every keyframe",
        stray == 0 and bool(run.keyframe.any()) and bool(mapping[run.keyframe].all()),
        f"Of {len(run.keyframe)} pictures {int(run.keyframe.sum())} became keyframes; the mapper worked on "
        f"{int(mapping.sum())} pictures, {stray} of them no keyframes",
        {"keyframes": int(run.keyframe.sum()), "pictures": len(run.keyframe), "stray": stray},
    )


def _global(run: FlowRun) -> Claim:
    both = _part(run, "global")
    count, keyframes = int(both.sum()), int(run.keyframe.sum())
    often = "once" if count == 1 else f"{count} times"
    few = keyframes < Settings().mapper.global_every
    return judged(
        "adjustment-of-all-keyframes",
        "A§2.2.2.2, eq. 2.9",
        "All keyframes are adjusted together, too",
        "the stage that adjusts all keyframes takes part in at least one picture, in keyframes only",
        None if few else count > 0 and not bool((both & ~run.keyframe).any()),
        f"With {keyframes} new keyframes, all were adjusted together {often}"
        + (", too few keyframes to tell" if few else ""),
        {"times": count, "keyframes": keyframes},
    )


def series(study: Study[FlowRun]) -> dict[str, object]:
    """Of every stage: in how many pictures it had a part, and its median time."""
    run = study.once
    return {"pictures": len(run.keyframe), "keyframes": int(run.keyframe.sum())} | {
        name: {"pictures": int(_part(run, name).sum()), "ms": float(run.ms[i])}
        for i, name in enumerate(STAGES)
    }


def figure(study: Study[FlowRun]) -> Figure:
    """The two pipelines as boxes."""
    from vslam_ref.plot.flow import FlowBox, flow_figure

    run = study.once

    def boxes(names: tuple[str, ...]) -> list[FlowBox]:
        return [
            FlowBox(name, int(_part(run, name).sum()), float(run.ms[STAGES.index(name)])) for name in names
        ]

    return flow_figure(boxes(TRACKER), boxes(MAPPER), len(run.keyframe), int(run.keyframe.sum()))


EXPERIMENT = Experiment(
    id="ptam-fig2.2",
    title="The flow of PTAM, from the code's own stages",
    source="A, figure 2.2",
    config_type=Fig22Config,
    simulate=None,
    once=follow,
    series=series,
    claims=claims,
    figure=figure,
    arrays=lambda study: study.once._asdict(),
    sample=lambda study: None,
    about={
        "took_part": "whether a stage had a part in a picture; (pictures, stages)",
        "keyframe": "whether it became a keyframe; (pictures,)",
        "lost": "whether it was lost; (pictures,)",
        "ms": "median CPU ms of a stage, this machine's; (stages,)",
    },
    quick={"pictures": 60},
)
