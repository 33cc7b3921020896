"""``vslam-ref identify``: gains, delays and noises of a recorded data set, found without its truth."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from vslam_ref.commands.options import add_json, json_target, warm, write_json

if TYPE_CHECKING:
    from vslam_ref.systems.slam_log import SlamLog

HELP = "find gains, delays and noises of a recorded data set, without its truth"
EPILOG = """\
data sets: mrclam (all robots together) and victoria_park, found through VSLAM_REF_DATA.
Takes minutes: every value is moved until the innovations of EKF and IEKF are most likely.
Without --json the document is printed.

example, with a known data set: vslam-ref identify mrclam --json mrclam.json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("dataset", metavar="DATASET", help="mrclam or victoria_park")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Identify a data set and print or write the document."""
    from vslam_ref.support.errors import InputError, suggestion
    from vslam_ref.support.json_text import to_json
    from vslam_ref.systems.slam_log import identify

    name = options.dataset
    if name not in identify.FREE:
        known = sorted(identify.FREE)
        raise InputError(f"unknown data set {name!r}{suggestion(name, known)}; known: {', '.join(known)}")
    target = json_target(options)
    print(f"backend: {warm('slam', 'reduced')}", file=sys.stderr)  # stdout may be the document
    found = identify.identify(read_logs(name), identify.START[name], identify.FREE[name])
    document = {"dataset": name, "command": f"vslam-ref identify {name}", **found}
    if target is None:
        print(to_json(document), end="")
    write_json(target, document)
    return 0


def read_logs(name: str) -> list[SlamLog]:
    """All logs of a set, without truth."""
    from vslam_ref.datasets import catalogue, mrclam, victoria_park

    if name == "mrclam":
        folder = mrclam.set_folder(catalogue.require("utias_mrclam"))
        return [mrclam.read_log(folder, robot) for robot in mrclam.robots(folder)]
    return [victoria_park.read_log(catalogue.require("victoria_park"))]
