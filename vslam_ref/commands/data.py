"""``vslam-ref data``: the real data sets that tests, notebooks and commands know."""

from __future__ import annotations

import argparse
import os

from vslam_ref.commands.options import add_json, json_target, write_json

HELP = "show the known data sets: what they are, where they were found, where to get them"
EPILOG = """\
VSLAM_REF_DATA holds the folders to search, separated like PATH. A set is found in a folder of its name.

example, with data sets in ~/slam-data: VSLAM_REF_DATA=~/slam-data vslam-ref data victoria_park"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("names", nargs="*", metavar="NAME", help="show these sets only (default: all)")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Print one block per data set."""
    from vslam_ref.datasets import catalogue, known

    target = json_target(options)
    names = options.names or [data_set.name for data_set in known.DATA_SETS]
    chosen = [(catalogue.get(name), catalogue.find(name)) for name in dict.fromkeys(names)]
    for data_set, folder in chosen:
        print(f"{data_set.name}: {data_set.what}")
        print(f"  licence {data_set.licence}: {known.LICENCE_CLASSES[data_set.licence]}")
        print(f"  get it: {data_set.source}")
        print(f"  found: {folder or 'no'}")
    found = sum(folder is not None for _, folder in chosen)
    where = os.environ.get(catalogue.VARIABLE) or "not set"
    print(f"{found} of {len(chosen)} found; {catalogue.VARIABLE} is {where}")
    write_json(
        target,
        {
            "data_sets": [
                {**data_set._asdict(), "found": str(folder) if folder else None}
                for data_set, folder in chosen
            ]
        },
    )
    return 0
