"""Corners that may become features: FAST-9, with a lower threshold where nothing else is found."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.corners import detect, is_peak
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
    found = detect(image, low_threshold, ARC)
    score = corner_score(image, found.xy, ARC)
    inside = (found.xy >= BORDER).all(1) & (found.xy < np.array(image.shape[::-1]) - BORDER).all(1)
    keep = is_peak(found, score) & inside
    xy, score = found.xy[keep], score[keep]
    across = image.shape[1] // cell + 1
    at = (xy[:, 1] // cell) * across + xy[:, 0] // cell
    bright = np.bincount(at[score >= threshold], minlength=int(at.max(initial=0)) + 1) > 0
    kept = (score >= threshold) | ~bright[at]  # eq-orb-cell
    return Candidates(xy[kept], score[kept])
