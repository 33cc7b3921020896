"""A place is believed when several keyframes in a row propose it: covisibility consistency.

::

    keyframe k - 2   proposes  a          group of a: a and the keyframes that share many points with it
    keyframe k - 1   proposes  b          group of b meets the group of a: two in a row
    keyframe k       proposes  c, d       group of c meets that of b: three; d meets none: one
                     believed: c

One picture can look like another by accident.  Three in a row, of places that touch each other, seldom do.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from vslam_ref.systems.orbslam.feature_map import FeatureMap


@dataclass
class Consistency:
    """What the last keyframe proposed: groups of keyframes, and how many in a row proposed each."""

    groups: list[tuple[frozenset[int], int]] = field(default_factory=list)

    def take(self, feature_map: FeatureMap, candidates: Iterable[int], wanted: int, least: int) -> list[int]:
        """Take the candidates of the next keyframe; return those that ``wanted`` in a row have proposed.

        Neighbours share ``least`` points.
        """
        groups, believed = [], []
        for candidate in candidates:
            group = group_of(feature_map, candidate, least)
            row = 1 + max((count for other, count in self.groups if group & other), default=0)
            groups.append((group, row))
            if row >= wanted:
                believed.append(candidate)
        self.groups = groups
        return believed

    def forget(self) -> None:
        """Begin anew."""
        self.groups = []


def group_of(feature_map: FeatureMap, kf: int, least: int) -> frozenset[int]:
    """Return a keyframe and all that share ``least`` points with it."""
    return frozenset([kf, *np.flatnonzero(feature_map.covisible(kf) >= least).tolist()])
