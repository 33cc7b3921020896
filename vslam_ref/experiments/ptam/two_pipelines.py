"""Mapping in line or beside: how late a pose comes when pictures come thirty times a second.

The same pictures of the rendered desk are given to PTAM at the pace of a camera, in real time: once with
mapping in line, once with the mapper in a thread of its own.  A picture's latency is from when the camera
gave it to when its pose is there; a picture that has to wait for the one before it is late by that, too.
Latencies are this machine's, and need a second core that is idle; they differ from run to run.  The thread's
own time tells whether other programs were in the way: in line, it works as long as a picture takes.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref import _kernels
from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.framework.scheduler import cores
from vslam_ref.experiments.ptam.parts_inputs import as_sequence
from vslam_ref.experiments.visual_slam import numbers
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam import KERNELS
from vslam_ref.systems.ptam.concurrent import ConcurrentPtam
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.tracker.quality import Quality
from vslam_ref.worlds.rendered import Effects, RenderedScene, scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A§2.1"
WAYS = ("in line", "beside")
RIGHT = 0.5
"""ATE, percent of the path, up to which a path is called right: speed bought by wrong poses is none."""
SETTLED = 5
"""Pictures after the start that are left out."""
IDLE = 0.8
"""Least share of the processor that the tracker must have while it works, for latencies to be its own."""


@dataclass(frozen=True)
class TwoPipelinesConfig:
    """The pictures and their pace."""

    runs: int = assume(3, "desks", "10 s each, twice")
    seed: int = assume(21, "", "any; fixed for repeatability")
    pictures: int = assume(300, "pictures", "10 s: some ten keyframes")
    rate: float = assume(30.0, "pictures a second", "a usual camera, PTAM's too")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse paces that mean nothing."""
        if self.runs < 1 or self.pictures < 60 or not 1 <= self.rate <= 240:
            raise ValueError("need at least one run, 60 pictures, and 1 to 240 pictures a second")


class LatencyRun(NamedTuple):
    """Of all desks, by way: latencies (s) of the pictures after the start (n,), and errors (runs,).

    ``got``: seconds of the processor over those that passed, in the steps with mapping in line.
    """

    latency: dict[str, Array]
    error: dict[str, Array]
    got: float


def follow(config: TwoPipelinesConfig) -> LatencyRun:
    """Run every desk both ways, one after the other."""
    if _kernels.backend() == "numba":
        _kernels.warm(*KERNELS)
    latency: dict[str, list[Array]] = {way: [] for way in WAYS}
    error: dict[str, list[float]] = {way: [] for way in WAYS}
    worked: list[tuple[float, float]] = []
    for seed in np.random.SeedSequence(config.seed).spawn(config.runs):
        made = scene("desk", int(seed.generate_state(1)[0]), frames=config.pictures,
                     effects=Effects(noise=config.noise))  # fmt: skip
        grey = [made.frame(k) for k in range(config.pictures)]
        for way in WAYS:
            system = (ConcurrentPtam if way == "beside" else Ptam)(made.camera, Settings())
            late, spent = paced(system, grey, config.rate)
            latency[way].append(late)
            worked += [spent] * (way == "in line")
            system.finish()
            error[way].append(_error(system, made))
    return LatencyRun(
        {way: np.concatenate(parts) for way, parts in latency.items()},
        {way: np.array(parts) for way, parts in error.items()},
        sum(cpu for cpu, _ in worked) / sum(wall for _, wall in worked),
    )


def paced(system: Ptam, grey: Sequence[ArrayLike], rate: float) -> tuple[Array, tuple[float, float]]:
    """Latencies (n,), seconds, of the pictures with a map, each given not before its time.

    And the seconds of all steps: of the thread on the processor, and on the clock.
    """
    late, spent = [], np.zeros(2)
    began = None
    for k, image in enumerate(grey):
        if system.map is not None and began is None:
            began = time.perf_counter() - k / rate  # the clock runs from the first picture after the start
        if began is not None:
            time.sleep(max(0.0, began + k / rate - time.perf_counter()))
        before = np.array([time.thread_time(), time.perf_counter()])
        outcome = system.step(k, image)
        spent += np.array([time.thread_time(), time.perf_counter()]) - before
        if began is not None and outcome.tracked is not None and outcome.tracked.quality is not Quality.LOST:
            late.append(time.perf_counter() - (began + k / rate))
    return np.array(late[SETTLED:]), (float(spent[0]), float(spent[1]))


def _error(system: Ptam, made: RenderedScene) -> float:
    which, T = system.trajectory()
    found = numbers.accuracy(as_sequence("desk", made), which.astype(np.int64), T).percent
    return np.nan if found is None else found


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[LatencyRun]) -> list[Claim]:
    """Judge that two pipelines make real time possible, and that the poses are still right."""
    return [_real_time(study), _same_paths(study)]


def _real_time(study: Study[LatencyRun]) -> Claim:
    latency, budget = study.once.latency, 1.0 / study.config.rate
    got = study.once.got
    missing = ""
    if cores() < 2 or not all(len(values) for values in latency.values()):
        missing = "This machine has one core, or no map began"
    elif got < IDLE:
        missing = (
            f"Other programs were in the way: the tracker had the processor for {got:.0%} of the time that "
            f"it worked, at least {IDLE:.0%} asked for. Run it again when nothing else runs"
        )
    late = {
        way: float(np.percentile(values, 99)) if len(values) else np.nan for way, values in latency.items()
    }
    worst = {way: float(values.max()) if len(values) else np.nan for way, values in latency.items()}
    told = "; ".join(
        f"mapping {way}: {1e3 * late[way]:.0f} ms at 99 %, {1e3 * worst[way]:.0f} ms at worst" for way in WAYS
    )
    return judged(
        "two-pipelines-make-real-time-possible",
        SOURCE,
        "Parting tracking and mapping into two pipelines makes real-time tracking possible",
        f"99 % of the poses come within {1e3 * budget:.0f} ms with mapping beside, and not in line; not "
        f"testable where the tracker got less than {IDLE:.0%} of the processor's time",
        None if missing else late["beside"] <= budget < late["in line"],
        missing or f"A picture has {1e3 * budget:.0f} ms. {told}",
        {"late_99_s": late, "worst_s": worst, "cores": cores(), "processor_share": got},
    )


def _same_paths(study: Study[LatencyRun]) -> Claim:
    error = study.once.error
    most = {way: float(np.max(np.where(np.isfinite(e), e, np.inf))) for way, e in error.items()}
    return judged(
        "both-ways-find-the-path",
        SOURCE,
        "The path is right both ways",
        f"in every run, both ways, an error of at most {RIGHT:g} % of the path",
        max(most.values()) <= RIGHT,
        f"The worst error is {most['in line']:.2g} % of the path in line, {most['beside']:.2g} % beside",
        {way: values.tolist() for way, values in error.items()},
        share=float(np.mean([values <= RIGHT for values in error.values()])),
        least_runs=1,
    )


def series(study: Study[LatencyRun]) -> dict[str, object]:
    """Latencies in milliseconds: median, 99 %, worst; errors."""
    return {
        way: {
            "latency_ms": np.percentile(study.once.latency[way], [50, 99, 100]) * 1e3,
            "error_percent": study.once.error[way],
        }
        for way in WAYS
        if len(study.once.latency[way])
    }


def figure(study: Study[LatencyRun]) -> Figure:
    """Shares of pictures over their latency."""
    from vslam_ref.plot.tracking_studies import latency_figure

    return latency_figure(study.once.latency, 1.0 / study.config.rate)


EXPERIMENT = Experiment(
    id="ptam-two-pipelines",
    title="Mapping in line, and in a pipeline of its own",
    source="A, section 2.1",
    config_type=TwoPipelinesConfig,
    simulate=None,
    once=follow,
    series=series,
    claims=claims,
    figure=figure,
    arrays=lambda study: {f"latency/{way.replace(' ', '_')}": v for way, v in study.once.latency.items()},
    about={"latency": "seconds from a picture to its pose, this machine's; (pictures,)"},
    quick={"runs": 1, "pictures": 90},
)
