"""Candidates by words: keyframes that look like this one, by more than its own neighbours do not.

::

    least   the smallest score of the keyframe with those that share points with it
    found   keyframes that share words with it, hardly a point, enough words, a score of at least ``least``
    groups  the score of each, and of those among its ten best neighbours that were found: added up
    best    of each group of at least 0.75 of the best group's score, the keyframe with the best score
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features.orb import OrbFeatures
from vslam_ref.features.vocabulary import Bag, Database, Vocabulary, bag, best, descend, score
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.visual_map import neighbours
from vslam_ref.systems.visual_map.keyframe_map import Bytes

COMMON, GROUP, NEIGHBOURS, SHARED = 0.8, 0.75, 10, 15
"""Share of the most common words; of the best group's score; neighbours of a group; points of a neighbour."""


class CandidatesByWords:
    """Keyframes by their words; each is remembered when it, or a later one, is asked for.

    Parameters
    ----------
    vocabulary : Vocabulary
    """

    def __init__(self, vocabulary: Vocabulary) -> None:
        self.vocabulary = vocabulary
        self.index = Database(vocabulary.words)  # of all keyframes, by their own numbers

    def __call__(self, feature_map: FeatureMap, kf: int) -> list[int]:
        """Keyframes older than ``kf`` that may show its place, the best group first."""
        self._remember(feature_map, kf + 1)
        now, shared = self.index.bag(kf), feature_map.covisible(kf)
        near = np.flatnonzero(shared[:kf] >= SHARED).tolist()
        least = min((score(now, self.index.bag(k)) for k in near), default=0.0)
        older = np.arange(len(self.index)) < kf
        used = feature_map.keyframes["alive"][: len(self.index)]
        found = self.index.query(now, older & used & (shared[: len(self.index)] < SHARED))
        good = (found.common > COMMON * found.common.max(initial=0)) & (found.score >= max(least, 1e-12))
        of = dict(zip(found.entry[good].tolist(), found.score[good].tolist(), strict=True))
        total: dict[int, float] = {}
        for k in of:
            members = [k, *(m for m in neighbours(feature_map, k, NEIGHBOURS).tolist() if m in of)]
            first = max(members, key=lambda m: (of[m], -m))
            total[first] = max(total.get(first, 0.0), sum(of[m] for m in members))
        most = max(total.values(), default=0.0)
        return sorted((k for k in total if total[k] >= GROUP * most), key=lambda k: (-total[k], k))

    def alike(self, feature_map: FeatureMap, features: OrbFeatures, count: int) -> IntArray:
        """Keyframes (count,) or fewer whose words are most like those of a picture's features."""
        self._remember(feature_map, len(feature_map.keyframes))
        found = self.index.query(self._bag(features.descriptor), feature_map.keyframes["alive"])
        return best(found, count).entry

    def _remember(self, feature_map: FeatureMap, count: int) -> None:
        """Have the first ``count`` keyframes in the index."""
        for kf in range(len(self.index), count):
            self.index.add(self._bag(feature_map.sightings["descriptor"][feature_map.features(kf)]))

    def _bag(self, descriptor: Bytes) -> Bag:
        return bag(self.vocabulary, self.vocabulary.word[descend(self.vocabulary, descriptor).node])
