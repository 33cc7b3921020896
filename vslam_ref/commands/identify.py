"""``vslam-ref identify``: gains, delays and noises of a recorded data set, found without its truth."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from vslam_ref.commands.options import add_json, json_target, warm, write_json

if TYPE_CHECKING:
    from vslam_ref.systems.slam_log import SlamLog

HELP = "find gains, delays and noises of a recorded data set, without its truth"
EPILOG = """\
data sets: mrclam and victoria_park, found through VSLAM_REF_DATA, or a folder in their format. All robots of
an MRCLAM set are used together.
Takes minutes: every value is moved until the innovations of EKF and IEKF are most likely.
Without --json the document is printed.

example, after 'vslam-ref sample robot --out samples':
  vslam-ref identify samples/robot --json robot.json
and with a known data set:
  vslam-ref identify mrclam --json mrclam.json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("dataset", metavar="DATASET", help="mrclam, victoria_park, or a folder")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Identify a data set and print or write the document."""
    from vslam_ref.experiments.slam_log.compare import locate
    from vslam_ref.support.json_text import to_json
    from vslam_ref.systems.slam_log import identify

    target = json_target(options)
    kind, folder = locate(options.dataset)
    logs = read_logs(kind, folder)
    print(f"backend: {warm('slam', 'reduced')}", file=sys.stderr)  # stdout may be the document
    found = identify.identify(logs, identify.START[kind], identify.FREE[kind])
    document = {"dataset": kind, "command": f"vslam-ref identify {options.dataset}", **found}
    if target is None:
        print(to_json(document), end="")
    write_json(target, document)
    return 0


def read_logs(kind: str, folder: Path) -> list[SlamLog]:
    """All logs of a folder in the format of a set, ``mrclam`` or ``victoria_park``; no truth is read."""
    from vslam_ref.datasets import mrclam, victoria_park

    if kind == "mrclam":
        folder = mrclam.set_folder(folder)
        return [mrclam.read_log(folder, robot) for robot in mrclam.robots(folder)]
    return [victoria_park.read_log(folder)]
