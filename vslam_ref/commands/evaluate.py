"""``vslam-ref evaluate``: an estimated trajectory against the true one."""

from __future__ import annotations

import argparse
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
    from vslam_ref.metrics.trajectory import Evaluation

HELP = "compare an estimated trajectory with the true one: ATE and RPE"
EPILOG = """\
alignment of the estimate before the absolute error (ATE) is measured:
  none    the two world frames are the same
  se3     best rotation and translation (the default)
  sim3    best rotation, translation and scale: for one camera, which does not know the scale

Poses are paired by time: nearest, at most 0.01 s apart, each used once; KITTI files, which have no
times, line by line. Of poses with equal times only the first is paired. The relative error (RPE) is that
of the step from each pair to the next.

formats: tum (t tx ty tz qx qy qz qw), kitti (12 numbers), euroc (ns,tx,ty,tz,qw,qx,qy,qz); '.gz' is unpacked

examples, after 'vslam-ref sample trajectory --out samples':
  vslam-ref evaluate samples/trajectory/estimate.txt samples/trajectory/groundtruth.txt --json errors.json
  vslam-ref evaluate samples/trajectory/estimate.txt samples/trajectory/groundtruth.txt --plot errors.svg
and with your own:
  vslam-ref evaluate keyframes.txt groundtruth.txt --align sim3"""

ALIGNMENTS = ("none", "se3", "sim3")
FORMATS = ("tum", "kitti", "euroc")
FIRST = "of equal times only the first is paired"
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
    parser.add_argument("--plot", metavar="FILE", help="draw both paths and the error over time (.png, .svg)")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Read both files, print the numbers and write what was asked for."""
    target = json_target(options)
    plot = file_target(options.plot, PLOTS)

    from vslam_ref.commands.tables import table
    from vslam_ref.datasets import trajectories
    from vslam_ref.metrics.trajectory import evaluate

    estimate = trajectories.read(Path(options.estimate), options.format)
    truth = trajectories.read(Path(options.truth), options.format)
    found = evaluate(estimate.trajectory, truth.trajectory, options.align)
    numbers = found.numbers()
    print(f"{options.estimate} against {options.truth}, alignment {options.align}")
    rows = [[words, f"{numbers[key]:.6f}" if unit or key == "scale" else f"{numbers[key]}", unit]
            for key, words, unit in ROWS]  # fmt: skip
    print(table(["what", "value", "unit"], rows))
    notes = print_notes(_notes(found, (options.estimate, estimate), (options.truth, truth)))
    print_backend()
    write_json(target, {**numbers, "notes": notes})
    if plot is not None:
        _draw(plot, found, Path(options.estimate).name, options.align)
    return 0


def _notes(found: Evaluation, *read: tuple[str, TrajectoryFile]) -> list[str]:
    """What a reader of the numbers should know."""
    notes = []
    for name, file in read:
        if file.repeated:
            notes.append(f"{name}: {file.repeated} pose(s) with the time of the pose before; {FIRST}")
        if file.unit_error > 1e-6:
            what = "R^T R" if file.format == "kitti" else "quaternion lengths"
            did = "used as they are" if file.format == "kitti" else "normalised"
            notes.append(f"{name}: {what} up to {file.unit_error:.1e} off 1, as rounded digits are; {did}")
    if found.absolute.alignment.reason:
        notes.append(f"the alignment is one of many: {found.absolute.alignment.reason}")
    return notes


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
