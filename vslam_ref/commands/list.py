"""``vslam-ref list``: what there is to read and to run."""

from __future__ import annotations

import argparse
import os
from typing import Any

from vslam_ref.commands.options import add_json, json_target, write_json

HELP = "show the chapters, experiments, systems and filters, and the data sets found"
EPILOG = "example: vslam-ref list --json list.json"

FILTERS = (
    ("ekf", "EKF-SLAM with the covariance in blocks", "vslam_ref.filters.ekf_slam"),
    ("ekf-anchored", "EKF started at zero covariance in its own frame", "vslam_ref.filters.ekf_slam"),
    ("ekf-ideal", "EKF with its Jacobians at the truth, a control", "vslam_ref.filters.ekf_slam"),
    ("iekf", "improved EKF (neither invariant nor iterated)", "vslam_ref.filters.carleman_ekf"),
)
"""Name in results, what it is, module."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Print the lists."""
    from vslam_ref.commands.tables import table

    target = json_target(options)
    content = contents()
    rows = [[f"{c['number']:02d}", c["title"], c["module"], c["state"]] for c in content["chapters"]]
    print("Chapters (docs/chapters/, notebooks/)\n" + table(["no", "title", "module", "state"], rows))
    rows = [[e["id"], e["title"], e["source"]] for e in content["experiments"]]
    print("\nExperiments (vslam-ref reproduce ID)\n" + table(["id", "title", "source"], rows))
    rows = [[s["name"], s["what"]] for s in content["systems"]]
    print("\nSystems (vslam-ref run NAME)\n" + table(["name", "what"], rows))
    print("\nFilters\n" + table(["name", "what", "module"], [list(row) for row in FILTERS]))
    found = content["data_sets_found"]
    rows = [[name, folder] for name, folder in found.items()]
    print("\nData sets found (vslam-ref data shows all)")
    print(table(["name", "folder"], rows) if rows else _none_found())
    write_json(target, content)
    return 0


def _none_found() -> str:
    searched = os.environ.get("VSLAM_REF_DATA")
    if searched:
        return f"none; VSLAM_REF_DATA is {searched}"
    return "none; set VSLAM_REF_DATA to the folder that holds them"


def contents() -> dict[str, Any]:
    """Return all lists as plain data."""
    from vslam_ref.chapters import CHAPTERS
    from vslam_ref.commands.run import SYSTEMS
    from vslam_ref.datasets.catalogue import find
    from vslam_ref.datasets.known import DATA_SETS
    from vslam_ref.experiments.registry import summaries

    folders = {data_set.name: find(data_set.name) for data_set in DATA_SETS}
    return {
        "chapters": [
            {"number": c.number, "title": c.title, "module": c.module, "state": c.state, "page": c.page}
            for c in CHAPTERS
        ],
        "experiments": [summary._asdict() for summary in summaries()],
        "systems": [{"name": name, "what": what} for name, what in SYSTEMS.items()],
        "filters": [{"name": name, "what": what, "module": module} for name, what, module in FILTERS],
        "data_sets_found": {name: str(folder) for name, folder in folders.items() if folder},
    }
