"""The rule of a statement: sizes of effect words, and the worlds in which a claim is false."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.experiments.iekf.measures import Curves, Measure, StudyClock

MARKED = 1.197
"""A growth is marked when it takes a consistent filter's expected NEES, 3, up to B's line, 3.592."""

APART = 1.1
"""Two error curves are clearly apart when one is a tenth higher, about what shows at a figure's size."""

MUCH = 2.0
"""Much better means at most half."""

BRIEF = 0.25
"""A short time is at most a quarter of the lap, 20 s."""

NullName = Literal["consistent", "inflated", "grown", "swapped", "scaled"]


def subject(series: str) -> str:
    """Return a series in words.

    >>> subject("nees:ekf/low"), subject("error:iekf/high")
    ("the EKF's NEES with low P0", "the IEKF's position error with high P0")
    """
    quantity, _, name = series.partition(":")
    who, _, p0 = name.partition("/")
    return f"the {who.upper()}'s {'NEES' if quantity == 'nees' else 'position error'} with {p0} P0"


@dataclass(frozen=True)
class Reading:
    """A naive reading: what it is in words, and whether it holds for each draw."""

    says: str
    holds: Callable[[Curves, StudyClock], NDArray[np.bool_]]


@dataclass(frozen=True)
class Rule:
    """What decides a claim; all of it fixed before the runs.

    Attributes
    ----------
    series : tuple of str
        The roles, in the order the measure takes them: ``"nees:ekf/low"``, ``"error:iekf/high"``.
    measure : Measure
        The statistic.
    above : bool
        The claim holds when the statistic is above the threshold; else when it is at most the threshold.
    null : str
        World in which the claim is false:

        ``"consistent"``  the control, exactly chi-squared at every time, correlated in time like a filter
        ``"inflated"``    the control, NEES 1.328 times too large: at one time 50 runs find that in 80 %
        ``"grown"``       the control with its NEES multiplied by 1.197^2 from the closure on
        ``"swapped"``     the study with the labels of the two sides exchanged run by run by a coin
        ``"scaled"``      the study with the first series scaled until the two differ by ``effect^2``
    calibrated : bool
        The threshold is the 95 % quantile of the statistic in the calm world: the label-swapped study if
        that is the null world, the consistent control otherwise.
    effect : float or None
        Declared size of an effect word.  With ``calibrated`` the larger of the two is the threshold.
    naive : Reading or None
        The pointwise reading, reported beside the rule and not judged.
    """

    series: tuple[str, ...]
    measure: Measure
    above: bool
    null: NullName
    calibrated: bool
    effect: float | None = None
    naive: Reading | None = None

    def __post_init__(self) -> None:
        if not self.calibrated and self.effect is None:
            raise ValueError("a rule needs a calibrated threshold, a declared effect, or both")
        if self.calibrated and self.effect is not None and not self.above:
            raise ValueError("a rule 'at most' takes its threshold from one place, calibration or effect")
        if self.null == "swapped" and len(self.series) % 2:
            raise ValueError("labels can be swapped only between two equal halves of the series")
        if self.null in ("grown", "scaled") and self.effect is None:
            raise ValueError(f"the {self.null} world needs a declared effect")
        if self.null == "scaled" and self.measure.window is None:
            raise ValueError("the scaled world needs a measure of one window")

    def holds(self, value: Array, threshold: float) -> NDArray[np.bool_]:
        """Whether the claim holds for each value of the statistic; never for NaN."""
        return value > threshold if self.above else value <= threshold

    @property
    def needs_control(self) -> bool:
        """Whether the consistent control is used."""
        calm = self.calibrated and self.null != "swapped"
        return calm or self.null in ("consistent", "inflated", "grown")

    def found(self, value: float) -> str:
        """Return in words that the statistic has a value."""
        names = [subject(name) for name in self.series]
        return self.measure.found.format(*names, v=value, all=" and ".join(names))

    def bound(self, threshold: float) -> str:
        """Return in words what the threshold stands for."""
        if self.effect == threshold or not self.calibrated:
            word = "at least" if self.above else "at most"
            return f"the rule asks for {word} {self.measure.number(threshold)}"
        if self.null == "swapped":
            return f"with two filters that are alike it would stay under {threshold:.3g} in 95 % of studies"
        return f"a consistent filter would stay under {threshold:.3g} in 95 % of studies"

    def text(self) -> str:
        """Return the rule in words."""
        calm = "with labels swapped" if self.null == "swapped" else "of the consistent control"
        parts = [f"{self.effect:g}"] if self.effect is not None else []
        parts += [f"the 95 % quantile {calm}"] if self.calibrated else []
        bound = f"the larger of {parts[0]} and {parts[1]}" if len(parts) == 2 else parts[0]
        text = (
            f"{self.measure.says} of {', '.join(self.series)} "
            f"{'>' if self.above else '<='} {bound}; null world: {self.null}"
        )
        return text + (f"; naive reading, not judged: {self.naive.says}" if self.naive else "")
