"""Reading pose graphs: from lines to tables, from tables to a graph, with what was odd."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.pose_graph_files import g2o, toro
from vslam_ref.datasets.pose_graph_files.lines import Kind, Table, information_names, upper
from vslam_ref.datasets.pose_graph_files.record import PoseGraphFile
from vslam_ref.datasets.text import FormatError, numbers, read_lines
from vslam_ref.estimation.posegraph import PoseGraph
from vslam_ref.estimation.posegraph.graph import parts, positive_definite
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, element_shape, scales

LARGEST = 512 * 2**20
"""Bytes; the largest graphs that are passed around have some 10 MB."""
FARTHEST = 1e12
"""A coordinate this large has no digits left for a centimetre."""
STRONGEST = 1e30
"""Bound of the information's diagonal, and one over its lower bound."""
SCALES = (np.exp(-8.0), np.exp(8.0))
UNIT = 1e-4
"""A quaternion's length this far from 1 is told: four digits explain no more."""
VERTICES = {**g2o.VERTICES, **toro.VERTICES}
EDGES = {**g2o.EDGES, **toro.EDGES}
RIGHT = "expected lines of g2o (VERTEX_SE2, EDGE_SE3:QUAT, ...) or TORO and GTSAM (VERTEX2, EDGE3, ...)"


def read_pose_graph(path: Path | str, *, max_bytes: int = LARGEST) -> PoseGraphFile:
    """Read a pose graph in g2o's, TORO's or GTSAM's text, plain or with ``.gz`` or ``.bz2``.

    Parameters
    ----------
    path : Path or str
    max_bytes : int
        Limit of the unpacked size.

    Returns
    -------
    PoseGraphFile
        ``notes`` tells lines that were left out, quaternions that were not of length 1, vertices and edges
        that stand twice, and parts that hang together nowhere.

    Raises
    ------
    FormatError
        On a line with a wrong number of columns or a word that is no finite number, an edge from a vertex to
        itself, information that is not positive definite, lines of two spaces in one file, or no edge.
    """
    path = Path(path)
    vertices, edges, fixed, other = _tables(path, max_bytes)
    if not edges:
        have = f"{sum(len(t.lines) for t in vertices.values())} vertices" if vertices else "no known line"
        raise FormatError(path, None, f"{have} and no edge; {RIGHT}")
    space = _one_space(path, vertices, edges)
    return _Assembly(path, space, vertices, edges, fixed).file(_told(other))


Tables = dict[str, Table]


def _tables(path: Path, max_bytes: int) -> tuple[Tables, Tables, Table, Counter[str]]:
    """Lines by their tags: vertices, edges, FIX; others are counted."""
    vertices: Tables = {}
    edges: Tables = {}
    fixed, other = Table(), Counter[str]()
    for line, text in read_lines(path, max_bytes):
        words = text.split()
        tag = words[0]
        if tag in VERTICES:
            _add(vertices.setdefault(tag, Table()), path, line, words, VERTICES[tag], 1)
        elif tag in EDGES:
            _add(edges.setdefault(tag, Table()), path, line, words, EDGES[tag], 2)
        elif tag == g2o.FIX:
            if len(words) < 2:
                raise FormatError(path, line, "FIX without a vertex; expected FIX id ...")
            fixed.lines += [line] * (len(words) - 1)
            fixed.ids += [(_id(path, line, word),) for word in words[1:]]
        else:
            other[tag if len(tag) <= 40 else tag[:40]] += 1
    return vertices, edges, fixed, other


def _add(table: Table, path: Path, line: int, words: list[str], kind: Kind, ends: int) -> None:
    """Add a line to its table."""
    entries = kind.entries or information_names(GROUPS[kind.space].DOF)
    names = kind.names if ends == 1 else (*kind.names, *entries)
    found = words[1 + ends :]
    longer = (*names, *kind.extra)
    if len(found) not in (len(names), len(longer)):
        right = f"{words[0]} needs {ends + len(names)}: {'id' if ends == 1 else 'i j'} {' '.join(names)}"
        raise FormatError(path, line, f"{len(words) - 1} columns after the tag; {right}")
    table.ids.append(tuple(_id(path, line, word) for word in words[1 : 1 + ends]))
    values = numbers(path, line, found, names if len(found) == len(names) else longer)
    table.rows.append(values[: len(names)])
    table.lines.append(line)


def _id(path: Path, line: int, word: str) -> int:
    # keys of GTSAM have a letter in their highest byte, and 19 digits
    if word.isascii() and word.isdigit() and len(word) <= 19 and int(word) < 2**63:
        return int(word)
    raise FormatError(path, line, f"vertex is {word!r}; expected a whole number, 0 or more")


def _one_space(path: Path, vertices: Tables, edges: Tables) -> Space:
    """The space of all lines."""
    first: dict[Space, tuple[int, str]] = {}
    for tables, kinds in ((vertices, VERTICES), (edges, EDGES)):
        for tag, table in tables.items():
            space, place = kinds[tag].space, (table.lines[0], tag)
            first[space] = min(first.get(space, place), place)
    if len(first) > 1:
        (line, tag), (before, other) = sorted(first.values(), reverse=True)[:2]
        what = f"{tag} in a file that has {other} on line {before}"
        raise FormatError(path, line, f"{what}; expected poses of one space")
    return next(iter(first))


def _told(other: Counter[str]) -> list[str]:
    """Lines of other kinds, in a sentence."""
    if not other:
        return []
    kinds = [f"{count} {tag}" for tag, count in sorted(other.items(), key=lambda one: (-one[1], one[0]))]
    shown = ", ".join(kinds[:5]) + (f" and {len(kinds) - 5} more kinds" if len(kinds) > 5 else "")
    return [f"{sum(other.values())} line(s) of other kinds left out: {shown}"]


class _Assembly:
    """Tables of a file, put together."""

    def __init__(self, path: Path, space: Space, vertices: Tables, edges: Tables, fixed: Table) -> None:
        self.path, self.space, self.fixed = path, space, fixed
        self.notes: list[str] = []
        self.format = min((table.lines[0], EDGES[tag].format) for tag, table in edges.items())[1]
        self.off: list[float] = []
        self.off_line = 0
        vertex_ids, vertex_lines, T, _ = self._joined(vertices, VERTICES)
        edge_ids, self.lines, self.measured, self.information = self._joined(edges, EDGES)
        self._require_edges(edge_ids)
        self.ids = np.unique(np.concatenate([vertex_ids.reshape(-1), edge_ids.reshape(-1)]))
        self.tail, self.head = np.searchsorted(self.ids, edge_ids).T
        self._place(vertex_ids.reshape(-1), vertex_lines, T)

    def file(self, notes: list[str]) -> PoseGraphFile:
        """Return the whole record."""
        told_fixed, fixed = self._gauge()
        graph = PoseGraph(
            self.space, self.T_world, self.tail, self.head, self.measured, self.information, fixed
        )
        self._repeated()
        if self.off:
            said = f"lengths up to {max(self.off):.2g} off 1 (first: line {self.off_line})"
            self.notes.insert(0, f"{len(self.off)} quaternion(s) normalised: {said}")
        return PoseGraphFile(
            graph,
            self.path,
            self.format,
            self.ids,
            self.placed,
            self.lines,
            told_fixed,
            (*self.notes, *notes),
        )

    def _joined(self, tables: Tables, kinds: dict[str, Kind]) -> tuple[IntArray, IntArray, Array, Array]:
        """Ids, lines, poses and information of all tables, in the order of the lines."""
        ends, d = (1 if kinds is VERTICES else 2), GROUPS[self.space].DOF
        ids = [np.zeros((0, ends), dtype=np.int64)]
        lines = [np.zeros(0, dtype=np.int64)]
        poses, information = [np.zeros((0, *element_shape(self.space)))], [np.zeros((0, d, d))]
        for tag, table in tables.items():
            kind, values = kinds[tag], table.values()
            ids.append(np.array(table.ids, dtype=np.int64))
            lines.append(np.array(table.lines, dtype=np.int64))
            k = len(kind.names)
            poses.append(self._poses(tag, kind, values[:, :k], lines[-1]))
            if kind.information is not None:
                information.append(self._information(tag, kind, values[:, k:], table))
        order = np.argsort(np.concatenate(lines), kind="stable")
        found = np.concatenate(information)
        kept = found[order] if len(found) else found
        return np.concatenate(ids)[order], np.concatenate(lines)[order], np.concatenate(poses)[order], kept

    def _poses(self, tag: str, kind: Kind, values: Array, lines: IntArray) -> Array:
        """Poses of a table; what is no pose is refused, what is nearly one told."""
        far = (np.abs(values) >= FARTHEST).any(1)
        self._require(~far, lines, f"{tag} has a number of {FARTHEST:g} or more; expected metres and radians")
        T, off = kind.poses(values)
        self._require(~np.isnan(off), lines, f"{tag} has a quaternion or a scale of 0; expected a rotation")
        if kind.space == "sim3":
            s = scales("sim3", T)
            good = (s > SCALES[0]) & (s < SCALES[1])
            self._require(good, lines, f"{tag} has a scale out of e^-8 to e^8; expected one near 1")
        if (off > UNIT).any():
            here = int(lines[np.argmax(off > UNIT)])
            self.off_line = min(self.off_line or here, here)
            self.off += off[off > UNIT].tolist()
        if kind.space == "se2":
            T = np.asarray(GROUPS["se2"].compose(T, np.zeros(3)))  # angles in (-pi, pi]
        return T

    def _information(self, tag: str, kind: Kind, values: Array, table: Table) -> Array:
        """Information of a table's edges; TORO's tags may hold it row by row."""
        assert kind.information is not None
        found = kind.information(values)
        if kind.information is toro.by_blocks and not positive_definite(found).all():
            by_rows = upper(3)(values)
            if positive_definite(by_rows).all():
                self.notes.append(f"information of {tag} read row by row: in TORO's order it makes no sense")
                found = by_rows
        diagonal = np.diagonal(found, axis1=1, axis2=2)
        bounded = ((diagonal < STRONGEST) & (diagonal > 1.0 / STRONGEST)).all(1)
        good = positive_definite(found) & bounded
        if not good.all():
            k = int(np.argmin(good))
            least = float(np.linalg.eigvalsh(found[k])[0])
            i, j = table.ids[k]
            what = f"{tag}: information of edge {i} -> {j} with least eigenvalue {least:.3g}"
            right = "expected a positive definite matrix, its upper triangle"
            raise FormatError(self.path, table.lines[k], f"{what}; {right}")
        return found

    def _require(self, good: Any, lines: IntArray, what: str) -> None:
        if not good.all():
            raise FormatError(self.path, int(lines[np.argmin(good)]), what)

    def _require_edges(self, ids: IntArray) -> None:
        same = ids[:, 0] == ids[:, 1]
        if same.any():
            k = int(np.argmax(same))
            what = f"edge from vertex {ids[k, 0]} to itself; expected two vertices"
            raise FormatError(self.path, int(self.lines[k]), what)

    def _place(self, ids: IntArray, lines: IntArray, T: Array) -> None:
        """Poses of the nodes: of those that stand twice the first one."""
        node = np.searchsorted(self.ids, ids)
        placed, first = np.unique(node, return_index=True)
        self.T_world = GROUPS[self.space].identity((len(self.ids),))
        self.T_world[placed] = T[first]
        self.placed = np.zeros(len(self.ids), dtype=np.bool_)
        self.placed[placed] = True
        again = np.setdiff1d(np.arange(len(ids)), first)
        if len(again):
            k = int(again[0])
            before = int(lines[first[np.searchsorted(placed, node[k])]])
            said = f"vertex {ids[k]} on lines {before} and {lines[k]}"
            self.notes.append(f"{len(again)} vertex line(s) again for the same id ({said}): the first counts")

    def _gauge(self) -> tuple[BoolArray, BoolArray]:
        """Nodes that the file fixes; and, with them, the first node of every other part."""
        n = len(self.ids)
        told = np.zeros(n, dtype=np.bool_)
        for line, (name,) in zip(self.fixed.lines, self.fixed.ids, strict=True):
            at = int(np.searchsorted(self.ids, name))
            if at == n or self.ids[at] != name or not self.placed[at]:
                what = f"FIX names vertex {name}, which has no VERTEX line; expected one with a pose"
                raise FormatError(self.path, line, what)
            told[at] = True
        part = parts(n, self.tail, self.head)
        first = np.unique(part, return_index=True)[1]
        fixed = told.copy()
        fixed[[k for k in first.tolist() if part[k] not in part[told]]] = True
        count = int(part.max(initial=-1)) + 1
        if count > 1:
            alone = int((np.bincount(part) == 1).sum())
            which = f"; {alone} of them a vertex without edges" if alone else ""
            self.notes.append(
                f"{count} parts that no edge joins{which}: each is held at its first vertex, or as FIX says"
            )
        return told, fixed

    def _repeated(self) -> None:
        """Tell edges that repeat one before them, number for number."""
        m = len(self.lines)
        rows = np.column_stack(
            [self.tail, self.head, self.measured.reshape(m, -1), self.information.reshape(m, -1)]
        )
        _, first = np.unique(rows, axis=0, return_index=True)
        again = np.setdiff1d(np.arange(m), first)
        if len(again):
            where = f"first: line {self.lines[again[0]]}"
            self.notes.append(
                f"{len(again)} edge(s) repeat one before, number for number ({where}): each counts"
            )
