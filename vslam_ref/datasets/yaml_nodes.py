"""YAML files as trees of nodes that know their lines; nothing in them is ever constructed or executed.

OpenCV begins its files with ``%YAML:1.0``, which no YAML standard knows; that line is taken as a comment.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import FormatError, decoded, number

T = TypeVar("T")
MAX_BYTES = 2**20
LONGEST = 1e12
"""Calibration and map files are flat and short: what is larger is another kind of file."""


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
        """Entries of a mapping, or FormatError; a key that stands twice is an error too."""
        if self.raw.id != "mapping":
            raise self.error(f"{self.name} is {_kind(self.raw)}; expected entries 'key: value'")
        found: dict[str, Node] = {}
        for key, value in self.raw.value:
            at = Node(self.path, str(key.value), value)
            if key.id != "scalar":
                raise self.error(f"a key of {self.name} is {_kind(key)}; expected a word")
            if key.value in found:
                raise Node(self.path, "", key).error(f"{key.value} again; expected it once")
            found[key.value] = at
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
        if lengths and len(elements) not in lengths:
            right = " or ".join(map(str, lengths))
            raise self.error(f"{self.name} has {len(elements)} numbers; expected {right}")
        return np.array([element.number() for element in elements], dtype=np.float64)

    def matrix(self) -> Array:
        """Matrix given as rows, cols, data, with or without OpenCV's tag, or as a list of rows."""
        if self.raw.id == "sequence":
            rows = [row.vector() for row in self.elements()]
            if len({len(row) for row in rows}) != 1:
                raise self.error(f"rows of {self.name} differ in length; expected a matrix")
            return np.array(rows)
        rows_, cols, data = self.get("rows").integer(0), self.get("cols").integer(0), self.get("data")
        values = data.vector()
        if len(values) != rows_ * cols:
            raise data.error(f"{self.name} has {len(values)} numbers; expected {rows_} x {cols}")
        return values.reshape(rows_, cols)


def _kind(raw: Any) -> str:
    return {"scalar": "one value", "sequence": "a list", "mapping": "a set of entries"}[raw.id]


def read_yaml(path: Path) -> Node:
    """Parse a file with one YAML document.

    Raises
    ------
    FormatError
        Where it cannot be read: no file, not text, too long, nested too deeply, or against YAML's grammar.
    """
    import yaml

    text = _read_text(path)
    try:
        raw = yaml.compose(text, Loader=yaml.SafeLoader)
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
    return Node(path, "the file", raw)


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _read_text(path: Path) -> str:
    """The file's text, its first line made a comment if it names a YAML version."""
    if not path.is_file():
        raise FormatError(path, None, "no such file")
    with path.open("rb") as stream:
        data = stream.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise FormatError(path, None, f"more than {MAX_BYTES} bytes; is this the right file?")
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
