"""Writing pose graphs: every number in full, so that reading gives the same graph."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.datasets.pose_graph_files import g2o, toro
from vslam_ref.datasets.pose_graph_files.record import PoseGraphFile
from vslam_ref.estimation.posegraph.spaces import WORDS
from vslam_ref.support.files import write_text

SUFFIXES = {".g2o": "g2o", ".graph": "toro", ".txt": "toro"}


def write_pose_graph(path: Path | str, file: PoseGraphFile) -> None:
    """Write a pose graph: ``.g2o``, or ``.graph`` and ``.txt`` for TORO's and GTSAM's text.

    Raises
    ------
    ValueError
        On another suffix, or a graph that the format cannot say.
    """
    path = Path(path)
    if path.suffix not in SUFFIXES:
        right = ".g2o, or .graph or .txt (TORO's and GTSAM's text)"
        raise ValueError(f"{path}: suffix {path.suffix!r} is of no format that is written; use {right}")
    write_text(path, pose_graph_text(file, SUFFIXES[path.suffix]))


def pose_graph_text(file: PoseGraphFile, format: str) -> str:
    """Return the text of a file in the format "g2o" or "toro".

    Raises
    ------
    ValueError
        If the format cannot say the graph.
    """
    graph = file.graph
    if format == "toro" and graph.space == "sim3":
        raise ValueError(f"a graph in {WORDS['sim3']}: TORO's and GTSAM's text cannot say it; use .g2o")
    room = g2o if format == "g2o" else toro
    vertex, edge = room.TAGS[graph.space]
    tail = " 1 1 0 0" if vertex == "VERTEX_SIM3:EXPMAP" else ""  # the camera that g2o expects there
    lines = []
    poses = room.columns(graph.space, graph.T_world).tolist()
    for name, row, there in zip(file.ids.tolist(), poses, file.placed.tolist(), strict=True):
        if there:
            lines.append(f"{vertex} {name} {_words(row)}{tail}")
    if format == "g2o" and file.told_fixed.any():
        lines.append(g2o.fixed_line(iter(file.ids[file.told_fixed].tolist())))
    ends = zip(file.ids[graph.tail].tolist(), file.ids[graph.head].tolist(), strict=True)
    measured = room.columns(graph.space, graph.measured)
    rows = np.concatenate([measured, room.triangles(graph.space, graph.information)], 1).tolist()
    lines += [f"{edge} {i} {j} {_words(row)}" for (i, j), row in zip(ends, rows, strict=True)]
    return "\n".join(lines) + "\n"


def _words(row: list[float]) -> str:
    return " ".join(map(repr, row))
