"""ORB-SLAM's text form of DBoW2: ``k L scoring weighting``, then a line for each node from 1 on.

``parent leaf b0 ... b31 weight``, where ``leaf`` is 1 for a word and 0 else; words count in the order of
their lines.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.datasets.text import FormatError, number
from vslam_ref.datasets.vocabulary_files.nodes import ListedNodes, VocabularyFile, header
from vslam_ref.datasets.vocabulary_files.storage import TYPED, _whole, descriptor_bytes
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.features.vocabulary.tree import BYTES
from vslam_ref.support.files import write_text as write_file

HEADER = ("k", "L", "scoring", "weighting")


def parse_text(path: Path, text: str) -> VocabularyFile:
    """Read a vocabulary from the text of such a file.

    Raises
    ------
    FormatError
        Where a line is not as stated, or the nodes are no tree.
    """
    rows = [(line, row.split()) for line, row in enumerate(text.split("\n"), 1) if row.strip()]
    if len(rows) < 2:
        raise FormatError(
            path, None, "no nodes; expected a line k L scoring weighting, and one for each node"
        )
    line, words = rows[0]
    if len(words) != len(HEADER):
        raise FormatError(path, line, f"{len(words)} numbers; expected {' '.join(HEADER)}")
    k, L, scoring, weighting = (_whole(path, line, w, n) for w, n in zip(words, HEADER, strict=True))
    header(path, line, k, L, scoring, weighting)
    listed, leaves, typed = _listed(path, rows[1:])
    return listed.tree(leaves, k, L, "dbow3" if typed else "text")


def _listed(path: Path, rows: list[tuple[int, list[str]]]) -> tuple[ListedNodes, np.ndarray, bool]:
    """Nodes of the lines, which of them are words, and whether descriptors say type and length."""
    n = len(rows)
    parents, weight, leaf = np.zeros(n, np.int64), np.zeros(n), np.zeros(n, np.bool_)
    descriptor = np.zeros((n, BYTES), np.uint8)
    typed = len(rows[0][1]) == BYTES + len(TYPED) + 3
    columns = BYTES + 3 + (len(TYPED) if typed else 0)
    for row, (line, words) in enumerate(rows):
        if len(words) != columns:
            raise FormatError(
                path, line, f"{len(words)} columns; expected {columns}: parent leaf bytes weight"
            )
        parents[row] = _whole(path, line, words[0], "parent")
        if words[1] not in ("0", "1"):
            raise FormatError(path, line, f"leaf is {words[1]!r}; expected 0 or 1")
        leaf[row] = words[1] == "1"
        descriptor[row] = descriptor_bytes(path, line, words[2:-1], typed)
        weight[row] = number(path, line, words[-1], "weight")
    lines = [line for line, _ in rows]
    listed = ListedNodes(path, np.arange(1, n + 1), parents, descriptor, weight, lines)
    return listed, np.flatnonzero(leaf), typed


def write_text(path: Path, vocabulary: Vocabulary) -> None:
    """Write a vocabulary so.

    Raises
    ------
    ValueError
        If its words do not stand in the order of their nodes, which this form cannot say.
    """
    v = vocabulary
    if (np.diff(v.node) < 0).any():
        raise ValueError("words in another order than their nodes: need write_storage, or write_vocabulary")
    out = [f"{v.branching} {v.levels} 0 0"]
    for node in range(1, len(v.children)):
        word = int(v.word[node])
        weight = float(v.weight[word]) if word >= 0 else 0.0
        text = " ".join(map(str, v.descriptor[node].tolist()))
        out.append(f"{v.parent[node]} {int(word >= 0)} {text} {weight!r}")
    write_file(path, "\n".join(out) + "\n")
