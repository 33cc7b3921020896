"""The loop closer asks after each keyframe whether this place was seen before.

::

    keyframe -> candidates -> consistent? -> verified? -> closed: joined, everything adjusted
                               no: wait       no: rejected, counted with its reason

Where candidates come from is not its business: it is given a function.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.systems.orbslam.feature_map import FeatureMap
from vslam_ref.systems.orbslam.loop_settings import LoopSettings
from vslam_ref.systems.orbslam.loops.consistency import Consistency
from vslam_ref.systems.orbslam.loops.join import Joined, join
from vslam_ref.systems.orbslam.loops.verify import LoopVerdict, verify
from vslam_ref.systems.orbslam.mapper.adjusting import adjust_all
from vslam_ref.systems.orbslam.settings import Settings

Candidates = Callable[[FeatureMap, int], Sequence[int]]
"""Keyframes that may show the place of a keyframe, the likeliest first; called once for each keyframe."""


@dataclass
class LoopCloser:
    """Finds loops and closes them.

    Parameters
    ----------
    candidates : callable
        Keyframes that may show the place of a keyframe; see :data:`Candidates`.
    rng : numpy.random.Generator
        Draws the samples of the similarity.
    settings : Settings, optional
        Of the system: of loops, and for the adjustment of everything.

    Attributes
    ----------
    closed : list of LoopVerdict
        Loops that were closed.
    rejected : Counter
        Candidates that were proposed often enough and turned out to be none, by reason.
    joined : Joined or None
        What the last closing did.
    """

    candidates: Candidates
    rng: np.random.Generator
    settings: Settings = field(default_factory=Settings)
    closed: list[LoopVerdict] = field(default_factory=list)
    rejected: Counter[str] = field(default_factory=Counter)
    joined: Joined | None = None
    _consistency: Consistency = field(default_factory=Consistency)

    @property
    def loops(self) -> LoopSettings:
        """Numbers of loop closing."""
        return self.settings.loops

    def __call__(self, feature_map: FeatureMap, kf: int) -> Array | None:
        """Look at a new keyframe, and close a loop if there is one.

        Parameters
        ----------
        feature_map : FeatureMap
        kf : int

        Returns
        -------
        ndarray, shape (K,), or None
            By which lengths near each keyframe have changed, a ratio, if a loop was closed: whoever keeps
            poses relative to keyframes changes them so.
        """
        proposed = [int(c) for c in self.candidates(feature_map, kf)]
        near, alive = feature_map.covisible(kf), feature_map.keyframes["alive"]
        proposed = [c for c in proposed if c != kf and alive[c] and near[c] < self.loops.group]
        if self.closed and kf < self.closed[-1].current + self.loops.apart:
            self._consistency.forget()
            return None
        for candidate in self._consistency.take(
            feature_map, proposed, self.loops.consistent, self.loops.group
        ):
            verdict = verify(feature_map, kf, candidate, self.rng, self.loops)
            if verdict.reason:
                self.rejected[verdict.reason] += 1
                continue
            self.joined = join(feature_map, verdict, self.loops)
            self.closed.append(verdict)
            self._consistency.forget()
            if self.loops.last_steps:
                adjust_all(feature_map, self.settings, self.loops.last_steps)
            return self.joined.scale
        return None

    def counts(self) -> dict[str, int]:
        """Loops that were closed, candidates that were rejected, edges of the last essential graph."""
        edges = 0 if self.joined is None else self.joined.edges
        return {
            "loops": len(self.closed),
            "loops_rejected": sum(self.rejected.values()),
            "essential_edges": edges,
        }
