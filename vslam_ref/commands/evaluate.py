"""``vslam-ref evaluate``: an estimated trajectory against the true one."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from vslam_ref.commands.options import (
    add_json,
    file_target,
    json_target,
    print_backend,
    print_notes,
    write_json,
)

if TYPE_CHECKING:
    from vslam_ref.datasets.trajectories import TrajectoryFile
    from vslam_ref.metrics.trajectory import Evaluation, Trajectory

HELP = "compare an estimated trajectory with the true one: ATE and RPE"
EPILOG = """\
alignment of the estimate before the absolute error (ATE) is measured:
  none    the two world frames are the same
  se3     best rotation and translation (the default)
  sim3    best rotation, translation and scale: for one camera, which does not know the scale

Poses are paired by time: nearest, at most 0.01 s apart (--max-difference), each used once; KITTI files,
which have no times, line by line. Of poses with equal times only the first is paired; lost frames (nan) are
left out. The relative error (RPE) is that of the step from each pair to the next. What is odd in a file, how
many poses found no partner and the likely reason are told in lines 'note: ...'.

formats: tum (t tx ty tz qx qy qz qw), kitti (12 numbers), euroc (ns,tx,ty,tz,qw,qx,qy,qz); '.gz' is unpacked
A header may name the columns in any order, as '# time tx ty tz qw qx qy qz'. Blanks, tabs, commas or
semicolons part them; more columns than a pose has are passed over. Times since 1970 may be in seconds,
milli-, micro- or nanoseconds.

examples, after 'vslam-ref sample trajectory --out samples':
  vslam-ref evaluate samples/trajectory/estimate.txt samples/trajectory/groundtruth.txt --json errors.json
  vslam-ref evaluate samples/trajectory/estimate.txt samples/trajectory/groundtruth.txt --plot errors.svg
and with your own:
  vslam-ref evaluate keyframes.txt groundtruth.txt --align sim3
  vslam-ref evaluate estimate.txt groundtruth.txt --offset -7200 --max-difference 0.02"""

ALIGNMENTS = ("none", "se3", "sim3")
FORMATS = ("tum", "kitti", "euroc")
MAX_DIFFERENCE = 0.01
"""Seconds; as in the library."""
QUATERNION = {True: "qw qx qy qz", False: "qx qy qz qw"}
"""Whether w is first -> the order of the numbers."""
CLEARLY = 0.5
"""Times the disagreement of rotations: so much better must another file explain it to be blamed instead."""
PLOTS = (".png", ".svg")
ROWS = (
    ("pairs", "pairs of poses", ""),
    ("ate_rmse", "ATE, RMSE", "m"),
    ("ate_mean", "ATE, mean", "m"),
    ("ate_median", "ATE, median", "m"),
    ("ate_max", "ATE, largest", "m"),
    ("rpe_trans_rmse", "RPE over 1 frame, translation, RMSE", "m"),
    ("rpe_rot_rmse_deg", "RPE over 1 frame, rotation, RMSE", "deg"),
    ("scale", "scale of the alignment", ""),
)
"""Key in the JSON, words and unit in the table."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("estimate", metavar="ESTIMATE", help="file with the estimated trajectory")
    parser.add_argument("truth", metavar="TRUTH", help="file with the true trajectory")
    parser.add_argument(
        "--align", choices=ALIGNMENTS, default="se3", help="what the alignment may change (default: se3)"
    )
    parser.add_argument(
        "--format", choices=FORMATS, help="format of both files (default: seen from the text)"
    )
    parser.add_argument(
        "--max-difference",
        type=_seconds(at_least_zero=True),
        default=MAX_DIFFERENCE,
        metavar="S",
        help=f"seconds between the two poses of a pair, at most (default: {MAX_DIFFERENCE:g})",
    )
    parser.add_argument(
        "--offset",
        type=_seconds(),
        default=0.0,
        metavar="S",
        help="seconds that are added to the times of the estimate (default: 0)",
    )
    parser.add_argument("--plot", metavar="FILE", help="draw both paths and the error over time (.png, .svg)")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Read both files, print the numbers and write what was asked for."""
    target = json_target(options)
    plot = file_target(options.plot, PLOTS)

    from vslam_ref.commands.tables import table
    from vslam_ref.datasets import trajectories
    from vslam_ref.metrics.trajectory import evaluate

    files = [trajectories.read(Path(name), options.format) for name in (options.estimate, options.truth)]
    estimate, truth = _same_lines(*files)
    limit, offset = options.max_difference, options.offset
    found = evaluate(estimate, truth, options.align, max_difference=limit, offset=offset)
    numbers = found.numbers()
    print(f"{options.estimate} against {options.truth}, alignment {options.align}")
    rows = [[words, f"{numbers[key]:.6f}" if unit or key == "scale" else f"{numbers[key]}", unit]
            for key, words, unit in ROWS]  # fmt: skip
    print(table(["what", "value", "unit"], rows))
    moved = estimate.later(offset) if offset else estimate
    notes = print_notes(_notes(options, found, files, moved, truth))
    print_backend()
    write_json(target, {**numbers, "notes": notes})
    if plot is not None:
        _draw(plot, found, Path(options.estimate).name, options.align)
    return 0


def _seconds(*, at_least_zero: bool = False) -> Callable[[str], float]:
    """Return a reader of finite seconds."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or (at_least_zero and value < 0):
            right = "seconds, 0 or more" if at_least_zero else "seconds"
            raise argparse.ArgumentTypeError(f"{text!r}: expected {right}")
        return value

    return read


def _same_lines(estimate: TrajectoryFile, truth: TrajectoryFile) -> tuple[Trajectory, Trajectory]:
    """Both trajectories; without times only the lines that are no lost frame in either."""
    paths = (estimate.trajectory, truth.trajectory)
    if any(path.times is not None for path in paths) or estimate.lines != truth.lines:
        return paths
    import numpy as np

    places = [file.places for file in (estimate, truth)]
    assert places[0] is not None
    assert places[1] is not None
    _, mine, theirs = np.intersect1d(places[0], places[1], return_indices=True)
    return paths[0].take(mine), paths[1].take(theirs)


def _notes(
    options: argparse.Namespace,
    found: Evaluation,
    files: list[TrajectoryFile],
    estimate: Trajectory,
    truth: Trajectory,
) -> list[str]:
    """What a reader of the numbers should know."""
    from vslam_ref.metrics.trajectory import pairing_notes

    names = (options.estimate, options.truth)
    notes = [f"{name}: {note}" for name, file in zip(names, files, strict=True) for note in file.notes]
    notes += pairing_notes(estimate, truth, found.pairs, options.max_difference, options.offset)
    pairs = (estimate.take(found.pairs.estimate), found.truth)
    notes += _order_notes(names, files, *pairs)
    if found.absolute.alignment.reason:
        notes.append(f"the alignment is one of many: {found.absolute.alignment.reason}")
    return notes


def _order_notes(
    names: tuple[str, str], files: list[TrajectoryFile], estimate: Trajectory, truth: Trajectory
) -> list[str]:
    """Whether the quaternions of one file, or of both, seem to stand in the other order."""
    from vslam_ref.metrics.trajectory import judge_order

    mine, theirs = (file.w_first for file in files)
    judged = []
    for asked in ((mine, None), (None, theirs), (mine, theirs)):
        order = judge_order(estimate, truth, asked) if asked != (None, None) else None
        if order is not None and order.likely:
            judged.append((order, asked))
    if not judged:
        return []
    order, asked = judged[0]
    for one in judged[1:]:  # a short path leaves it open: the estimate is the likelier culprit
        if one[0].other < CLEARLY * order.other:
            order, asked = one
    told = [_other_order(name, first) for name, first in zip(names, asked, strict=True) if first is not None]
    read, other = math.degrees(order.read), math.degrees(order.other)
    told[-1] += f"; the rotations of the two files then agree to {other:.2g} degrees, now to {read:.2g}"
    return told


def _other_order(name: str, w_first: bool) -> str:
    was, seems = ("first", "last") if w_first else ("last", "first")
    told = f"{name}: its quaternions were read with w {was}, and w seems to be {seems}: if so, put the line"
    return f"{told} '# time tx ty tz {QUATERNION[not w_first]}' above the poses"


def _draw(path: Path, found: Evaluation, name: str, align: str) -> None:
    from vslam_ref.plot.saving import figure_bytes
    from vslam_ref.plot.trajectory import trajectory_figure
    from vslam_ref.support import files

    words = "not aligned" if align == "none" else f"aligned, {align}"
    figure = trajectory_figure(
        found.absolute.aligned.t_world_body,
        found.truth.t_world_body,
        found.absolute.errors,
        found.truth.times,
        name,
        words,
    )
    files.write_bytes(path, figure_bytes(figure, path.suffix[1:], name))
