"""Lines of a table as words: separators, comments and headers as programs write them.

Words are parted by blanks, tabs, commas or semicolons; a line may end with a separator.  Lines that begin
with ``#``, ``%`` or ``//`` are comments.  Names of columns stand in the first line without a number in it, or
in a comment above the data.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from vslam_ref.datasets.text import FormatError, is_number, read_text
from vslam_ref.datasets.trajectories.names import Layout, layout, split_header

COMMENTS = ("#", "%", "//")
_LOST = re.compile(r"[-+]?(nan|inf|infinity)(\(.*\))?|[-+]?1\.#.*|n/?a|none|null|<na>|", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?")


class Rows(NamedTuple):
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
    """

    path: Path
    words: list[list[str]]
    lines: list[int]
    commas: bool
    header: Layout | None
    notes: tuple[str, ...]


def read_rows(path: Path) -> Rows:
    """Read the words of a table.

    Raises
    ------
    FormatError
        If a line has more or fewer columns than the first, there is none, or a header names no pose.
    """
    text = read_text(path)
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
    names = split_header(kept[0])
    if _is_header(names):
        pairs = [(n, line) for n, line in zip(lines, kept, strict=True) if line != kept[0]]
        if not pairs:
            raise FormatError(path, None, "no data below the header; expected one pose a line")
        first, lines, kept = lines[0], [n for n, _ in pairs], [line for _, line in pairs]
        commas, words = _same_columns(path, lines, kept, len(names), text)
        header, notes = _named(path, first, names, len(words[0]))
        return Rows(path, words, lines, commas, header, notes)
    commas, words = _same_columns(path, lines, kept, None, text)
    return Rows(path, words, lines, commas, _of_comments(comments, len(words[0])), ())


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
    if any(" " in word or "\t" in word for word in words) and not any(
        map(re.compile("[a-zA-Z]{4}").search, words)
    ):
        words = [part for word in words for part in word.split() or [""]]
    return True, words


def _same_columns(
    path: Path, lines: list[int], kept: list[str], count: int | None, text: str
) -> tuple[bool, list[list[str]]]:
    """Words of all lines, as many in each as in the header or the first line; separators at the end go."""
    commas, first = _split(kept[0])
    if count is None:
        while len(first) > 1 and first[-1] == "":
            first.pop()
        count = len(first)
    elif len(first) == count + 1 and first[-1] != "" and not commas:
        count += 1  # a table whose rows have a name that the header does not
    found = []
    for number, line in zip(lines, kept, strict=True):
        words = _split(line)[1]
        if len(words) > count and not any(words[count:]):
            words = words[:count]
        if len(words) != count:
            cut = number == lines[-1] and len(words) < count and not text.endswith(("\n", "\r"))
            why = (
                "; the file ends within this line, as of a program that was stopped: take it out"
                if cut
                else ""
            )
            raise FormatError(
                path, number, f"{len(words)} columns; expected {count}, as in the first line{why}"
            )
        found.append(words)
    return commas, found


def _is_header(names: list[str]) -> bool:
    """Whether a line has names only: no number, and some letters."""
    words = [name for name in names if name]
    return bool(words) and all(
        re.search("[A-Za-z]", w) and not is_number(w) and not is_lost(w) for w in words
    )


def _named(path: Path, line: int, names: list[str], count: int) -> tuple[Layout | None, tuple[str, ...]]:
    """The layout that a header tells, or what to do without."""
    found = layout(names) if len(names) == count else f"{len(names)} names for {count} columns"
    if isinstance(found, Layout):
        return found, ()
    if any(isinstance(layout([*names, *more]), Layout) for more in (["time"], ["qw", "qx", "qy", "qz"])):
        right = "expected names of time, position and quaternion: time tx ty tz qx qy qz qw"
        raise FormatError(path, line, f"the header has {found}; {right}")
    told = (
        f"line {line} ({' '.join(names)[:40]}) names no pose: the columns are taken to be in the usual order"
    )
    return None, (told,)


def _of_comments(comments: list[str], count: int) -> Layout | None:
    """The layout that the last comment with as many names tells, if one does."""
    for text in reversed(comments):
        names = split_header(text)
        found = layout(names) if len(names) == count else ""
        if isinstance(found, Layout):
            return found
    return None
