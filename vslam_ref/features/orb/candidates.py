"""Corners that may become features: FAST-9, with a lower threshold where nothing else is found."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.corners import Corners, detect, is_peak
from vslam_ref.features.fast import Pixels, corner_score
from vslam_ref.features.levels import Bytes

ARC = 9
BORDER = 19
"""Pixels around a feature: a pair of the table, turned, reaches 18 of them, and what turns is rounded."""


class Candidates(NamedTuple):
    """Corners (n, 2), whole pixels (x, y) in row order, and FAST's score (n,), grey levels."""

    xy: Pixels
    score: IntArray


def candidates(image: Bytes, threshold: int, low_threshold: int, cell: int) -> Candidates:
    """Peaks of FAST-9 that have 19 pixels around them.

    Implements :eq:`eq-orb-cell`.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W)
    threshold, low_threshold : int
        Grey levels.  In a cell with a peak at ``threshold``, those below it are left out.
    cell : int
        Side of a cell, pixels.

    Returns
    -------
    Candidates
    """
    found = _peaks(image, detect(image, threshold, ARC))
    full = np.zeros([n // cell + 3 for n in image.shape], np.bool_)  # with a cell more on each side
    full[tuple(found.xy.T[::-1] // cell + 1)] = True
    empty = ~full
    empty[:, [0, -1]] = empty[[0, -1]] = False
    rows = empty.copy()
    rows[1:] |= empty[:-1]
    rows[:-1] |= empty[1:]
    near = rows.copy()  # empty cells and those around them, whose corners are compared with theirs
    near[:, 1:] |= rows[:, :-1]
    near[:, :-1] |= rows[:, 1:]
    low = detect(image, low_threshold, ARC)
    more = _peaks(image, low.only(near[tuple(low.xy.T[::-1] // cell + 1)]))
    alone = empty[tuple(more.xy.T[::-1] // cell + 1)]  # eq-orb-cell
    xy, score = np.concatenate([found.xy, more.xy[alone]]), np.concatenate([found.score, more.score[alone]])
    order = np.lexsort(xy.T)
    return Candidates(xy[order], score[order])


def _peaks(image: Bytes, corners: Corners) -> Candidates:
    """Those of the corners that are above their neighbours and not near the border."""
    score = corner_score(image, corners.xy, ARC)
    keep = is_peak(corners, score)
    xy, score = corners.xy[keep], score[keep]
    x, y = xy.T
    height, width = image.shape
    inside = (x >= BORDER) & (x < width - BORDER) & (y >= BORDER) & (y < height - BORDER)
    return Candidates(xy[inside], score[inside])
