"""``vslam-ref posegraph``: the poses that agree best with the edges of a file."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import add_json, add_set, file_target, json_target, print_notes, write_json
from vslam_ref.commands.steps import StepTable

if TYPE_CHECKING:
    from vslam_ref.arrays import Array, BoolArray
    from vslam_ref.datasets.pose_graph_files import PoseGraphFile
    from vslam_ref.estimation.posegraph import GraphSolution

HELP = "solve a pose graph: poses from what was measured between them"
EPILOG = """\
formats: g2o (SE2, SE3:QUAT, SIM3:QUAT, SIM3:EXPMAP, FIX), TORO and GTSAM (VERTEX2, EDGE2, VERTEX3, EDGE3)

starts: file (the poses of the file; the default where it has them), odometry (from pose to pose along the
edges between neighbours in time; the default where it has none), chordal (rotations as matrices: linear)

losses: l2 (least squares, the default), huber, cauchy, geman-mcclure, switchable, dcs, max-mixture. The last
four tell false loops: these are rejected, the others solved once more by least squares, and what is honest
then is taken back. A loop is an edge between vertices that are not neighbours in the order of their ids.

conventions: log (the error of an edge is the whole logarithm, the default), g2o (translation and angle, in
space the quaternion's vector part, as g2o has it: another chi2, not a better one)

chi2 is the sum of e^T Omega e, without one half: at the start of all edges, at the end of those not rejected.
The first vertex of every part is held, or those that FIX names.

examples, after 'vslam-ref sample posegraph --out samples':
  vslam-ref posegraph samples/posegraph/graph.g2o --start chordal --json result.json --plot rounds.svg
  vslam-ref posegraph samples/posegraph/false.g2o --loss switchable --out solved.g2o
  vslam-ref posegraph samples/posegraph/graph.g2o --loss cauchy --loss-on all --set constant=3
and with a known data set:
  vslam-ref posegraph sphere2500.g2o"""

STARTS = ("file", "odometry", "chordal")
LOSSES = ("l2", "huber", "cauchy", "geman-mcclure", "switchable", "dcs", "max-mixture")
SUFFIXES = (".g2o", ".graph", ".txt")
PLOTS = (".png", ".svg")
HOPELESS = {
    "nothing_free": "has no vertex that may move",
    "not_finite": "has a chi² that is not finite at the start",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("file", metavar="FILE", help="the graph; see below")
    parser.add_argument("--start", choices=STARTS, help="where to begin (default: the file's poses)")
    parser.add_argument("--loss", choices=LOSSES, default="l2", help="loss of an edge (default: l2)")
    parser.add_argument(
        "--loss-on",
        choices=("loops", "all"),
        default="loops",
        help="edges that the loss is for; the others are squared (default: loops)",
    )
    parser.add_argument(
        "--convention", choices=("log", "g2o"), default="log", help="error of an edge (default: log)"
    )
    parser.add_argument(
        "--parts",
        choices=("solve", "refuse"),
        default="solve",
        help="what to do with parts that no edge joins (default: solve each)",
    )
    parser.add_argument(
        "--out",
        metavar="FILE",
        help="write the solved graph without rejected edges: .g2o, or .graph or .txt (TORO, GTSAM)",
    )
    parser.add_argument(
        "--plot", metavar="FILE", help="draw start, solution and loops from above (.png, .svg)"
    )
    add_set(parser, "cost, gradient, max_iterations, damping, negligible, constant (of the loss)")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Read, solve, print the numbers and write what was asked for."""
    from vslam_ref.datasets.pose_graph_files import read_pose_graph, write_pose_graph
    from vslam_ref.estimation.posegraph import Options, solve_graph
    from vslam_ref.support.config import apply_overrides

    target, out = json_target(options), file_target(options.out, SUFFIXES)
    plot = file_target(options.plot, PLOTS)
    settings = apply_overrides(Options(), options.set)
    file = read_pose_graph(Path(options.file))
    _require_possible(file, options)
    graph = file.graph
    vertices, edges = graph.sizes
    loops = int(graph.loops.sum())
    print(f"{options.file}: {vertices} vertices, {edges} edges ({loops} loops)")
    start, told = _start(file, options.start)
    notes = print_notes([*file.notes, *told])
    judged: BoolArray = graph.loops if options.loss_on == "loops" else graph.loops | True
    wall, cpu = time.perf_counter(), time.process_time()
    found = solve_graph(
        graph.at(_start_poses(file, start)),
        options.loss,
        judged=judged,
        convention=options.convention,
        options=settings,
        progress=StepTable("2 x cost", 2.0),
    )
    seconds, cpu_seconds = time.perf_counter() - wall, time.process_time() - cpu
    if found.reason in HOPELESS:
        raise ValueError(f"{options.file} {HOPELESS[found.reason]}: nothing was solved, nothing written")
    if found.loosened:
        hang = f"{found.loosened} part(s) hang on rejected edges only: each held where the loss left it"
        notes += print_notes([hang])
    numbers = _numbers(file, found) | {"seconds": seconds, "cpu_seconds": cpu_seconds, "start": start}
    _show(numbers, file, found)
    write_json(target, {**numbers, "notes": notes})
    after = file.at(found.graph.T_world)
    if out is not None:
        write_pose_graph(out, after.without(found.rejected))
    if plot is not None:
        _draw(plot, file, start, found)
    return 0


def _require_possible(file: PoseGraphFile, options: argparse.Namespace) -> None:
    """Refuse, before any work, what cannot be done."""
    from vslam_ref.estimation.posegraph.starts import disconnected_parts

    count = disconnected_parts(file.graph)
    if options.parts == "refuse" and count > 1:
        raise ValueError(f"{options.file}: {count} parts that no edge joins; expected one (--parts refuse)")
    if file.graph.space == "sim3" and options.out and Path(options.out).suffix != ".g2o":
        raise ValueError(f"--out {options.out}: a graph in Sim(3) can be written as .g2o only")


def _start(file: PoseGraphFile, asked: str | None) -> tuple[str, list[str]]:
    """Which start, and what is to be told about it."""
    if asked is None and not file.placed.any():
        return "odometry", ["the file has no poses: the start is chained along the odometry"]
    if asked in (None, "file"):
        file.require_poses()
        return "file", []
    return str(asked), []


def _start_poses(file: PoseGraphFile, start: str) -> Array:
    from vslam_ref.estimation.posegraph import chordal_start, odometry_start

    if start == "file":
        return file.graph.T_world
    return odometry_start(file.graph) if start == "odometry" else chordal_start(file.graph)


def _numbers(file: PoseGraphFile, found: GraphSolution) -> dict[str, Any]:
    from vslam_ref._kernels import backend

    graph = file.graph
    vertices, edges = graph.sizes
    false = found.rejected.nonzero()[0]
    return {
        "vertices": vertices,
        "edges": edges,
        "loops": int(graph.loops.sum()),
        "initial_chi2": found.initial_chi2,
        "final_chi2": found.chi2,
        "iterations": len(found.history),
        "reason": found.reason,
        "rejected": int(found.rejected.sum()),
        "rejected_edges": [[int(file.ids[graph.tail[k]]), int(file.ids[graph.head[k]])] for k in false],
        "backend": backend(),
    }


def _show(numbers: dict[str, Any], file: PoseGraphFile, found: GraphSolution) -> None:
    from vslam_ref.commands.tables import table

    rows = [
        ["start", numbers["start"]],
        ["chi² at the start", f"{numbers['initial_chi2']:.7g}"],
        ["chi² at the end", f"{numbers['final_chi2']:.9g}"],
        ["iterations", str(numbers["iterations"])],
        ["ended", f"{found.reason}: {found.message}"],
        ["backend", numbers["backend"]],
        ["seconds (CPU)", f"{numbers['seconds']:.3f} ({numbers['cpu_seconds']:.3f})"],
        ["edges rejected", str(numbers["rejected"])],
    ]
    print(table(["what", "value"], rows))
    false = found.rejected.nonzero()[0].tolist()
    if false:
        shown = ", ".join(file.edge_name(k) for k in false[:5])
        more = f" and {len(false) - 5} more" if len(false) > 5 else ""
        print(f"rejected: {shown}{more}")


def _draw(path: Path, file: PoseGraphFile, start: str, found: GraphSolution) -> None:
    from vslam_ref.estimation.posegraph.spaces import translations
    from vslam_ref.plot.posegraph import graph_figure
    from vslam_ref.plot.saving import figure_bytes
    from vslam_ref.support import files

    graph = found.graph
    before = translations(graph.space, _start_poses(file, start))
    figure = graph_figure(
        before,
        translations(graph.space, graph.T_world),
        graph.tail,
        graph.head,
        graph.loops,
        found.rejected,
    )
    files.write_bytes(path, figure_bytes(figure, path.suffix[1:], "pose graph"))
