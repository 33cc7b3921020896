"""Reading numbers from text files that others wrote: plain or packed, with errors that say where.

Every error of this room is a :class:`FormatError`: one line with the file, the line number, what is
wrong and what would be right.  Decompression stops at a limit, so a small file cannot fill the memory.
"""

from __future__ import annotations

import bz2
import gzip
import math
import zlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO, NamedTuple, cast

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray

MAX_BYTES = 64 * 2**20
"""Unpacked size at which reading stops; the largest known log of this kind has 3 MiB."""
_PIECE = 2**20
LONELY = 60.0
"""Seconds: no buffer of a logger is so long."""
LARGEST_INTEGER = 2**53
"""Beyond it a double does not hold every integer."""


class FormatError(ValueError):
    """A file is not what it should be; the message is one line, ``file:line: what; what is right``.

    It stays one line that a person reads, whatever the file holds: what cannot be printed is escaped, a word
    of more than ``LONGEST_WORD`` characters shortened, and of a long message the middle left out.
    """

    def __init__(self, path: Path, line: int | None, what: str) -> None:
        self.path, self.line = path, line
        place = _printable(f"{path}{'' if line is None else f':{line}'}")
        super().__init__(f"{place}: {_short(_printable(what))}")


LONGEST_WORD = 60
LONGEST_MESSAGE = 400
"""Characters."""


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _short(text: str) -> str:
    """The text with its long words cut, and its middle left out if it is still too long."""
    words = (w if len(w) <= LONGEST_WORD else f"{w[: LONGEST_WORD - 20]}…{w[-5:]}" for w in text.split(" "))
    text = " ".join(words)
    half = LONGEST_MESSAGE // 2
    return text if len(text) <= LONGEST_MESSAGE else f"{text[:half]} … {text[-half:]}"


class Columns(NamedTuple):
    """Rows of a text table: the file, values (n, k) and the line number (n,) of each row."""

    path: Path
    values: Array
    lines: IntArray

    def require(self, good: BoolArray, what: Callable[[int], str]) -> None:
        """Raise :class:`FormatError` at the first row that is not good; ``what(row)`` says what is wrong."""
        bad = np.flatnonzero(~good)
        if len(bad):
            row = int(bad[0])
            raise FormatError(self.path, int(self.lines[row]), what(row))


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


def read_bytes(path: Path, max_bytes: int = MAX_BYTES, *, whole: bool = True) -> bytes:
    """Read a file, unpacked if its name ends in ``.gz`` or ``.bz2``; unless ``whole``, its first bytes only.

    It is read piece by piece, and no more than one piece beyond the limit is ever unpacked.

    Raises
    ------
    FormatError
        On a missing file, a damaged archive, or (if ``whole``) more than ``max_bytes``.
    """
    kind = {".gz": "gzip", ".bz2": "bzip2"}.get(path.suffix, "")
    try:
        with open_packed(path) as stream:
            return _all_of(stream, path, max_bytes) if whole else stream.read(max_bytes)
    except FileNotFoundError:
        raise FormatError(path, None, "no such file") from None
    except (OSError, EOFError, zlib.error) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())
        if not kind or isinstance(error, IsADirectoryError | PermissionError):
            raise FormatError(path, None, f"cannot be read ({reason}); expected a file") from None
        raise FormatError(path, None, f"damaged {kind} file ({reason}); fetch it again") from None


def _all_of(stream: IO[bytes], path: Path, max_bytes: int) -> bytes:
    pieces: list[bytes] = []
    left = max_bytes
    while piece := stream.read(_PIECE):
        pieces.append(piece)
        left -= len(piece)
        if left < 0:
            right = f"expected at most {max_bytes}; is this the right file?"
            raise FormatError(path, None, f"more than {max_bytes} bytes unpacked; {right}")
    return b"".join(pieces)


def open_packed(path: Path) -> IO[bytes]:
    """Open a file for reading bytes, unpacked on the way if its name ends in ``.gz`` or ``.bz2``."""
    if path.suffix == ".gz":
        return cast("IO[bytes]", gzip.open(path, "rb"))
    return bz2.open(path, "rb") if path.suffix == ".bz2" else path.open("rb")


def read_text(path: Path, max_bytes: int = MAX_BYTES) -> str:
    """Read a text file as :func:`read_bytes` does; a byte order mark is dropped.

    Raises
    ------
    FormatError
        As :func:`read_bytes`, and on bytes that are not text.
    """
    return decoded(path, read_bytes(path, max_bytes))


def decoded(path: Path, data: bytes) -> str:
    """Text of a file's bytes without a byte order mark, or :class:`FormatError` where they are not UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        raise FormatError(path, line, "not a text file; UTF-8 expected") from None


def read_lines(path: Path, max_bytes: int = MAX_BYTES) -> Iterator[tuple[int, str]]:
    """Yield (line number, text) of the lines that are neither empty nor ``#`` comments.

    Raises
    ------
    FormatError
        As :func:`read_text`.
    """
    for number, line_text in enumerate(read_text(path, max_bytes).splitlines(), 1):
        stripped = line_text.strip()
        if stripped and not stripped.startswith("#"):
            yield number, stripped


def number(path: Path, line: int, word: str, name: str) -> float:
    """Read one finite number, or raise :class:`FormatError` with the column's name.

    Python's own ``1_000`` and digits of other scripts are no numbers of a file.
    """
    try:
        if "_" in word or not word.isascii():
            raise ValueError
        value = float(word)
    except ValueError:
        raise FormatError(path, line, f"{name} is {word!r}; expected a number") from None
    if not math.isfinite(value):
        raise FormatError(path, line, f"{name} is {word!r}; expected a finite number")
    return value


def numbers(path: Path, line: int, words: Sequence[str], names: Sequence[str]) -> list[float]:
    """Read the numbers of a line, which must be as many as they have names."""
    if len(words) != len(names):
        raise FormatError(path, line, f"{len(words)} columns; expected {len(names)}: {', '.join(names)}")
    return [number(path, line, word, name) for word, name in zip(words, names, strict=True)]


def is_number(word: str) -> bool:
    """Whether Python reads a word as a number, finite or not."""
    try:
        float(word)
    except ValueError:
        return False
    return True


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
        On a wrong number of columns, a word that is not a finite number, or no row at all.
    """
    rows: list[list[float]] = []
    lines: list[int] = []
    for line, text in read_lines(path):
        rows.append(numbers(path, line, text.split(), names))
        lines.append(line)
    if not rows:
        raise FormatError(path, None, f"no data; expected lines of {', '.join(names)}")
    return Columns(path, np.array(rows), np.array(lines))


def require_order(table: Columns, column: int, *, strict: bool = False) -> None:
    """Raise :class:`FormatError` at the first row whose time lies before that of the row above.

    With ``strict``, equal times are refused too.
    """
    times = table.values[:, column]
    step = np.diff(times, prepend=-np.inf)
    table.require(
        step > 0 if strict else step >= 0,
        lambda k: f"time {times[k]:.3f} s after {times[k - 1]:.3f} s; times must not go back",
    )


def sorted_by(table: Columns, column: int) -> tuple[Columns, int]:
    """The rows in the order of their times, equal ones as they stand; how many stood behind a later one.

    Raises
    ------
    FormatError
        At a time that, out of order, lies more than :data:`LONELY` from all others: a damaged stamp.
    """
    times = table.values[:, column]
    late = int(np.count_nonzero(times < np.maximum.accumulate(times)))
    if not late:
        return table, 0
    order = np.argsort(times, kind="stable")
    step = np.diff(times[order], prepend=-np.inf, append=np.inf)
    lonely = np.minimum(step[:-1], step[1:]) > LONELY
    Columns(table.path, table.values[order], table.lines[order]).require(
        ~lonely,
        lambda k: f"time {times[order[k]]:.3f} s, out of order and more than {LONELY:g} s from all others",
    )
    return Columns(table.path, table.values[order], table.lines[order]), late


def require_integers(table: Columns, column: int, name: str) -> IntArray:
    """Return a column as integers, or raise :class:`FormatError` at the first that is not an integer."""
    values = table.values[:, column]
    small = np.abs(values) < LARGEST_INTEGER
    table.require(
        (values == np.round(values)) & small,
        lambda k: f"{name} is {values[k]:g}; expected an integer{'' if small[k] else ' below 9e15'}",
    )
    return values.astype(np.int64)
