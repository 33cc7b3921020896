"""What a pose graph file says: the graph, and what else stands in the file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.posegraph import PoseGraph


@dataclass(frozen=True)
class PoseGraphFile:
    """A pose graph and what its file says beside it.

    Parameters
    ----------
    graph : PoseGraph
        Nodes in the order of their ids; those without a pose in the file at the identity.
    path : Path
        For errors; "graph" where there was no file.
    format : str
        "g2o" or "toro": that of the first edge.
    ids : ndarray of int, shape (n,), optional
        Numbers of the nodes in the file; by default 0, 1, 2, ...
    placed : ndarray of bool, shape (n,), optional
        Nodes that have a pose in the file; by default all.
    edge_lines : ndarray of int, shape (m,), optional
        Line of each edge in the file, 0 where there was none.
    told_fixed : ndarray of bool, shape (n,), optional
        Nodes that the file fixes; the graph fixes the first node of every other part as well.
    notes : tuple of str
        What was left out or changed, a sentence each; empty if nothing was.
    """

    graph: PoseGraph
    path: Path = Path("graph")
    format: str = "g2o"
    ids: IntArray = None  # type: ignore[assignment]
    placed: BoolArray = None  # type: ignore[assignment]
    edge_lines: IntArray = None  # type: ignore[assignment]
    told_fixed: BoolArray = None  # type: ignore[assignment]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n, m = self.graph.sizes
        usual = {
            "ids": np.arange(n),
            "placed": np.ones(n, dtype=np.bool_),
            "edge_lines": np.zeros(m, dtype=np.int64),
            "told_fixed": np.zeros(n, dtype=np.bool_),
        }
        for name, value in usual.items():
            given: object = getattr(self, name)
            object.__setattr__(self, name, value if given is None else np.asarray(given, dtype=value.dtype))
            if getattr(self, name).shape != value.shape:
                raise ValueError(f"{name} has shape {getattr(self, name).shape}: need {value.shape}")

    def at(self, T_world: Array) -> Self:
        """Return the same file with other poses, for example after the graph was solved."""
        everywhere = np.ones(len(T_world), dtype=np.bool_)
        return replace(self, graph=self.graph.at(T_world), placed=everywhere)

    def without(self, left_out: BoolArray) -> Self:
        """Return the file without some of its edges, (m,)."""
        keep = ~left_out
        if keep.all():
            return self
        graph = self.graph
        parted = PoseGraph(  # the gauge is found anew: parts may have come apart
            graph.space,
            graph.T_world,
            graph.tail[keep],
            graph.head[keep],
            graph.measured[keep],
            graph.information[keep],
        )
        return replace(self, graph=parted, edge_lines=self.edge_lines[keep])

    def edge_name(self, edge: int) -> str:
        """An edge in words: its ends, and its line where it has one."""
        graph, line = self.graph, int(self.edge_lines[edge])
        ends = f"edge {self.ids[graph.tail[edge]]} -> {self.ids[graph.head[edge]]}"
        return f"{ends} (line {line})" if line else ends

    def require_poses(self) -> None:
        """Raise :class:`FormatError` at the first edge of a node that has no pose in the file."""
        graph = self.graph
        loose = ~self.placed[graph.tail] | ~self.placed[graph.head]
        if not loose.any():
            return
        edge = int(np.argmax(loose))
        ends = (graph.tail[edge], graph.head[edge])
        node = next(self.ids[one] for one in ends if not self.placed[one])
        right = "expected a pose for every vertex, or a start from the edges (odometry or chordal)"
        line = int(self.edge_lines[edge]) or None
        raise FormatError(self.path, line, f"vertex {node} has no VERTEX line; {right}")
