"""Run, judge, draw and write experiments, in one process so that they can share their runs."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vslam_ref.experiments.framework import report, writer
from vslam_ref.experiments.framework.claims import Claim
from vslam_ref.experiments.framework.experiment import Experiment, RunContext
from vslam_ref.support import files


@dataclass(frozen=True)
class Outcome:
    """One experiment that has been run and written."""

    experiment: Experiment[Any]
    claims: tuple[Claim, ...]
    folder: Path
    seed: int | None
    runs: int | None
    seconds: float


def reproduce(
    work: Sequence[tuple[Experiment[Any], Any]], context: RunContext, out: Path
) -> Iterator[Outcome]:
    """Run each (experiment, config) in turn; write ``out/<id>`` and renew ``out/index.html`` after each.

    Parameters
    ----------
    work : sequence of (Experiment, config)
        What to run, in this order.
    context : RunContext
        Shared by all, so that experiments of one study run it once.
    out : Path
        Made if missing.

    Yields
    ------
    Outcome
        As soon as its files are in place.
    """
    out = files.require_folder(out)
    files.clean(out)
    for experiment, config in work:
        start = time.perf_counter()
        result = experiment.run(config, context)
        seconds = time.perf_counter() - start
        claims = tuple(experiment.claims(result))
        content = writer.document(experiment, config, result, claims, seconds)
        folder = out / experiment.id
        writer.write_folder(folder, content, result.arrays, experiment.figure(result))
        report.write_index(out)
        yield Outcome(experiment, claims, folder, result.seed, result.runs, seconds)
