"""The three filters, and the batch solution, of one recorded log beside its truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets import catalogue, mrclam, noise, victoria_park
from vslam_ref.filters.estimates import MapEstimate
from vslam_ref.support.config import config_to_dict
from vslam_ref.support.errors import InputError, suggestion
from vslam_ref.systems.slam_log import (
    FILTERS,
    LogRun,
    LogTruth,
    RobotCalibration,
    RunSettings,
    SlamLog,
    gap_notes,
    run_log,
    summary,
)
from vslam_ref.systems.slam_log.evaluate import errors_while_blind
from vslam_ref.systems.slam_log.runner import SeenLandmarks
from vslam_ref.systems.slam_log.timeline import build_timeline

if TYPE_CHECKING:
    from vslam_ref.systems.slam_log.batch import Batch


SETS = {"mrclam": "utias_mrclam", "victoria_park": "victoria_park"}
"""Name on the command line -> folder of the data set; the folder's name is accepted too."""
DEFAULT_ROBOT = 1


@dataclass(frozen=True)
class LogConfig:
    """Everything a run of a log depends on."""

    calibration: RobotCalibration = field(default_factory=RobotCalibration)
    run: RunSettings = field(default_factory=RunSettings)


class Source(NamedTuple):
    """Where a log came from: set name, robot (None where there is one vehicle), log, truth or None."""

    dataset: str
    robot: int | None
    log: SlamLog
    truth: LogTruth | None


class Comparison(NamedTuple):
    """What came of one log."""

    source: Source
    config: LogConfig
    runs: dict[str, LogRun]
    batch: LogRun | None


def open_source(dataset: str, robot: int | None) -> Source:
    """Find a data set by its name or its folder, and read log and truth.

    Parameters
    ----------
    dataset : str
        ``mrclam``, ``victoria_park``, the name of their folders in ``VSLAM_REF_DATA``, or a path to a
        folder of one of these formats.
    robot : int or None
        For ``mrclam``; None means robot 1.

    Raises
    ------
    ValueError
        If nothing is found, or a file is not as it should be.
    """
    kind, folder = locate(dataset)
    if kind == "victoria_park":
        if robot is not None:
            raise InputError(f"--robot {robot}: Victoria Park has one vehicle; leave it out")
        log = victoria_park.read_log(folder)
        has_truth = (folder / "aa3_gpsx.mat").is_file()
        return Source(kind, None, log, victoria_park.read_truth(folder, log) if has_truth else None)
    folder = mrclam.set_folder(folder)
    robot = DEFAULT_ROBOT if robot is None else robot
    log = mrclam.read_log(folder, robot)
    has_truth = any(folder.glob(f"Robot{robot}_Groundtruth.dat*"))
    return Source(kind, robot, log, mrclam.read_truth(folder, robot, log) if has_truth else None)


def locate(dataset: str) -> tuple[str, Path]:
    """Format, ``mrclam`` or ``victoria_park``, and folder of a data set; ``InputError`` if there is none."""
    for name, folder_name in SETS.items():
        if dataset in (name, folder_name):
            return name, catalogue.require(folder_name)
    folder = Path(dataset).expanduser()
    if not folder.is_dir():
        hint = suggestion(dataset, SETS)
        raise InputError(f"unknown data set {dataset!r}{hint}; expected {', '.join(SETS)} or a folder of one")
    if (folder / "victoria_park.txt").is_file() or (folder / "aa3_dr.mat").is_file():
        return "victoria_park", folder
    if mrclam.robots(folder) or any(folder.glob("MRCLAM_Dataset*")):
        return "mrclam", folder
    raise InputError(
        f"folder {dataset!r} holds neither RobotN_Odometry.dat nor aa3_dr.mat and victoria_park.txt"
    )


def default_config(dataset: str) -> LogConfig:
    """The identified values of a set, and the settings of a run."""
    return LogConfig(noise.calibration(dataset), RunSettings())


def compare(
    source: Source, config: LogConfig, names: Sequence[str] = tuple(FILTERS), batch: bool = True
) -> Comparison:
    """Run filters over a log, and its batch solution."""
    runs = {name: run_log(source.log, config.calibration, name, config.run) for name in names}
    bound = None
    if batch:
        from vslam_ref.systems.slam_log.batch import solve_batch

        start = runs["ekf"] if "ekf" in runs else run_log(source.log, config.calibration, "ekf", config.run)
        bound = as_run(solve_batch(source.log, config.calibration, start), source.log, start.times)
    return Comparison(source, config, runs, bound)


def as_run(batch: Batch, log: SlamLog, times: Array) -> LogRun:
    """A batch solution as a run with records at ``times``, so that it is judged alike.

    Covariances are NaN: they are not computed.
    """
    from vslam_ref.systems.slam_log.preintegration import poses_between

    line = build_timeline(log, batch.calibration, times)
    poses = poses_between(line, batch.poses)
    unknown = np.full((len(batch.ids), 2, 2), np.nan)
    ids = np.concatenate([s.ids for s in log.sightings])
    seen = SeenLandmarks(
        times=np.repeat(batch.times, [len(s.ids) for s in log.sightings]),
        ids=ids,
        polar=np.concatenate([s.polar for s in log.sightings]),
        innovation=-batch.sightings,
        S=np.full((len(ids), 2, 2), np.nan),
        accepted=batch.used,
    )
    marks = MapEstimate(batch.ids, batch.landmarks[None], unknown[None])
    return LogRun("batch", times, poses, np.full((len(times), 3, 3), np.nan), marks, seen)


def document(comparison: Comparison, asked: str) -> dict[str, Any]:
    """The JSON of a run: the asked filter's numbers on top, all filters' beside them."""
    source = comparison.source
    filters = {name: summary(run, source.truth) for name, run in comparison.runs.items()}
    bound = None
    if comparison.batch is not None:
        bound = {**summary(comparison.batch, source.truth), "nees_mean": None}
    return {
        "dataset": source.dataset,
        "robot": source.robot,
        "filter": asked,
        **filters[asked],
        "filters": filters,
        "batch": bound,
        "sightings": int(sum(len(s.ids) for s in source.log.sightings)),
        "dropped": dict(source.log.dropped),
        "notes": list(notes(source)),
        "truth": _truth_note(source.truth),
        "blind": None if source.truth is None else errors_while_blind(comparison.runs[asked], source.truth),
        "config": config_to_dict(comparison.config),
    }


def notes(source: Source) -> tuple[str, ...]:
    """What is odd in the files of a log, and where it is silent."""
    of_truth = () if source.truth is None else source.truth.notes
    return (*source.log.notes, *of_truth, *gap_notes(source.log))


def _truth_note(truth: LogTruth | None) -> str | None:
    if truth is None:
        return None
    return "motion capture" if truth.exact else "GPS, jumps excluded"
