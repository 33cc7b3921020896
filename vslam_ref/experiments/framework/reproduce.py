"""Run, judge, draw and write experiments, in one process so that they can share their runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vslam_ref import _kernels
from vslam_ref.experiments.framework import report, writer
from vslam_ref.experiments.framework.claims import Claim
from vslam_ref.experiments.framework.driver import Study
from vslam_ref.experiments.framework.experiment import Experiment
from vslam_ref.experiments.framework.kept import Kept, kept_beside
from vslam_ref.experiments.framework.scheduler import RunContext
from vslam_ref.support import files
from vslam_ref.support.config import config_to_dict

Work = Sequence[tuple[Experiment[Any], Any]]


@dataclass(frozen=True)
class Reproduced:
    """One experiment that has been run and written."""

    experiment: Experiment[Any]
    claims: tuple[Claim, ...]
    folder: Path
    seed: int | None
    runs: int | None
    seconds: float
    quick: bool = False
    shares_with: str | None = None
    """The experiment whose runs were used again: ``seconds`` has no simulation in it then."""


def reproduce(
    work: Work,
    context: RunContext,
    out: Path,
    quick: bool = False,
    begin: Callable[[int, Experiment[Any]], None] | None = None,
) -> Iterator[Reproduced]:
    """Run each (experiment, config) in turn; write ``out/<id>`` and renew ``out/index.html`` after each.

    Experiments that simulate the same with the same config, one after the other, share their runs.  Finished
    batches are kept beside ``out`` until the experiments that need them are written.

    Parameters
    ----------
    work : sequence of (Experiment, config)
        What to run, in this order.
    context : RunContext
        Where it is computed.
    out : Path
        Made if missing.
    quick : bool
        Whether the configs are those of a quick run: results say so.
    begin : callable, optional
        Called with the number, from 1 on, and the experiment that is begun.

    Yields
    ------
    Reproduced
        As soon as its files are in place.
    """
    out = files.require_folder(out)
    files.clean(out)
    shared: tuple[Any, Study[Any], Kept, str] | None = None
    for number, (experiment, config) in enumerate(work, 1):
        if begin is not None:
            begin(number, experiment)
        start = time.perf_counter()
        same = experiment.simulate, experiment.once, config
        if shared is None or shared[0] != same:
            if shared is not None:
                shared[2].remove()
            kept = kept_beside(out, experiment.id, config_to_dict(config), _kernels.backend())
            shared = same, experiment.run(config, context, kept), kept, experiment.id
        seconds = time.perf_counter() - start
        first = shared[3] if shared[3] != experiment.id else None
        yield replace(_write(experiment, shared[1], out, seconds, quick), shares_with=first)
    if shared is not None:
        shared[2].remove()


def _write(
    experiment: Experiment[Any], study: Study[Any], out: Path, seconds: float, quick: bool
) -> Reproduced:
    """Judge, draw and write one experiment."""
    claims = experiment.judge(study, quick)
    folder = out / experiment.id
    content = writer.document(experiment, study, claims, seconds, quick)
    writer.write_folder(folder, content, experiment.arrays(study), experiment.figure(study))
    report.write_index(out)
    return Reproduced(experiment, claims, folder, content["seed"], content["runs"], seconds, quick)
