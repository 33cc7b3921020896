"""``vslam-ref run ekf-slam|iekf-slam``: filters over the log of a vehicle."""

from __future__ import annotations

import argparse

from vslam_ref.commands.options import (
    add_json,
    add_set,
    at_least,
    folder_target,
    json_target,
    print_backend,
    print_notes,
    warm,
    write_json,
)

SYSTEMS = {
    "ekf-slam": "EKF-SLAM; the IEKF, the anchored EKF and a batch solution are shown beside it",
    "iekf-slam": "IEKF-SLAM: the improved EKF of seed B (neither invariant nor iterated); same company",
}
EPILOG = """\
data sets: mrclam (--robot N) and victoria_park, found through VSLAM_REF_DATA, or a folder in their format.
What is odd in the files is told in lines 'note: ...': misread barcodes (up to 5 % are dropped), lines out of
order, gaps of the odometry over 2 s and of the sightings over 30 s.  Through a gap of the odometry the last
speed holds, with the variance that holding it as long has elsewhere in the log.
Gains and noises are those identified without truth; '--set calibration.sigma_range=0.05' changes one,
'--set run.gate=9' a setting of the run."""
EXAMPLES = """\
examples, after 'vslam-ref sample robot --out samples':
  vslam-ref run iekf-slam samples/robot --out out/robot
  vslam-ref run ekf-slam samples/robot --no-batch --set calibration.turn_gain=1 --json robot.json
and with known data sets:
  vslam-ref run ekf-slam mrclam --robot 3 --out out/robot3
  vslam-ref run iekf-slam victoria_park --out out/park"""

FILTERS = {"ekf-slam": "ekf", "iekf-slam": "iekf"}
"""System -> the filter whose numbers stand on top of the JSON."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this family."""
    parser.add_argument("dataset", metavar="DATASET", help="what to run it on; see below")
    parser.add_argument("--robot", type=at_least(1), metavar="N", help="robot of an MRCLAM set (default: 1)")
    parser.add_argument("--out", metavar="DIR", help="write figures, trajectories, maps and a page there")
    parser.add_argument("--no-batch", action="store_true", help="leave the batch solution out")
    add_set(parser)
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Run the filters over a log, print and write their numbers."""
    import time

    from vslam_ref.commands.tables import table
    from vslam_ref.experiments.slam_log import compare as logs
    from vslam_ref.support.config import apply_overrides
    from vslam_ref.support.provenance import versions

    target = json_target(options)
    out = folder_target(options.out)
    source = logs.open_source(options.dataset, options.robot)
    warm("slam", "reduced")
    began = time.perf_counter()
    config = apply_overrides(logs.default_config(source.dataset), options.set)
    comparison = logs.compare(source, config, batch=not options.no_batch)
    content = logs.document(comparison, FILTERS[options.system])
    content |= {"seconds": time.perf_counter() - began, "versions": versions()}

    from vslam_ref.experiments.slam_log import report

    heads, rows = report.number_rows(content)
    seen, truth = content["sightings"], content["truth"] or "none"
    print(f"{source.log.name}: {seen} sightings of landmarks, truth: {truth}")
    print(table(heads, rows))
    print_notes(content["notes"])
    print_backend()
    if out is not None:
        report.write_report(out, comparison, content)
        print(f"page: {out / 'report.html'}")
    write_json(target, content)
    return 0
