"""Which pictures a folder or a list has, in which order, and which ones are missing between them."""

from __future__ import annotations

import re
from collections.abc import Sequence as Items
from pathlib import Path

import numpy as np

from vslam_ref.datasets.pictures import SUFFIXES
from vslam_ref.datasets.text import FormatError

GAPS = 0.1
"""Share of all pictures that may be missing between the others; beyond it, numbers are only names."""
_DECIMAL = re.compile(r"[0-9]{1,18}\.[0-9]{1,18}")


def pictures_in(folder: Path, ending: str = "") -> list[Path]:
    """Pictures of a folder in the order of the numbers in their names; ``ending`` is that of their stems.

    Raises
    ------
    FormatError
        If there is none.
    """
    found = [
        path
        for path in folder.iterdir()
        if path.suffix.lower() in SUFFIXES
        and path.stem.endswith(ending)
        and not path.name.startswith(".")
        and path.is_file()
    ]
    if not found:
        raise FormatError(folder, None, f"no picture in this folder; expected {', '.join(SUFFIXES)}")
    if all(_DECIMAL.fullmatch(path.stem) for path in found):  # stamps in seconds
        return sorted(found, key=lambda path: (float(path.stem), path.name))
    return sorted(found, key=_natural)


def _natural(path: Path) -> tuple[list[tuple[int, int, str]], str]:
    """Sort key: runs of digits count as numbers, so 9.jpg comes before 10.jpg."""
    words = re.split(r"([0-9]+)", path.name)
    return [(1, int(w), "") if w.isascii() and w.isdigit() else (0, 0, w) for w in words], path.name


def with_gaps(pictures: Items[Path]) -> list[Path]:
    """Put the missing ones between pictures that are numbered evenly; else return them as they are.

    Names count as numbered if they differ in their last run of digits only.

    Examples
    --------
    >>> there = [Path(f"{k:02d}.png") for k in range(12) if k != 7]
    >>> [str(path) for path in with_gaps(there)][6:9]
    ['06.png', '07.png', '08.png']
    """
    parts = [re.fullmatch(r"(.*?)([0-9]{1,15})([^0-9]*)", path.name) for path in pictures]
    if len(parts) < 3 or any(part is None for part in parts):
        return list(pictures)
    matched = [part for part in parts if part is not None]
    numbers = np.array([int(part[2]) for part in matched])
    step = np.diff(numbers)
    usual = int(np.median(step))
    if (
        len({(part[1], part[3]) for part in matched}) > 1
        or usual < 1
        or (step < 1).any()
        or (step % usual).any()
    ):
        return list(pictures)
    missing = int((step // usual - 1).sum())
    if missing > GAPS * len(numbers):
        return list(pictures)
    there = dict(zip(numbers.tolist(), pictures, strict=True))
    first, width = matched[0], len(matched[0][2])
    head, tail = first[1], first[3]
    every = range(int(numbers[0]), int(numbers[-1]) + 1, usual)
    return [there.get(n, pictures[0].with_name(f"{head}{n:0{width}d}{tail}")) for n in every]


def inside(folder: Path, listed: Path, line: int, name: str) -> Path:
    """Path of a picture that a list names: it must lie in the list's folder, there or not.

    Raises
    ------
    FormatError
        At ``line`` of the file ``listed``, on a name that leads out of the folder or that no file can have.
    """
    parts = Path(name).parts
    if not parts or Path(name).is_absolute() or ".." in parts or "\0" in name or "\\" in name:
        raise FormatError(listed, line, f"picture {name!r}; expected the name of a file in {folder.name}/")
    if Path(name).suffix.lower() not in SUFFIXES:
        raise FormatError(listed, line, f"picture {name!r}; expected one of {', '.join(SUFFIXES)}")
    return folder / name
