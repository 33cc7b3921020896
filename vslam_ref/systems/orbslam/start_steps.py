"""How this system comes from one picture to another before there is a map: by matching with the first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.orbslam import start
from vslam_ref.systems.orbslam.feature_map import DescribedPicture
from vslam_ref.systems.orbslam.settings import Settings
from vslam_ref.systems.visual_map.telling import Attempt


@dataclass
class MatchingSteps:
    """Matches for :class:`~vslam_ref.systems.visual_map.chosen_start.ChosenStart`, and for the system."""

    camera: Camera
    shape: tuple[int, int]
    settings: Settings
    rng: np.random.Generator

    @property
    def least(self) -> int:
        """Features that are needed."""
        return self.settings.start.least_matches

    def begin(self, picture: DescribedPicture) -> start.StartMatches:
        """Take a picture as the first."""
        return start.begin(picture, self.settings.start)

    def go_on(self, matched: start.StartMatches, picture: DescribedPicture) -> start.StartMatches:
        """Match the first with the next."""
        return start.go_on(matched, picture, self.shape, self.settings.start, self.settings.features)

    def count(self, matched: start.StartMatches) -> int:
        """Features that the newest shows."""
        return len(matched.rows)

    def attempt(self, matched: start.StartMatches) -> Attempt | str:
        """Try to start from the first, the newest, and one between."""
        s = self.settings
        return start.attempt(self.camera, matched, s.start, s.features.scale, self.rng)
