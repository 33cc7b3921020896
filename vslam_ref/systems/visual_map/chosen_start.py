"""A start from two pictures that the user chose: one attempt, at the second, and its answer is final."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from vslam_ref.systems.visual_map.telling import Attempt


class StartSteps(Protocol):
    """How a system comes from one picture to another: its own trails begin and go on with pictures."""

    @property
    def least(self) -> int:
        """Points that are needed."""

    def begin(self, picture: Any) -> Any:
        """Begin with a picture."""

    def go_on(self, trails: Any, picture: Any) -> Any:
        """Go on to the next picture."""

    def count(self, trails: Any) -> int:
        """Points that are followed now."""

    def attempt(self, trails: Any) -> Attempt | str:
        """Try to start; a sentence if there is nothing to try."""


class ToldStart(NamedTuple):
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

    def take(self, steps: StartSteps, trails: Any, picture: Any) -> tuple[Any, ToldStart]:
        """Take the next picture: begin trails at the first one chosen, go on to the last, and try there."""
        if self.reason or picture.number < self.first:
            return None, ToldStart()
        if picture.number == self.first:
            trails = steps.begin(picture)
            return trails, self._few(steps, trails, picture)
        if trails is None:
            return None, self._refuse(f"picture {self.first} could not be looked at")
        if picture.number > self.last:
            return None, self._refuse(f"picture {self.last} could not be looked at")
        trails = steps.go_on(trails, picture)
        told = self._few(steps, trails, picture)
        if told.reason or picture.number < self.last:
            return trails, told
        found = steps.attempt(trails)
        if isinstance(found, str):
            return trails, self._refuse(found)
        if found.reason:
            return trails, self._refuse(found.reason)._replace(attempt=found)
        return trails, ToldStart(found)

    def _few(self, steps: StartSteps, trails: Any, picture: Any) -> ToldStart:
        """Refuse where too few points are found."""
        found = steps.count(trails)
        if found >= steps.least:
            return ToldStart()
        return self._refuse(f"{found} corners are found in picture {picture.number}: need {steps.least}")

    def _refuse(self, reason: str) -> ToldStart:
        """Remember why; it is final."""
        self.reason = f"pictures {self.first} and {self.last} make no start: {reason}"
        return ToldStart(reason=self.reason)

    def no_start(self) -> str:
        """Why there is no map, when the pictures have ended."""
        early = f"the pictures ended before number {self.last}, with which the start was to be tried"
        return self.reason or early
