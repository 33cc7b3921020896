"""A tiny Monte Carlo experiment, complete in every part, that takes milliseconds.

It lies in a module of its own so that worker processes can import it by name.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, register, verdict

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


def simulate(batch: list[np.random.SeedSequence]) -> NDArray[np.float64]:
    """One row of numbers per run; products big enough that threads could change their rounding."""
    rows = []
    if "TOY_HANG" in os.environ:  # for the test of Ctrl-C
        Path(os.environ["TOY_HANG"]).touch()
        time.sleep(120)
    for seed in batch:
        rng = np.random.default_rng(seed)
        a, b = rng.standard_normal((2, 96, 96))
        rows.append(np.linalg.norm(a @ b, axis=1)[:TIMES] / 96.0)
    return np.array(rows)


def worker_threads(_: int) -> tuple[int, int, str]:
    """Return process id, number of threads of the linear algebra, and backend, as seen by a batch."""
    from threadpoolctl import threadpool_info

    from vslam_ref import _kernels

    time.sleep(0.01)  # so that threads of one worker overlap
    return os.getpid(), max((p["num_threads"] for p in threadpool_info()), default=1), _kernels.backend()


def run(config: ToyConfig, context: RunContext) -> Result:
    seeds = np.random.SeedSequence(config.seed).spawn(config.population)
    batches = [seeds[i : i + config.batch] for i in range(0, len(seeds), config.batch)]
    nees = config.scale * np.concatenate(context.map(simulate, batches, "toy"))
    return Result(
        series={"time": np.arange(TIMES), "nees": {"ekf/low": nees.mean(0), "nothing": [float("nan")]}},
        seed=config.seed,
        runs=config.runs,
        arrays={"nees/ekf/low": nees},
        payload=config,
    )


def claims(result: Result) -> list[Claim]:
    mean = float(np.mean(result.series["nees"]["ekf/low"]))
    return [
        Claim("always", "toy <1>", "one < two & so on", "none", {}, None, None, None, verdict(None)),
        Claim("near-1", "toy 2", "the mean is near 1", "|mean - 1| < 0.05", {"mean": mean},
              [mean - 0.1, mean + 0.1], 0.05, 1.0, verdict(abs(mean - 1.0) < 0.05)),
    ]  # fmt: skip


def figure(result: Result) -> Figure:
    drawn = Figure()
    drawn.add_subplot().plot(result.series["time"], result.series["nees"]["ekf/low"])
    return drawn


def quick(config: ToyConfig) -> ToyConfig:
    return replace(config, population=8, runs=2)


TOY = Experiment(
    id="toy",
    title="A toy <script>alert(1)</script>",
    source="nobody's paper & none",
    config_type=ToyConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
    defaults={"box.side": 3.0},
)

if os.environ.get("TOY_REGISTER"):  # for programs started by a test
    register(TOY)
