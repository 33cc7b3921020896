"""A tiny Monte Carlo experiment, complete in every part, that takes milliseconds.

It lies in a module of its own so that worker processes can import it by name.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vslam_ref.experiments.framework import Claim, Experiment, Study, batches, judged, register

TIMES = 5


@dataclass(frozen=True)
class Box:
    side: float = field(default=2.0, metadata={"reason": "any", "unit": "m"})
    corners: tuple[float, ...] = field(default=(0.0, 1.0), metadata={"reason": "any", "unit": "m"})


@dataclass(frozen=True)
class ToyConfig:
    runs: int = field(default=6, metadata={"reason": "few are quick"})
    population: int = field(default=24, metadata={"reason": "four samples"})
    batch: int = field(default=4, metadata={"reason": "several batches"})
    seed: int = field(default=3, metadata={"reason": "any"})
    scale: float = field(default=1.0, metadata={"reason": "1 makes the claim true"})
    shape: Literal["round", "square"] = field(default="round", metadata={"reason": "<b>any</b> & all"})
    box: Box = Box()

    def __post_init__(self) -> None:
        if self.scale <= 0.0:
            raise ValueError(f"scale {self.scale} must be positive")


class Rows(NamedTuple):
    """One row of numbers per run."""

    nees: NDArray[np.float64]


def simulate(config: ToyConfig, point: None, seeds: tuple[np.random.SeedSequence, ...]) -> Rows:
    """One row of numbers per run; products big enough that threads could change their rounding."""
    rows = []
    if "TOY_HANG" in os.environ:  # for the test of Ctrl-C
        Path(os.environ["TOY_HANG"]).touch()
        time.sleep(120)
    if "TOY_LOG" in os.environ:  # for the test of a run that is killed and started again
        with open(os.environ["TOY_LOG"], "a") as log:
            log.write(f"{seeds[0].spawn_key[0]}\n")
        Path(f"{os.environ['TOY_LOG']}-by-{os.getpid()}").touch()
        time.sleep(float(os.environ.get("TOY_SLEEP", "0")))
    for seed in seeds:
        rng = np.random.default_rng(seed)
        a, b = rng.standard_normal((2, 96, 96))
        rows.append(np.linalg.norm(a @ b, axis=1)[:TIMES] / 96.0)
    return Rows(config.scale * np.array(rows))


def worker_threads(_: int) -> tuple[int, int, str]:
    """Return process id, number of threads of the linear algebra, and backend, as seen by a batch."""
    from threadpoolctl import threadpool_info

    from vslam_ref import _kernels

    time.sleep(0.01)  # so that threads of one worker overlap
    return os.getpid(), max((p["num_threads"] for p in threadpool_info()), default=1), _kernels.backend()


def seeds(config: ToyConfig, point: None) -> list[tuple[np.random.SeedSequence, ...]]:
    return batches(np.random.SeedSequence(config.seed).spawn(config.population), config.batch)


def series(study: Study[Rows]) -> dict[str, object]:
    nees = {"ekf/low": study.data.nees.mean(0), "nothing": [float("nan")]}
    return {"time": np.arange(TIMES), "nees": nees}


def claims(study: Study[Rows]) -> list[Claim]:
    mean = float(np.mean(study.data.nees))
    near = abs(mean - 1.0) < 0.05
    return [
        judged("always", "toy <1>", "one < two & so on", "none", None, "Nothing was asked", {}),
        judged("near-1", "toy 2", "the mean is near 1", "|mean - 1| < 0.05", near,
               f"The mean is {mean:.2f}, and 1 is meant", {"mean": mean}, ci=[mean - 0.1, mean + 0.1],
               null_rate=0.05, share=1.0, least_runs=5),
    ]  # fmt: skip


def figure(study: Study[Rows]) -> Figure:
    drawn = Figure()
    drawn.add_subplot().plot(np.arange(TIMES), study.data.nees.mean(0))
    return drawn


TOY = Experiment(
    id="toy",
    title="A toy <script>alert(1)</script>",
    source="nobody's paper & none",
    config_type=ToyConfig,
    simulate=simulate,
    seeds=seeds,
    series=series,
    arrays=lambda study: {"nees/ekf/low": study.data.nees},
    claims=claims,
    figure=figure,
    about={"nees": "numbers near 1; (runs, times)"},
    quick={"population": 8, "runs": 2},
    defaults={"box.side": 3.0},
)

if os.environ.get("TOY_REGISTER"):  # for programs started by a test
    register(TOY)
