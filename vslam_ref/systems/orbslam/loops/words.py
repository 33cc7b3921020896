"""Candidates by words: keyframes that look like this one, by more than its own neighbours do not.

::

    least   the smallest score of the keyframe with those that share points with it
    found   keyframes that share words with it, hardly a point, enough words, a score of at least ``least``
    groups  the score of each, and of those among its ten best neighbours that were found: added up
    best    of each group of at least 0.75 of the best group's score, the keyframe with the best score
"""

from __future__ import annotations

import numpy as np

from vslam_ref.features.vocabulary import Bag, Database, Vocabulary, bag, descend, score
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.visual_map import neighbours

COMMON, GROUP, NEIGHBOURS, SHARED = 0.8, 0.75, 10, 15
"""Share of the most common words; of the best group's score; neighbours of a group; points of a neighbour."""


class CandidatesByWords:
    """Keyframes by their words; each is remembered when it has been asked for.

    Parameters
    ----------
    vocabulary : Vocabulary
    """

    def __init__(self, vocabulary: Vocabulary) -> None:
        self.vocabulary = vocabulary
        self.index = Database(vocabulary.words)
        self._entry: dict[int, int] = {}  # of a keyframe
        self._keyframe: list[int] = []  # of an entry

    def __call__(self, feature_map: FeatureMap, kf: int) -> list[int]:
        """Keyframes that may show the place of ``kf``, the best group first; remember ``kf``."""
        descriptor = feature_map.sightings["descriptor"][feature_map.features(kf)]
        now = bag(self.vocabulary, self.vocabulary.word[descend(self.vocabulary, descriptor).node])
        found = self._proposed(feature_map, kf, now)
        self._entry[kf] = self.index.add(now)
        self._keyframe.append(kf)
        return found

    def _proposed(self, feature_map: FeatureMap, kf: int, now: Bag) -> list[int]:
        shared = feature_map.covisible(kf)
        near = [k for k in np.flatnonzero(shared >= SHARED).tolist() if k in self._entry]
        least = min((score(now, self.index.bag(self._entry[k])) for k in near), default=0.0)
        keyframe = np.array(self._keyframe, dtype=np.int64)
        found = self.index.query(now, (shared[keyframe] < SHARED) & feature_map.keyframes["alive"][keyframe])
        good = (found.common > COMMON * found.common.max(initial=0)) & (found.score >= max(least, 1e-12))
        of = dict(zip(keyframe[found.entry[good]].tolist(), found.score[good].tolist(), strict=True))
        total: dict[int, float] = {}
        for k in of:
            members = [k, *(m for m in neighbours(feature_map, k, NEIGHBOURS).tolist() if m in of)]
            best = max(members, key=lambda m: (of[m], -m))
            total[best] = max(total.get(best, 0.0), sum(of[m] for m in members))
        most = max(total.values(), default=0.0)
        return sorted((k for k in total if total[k] >= GROUP * most), key=lambda k: (-total[k], k))
