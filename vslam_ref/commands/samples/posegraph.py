"""Pose graphs of a robot's rounds, with their true poses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.commands.samples import Made
from vslam_ref.datasets.pose_graph_files import PoseGraphFile, write_pose_graph
from vslam_ref.estimation.posegraph import PoseGraph
from vslam_ref.worlds.rounds import SIGMA_M, SIGMA_RAD, make_rounds

FALSE = 12
README = f"""\
A robot goes round a block four times; it measures each step, and recognises some places of the round before.

format: g2o (VERTEX_SE2, EDGE_SE2; VERTEX_SE3:QUAT, EDGE_SE3:QUAT); poses in the files are the odometry
        graph.g2o   in space, up a ramp: steps and loops with noise of {SIGMA_M} m and {SIGMA_RAD} rad
        false.g2o   in the plane, the same noise, and {FALSE} loops that join places which are not the same
true:   truth.g2o, false_truth.g2o   the same with the true poses
        truth.json  counts, the false edges, and the chi² that a solved graph leaves (mean and standard
                    deviation; of false.g2o without its false edges)"""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Write two graphs at their odometry, and both with true poses."""
    known: dict[str, Any] = {}
    for name, made in (
        ("graph", make_rounds("se3", rng)),
        ("false", make_rounds("se2", rng, false_loops=FALSE)),
    ):
        write_pose_graph(folder / f"{name}.g2o", PoseGraphFile(made.graph))
        truth = "truth" if name == "graph" else f"{name}_truth"
        write_pose_graph(folder / f"{truth}.g2o", PoseGraphFile(made.graph.at(made.true)))
        ends = np.stack([made.graph.tail, made.graph.head], 1)[made.false].tolist()
        known[name] = {**_law(made.graph.only(~made.false)), "false_edges": ends}
    command = "vslam-ref posegraph samples/posegraph"
    return Made(
        README,
        (
            f"{command}/graph.g2o --plot rounds.svg",
            f"{command}/graph.g2o --start chordal --out solved.g2o",
            f"{command}/false.g2o --loss switchable --plot false.svg",
        ),
        known,
    )


def _law(graph: PoseGraph) -> dict[str, Any]:
    """Counts, and the law of the least chi²."""
    nodes, edges = graph.sizes
    redundancy = graph.information.shape[-1] * (edges - nodes + 1)
    return {
        "vertices": nodes,
        "true_edges": edges,
        "redundancy": redundancy,
        "final_chi2_mean": redundancy,
        "final_chi2_sd": float(np.sqrt(2 * redundancy)),
    }
