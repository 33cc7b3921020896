"""Reading numbers from text files that others wrote: plain or gzipped, with errors that say where.

Every error of this room is a :class:`FormatError`: one line with the file, the line number, what is
wrong and what would be right.  Decompression stops at a limit, so a small file cannot fill the memory.
"""

from __future__ import annotations

import gzip
import math
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

MAX_BYTES = 64 * 2**20
"""Unpacked size at which reading stops; the largest known log of this kind has 3 MiB."""


class FormatError(ValueError):
    """A file is not what it should be; the message is one line, ``file:line: what; what is right``."""

    def __init__(self, path: Path, line: int | None, what: str) -> None:
        self.path, self.line = path, line
        super().__init__(f"{path}{'' if line is None else f':{line}'}: {what}")


class Columns(NamedTuple):
    """Rows of a text table: the file, values (n, k) and the line number (n,) of each row."""

    path: Path
    values: Array
    lines: IntArray


def existing(folder: Path, name: str) -> Path:
    """Return ``folder/name`` or ``folder/name.gz``, whichever is there.

    Raises
    ------
    FormatError
        If neither is.
    """
    for path in (folder / name, folder / f"{name}.gz"):
        if path.is_file():
            return path
    raise FormatError(folder / name, None, "no such file, plain or with .gz")


def read_lines(path: Path, max_bytes: int = MAX_BYTES) -> Iterator[tuple[int, str]]:
    """Yield (line number, text) of the lines that are neither empty nor ``#`` comments.

    Raises
    ------
    FormatError
        On a damaged archive, more than ``max_bytes`` of text, or bytes that are no text.
    """
    try:
        with gzip.open(path, "rb") if path.suffix == ".gz" else path.open("rb") as stream:
            data = stream.read(max_bytes + 1)
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise FormatError(path, None, f"damaged gzip file ({error}); fetch it again") from None
    if len(data) > max_bytes:
        raise FormatError(path, None, f"more than {max_bytes} bytes unpacked; is this the right file?")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise FormatError(path, line, "not a text file; UTF-8 expected") from None
    for number, line_text in enumerate(text.splitlines(), 1):
        stripped = line_text.strip()
        if stripped and not stripped.startswith("#"):
            yield number, stripped


def number(path: Path, line: int, word: str, name: str) -> float:
    """Read one finite number, or raise :class:`FormatError` with the column's name."""
    try:
        value = float(word)
    except ValueError:
        raise FormatError(path, line, f"{name} is {word!r}; expected a number") from None
    if not math.isfinite(value):
        raise FormatError(path, line, f"{name} is {word!r}; expected a finite number")
    return value


def read_columns(path: Path, names: Sequence[str]) -> Columns:
    """Read a table of finite numbers, one row a line, separated by blanks.

    Parameters
    ----------
    path : Path
        Plain text or ``.gz``.
    names : sequence of str
        What the columns are, for errors; every line must have exactly these.

    Raises
    ------
    FormatError
        On a wrong number of columns, a word that is no finite number, or no row at all.
    """
    rows: list[list[float]] = []
    lines: list[int] = []
    for line, text in read_lines(path):
        words = text.split()
        if len(words) != len(names):
            right = f"expected {len(names)}: {', '.join(names)}"
            raise FormatError(path, line, f"{len(words)} columns; {right}")
        rows.append([number(path, line, word, name) for word, name in zip(words, names, strict=True)])
        lines.append(line)
    if not rows:
        raise FormatError(path, None, f"no data; expected lines of {', '.join(names)}")
    return Columns(path, np.array(rows), np.array(lines))


def require_order(table: Columns, column: int, *, strict: bool = False) -> None:
    """Raise :class:`FormatError` at the first row whose time lies before that of the row above.

    With ``strict``, equal times are refused too.
    """
    step = np.diff(table.values[:, column])
    bad = np.flatnonzero(step <= 0 if strict else step < 0)
    if len(bad):
        at = int(bad[0]) + 1
        before, now = table.values[at - 1, column], table.values[at, column]
        what = f"time {now:.3f} s after {before:.3f} s; times must not go back"
        raise FormatError(table.path, int(table.lines[at]), what)


def require_integers(table: Columns, column: int, name: str) -> IntArray:
    """Return a column as integers, or raise :class:`FormatError` at the first that is none."""
    values = table.values[:, column]
    bad = np.flatnonzero(values != np.round(values))
    if len(bad):
        at = int(bad[0])
        raise FormatError(table.path, int(table.lines[at]), f"{name} is {values[at]:g}; expected an integer")
    return values.astype(np.int64)
