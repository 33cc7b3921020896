"""Pictures of a board for ``calibrate``: corners found, copies and pictures without a board set aside."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from vslam_ref.arrays import Array
    from vslam_ref.estimation.calibration import Board

SAME_VIEW = 0.25
"""Pixels, RMS: a board that has moved by less gives no other view, only another measurement of the same."""
NAMED = 40
"""Pictures that are named one by one; of more, the first and how many others."""


class BoardImages(NamedTuple):
    """Pictures with a board and their corners, those without, copies of others, and the size they all have.

    ``copies`` are pairs (picture, the one that it repeats).
    """

    used: list[Path]
    corners: list[Array]
    skipped: list[Path]
    copies: list[tuple[Path, Path]]
    size: tuple[int, int]

    @property
    def total(self) -> int:
        """Number of all pictures."""
        return len(self.used) + len(self.skipped) + len(self.copies)

    def notes(self) -> list[str]:
        """What is to be told about pictures that are not used."""
        told = [f"{path}: no board found, left out" for path in self.skipped]
        if self.copies:
            which = names([path for path, _ in self.copies])
            of = names(list(dict.fromkeys(first for _, first in self.copies)))
            what = f"{len(self.copies)} copies of one view left out, as they say nothing new"
            told.append(f"{what}: {which} (their corners are within {SAME_VIEW} px of those of {of})")
        return told

    def aside(self) -> str:
        """The same in short, behind a refusal; "" where all pictures are used."""
        parts = []
        if self.copies:
            which = names([path for path, _ in self.copies])
            parts.append(f"{len(self.copies)} of {self.total} pictures are copies of another: {which}")
        if self.skipped:
            parts.append(f"no board in {len(self.skipped)} of {self.total}: {names(self.skipped)}")
        return f" ({'; '.join(parts)})" if parts else ""


def find_boards(paths: list[Path], board: Board) -> BoardImages:
    """Look for the board in all pictures.

    Raises
    ------
    FormatError
        Where pictures differ in size, or one cannot be read.
    ValueError
        Where no picture shows the board; all of them are named.
    """
    from tqdm import tqdm

    from vslam_ref.datasets.checkerboard import find_corners
    from vslam_ref.datasets.pictures import read_grey
    from vslam_ref.datasets.text import FormatError

    found: list[tuple[Path, Array]] = []
    skipped: list[Path] = []
    size: tuple[int, int] | None = None
    for path in tqdm(paths, desc="corners", unit="image", leave=False, disable=None):
        image = read_grey(path)
        this = (image.shape[1], image.shape[0])
        if size is not None and this != size:
            right = f"the images before have {size[0]}x{size[1]}"
            raise FormatError(path, None, f"{this[0]}x{this[1]} pixels; {right}, and one camera has one size")
        size = this
        uv = find_corners(image, board.columns, board.rows)
        if uv is None:
            skipped.append(path)
        else:
            found.append((path, uv))
    if not found or size is None:
        what = f"no board of {board.columns}x{board.rows} inner corners in {len(paths)} image(s)"
        raise ValueError(f"{what}, {names(paths)}; --board counts inner corners, not squares")
    return _without_copies(found, skipped, size)


def _without_copies(
    found: list[tuple[Path, Array]], skipped: list[Path], size: tuple[int, int]
) -> BoardImages:
    """The first picture of each view; the others with the one that they repeat."""
    kept = BoardImages([], [], skipped, [], size)
    for path, uv in found:
        off = [float(np.sqrt(((uv - other) ** 2).sum(axis=1).mean())) for other in kept.corners]
        if off and min(off) < SAME_VIEW:
            kept.copies.append((path, kept.used[int(np.argmin(off))]))
        else:
            kept.used.append(path)
            kept.corners.append(uv)
    return kept


def names(paths: list[Path]) -> str:
    """File names; of very many the first, and how many others."""
    shown = ", ".join(path.name for path in paths[:NAMED])
    return shown if len(paths) <= NAMED else f"{shown}, and {len(paths) - NAMED} others"
