"""Text files that are one long row of numbers, as BAL's and Bundler's: read fast, wrong ones found by line.

Where a line ends says nothing in such a file, only how many numbers come.  Millions of them are turned
to doubles piece by piece; the line of a number is looked for only when something is wrong with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.text import FormatError

ALLOWED = b"0123456789+-.eE \t\r\n"
"""No ``nan``, no ``inf``, no ``1_000``: a number of these files has nothing else."""
LONGEST_WORD = 400
"""A double printed in full without an exponent has up to 311 digits before the point."""
PIECE = 2**22
"""Bytes that are turned to numbers at a time."""


@dataclass(frozen=True)
class Numbers:
    """The numbers of a file, finite, and where they stand.

    Parameters
    ----------
    path : Path
    data : bytes
        The file's text.
    values : ndarray, shape (n,)
    """

    path: Path
    data: bytes
    values: Array

    def line(self, at: int) -> int:
        """Line of number ``at``, from 1; of the last line for ``at`` beyond the end."""
        for k, match in enumerate(re.finditer(rb"\S+", self.data)):
            if k == at:
                return self.data.count(b"\n", 0, match.start()) + 1
        return self.data.rstrip().count(b"\n") + 1

    def error(self, at: int, what: str) -> FormatError:
        """The error at number ``at``."""
        return FormatError(self.path, self.line(at), what)

    def require(self, good: NDArray[np.bool_], at: ArrayLike, name: str, right: str) -> None:
        """Raise :class:`FormatError` at the first number that is not ``good``.

        Parameters
        ----------
        good : ndarray of bool
        at : array_like of int
            Places in ``values``, of the same shape.
        name, right : str
            What these numbers are, and what they should be.
        """
        bad = np.flatnonzero(~np.ravel(good))
        if len(bad):
            k = int(np.ravel(np.asarray(at))[bad[0]])
            raise self.error(k, f"{name} is {self.values[k]:g}; expected {right}")

    def whole(self, at: ArrayLike, name: str, below: int, *, right: str = "") -> IntArray:
        """Numbers as integers from 0 to ``below`` - 1, or :class:`FormatError` at the first other one."""
        places = np.asarray(at)
        values = self.values[places]
        right = right or (f"a whole number from 0 to {below - 1}" if below > 0 else "none, there are none")
        self.require((values >= 0) & (values < below) & (values == np.floor(values)), places, name, right)
        found: IntArray = values.astype(np.int64)
        return found

    def require_below(self, limit: float) -> None:
        """Raise :class:`FormatError` at the first number whose size is not below a limit."""
        if len(self.values) and not max(self.values.max(), -self.values.min()) < limit:
            at = int(np.argmax(~(np.abs(self.values) < limit)))
            raise self.error(at, f"a number is {self.values[at]:g}; expected less than {limit:g} in size")

    def require_count(self, count: int, why: str) -> None:
        """Raise :class:`FormatError` unless there are exactly ``count`` numbers; ``why`` says of what."""
        if len(self.values) < count:
            what = f"the file ends after {len(self.values)} numbers; expected {count}: {why}"
            raise self.error(len(self.values), what)
        if len(self.values) > count:
            raise self.error(count, f"numbers go on; expected {count} in the file: {why}")


def read_numbers(path: Path, data: bytes) -> Numbers:
    r"""Turn a text to numbers.

    Parameters
    ----------
    path : Path
        For errors.
    data : bytes
        The text; a comment at its beginning must have been blanked.

    Raises
    ------
    FormatError
        At the first word that is not a finite number.

    Examples
    --------
    >>> found = read_numbers(Path("a.txt"), b"1 2\n3e2")
    >>> found.values.tolist(), found.line(2)
    ([1.0, 2.0, 300.0], 2)
    >>> read_numbers(Path("a.txt"), b"1 2\nnan 4")
    Traceback (most recent call last):
    vslam_ref.datasets.text.FormatError: a.txt:2: 'nan' is not a number; expected a finite number
    """
    parts: list[Array] = []
    for start, stop in _pieces(data):
        piece = data[start:stop]
        words = piece.split()
        if piece.translate(None, ALLOWED) or max(map(len, words), default=0) > LONGEST_WORD:
            raise _wrong_word(path, data, start, stop)
        try:
            values = np.array(list(map(float, words)), dtype=np.float64)
        except ValueError:
            raise _wrong_word(path, data, start, stop) from None
        if not np.isfinite(values).all():
            raise _wrong_word(path, data, start, stop)
        parts.append(values)
    return Numbers(path, data, np.concatenate(parts) if parts else np.zeros(0))


def _pieces(data: bytes) -> Iterator[tuple[int, int]]:
    """Begin and end of pieces that cut no word."""
    start = 0
    while start < len(data):
        stop = min(start + PIECE, len(data))
        if stop < len(data):
            cut = max(data.rfind(space, start, stop) for space in (b"\n", b" "))
            stop = cut + 1 if cut >= start else stop  # a word of this size is refused anyway
        yield start, stop
        start = stop


def _wrong_word(path: Path, data: bytes, start: int, stop: int) -> FormatError:
    """The error at the first word of a piece that is not a finite number."""
    at, what = start, "not a text of numbers; expected digits, blanks and line ends"
    for match in re.finditer(rb"\S+", data[start:stop]):
        if not _is_number(match[0]):
            at, word = start + match.start(), match[0]
            shown = word[:40].decode("ascii", "backslashreplace")
            what = f"{shown!r} is not a number; expected a finite number"
            if len(word) > LONGEST_WORD:
                what = f"a word of {len(word)} characters; expected a number of at most {LONGEST_WORD}"
            break
    return FormatError(path, data.count(b"\n", 0, at) + 1, what)


def _is_number(word: bytes) -> bool:
    if len(word) > LONGEST_WORD or word.translate(None, ALLOWED):
        return False
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
