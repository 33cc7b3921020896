"""A start from two pictures that the user chose: one attempt, at the second, and its answer is final."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.ptam import trails as trail_steps
from vslam_ref.systems.ptam.settings import Settings
from vslam_ref.systems.ptam.start import Attempt, attempt
from vslam_ref.systems.visual_map import PreparedPicture


class Told(NamedTuple):
    """What became of a picture before the map: an attempt, if it is the second one chosen, and a reason."""

    attempt: Attempt | None = None
    reason: str = ""


@dataclass
class ChosenStart:
    """The two pictures, by their numbers, and why they made no start.

    Parameters
    ----------
    first, last : int
        Numbers in the sequence.

    Raises
    ------
    ValueError
        If the last does not come after the first.
    """

    first: int
    last: int
    reason: str = ""

    def __post_init__(self) -> None:
        if not 0 <= self.first < self.last:
            raise ValueError(f"start from pictures {self.first} and {self.last}: need the first one earlier")

    def take(
        self,
        trails: trail_steps.Trails | None,
        picture: PreparedPicture,
        camera: Camera,
        settings: Settings,
        rng: np.random.Generator,
    ) -> tuple[trail_steps.Trails | None, Told]:
        """Take the next picture: begin trails at the first one chosen, go on to the last, and try there."""
        s = settings.start
        if self.reason or picture.number < self.first:
            return None, Told()
        if picture.number == self.first:
            begun = trail_steps.begin(picture, s, settings.features)
            few = len(begun.now) < s.least_trails
            return begun, self._refuse(_count(len(begun.now), picture, s.least_trails)) if few else Told()
        if trails is None:
            return None, self._refuse(f"picture {self.first} could not be looked at")
        if picture.number > self.last:
            return None, self._refuse(f"picture {self.last} could not be looked at")
        trails = trail_steps.go_on(trails, picture, s)
        if len(trails.now) < s.least_trails:
            return trails, self._refuse(_count(len(trails.now), picture, s.least_trails))
        if picture.number < self.last:
            return trails, Told()
        found = attempt(camera, trails, s, rng)
        if isinstance(found, str):
            return trails, self._refuse(found)
        return trails, self._refuse(found.reason)._replace(attempt=found) if found.reason else Told(found)

    def _refuse(self, reason: str) -> Told:
        """Remember why; it is final."""
        self.reason = f"pictures {self.first} and {self.last} make no start: {reason}"
        return Told(reason=self.reason)

    def no_start(self) -> str:
        """Why there is no map, when the pictures have ended."""
        early = f"the pictures ended before number {self.last}, with which the start was to be tried"
        return self.reason or early


def _count(found: int, picture: PreparedPicture, least: int) -> str:
    return f"{found} corners are found in picture {picture.number}: need {least}"
