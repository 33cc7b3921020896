"""Corners that may become features: FAST-9, with a lower threshold where nothing else is found."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.corners import in_rows, is_peak
from vslam_ref.features.fast import Pixels, corner_score, segment_test
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
        Side of a cell, pixels, at least 3.

    Returns
    -------
    Candidates
    """
    found = _peaks(image, segment_test(image, threshold, ARC))
    y, x = (np.arange(n) // cell for n in image.shape)
    full = np.zeros((y[-1] + 1, x[-1] + 1), np.bool_)
    full[y[found.xy[:, 1]], x[found.xy[:, 0]]] = True
    low = segment_test(image, low_threshold, ARC)
    beside = np.zeros(len(low), np.bool_)  # a peak is compared with neighbours in other cells, too
    for step in ((-1, -1), (1, -1), (-1, 1), (1, 1)):
        i, j = np.clip(low + step, 0, np.array(image.shape[::-1]) - 1).T
        beside |= ~full[y[j], x[i]]
    more = _peaks(image, low[beside])
    empty = ~full[y[more.xy[:, 1]], x[more.xy[:, 0]]]  # eq-orb-cell
    xy, score = np.concatenate([found.xy, more.xy[empty]]), np.concatenate([found.score, more.score[empty]])
    order = np.lexsort(xy.T)
    return Candidates(xy[order], score[order])


def _peaks(image: Bytes, xy: Pixels) -> Candidates:
    """Those of the corners, in row order, that are above their neighbours and not near the border."""
    score = corner_score(image, xy, ARC)
    inside = (xy >= BORDER).all(1) & (xy < np.array(image.shape[::-1]) - BORDER).all(1)
    keep = inside & is_peak(in_rows(xy, (image.shape[0], image.shape[1])), score)
    return Candidates(xy[keep], score[keep])
