"""Figure 3.1: the flow of ORB-SLAM, drawn from what the code called.

ORB-SLAM runs over a rendered scene while every call of a function with a box is noted, in its order
(:mod:`.calls`).  The figure shows the three processes of A with their boxes, and in how many pictures each
was called.  The claims compare with the text: what every picture passes, what only a keyframe, in which
order; and a stopwatch in the code itself, which knows nothing of the boxes, must have seen the same.

A has three processes side by side.  Here one calls the next on one thread, so that a run can be repeated to
the byte: the boxes and their order are compared, not what runs at the same time.

Implements A fig 3.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import BoolArray, IntArray
from vslam_ref.datasets.vocabulary_files import shipped_vocabulary
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.orbslam.calls import PROCESSES, STAGES, noted
from vslam_ref.support.config import assume
from vslam_ref.support.stopwatch import REST
from vslam_ref.systems.orbslam import OrbSlam, Settings
from vslam_ref.systems.visual_map.telling import Quality
from vslam_ref.worlds.rendered import Effects, scene
from vslam_ref.worlds.rendered.scenes import NAMES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A, fig 3.1"
ALWAYS = ("ORB\nfeatures", "points in\nwindows", "pose", "local map", "keyframe?")
"""Boxes of the tracker that every picture passes that is not lost."""
NOT_CALLED = -1


@dataclass(frozen=True)
class Fig31Config:
    """The pictures."""

    scene: str = assume("desk", "", "the pictures of fig2.2 beside it; building for a loop that closes")
    seed: int = assume(22, "", "of the scene; any")
    pictures: int = assume(200, "pictures", "7 s: some forty keyframes")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse runs that cannot start."""
        if self.pictures < 30 or self.scene not in NAMES:
            given = f"scene={self.scene}, pictures={self.pictures}"
            raise ValueError(f"{given}: need one of {', '.join(NAMES)}, and at least 30 pictures")


class CalledRun(NamedTuple):
    """What was called for the pictures after the start.

    Attributes
    ----------
    place : ndarray of int, shape (n, boxes)
        Place of the first call of a box's function among all calls of its picture; -1: not called.
    keyframe, lost : ndarray of bool, shape (n,)
    watched : ndarray of bool, shape (n, boxes)
        Whether the code's own stopwatch saw the box's stage.
    unknown : ndarray of str, shape (u,)
        Stages that the stopwatch saw, and no box has.
    """

    place: IntArray
    keyframe: BoolArray
    lost: BoolArray
    watched: BoolArray
    unknown: NDArray[np.str_]


def follow(config: Fig31Config) -> CalledRun:
    """Run over the scene, and note the calls."""
    made = scene(config.scene, config.seed, frames=config.pictures, effects=Effects(noise=config.noise))
    system = OrbSlam(made.camera, Settings(), None, shipped_vocabulary())
    place, keyframe, lost, watched = [], [], [], []
    unknown: set[str] = set()
    known = {stage.stage for stage in STAGES}
    for k in range(config.pictures):
        grey = made.frame(k)
        calls: list[int] = []
        with noted(STAGES, calls):
            outcome = system.step(k, grey)
        if outcome.tracked is None:
            continue
        first = {box: calls.index(box) for box in set(calls)}
        place.append([first.get(box, NOT_CALLED) for box in range(len(STAGES))])
        keyframe.append(outcome.mapped is not None)
        lost.append(outcome.tracked.quality is Quality.LOST)
        watched.append([stage.stage in outcome.stages for stage in STAGES])
        unknown |= set(outcome.stages) - known
    shape = (-1, len(STAGES))
    return CalledRun(
        np.array(place, np.int64).reshape(shape),
        np.array(keyframe, bool),
        np.array(lost, bool),
        np.array(watched, bool).reshape(shape),
        np.array(sorted(unknown), "<U20"),
    )


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[CalledRun]) -> list[Claim]:
    """Judge the boxes of A's figure, and their order."""
    run = study.once
    return [_tracking(run), _mapping(run), _closing(run), _drawn_is_called(run)]


def _columns(process: str) -> list[int]:
    return [k for k, stage in enumerate(STAGES) if stage.process == process]


def _tracking(run: CalledRun) -> Claim:
    columns = [k for k, stage in enumerate(STAGES) if stage.name in ALWAYS]
    rows = ~run.lost
    share = (run.place[rows][:, columns] != NOT_CALLED).mean(0) if rows.any() else np.zeros(len(columns))
    names = [STAGES[k].name.replace("\n", " ") for k in columns]
    return judged(
        "tracking-of-every-picture",
        "A§3.1",
        "Tracking finds features in every picture, a pose, and decides about a keyframe",
        f"{', '.join(names)} are called for all pictures that are not lost, and there are some",
        bool(rows.any()) and bool((share == 1.0).all()),
        f"In {int(rows.sum())} pictures that were not lost: "
        f"{', '.join(f'{name} {s:.0%}' for name, s in zip(names, share, strict=True))}",
        dict(zip(names, share.tolist(), strict=True)),
    )


def _mapping(run: CalledRun) -> Claim:
    called = run.place[:, _columns("local mapping")]
    some, every = (called != NOT_CALLED).any(1), (called != NOT_CALLED).all(1)
    ordered = every & (np.diff(called, axis=1) > 0).all(1)
    stray = int((some & ~run.keyframe).sum())
    return judged(
        "local-mapping-of-every-keyframe",
        "A§3.1",
        "Local mapping keeps the keyframes, makes points and adjusts, after each new keyframe and only then",
        "all boxes of local mapping are called for every keyframe, in the order drawn, and none for another "
        "picture; there are keyframes",
        bool(run.keyframe.any()) and bool(ordered[run.keyframe].all()) and stray == 0,
        f"Of {len(run.keyframe)} pictures {int(run.keyframe.sum())} became keyframes; for "
        f"{int(ordered[run.keyframe].sum())} of these all boxes were called in the order drawn, for {stray} "
        "other pictures one was",
        {"keyframes": int(run.keyframe.sum()), "in_order": int(ordered.sum()), "stray": stray},
    )


def _closing(run: CalledRun) -> Claim:
    columns = _columns("loop closing")
    called = run.place[:, columns]
    mapped = run.place[:, _columns("local mapping")].max(1)
    asked = (called[:, 0] != NOT_CALLED) & (called[:, 0] > mapped)
    stray = int(((called != NOT_CALLED).any(1) & ~run.keyframe).sum())
    right = np.array([_in_order(row) for row in called], bool)
    counts = {STAGES[k].name.replace("\n", " "): int((run.place[:, k] != NOT_CALLED).sum()) for k in columns}
    return judged(
        "loop-closing-after-local-mapping",
        "A§3.1",
        "Loop closing looks for a known place at each keyframe, and corrects what it has detected",
        "for every keyframe candidates are asked for, after local mapping, and for no other picture; what is "
        "called of the boxes then comes in the order drawn, without a gap; there are keyframes",
        bool(run.keyframe.any()) and bool((asked & right)[run.keyframe].all()) and stray == 0,
        f"Of {int(run.keyframe.sum())} keyframes {int(asked[run.keyframe].sum())} were looked at after local "
        f"mapping, and of the other pictures {stray}; "
        f"pictures of each box: {', '.join(f'{name} {n}' for name, n in counts.items())}",
        counts,
    )


def _in_order(row: IntArray) -> bool:
    """Whether the boxes that were called are the first ones, one after the other."""
    there = row != NOT_CALLED
    count = int(there.sum())
    return bool(there[:count].all()) and bool((np.diff(row[:count]) > 0).all())


def _drawn_is_called(run: CalledRun) -> Claim:
    called = run.place != NOT_CALLED
    differ = []
    for name in dict.fromkeys(stage.stage for stage in STAGES if stage.stage != REST):
        columns = [k for k, stage in enumerate(STAGES) if stage.stage == name]
        if (called[:, columns].any(1) != run.watched[:, columns].any(1)).any():
            differ.append(name)
    unknown = run.unknown.tolist()
    told = [f"no box has the stages {', '.join(unknown)}"] if unknown else []
    told += [f"calls and stopwatch differ in {', '.join(differ)}"] if differ else []
    return judged(
        "drawn-is-called",
        SOURCE,
        "The boxes of the figure are the stages of the code",
        "picture by picture, the stopwatch in the code saw a stage if and only if a function of its boxes "
        "was called, and saw no stage without a box; there are pictures",
        len(run.place) > 0 and not differ and not unknown,
        f"In {len(run.place)} pictures: " + ("; ".join(told) or "both saw the same stages"),
        {"differ": differ, "without_box": unknown},
    )


def series(study: Study[CalledRun]) -> dict[str, object]:
    """Of every box: its process, its function, and in how many pictures it was called."""
    run = study.once
    return {"pictures": len(run.keyframe), "keyframes": int(run.keyframe.sum())} | {
        stage.name.replace("\n", " "): {
            "process": stage.process,
            "function": stage.function,
            "pictures": int((run.place[:, k] != NOT_CALLED).sum()),
        }
        for k, stage in enumerate(STAGES)
    }


def figure(study: Study[CalledRun]) -> Figure:
    """The three processes as boxes."""
    from vslam_ref.plot.flow import FlowBox, processes_figure

    run = study.once
    count = (run.place != NOT_CALLED).sum(0)
    rows = {
        process: [FlowBox(STAGES[k].name, int(count[k]), None) for k in _columns(process)]
        for process in PROCESSES
    }
    keyframes = f"{int(run.keyframe.sum())} keyframes"
    told = dict.fromkeys(PROCESSES, keyframes) | {PROCESSES[0]: f"{len(run.keyframe)} pictures"}
    return processes_figure(rows, told)


EXPERIMENT = Experiment(
    id="orbslam-fig3.1",
    title="The flow of ORB-SLAM, from the functions that were called",
    source="A, figure 3.1",
    config_type=Fig31Config,
    simulate=None,
    once=follow,
    series=series,
    claims=claims,
    figure=figure,
    arrays=lambda study: study.once._asdict(),
    sample=lambda study: None,
    about={
        "place": "place of a box's first call among those of its picture, -1 for none; (pictures, boxes)",
        "keyframe": "whether it became a keyframe; (pictures,)",
        "lost": "whether it was lost; (pictures,)",
        "watched": "whether the stopwatch saw the box's stage; (pictures, boxes)",
        "unknown": "stages that no box has; (stages,)",
    },
    quick={"pictures": 40},
)
