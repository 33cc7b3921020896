"""YAML files as trees of nodes that know their lines; nothing in them is ever constructed or executed.

OpenCV begins its files with ``%YAML:1.0``, which no YAML standard knows; that line is taken as a comment.
An alias (``*a``) costs nothing until a matrix is made of it, and a matrix has at most ``MOST_NUMBERS``: a
small file cannot fill the memory.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import FormatError, decoded, number, read_bytes

T = TypeVar("T")
HEADER, PACKED = 24, {"d": "<f8", "f": "<f4", "i": "<i4"}
"""Of a matrix in base 64: bytes before the numbers, and the types that are read."""
MAX_BYTES = 2**20
LONGEST = 1e12
"""Calibration and map files are flat and short: what is larger is another kind of file."""
MOST_NUMBERS = 4096
"""Of a matrix: the largest that is read here has sixteen."""


class Node(NamedTuple):
    """One value of a file: the file, what the value is called, and the parser's node."""

    path: Path
    name: str
    raw: Any

    @property
    def line(self) -> int:
        """Line number, from 1."""
        return int(self.raw.start_mark.line) + 1

    def error(self, what: str) -> FormatError:
        """The error at this line."""
        return FormatError(self.path, self.line, what)

    def items(self) -> dict[str, Node]:
        """Entries of a mapping, or FormatError; so is a key that stands twice, with another value."""
        if self.raw.id != "mapping":
            raise self.error(f"{self.name} is {_kind(self.raw)}; expected entries 'key: value'")
        found: dict[str, Node] = {}
        for key, value in self.raw.value:
            at = Node(self.path, str(key.value), value)
            if key.id != "scalar":
                raise self.error(f"a key of {self.name} is {_kind(key)}; expected a word")
            if key.value in found and not _same(found[key.value].raw, value):
                raise Node(self.path, "", key).error(f"{key.value} again; expected it once")
            found.setdefault(key.value, at)
        return found

    def get(self, *names: str) -> Node:
        """First entry that has one of these names, or FormatError that lists them."""
        entries = self.items()
        for name in names:
            if name in entries:
                return entries[name]
        raise self.error(f"{self.name} has no {' or '.join(names)}; found: {', '.join(entries) or 'nothing'}")

    def text(self) -> str:
        """A word or sentence."""
        if self.raw.id != "scalar":
            raise self.error(f"{self.name} is {_kind(self.raw)}; expected one word")
        return str(self.raw.value)

    def number(self) -> float:
        """A finite number."""
        return number(self.path, self.line, self.text(), self.name)

    def integer(self, least: int = 1) -> int:
        """A whole number, at least ``least``."""
        value = self.number()
        if not value.is_integer() or not least <= value < 2**31:
            raise self.error(f"{self.name} is {self.text()!r}; expected a whole number, at least {least}")
        return int(value)

    def choice(self, options: Mapping[str, T]) -> T:
        """What a word (in any case, blanks around it) stands for, or FormatError that lists the words."""
        word = self.text().strip().lower()
        if word not in options:
            raise self.error(f"{self.name} is {self.text()!r}; expected one of {', '.join(options)}")
        return options[word]

    def size(self) -> tuple[int, int]:
        """Width and height."""
        words = self.elements()
        if len(words) != 2:
            raise self.error(f"{self.name} has {len(words)} numbers; expected width and height")
        return words[0].integer(), words[1].integer()

    def elements(self) -> list[Node]:
        """Elements of a list."""
        if self.raw.id != "sequence":
            raise self.error(f"{self.name} is {_kind(self.raw)}; expected a list")
        return [Node(self.path, f"{self.name}[{i}]", value) for i, value in enumerate(self.raw.value)]

    def vector(self, *lengths: int) -> Array:
        """Numbers of a list, whose length must be one of those given (any, if none is)."""
        elements = self.elements()
        if len(elements) > MOST_NUMBERS:
            raise self.error(f"{self.name} has {len(elements)} numbers; at most {MOST_NUMBERS} are read")
        if lengths and len(elements) not in lengths:
            right = " or ".join(map(str, lengths))
            raise self.error(f"{self.name} has {len(elements)} numbers; expected {right}")
        return np.array([element.number() for element in elements], dtype=np.float64)

    def matrix(self) -> Array:
        """Matrix given as rows, cols, data, with or without OpenCV's tag, or as a list of rows."""
        if self.raw.id == "sequence":
            elements = self.elements()
            if len(elements) > MOST_NUMBERS**0.5:
                raise self.error(f"{self.name} has {len(elements)} rows; expected a matrix of a few")
            rows = [row.vector() for row in elements]
            if len({len(row) for row in rows}) != 1:
                raise self.error(f"rows of {self.name} differ in length; expected a matrix")
            return np.array(rows)
        rows_, cols, data = self.get("rows").integer(0), self.get("cols").integer(0), self.get("data")
        values = _packed(data) if data.raw.id == "scalar" else data.vector()
        if len(values) != rows_ * cols:
            raise data.error(f"{self.name} has {len(values)} numbers; expected {rows_} x {cols}")
        return values.reshape(rows_, cols)


def _same(one: Any, other: Any) -> bool:
    """Whether two values are the same word: such a line stands twice and says nothing new."""
    return one.id == other.id == "scalar" and bool(one.value == other.value)


def _packed(data: Node) -> Array:
    """Numbers that OpenCV wrote in base 64: 24 letters say their type, then come their bytes."""
    text = "".join(data.text().removeprefix("$base64$").split())
    try:
        content = base64.b64decode(text, validate=True)
        kind = content[:HEADER].decode("ascii").strip().lstrip("1")
        values = np.frombuffer(content[HEADER:], PACKED[kind])
    except (ValueError, KeyError):
        what = f"{data.name} is {data.text()!r}; expected a list of numbers, or OpenCV's base 64"
        raise data.error(what) from None
    if len(values) > MOST_NUMBERS or not np.isfinite(values).all():
        raise data.error(f"{data.name}: expected at most {MOST_NUMBERS} numbers, all of them finite")
    return values.astype(np.float64)


def _kind(raw: Any) -> str:
    return {"scalar": "one value", "sequence": "a list", "mapping": "a set of entries"}[raw.id]


def read_yaml(path: Path) -> Node:
    """Parse a file with one YAML document.

    Raises
    ------
    FormatError
        Where it cannot be read: no file, not text, too long, nested too deeply, or against YAML's grammar.
    """
    return parse_yaml(path, plain_text(path, read_bytes(path, MAX_BYTES)))


def parse_yaml(path: Path, text: str) -> Node:
    """Parse a text with one YAML document; an end ``---`` with nothing behind it is allowed.

    Raises
    ------
    FormatError
        As :func:`read_yaml`.
    """
    import yaml

    try:
        documents = yaml.compose_all(text, Loader=yaml.SafeLoader)
        raw = next(documents, None)
        after = next((one for one in documents if one is not None and one.value), None)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        what = f"{error.problem or error.context}; expected YAML"
        raise FormatError(path, mark.line + 1 if mark else None, _one_line(what)) from None
    except RecursionError:
        raise FormatError(path, None, "nested too deeply; is this the right file?") from None
    except (yaml.YAMLError, ValueError) as error:
        raise FormatError(path, None, _one_line(f"{error}; expected YAML")) from None
    if raw is None:
        raise FormatError(path, None, "empty; expected YAML")
    if after is not None:
        what = "another document begins (---); expected one"
        raise FormatError(path, int(after.start_mark.line) + 1, what)
    return Node(path, "the file", raw)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def plain_text(path: Path, data: bytes) -> str:
    """The file's text, its first line made a comment if it names a YAML version."""
    text = decoded(path, data)
    return "#" + text[1:] if text.startswith("%YAML") else text


def rigid(node: Node, T: Array) -> Array:
    """Check that a matrix is a rigid motion as far as printed digits go, or raise FormatError."""
    if T.shape != (4, 4):
        raise node.error(f"{node.name} is {T.shape[0]} x {T.shape[1]}; expected 4 x 4")
    R = T[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is not a rotation either
        is_rotation = np.allclose(R @ R.T, np.eye(3), atol=1e-4) and np.linalg.det(R) > 0
    if not is_rotation:
        raise node.error(f"{node.name} is not a rigid motion; expected a rotation in its upper left 3 x 3")
    if not np.allclose(T[3], [0, 0, 0, 1], atol=1e-9):
        raise node.error(f"last row of {node.name} is {T[3].tolist()}; expected [0, 0, 0, 1]")
    if not (np.abs(T[:3, 3]) < LONGEST).all():
        raise node.error(f"{node.name} moves by {T[:3, 3].tolist()} m; expected less than {LONGEST:g}")
    return T


def build(node: Node, make: Any, *values: float) -> Any:
    """Make a camera of numbers, its refusal as an error at this line."""
    try:
        return make(*values)
    except ValueError as error:
        raise node.error(str(error)) from None
