"""What can be chosen about ORB features."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OrbSettings:
    """How many features are looked for, and how.

    Parameters
    ----------
    features : int
        At most so many, over all octaves.
    octaves : int
        Pictures of the pyramid, at least 1.
    scale : float
        A pixel of an octave is so many pixels of the one before wide; above 1, at most 2.
    threshold, low_threshold : int
        Grey levels of FAST-9; the lower one counts in cells without a corner at the higher one.
    cell : int
        Side of a cell, pixels of the octave.
    spread : bool
        Whether a quadtree spreads the features over the picture; else those with the best response are kept.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> OrbSettings(octaves=0)
    Traceback (most recent call last):
    ValueError: octaves is 0: need at least 1
    """

    features: int = 1000
    octaves: int = 8
    scale: float = 1.2
    threshold: int = 20
    low_threshold: int = 7
    cell: int = 35
    spread: bool = True

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, least in {"features": 0, "octaves": 1, "cell": 1}.items():
            if getattr(self, name) < least:
                raise ValueError(f"{name} is {getattr(self, name)}: need at least {least}")
        if not 1 < self.scale <= 2:
            raise ValueError(f"scale is {self.scale}: need more than 1 and at most 2")
        if not 0 <= self.low_threshold <= self.threshold <= 254:
            raise ValueError(
                f"low_threshold is {self.low_threshold} and threshold {self.threshold}: "
                "need 0 <= low_threshold <= threshold <= 254 grey levels"
            )
