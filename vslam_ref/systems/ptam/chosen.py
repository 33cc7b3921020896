"""How PTAM comes from one chosen picture to the other: by trails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.ptam import trails as trail_steps
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.start import attempt
from vslam_ref.systems.ptam.trails import Trails
from vslam_ref.systems.visual_map import PreparedPicture
from vslam_ref.systems.visual_map.telling import Attempt


@dataclass
class ChosenSteps:
    """Trails for :class:`~vslam_ref.systems.visual_map.chosen_start.ChosenStart`."""

    camera: Camera
    settings: Settings
    rng: np.random.Generator

    @property
    def least(self) -> int:
        """Corners that are needed."""
        return self.settings.start.least_trails

    def begin(self, picture: PreparedPicture) -> Trails:
        """Take the corners of a picture."""
        return trail_steps.begin(picture, self.settings.start, self.settings.features)

    def go_on(self, trails: Trails, picture: PreparedPicture) -> Trails:
        """Follow them into the next."""
        return trail_steps.go_on(trails, picture, self.settings.start)

    def count(self, trails: Trails) -> int:
        """Corners that are followed."""
        return len(trails.level)

    def attempt(self, trails: Trails) -> Attempt | str:
        """Try to start from the ends of the trails."""
        return attempt(self.camera, trails, self.settings.start, self.rng)
