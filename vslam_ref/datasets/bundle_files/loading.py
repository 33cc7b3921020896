"""Getting a bundle file into memory: how much is unpacked at most, and the checks that all formats share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.text import FormatError, read_bytes
from vslam_ref.geometry import so3

LARGEST = 2 * 2**30
"""Bytes.  The largest BAL problem, 13682 cameras and 29 million observations, has about 1.7 GB of text."""
RATIO = 32
"""Printed measurements shrink 3 to 5 times.  What shrinks more than this is not a bundle file."""
SMALL = 64 * 2**20
"""Bytes that any archive may unpack to: text full of zeros shrinks a thousand times."""
FARTHEST = 1e15
"""A coordinate this large, beside another of 1, has no digits left for it."""
UNIT_TOLERANCE = 1e-3
"""Largest entry of R^T R - I that is taken for rounding: four decimals."""


def load(path: Path, max_bytes: int | None = None) -> bytes:
    """Read a file, unpacked if it ends in ``.gz`` or ``.bz2``.

    Parameters
    ----------
    path : Path
    max_bytes : int, optional
        Limit of the unpacked size.  By default ``LARGEST``, and of an archive no more than ``RATIO`` times
        its own size or ``SMALL``.

    Raises
    ------
    FormatError
        Beyond the limit, on a missing file, a damaged archive, or an empty one.
    """
    limit = max_bytes
    if limit is None:
        packed = path.suffix in (".gz", ".bz2") and path.is_file()
        limit = min(LARGEST, max(SMALL, RATIO * path.stat().st_size)) if packed else LARGEST
    data = read_bytes(path, limit)
    if not data.strip():
        raise FormatError(path, None, "the file is empty; expected a bundle adjustment problem")
    return data


def require_room(path: Path, line: int | None, counts: str, needed: int, size: int) -> None:
    """Refuse counts that cannot fit the file, before memory of their size is taken.

    Parameters
    ----------
    path, line
        Where the counts stand.
    counts : str
        In words.
    needed, size : int
        Bytes that they need at least, and that there are.
    """
    if needed > size:
        what = f"{counts} need at least {needed} bytes; the file has {size}: truncated, or a wrong count"
        raise FormatError(path, line, what)


def first_of_each(view: IntArray, point: IntArray) -> BoolArray:
    """Which observations are the first of their view and point, shape (n,).

    Examples
    --------
    >>> first_of_each(np.array([0, 1, 0, 0]), np.array([5, 5, 5, 6])).tolist()
    [True, True, False, True]
    """
    order = np.lexsort((np.arange(len(view)), point, view))
    first = np.ones(len(view), dtype=np.bool_)
    first[order[1:]] = (np.diff(view[order]) != 0) | (np.diff(point[order]) != 0)
    return first


def told_again(again: BoolArray, who: str = "a camera") -> tuple[str, ...]:
    """What is told where observations (n,) were left out since their view has the point already.

    Examples
    --------
    >>> told_again(np.array([False, True]))
    ('1 observation of a point that a camera sees twice left out: the first one is kept',)
    """
    count = int(again.sum())
    what = f"of a point that {who} sees twice left out: the first one is kept"
    return (f"{counted(count, 'observation')} {what}",) if count else ()


def counted(count: int, noun: str) -> str:
    """A number and its noun.

    Examples
    --------
    >>> counted(1, "camera"), counted(2, "camera")
    ('1 camera', '2 cameras')
    """
    return f"{count} {noun}{'' if count == 1 else 's'}"


def rotations(path: Path, R: Array, line: Callable[[int], int | None], what: str) -> Array:
    """Rotations (V, 3, 3) nearest to the matrices of a file, which are rounded there.

    Raises
    ------
    FormatError
        If one is farther from a rotation than rounding explains.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max((1, 2), initial=0.0)
        good = (off <= UNIT_TOLERANCE) & (np.linalg.det(R) > 0)
    bad = np.flatnonzero(~good)
    if len(bad):
        k = int(bad[0])
        with np.errstate(over="ignore", invalid="ignore"):
            determinant = np.linalg.det(R[k])
        found = f"R^T R is off by {off[k]:.3g}, determinant {determinant:.3g}; expected 0 and 1"
        raise FormatError(path, line(k), f"R of {what} {k} is not a rotation: {found}")
    return np.asarray(so3.nearest(R)) if len(R) else R
