"""How places are recognised, and what the thresholds rest on.

The thresholds were chosen by ``python -m vslam_ref.experiments.orbslam.lookalikes``, on four buildings of
look-alikes with a picture a metre and with one every two metres.  The most support of a wrong candidate is
19.7 (18.8 in another building; with a picture every two metres 15.6): ``sure`` is a tenth above it, rounded
up.  No wrong candidate followed a sure one near it with more than 10: ``likely`` is half of ``sure``.  There
they accept 175 of 180 revisits with a picture a metre, 81 of 92 with one every two, and no wrong place.

Two doubtful pictures that agree are not enough.  They were once: 12 each, where a wrong candidate had reached
10.8 on the word of the picture before.  But pictures that follow each other show the same look-alike, and the
denser they follow the longer: in one of three other buildings with a picture a metre, three wrong places were
accepted so.  Only a place that was sure is news of where the walk is now.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from vslam_ref.features.vocabulary import Matching
from vslam_ref.geometry.multiview.two_views import Draws


@dataclass(frozen=True)
class RecognitionSettings:
    """How places are recognised.

    Parameters
    ----------
    gap : int
        The last pictures so many, which show the place anyway, are no candidates.
    relative : float
        Least score of a candidate, as a share of the score with the picture before.
    common : float
        Least number of common words, as a share of the candidate's that has most.
    reach : int
        Pictures so far before and after one are its neighbours.
    group : float
        Groups with less than this share of the best group's score are left out.
    candidates : int
        Most groups that are verified.
    level : int
        Of the nodes under which pairs are looked for; 0 is all with all.
    matching : Matching
    pixels : float
        Farthest that a pair lies from the epipolar geometry, Sampson's distance, pixels.
    square : float
        Side of the squares by which inliers are counted, pixels; a sixteenth of the picture's width.
    sure : float
        Support that is enough alone, squares.
    likely : float
        Support that is enough if a place near this one was recognised in the picture before, squares.
    near : int
        How many pictures apart places are near.
    draws : Draws

    Raises
    ------
    ValueError
        If a number is out of range.
    """

    gap: int = 8
    relative: float = 0.3
    common: float = 0.5
    reach: int = 2
    group: float = 0.5
    candidates: int = 5
    level: int = 0
    matching: Matching = field(default_factory=Matching)
    pixels: float = 3.0
    square: float = 32.0
    sure: float = 22.0
    likely: float = 11.0
    near: int = 3
    draws: Draws = field(default_factory=lambda: Draws(confidence=0.99, least=300, most=1000, batch=100))

    def __post_init__(self) -> None:
        """Refuse settings that mean nothing."""
        shares = (self.relative, self.common, self.group)
        counts = (self.gap, self.reach, self.level, self.near)
        if not all(0.0 <= share <= 1.0 for share in shares) or min(counts) < 0 or self.candidates < 1:
            raise ValueError(f"{self}: need shares from 0 to 1, counts of at least 0, and a candidate")
        if not (min(self.pixels, self.square) > 0 and 0 < self.likely <= self.sure):
            raise ValueError(f"{self}: need pixels and square above 0, and 0 < likely <= sure")
