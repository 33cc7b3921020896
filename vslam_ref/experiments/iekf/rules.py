"""The vocabulary of the rules: time windows, statistics of mean curves, worlds in which a claim is false.

A statistic maps the mean curves of draws of runs, one array (S, T) per role, to one number per draw.
It knows the curves and the clock, nothing else; so the same function judges B's own runs, the whole
population, subsets of it, and a world made up to fool it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.metrics import consistency

Curves = tuple[Array, ...]

DOF = 3
"""Degrees of freedom of a pose."""

MARKED = 1.197
"""A growth is marked when it takes a consistent filter's expected NEES, 3, up to B's line, 3.592."""

APART = 1.1
"""Two error curves are clearly apart when one is a tenth higher, about what shows at a figure's size."""

MUCH = 2.0
"""Much better means at most half."""

BRIEF = 0.25
"""A short time is at most a quarter of the lap, 20 s."""

WindowName = Literal["lap 1", "lap 2", "both laps", "before closure", "after closure", "closure", "end"]
PHRASES: dict[WindowName, str] = {
    "before closure": "60-70 s",
    "after closure": "80-90 s",
    "closure": "75-85 s",
    "end": "150-160 s",
}
"""Windows in words, at B's clock; the laps are called by their names."""

NullName = Literal["consistent", "inflated", "grown", "swapped", "scaled"]


def phrase(*names: WindowName) -> str:
    """Windows in words."""
    return " and ".join(PHRASES.get(name, name) for name in names)


@dataclass(frozen=True)
class Scene:
    """The clock of a study, and what follows from the number of runs.

    Attributes
    ----------
    time : ndarray, shape (T,)
        Seconds from the start.
    lap_seconds : float
        Duration of one lap; the loop closes then.
    runs : int
        Runs of one study (B: 50).
    """

    time: Array
    lap_seconds: float
    runs: int

    @cached_property
    def line(self) -> float:
        """One-sided 95 % line of the mean NEES at one time; 3.592 for 50 runs."""
        return consistency.mean_line(self.runs, DOF)

    @cached_property
    def inflation(self) -> float:
        """Factor on the NEES that a test at one time finds with power 0.8; 1.328 for 50 runs."""
        return consistency.detectable_inflation(self.runs, DOF)

    def window(self, name: WindowName) -> NDArray[np.bool_]:
        """Time points of a window; "near" is an eighth of a lap, 10 s in B."""
        t, lap, near = self.time, self.lap_seconds, self.lap_seconds / 8.0
        start, stop = {
            "lap 1": (0.0, lap),
            "lap 2": (lap, 2 * lap),
            "both laps": (0.0, 2 * lap),
            "before closure": (lap - 2 * near, lap - near),
            "after closure": (lap, lap + near),
            "closure": (lap - near / 2, lap + near / 2),
            "end": (2 * lap - near, 2 * lap),
        }[name]
        slack = lap * 1e-9  # times are multiples of 0.1 s with rounding
        upto = t <= stop + slack if stop == 2 * lap else t < stop - slack
        return (t >= start - slack) & upto

    def average(self, curve: Array, name: WindowName) -> Array:
        """Time average of each curve (S, T) in a window, (S,)."""
        return consistency.window_mean(curve, self.window(name))


@dataclass(frozen=True)
class Measure:
    """A statistic of mean curves: what it is in words, the function, and its window where it has one."""

    says: str
    compute: Callable[[Curves, Scene], Array]
    window: WindowName | None = None


@dataclass(frozen=True)
class Reading:
    """A naive reading: what it is in words, and whether it holds for each draw."""

    says: str
    holds: Callable[[Curves, Scene], NDArray[np.bool_]]


def average(name: WindowName) -> Measure:
    """Time average of the curve in a window."""
    return Measure(f"time average over {phrase(name)}", lambda c, s: s.average(c[0], name))


def maximum(name: WindowName) -> Measure:
    """Largest value of the curve in a window."""
    return Measure(
        f"maximum over {phrase(name)}", lambda c, s: consistency.time_maximum(c[0], s.window(name))
    )


def share_above_line(name: WindowName) -> Measure:
    """Share of a window's time in which the curve lies above B's line."""
    return Measure(
        f"share of {phrase(name)} above the line 3.592",
        lambda c, s: consistency.fraction_above(c[0], s.line, s.window(name)),
    )


def least_average(*names: WindowName) -> Measure:
    """Smallest time average over the windows and the series."""
    return Measure(
        f"smallest of the time averages over {phrase(*names)}",
        lambda c, s: np.minimum.reduce([s.average(curve, n) for curve in c for n in names]),
    )


def greatest_average(*names: WindowName) -> Measure:
    """Largest time average over the windows and the series."""
    return Measure(
        f"largest of the time averages over {phrase(*names)}",
        lambda c, s: np.maximum.reduce([s.average(curve, n) for curve in c for n in names]),
    )


def ratio(name: WindowName) -> Measure:
    """First series over second, time averages in a window."""
    return Measure(
        f"ratio of the time averages over {phrase(name)}, first to second,",
        lambda c, s: s.average(c[0], name) / s.average(c[1], name),
    )


def difference_factor(name: WindowName) -> Measure:
    """Factor between two series, whichever is larger."""

    def compute(c: Curves, s: Scene) -> Array:
        r = s.average(c[0], name) / s.average(c[1], name)
        return np.maximum(r, 1.0 / r)

    return Measure(f"factor between the time averages over {phrase(name)}, larger to smaller,", compute, name)


def growth_at_closure() -> Measure:
    """Mean of the 10 s after the lap ends, over 60-70 s.

    With a range of 6 m the first landmarks come back into view some 6 s before the lap ends; the 10 s
    between the windows are left out because the loop closes somewhere in them.
    """
    return Measure(
        f"time average over {phrase('after closure')} divided by that over {phrase('before closure')}",
        lambda c, s: s.average(c[0], "after closure") / s.average(c[0], "before closure"),
    )


def _rise(curve: Array, s: Scene) -> Array:
    return s.average(curve, "end") - s.average(curve, "after closure")


def rise_in_lap_2() -> Measure:
    """Last 10 s of lap 2 less its first 10 s."""
    return Measure(
        "rise in lap 2, time average over 150-160 s less that over 80-90 s,", lambda c, s: _rise(c[0], s)
    )


def rise_difference() -> Measure:
    """Rise of the first series in lap 2 less that of the second."""
    return Measure(
        "difference of the rises in lap 2 (150-160 s less 80-90 s), first less second,",
        lambda c, s: _rise(c[0], s) - _rise(c[1], s),
    )


def ratio_of_ratios(name: WindowName) -> Measure:
    """(first / second) / (third / fourth), time averages in a window."""

    def compute(c: Curves, s: Scene) -> Array:
        a, b, p, q = (s.average(curve, name) for curve in c)
        return (a / b) / (p / q)

    return Measure(f"first/second divided by third/fourth, time averages over {phrase(name)},", compute)


def least_ratio(name: WindowName) -> Measure:
    """Smaller of first/third and second/fourth."""

    def compute(c: Curves, s: Scene) -> Array:
        a, b, p, q = (s.average(curve, name) for curve in c)
        return np.minimum(a / p, b / q)

    return Measure(f"smaller of first/third and second/fourth, time averages over {phrase(name)},", compute)


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
