"""YAML of DBoW2 and DBoW3: a header, a list of nodes, and a list that gives each word its node.

The lists have ten thousands of entries of one shape, which are read entry by entry, not as YAML: so a file of
a million words takes seconds, and nothing in it can be constructed.  DBoW3 writes the type of the
descriptor's elements and their number before them, "0 32".
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.datasets.text import FormatError, number
from vslam_ref.datasets.vocabulary_files.nodes import ListedNodes, VocabularyFile, header
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.features.vocabulary.tree import BYTES
from vslam_ref.support.files import write_text as write_file

HEADER = ("k", "L", "scoringType", "weightingType")
KEY = re.compile(r"[ \t]*([A-Za-z]\w*)[ \t]*:[ \t]*([^\s#]*)[ \t]*")
ENTRY = re.compile(r"\s*-\s*\{([^{}]*)\}")
WORD = r'\s*(\w+)\s*:\s*("[^"]*"|[^\s,"]+)\s*'
FIELD = re.compile(WORD)
TYPED = ("0", "32")
"""How a descriptor of DBoW3 begins: unsigned bytes, 32 of them."""
NODE = ("nodeId", "parentId", "weight", "descriptor")
LEAF = ("wordId", "nodeId")
MOST_ID = 2**31


def parse_storage(path: Path, text: str) -> VocabularyFile:
    """Read a vocabulary from the text of a YAML file.

    Raises
    ------
    FormatError
        Where it is not as DBoW2 or DBoW3 write it, or no tree.
    """
    at, numbers, line = _header(path, text)
    k, L, scoring, weighting = (numbers[name] for name in HEADER)
    header(path, line, k, L, scoring, weighting)
    entries, lines, at = _entries(path, text, at, NODE)
    at = _section(path, text, at, "words")
    words, word_lines, at = _entries(path, text, at, LEAF)
    rest = text[at:].strip()
    if rest not in ("", "..."):
        raise FormatError(path, _line(text, at) + 1, f"{rest[:40]!r} behind the words; expected the end")
    if not entries or not words:
        raise FormatError(path, None, "no nodes or no words; expected both")
    listed, typed = _listed(path, entries, lines)
    return listed.tree(_leaves(listed, words, word_lines), k, L, "dbow3" if typed else "dbow2")


def _line(text: str, at: int) -> int:
    return text.count("\n", 0, at) + 1


def _header(path: Path, text: str) -> tuple[int, dict[str, int], int]:
    """Where the nodes begin, the numbers of the header, and its line."""
    found: dict[str, int] = {}
    at = 0
    for line, row in enumerate(text.splitlines(keepends=True), 1):
        at += len(row)
        said = KEY.fullmatch(row.rstrip())
        if said is None:
            if row.strip() in ("", "---") or row.startswith("%YAML"):
                continue
            raise FormatError(path, line, f"{row.strip()[:40]!r}; expected vocabulary: k, L, ... nodes:")
        name, value = said[1], said[2]
        if name == "nodes":
            missing = [one for one in HEADER if one not in found]
            if missing:
                raise FormatError(path, line, f"no {', '.join(missing)} before the nodes; expected them")
            return at, found, line
        if name in found:
            raise FormatError(path, line, f"{name} again; expected it once")
        if name in HEADER:
            found[name] = _whole(path, line, value, name)
        elif value or name != "vocabulary":
            raise FormatError(path, line, f"{name}; expected one of {', '.join(HEADER)}")
    raise FormatError(path, None, "no nodes; expected vocabulary: k, L, ... nodes:")


def _whole(path: Path, line: int, word: str, name: str, least: int = 0) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 11 and least <= int(word) < MOST_ID):
        raise FormatError(path, line, f"{name} is {word!r}; expected a whole number from {least}")
    return int(word)


def _section(path: Path, text: str, at: int, name: str) -> int:
    found = re.compile(rf"\s*{name}\s*:").match(text, at)
    if found is None:
        seen = text[at:].strip()[:40]
        raise FormatError(path, _line(text, at) + 1, f"{seen!r}; expected another node, or {name}:")
    return found.end()


Entries = list[dict[str, str]]


def _entries(path: Path, text: str, at: int, names: tuple[str, ...]) -> tuple[Entries, list[int], int]:
    """Entries ``- { a:1, b:2 }`` from a place on, their lines, and where they end."""
    entries: Entries = []
    lines: list[int] = []
    whole = re.compile(r"\s*,".join(rf"\s*{name}\s*:\s*(\"[^\"]*\"|[^\s,\"]+)" for name in names) + r"\s*")
    line, seen = _line(text, at), at
    while (entry := ENTRY.match(text, at)) is not None:
        start = entry.start(1)
        line += text.count("\n", seen, start)
        seen = start
        said = whole.fullmatch(entry[1])
        if said is None:
            shown = " ".join(entry[1].split())[:60]
            raise FormatError(path, line, f"entry {shown!r}; expected {', '.join(names)}")
        entries.append(dict(zip(names, said.groups(), strict=True)))
        lines.append(line)
        at = entry.end()
    return entries, lines, at


def _listed(path: Path, entries: Entries, lines: list[int]) -> tuple[ListedNodes, bool]:
    """Nodes of the entries, and whether their descriptors say type and length."""
    n = len(entries)
    ids, parents, weight = np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n)
    descriptor = np.zeros((n, BYTES), np.uint8)
    typed = len(entries[0]["descriptor"].strip('"').split()) == BYTES + len(TYPED)
    for row, (entry, line) in enumerate(zip(entries, lines, strict=True)):
        ids[row] = _whole(path, line, entry["nodeId"], "nodeId")
        parents[row] = _whole(path, line, entry["parentId"], "parentId")
        weight[row] = number(path, line, entry["weight"], "weight")
        words = entry["descriptor"].strip('"').split()
        descriptor[row] = descriptor_bytes(path, line, words, typed)
    return ListedNodes(path, ids, parents, descriptor, weight, lines), typed


def descriptor_bytes(path: Path, line: int, words: list[str], typed: bool) -> np.ndarray:
    """The 32 bytes of a descriptor, with or without type and length before them."""
    if typed:
        if tuple(words[:2]) != TYPED:
            raise FormatError(path, line, f"descriptor begins {' '.join(words[:2])!r}; expected '0 32'")
        words = words[2:]
    try:
        if len(words) != BYTES or not all(word.isascii() and word.isdigit() for word in words):
            raise ValueError
        return np.frombuffer(bytes(map(int, words)), np.uint8)
    except ValueError:
        said = f"descriptor has {len(words)} words"
        raise FormatError(path, line, f"{said}; expected {BYTES} whole numbers from 0 to 255") from None


def _leaves(listed: ListedNodes, words: Entries, lines: list[int]) -> np.ndarray:
    """Row of the node of each word."""
    row_of = {int(node): row for row, node in enumerate(listed.ids)}
    rows = np.full(len(words), -1)
    for entry, line in zip(words, lines, strict=True):
        word, node = (_whole(listed.path, line, entry[name], name) for name in LEAF)
        if word >= len(words) or rows[word] >= 0:
            said = f"word {word} {'again' if word < len(words) else f'of {len(words)} words'}"
            raise FormatError(listed.path, line, f"{said}; expected 0 to {len(words) - 1}, each once")
        if node not in row_of:
            raise FormatError(listed.path, line, f"word {word} has node {node}, which is not there")
        rows[word] = row_of[node]
    return rows


def write_storage(path: Path, vocabulary: Vocabulary, *, typed: bool = False) -> None:
    """Write a vocabulary as DBoW2's YAML, or DBoW3's if ``typed``; parents stand before their children."""
    v = vocabulary
    weight = np.zeros(len(v.children))
    weight[v.node] = v.weight
    before = " ".join(TYPED) + " " if typed else ""
    out = ["%YAML:1.0", "---", "vocabulary:", f"   k: {v.branching}", f"   L: {v.levels}"]
    out += ["   scoringType: 0", "   weightingType: 0", "   nodes:"]
    for node in range(1, len(v.children)):
        text = before + " ".join(map(str, v.descriptor[node].tolist()))
        out.append(f"      - {{ nodeId:{node}, parentId:{v.parent[node]}, weight:{float(weight[node])!r},")
        out.append(f'          descriptor:"{text} " }}')
    out.append("   words:")
    out += [f"      - {{ wordId:{word}, nodeId:{node} }}" for word, node in enumerate(v.node.tolist())]
    write_file(path, "\n".join(out) + "\n")
