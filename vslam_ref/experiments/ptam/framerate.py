"""Pictures a second: A's "hardly 30, rarely 20" measured here, in NumPy and in Numba.

PTAM runs over rendered scenes, an open one and a desk, on one thread with mapping in line.  Of every picture
after the start the CPU seconds of the thread are kept, those of tracking (all stages but the mapper's) and
the whole.  Rendering is not counted.  The times are this machine's, and differ a little from run to run.

Implements A§2.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref import _kernels
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.experiments.framework import Claim, Experiment, Study, judged
from vslam_ref.experiments.ptam.fig2_2 import MAPPER
from vslam_ref.support.config import assume
from vslam_ref.systems.ptam import KERNELS
from vslam_ref.systems.ptam.ptam import Ptam
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.worlds.rendered import Effects, scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "A§2.3.1"
HARDLY, RARELY = 0.1, 0.5
"""Share of pictures that is "hardly" any, and that is "rarely" more."""
FAST, SLOW = 30.0, 20.0
"""A's rates, pictures a second."""
SETTLED = 5
"""Pictures after the start that are left out: caches are cold."""


@dataclass(frozen=True)
class FramerateConfig:
    """The pictures."""

    seed: int = assume(23, "", "of the scenes; any")
    scenes: tuple[str, ...] = assume(("corridor", "desk"), "", "A's open scene, and its desk")
    pictures: int = assume(150, "pictures", "5 s of each")
    noise: float = assume(2.0, "grey levels", "a usual camera indoors")

    def __post_init__(self) -> None:
        """Refuse runs that are too short to tell a share."""
        if self.pictures < 30 or not self.scenes:
            raise ValueError(
                f"pictures={self.pictures}, scenes={self.scenes}: need 30, and at least one scene"
            )


class SceneOnBackend(NamedTuple):
    """A scene on a backend."""

    scene: str
    backend: str


class FramerateRun(NamedTuple):
    """CPU seconds of each picture after the start (n,), and which became keyframes; points looked for."""

    tracking: Array
    whole: Array
    keyframe: BoolArray
    tried: IntArray


def cases(config: FramerateConfig) -> list[SceneOnBackend]:
    """Every scene on every backend."""
    return [SceneOnBackend(name, backend) for name in config.scenes for backend in _kernels.available()]


def words(case: SceneOnBackend) -> str:
    """Name of a case."""
    return f"{case.scene}-{case.backend}"


def simulate(config: FramerateConfig, case: SceneOnBackend, unit: None) -> FramerateRun:
    """Run over one scene on one backend."""
    made = scene(case.scene, config.seed, frames=config.pictures, effects=Effects(noise=config.noise))
    grey = [made.frame(k) for k in range(config.pictures)]
    rows = []
    with _kernels.use_backend(case.backend):
        if case.backend == "numba":
            _kernels.warm(*KERNELS)
        system = Ptam(made.camera, Settings())
        for k, image in enumerate(grey):
            outcome = system.step(k, image)
            if outcome.tracked is not None:
                whole = sum(outcome.stages.values())
                mapping = sum(outcome.stages.get(name, 0.0) for name in MAPPER)
                tried = len(outcome.tracked.fine.seen.point)
                rows.append((whole - mapping, whole, outcome.mapped is not None, tried))
    table = np.array(rows[SETTLED:], np.float64).reshape(-1, 4)
    return FramerateRun(table[:, 0], table[:, 1], table[:, 2] > 0, table[:, 3].astype(np.int64))


# --- claims ---------------------------------------------------------------------------------------


def claims(study: Study[dict[str, FramerateRun]]) -> list[Claim]:
    """Judge A's frame rates, on each backend."""
    return [_rates(study, backend) for backend in _kernels.available()]


def shares(run: FramerateRun) -> tuple[float, float, float]:
    """Median rate, and shares of pictures as quick as FAST and as SLOW, mapping in line."""
    whole = np.asarray(run.whole)
    return (
        float(1.0 / np.median(whole)),
        float(np.mean(whole <= 1.0 / FAST)),
        float(np.mean(whole <= 1.0 / SLOW)),
    )


def _rates(study: Study[dict[str, FramerateRun]], backend: str) -> Claim:
    found = {name: shares(study.data[f"{name}-{backend}"]) for name in study.config.scenes
             if len(study.data[f"{name}-{backend}"].whole)}  # fmt: skip
    holds = all(fast <= HARDLY and slow <= RARELY for _, fast, slow in found.values()) if found else None
    told = "; ".join(
        f"{name}: {rate:.0f} pictures a second in the median, {fast:.0%} of them at {FAST:.0f} or more, "
        f"{slow:.0%} at {SLOW:.0f} or more"
        for name, (rate, fast, slow) in found.items()
    )
    return judged(
        f"hardly-30-rarely-20-{backend}",
        SOURCE,
        f"On a usual computer PTAM hardly reaches 30 pictures a second, rarely 20 (here in {backend})",
        f"in every scene at most {HARDLY:.0%} of the pictures at {FAST:.0f} a second, at most {RARELY:.0%} "
        f"at {SLOW:.0f}; mapping in line, CPU time of one thread",
        holds,
        f"On one core of this machine, {backend}, {told or 'no scene started'}",
        {name: {"median_rate": r, "share_30": f, "share_20": s} for name, (r, f, s) in found.items()},
    )


def series(study: Study[dict[str, FramerateRun]]) -> dict[str, object]:
    """Milliseconds of tracking and of whole pictures: medians and 99 %."""
    return {
        name: {
            "tracking_ms": np.percentile(run.tracking, [50, 99]) * 1e3,
            "whole_ms": np.percentile(run.whole, [50, 99]) * 1e3,
            "points_tried": float(np.median(run.tried)),
            "keyframes": int(run.keyframe.sum()),
        }
        for name, run in study.data.items()
        if len(run.whole)
    }


def figure(study: Study[dict[str, FramerateRun]]) -> Figure:
    """Shares of pictures over the rate they were done at."""
    from vslam_ref.plot.tracking_studies import rates_figure

    scenes: Sequence[str] = study.config.scenes
    curves = {
        name: {b: 1.0 / np.asarray(study.data[f"{name}-{b}"].whole) for b in _kernels.available()}
        for name in scenes
    }
    return rates_figure(curves, (SLOW, FAST))


EXPERIMENT = Experiment(
    id="ptam-framerate",
    title="Pictures a second, in NumPy and in Numba",
    source="A, section 2.3.1",
    config_type=FramerateConfig,
    simulate=simulate,
    points=cases,
    name=words,
    seeds=lambda config, case: [None],
    series=series,
    claims=claims,
    figure=figure,
    sample=lambda study: None,
    arrays=lambda study: {
        f"{field}/{name}": np.asarray(values)[0]
        for name, run in study.data.items()
        for field, values in run._asdict().items()
    },
    about={
        "tracking": "CPU seconds of tracking, this machine's; (pictures,)",
        "whole": "the same with mapping in line; (pictures,)",
        "keyframe": "whether the picture became a keyframe; (pictures,)",
        "tried": "points looked for in the fine pass; (pictures,)",
    },
    quick={"pictures": 40, "scenes": ("desk",)},
)
