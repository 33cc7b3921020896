"""What may be wrong with a triangulated point, and the sentence for it."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

StateArray = NDArray[np.int8]


class PointState(IntEnum):
    """State of one point: the first of TOO_FEW, NO_RAY, ... that applies.

    With too little parallax the side on which nearly parallel rays meet is noise, so that is reported first.

    Examples
    --------
    >>> PointState.BEHIND.reason
    'behind a camera that is said to see it'
    """

    OK = 0
    TOO_FEW = 1
    NO_RAY = 2
    NO_DEPTH = 3
    SMALL_PARALLAX = 4
    BEHIND = 5
    NOT_CONVERGED = 6

    @property
    def reason(self) -> str:
        """The state in words; empty for OK."""
        return _REASONS[self]


_REASONS = {
    PointState.OK: "",
    PointState.TOO_FEW: "fewer than two views",
    PointState.NO_RAY: "a pixel outside the camera's invertible field: it has no ray",
    PointState.NO_DEPTH: "the rays do not fix a point: one centre, all along the baseline, or parallel",
    PointState.SMALL_PARALLAX: "the rays differ by less than the smallest parallax: depth is mostly noise",
    PointState.BEHIND: "behind a camera that is said to see it",
    PointState.NOT_CONVERGED: "the reprojection error did not settle",
}
