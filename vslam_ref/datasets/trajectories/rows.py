"""Lines of a table as words: separators, comments and headers as programs write them.

Words are parted by blanks, tabs, commas or semicolons; a line may end with a separator.  Lines that begin
with ``#``, ``%`` or ``//`` are comments.  Names of columns stand in the first line without a number in it, or
in a comment above the data.
"""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from vslam_ref.datasets.text import FormatError, decoded, is_number, read_bytes
from vslam_ref.datasets.trajectories.names import Layout, layout, role, split_header

CUT = "; the file ends within this line, as of a program that was stopped: take it out"
COMMENTS = ("#", "%", "//")
_LOST = re.compile(r"[-+]?(nan|inf|infinity)(\(.*\))?|[-+]?1\.#.*|n/?a|none|null|<na>|", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?")


class WordTable(NamedTuple):
    """Words of the lines that are neither empty nor comments.

    Attributes
    ----------
    path : Path
    words : list of list of str
        As many in each line.
    lines : list of int
        Their line numbers.
    commas : bool
        Whether commas or semicolons part the words.
    header : Layout or None
        Where a pose stands, if names of the columns say so.
    notes : tuple of str
    cut : int
        Number of the last line if the file ends within it, without a line end; else 0.
    """

    path: Path
    words: list[list[str]]
    lines: list[int]
    commas: bool
    header: Layout | None
    notes: tuple[str, ...]
    cut: int


def read_rows(path: Path) -> WordTable:
    """Read the words of a table.

    Raises
    ------
    FormatError
        If a line has more or fewer columns than the first, there is none, or a header names no pose.
    """
    text = _text(path)
    lines: list[int] = []
    kept: list[str] = []
    comments: list[str] = []
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip("\ufeff \t")
        if line.startswith(COMMENTS):
            comments += [line.lstrip("#%/ \t")] * (not kept)
        elif line:
            lines.append(number)
            kept.append(line)
    if not kept:
        raise FormatError(path, None, "no data; expected one pose a line (TUM, KITTI or EuRoC)")
    cut = 0 if text.endswith(("\n", "\r")) else lines[-1]
    names = split_header(kept[0])
    if _is_header(names):
        pairs = [(n, line) for n, line in zip(lines, kept, strict=True) if line != kept[0]]
        if not pairs:
            raise FormatError(path, None, "no data below the header; expected one pose a line")
        first, lines, kept = lines[0], [n for n, _ in pairs], [line for _, line in pairs]
        commas, words, mixed = _same_columns(path, lines, kept, cut)
        header, notes = _named(path, first, names, len(words[0]))
        return WordTable(path, words, lines, commas, header, (*mixed, *notes), cut)
    commas, words, mixed = _same_columns(path, lines, kept, cut)
    return WordTable(path, words, lines, commas, _of_comments(comments, len(words[0])), mixed, cut)


def _text(path: Path) -> str:
    """The text of a file: UTF-8, or the UTF-16 that Windows' shell writes."""
    data = read_bytes(path)
    if data[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        return decoded(path, data)
    try:
        return data.decode("utf-16")
    except UnicodeDecodeError:
        raise FormatError(path, None, "not a text file; UTF-8 expected") from None


def is_lost(word: str) -> bool:
    """Whether a word stands for a number that is not known: ``nan``, ``-nan(ind)``, ``inf``, nothing.

    Examples
    --------
    >>> [is_lost(word) for word in ("nan", "-nan(ind)", "", "-1.#IND", "1e999", "x")]
    [True, True, True, True, False, False]
    """
    return _LOST.fullmatch(word) is not None


def _split(line: str) -> tuple[bool, list[str]]:
    """Whether commas or semicolons part the words of a line; and the words."""
    if ";" in line:
        words = [word.strip() for word in line.split(";")]
        return True, [w.replace(",", ".") if _DECIMAL_COMMA.fullmatch(w) else w for w in words]
    by_blanks = line.split()
    if "," not in line or (len(by_blanks) >= 8 and all(map(_DECIMAL_COMMA.fullmatch, by_blanks))):
        return False, [word.replace(",", ".") for word in by_blanks]
    words = [word.strip() for word in line.split(",")]
    parts = [part for word in words for part in word.split() or [""]]
    return True, parts if all(part == "" or is_number(part) for part in parts) else words


def _same_columns(
    path: Path, lines: list[int], kept: list[str], cut: int
) -> tuple[bool, list[list[str]], tuple[str, ...]]:
    """Whether commas part the words; words of all lines, as many in each as in most; what is odd.

    Separators at the end of a line go.
    """
    split = [_split(line) for line in kept]
    count = Counter(_without_end(words) for _, words in split).most_common(1)[0][0]
    found = []
    for number, (_, words) in zip(lines, split, strict=True):
        if len(words) > count and not any(words[count:]):
            words = words[:count]
        if len(words) != count:
            what = f"{len(words)} columns; expected {count}, as in the other lines"
            what += CUT if number == cut and len(words) < count else ""
            raise FormatError(path, number, what)
        found.append(words)
    other = [number for number, (commas, _) in zip(lines, split, strict=True) if commas != split[0][0]]
    told = f"separators change, first at line {other[0]}: read as if they were the same" if other else ""
    return split[0][0], found, (told,) if told else ()


def _without_end(words: list[str]) -> int:
    """How many words there are before separators that end the line."""
    count = len(words)
    while count > 1 and words[count - 1] == "":
        count -= 1
    return count


def _is_header(names: list[str]) -> bool:
    """Whether a line has names only: no number, and some letters."""
    words = [name for name in names if name]
    return bool(words) and all(
        re.search("[A-Za-z]", w) and not is_number(w) and not is_lost(w) for w in words
    )


def _named(path: Path, line: int, names: list[str], count: int) -> tuple[Layout | None, tuple[str, ...]]:
    """The layout that a header tells, or what to do without; R gives its column of row names no name."""
    names = ["", *names] if len(names) == count - 1 else names
    found = layout(names) if len(names) == count else f"{len(names)} names for {count} columns"
    if isinstance(found, Layout):
        return found, ()
    if len({role(name) for name in names} - {""}) > 3:
        right = "expected names of time, position and quaternion: time tx ty tz qx qy qz qw"
        raise FormatError(path, line, f"the header has {found}; {right}")
    told = (
        f"line {line} ({' '.join(names)[:40]}) names no pose: the columns are taken to be in the usual order"
    )
    return None, (told,)


def _of_comments(comments: list[str], count: int) -> Layout | None:
    """The layout that the last comment with names of the columns, or of the first of them, tells."""
    for text in reversed(comments):
        names = split_header(text)
        found = layout(names) if len(names) <= count else ""
        if isinstance(found, Layout):
            return found
    return None
