"""Time windows, and statistics of mean curves.

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

WindowName = Literal["lap 1", "lap 2", "both laps", "before closure", "after closure", "closure", "end"]
PHRASES: dict[WindowName, str] = {
    "before closure": "60-70 s",
    "after closure": "80-90 s",
    "closure": "75-85 s",
    "end": "150-160 s",
}
"""Windows in words, at B's clock; the laps are called by their names."""


def phrase(*names: WindowName) -> str:
    """Windows in words."""
    return " and ".join(PHRASES.get(name, name) for name in names)


@dataclass(frozen=True)
class StudyClock:
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
    """A statistic of mean curves.

    Attributes
    ----------
    says : str
        What it is, in the words of a rule.
    found : str
        What was found, with places for the value, ``{v}``, and for the series, ``{0}``, ``{1}``, ...
    compute : callable
    window : str or None
        Where it has one.
    percent : bool
        It is a share, and read in percent.
    """

    says: str
    found: str
    compute: Callable[[Curves, StudyClock], Array]
    window: WindowName | None = None
    percent: bool = False

    def number(self, value: float) -> str:
        """Return a value of it in words."""
        return f"{100 * value:.3g}%" if self.percent else f"{value:.3g}"


def average(name: WindowName) -> Measure:
    """Time average of the curve in a window."""
    w = phrase(name)
    return Measure(
        f"time average over {w}",
        f"{{0}} is {{v:.3g}} on average over {w}",
        lambda c, s: s.average(c[0], name),
    )


def maximum(name: WindowName) -> Measure:
    """Largest value of the curve in a window."""
    w = phrase(name)
    return Measure(
        f"maximum over {w}", f"{{0}} reaches {{v:.3g}} in {w}",
        lambda c, s: consistency.time_maximum(c[0], s.window(name)),
    )  # fmt: skip


def share_above_line(name: WindowName) -> Measure:
    """Share of a window's time in which the curve lies above B's line."""
    w = phrase(name)
    return Measure(
        f"share of {w} above the line 3.592", f"{{0}} lies above the line 3.592 for {{v:.0%}} of {w}",
        lambda c, s: consistency.fraction_above(c[0], s.line, s.window(name)), percent=True,
    )  # fmt: skip


def least_average(*names: WindowName) -> Measure:
    """Smallest time average over the windows and the series."""
    w = phrase(*names)
    return Measure(
        f"smallest of the time averages over {w}",
        f"the smallest time average of {{all}} over {w} is {{v:.3g}}",
        lambda c, s: np.minimum.reduce([s.average(curve, n) for curve in c for n in names]),
    )  # fmt: skip


def greatest_average(*names: WindowName) -> Measure:
    """Largest time average over the windows and the series."""
    w = phrase(*names)
    return Measure(
        f"largest of the time averages over {w}",
        f"the largest time average of {{all}} over {w} is {{v:.3g}}",
        lambda c, s: np.maximum.reduce([s.average(curve, n) for curve in c for n in names]),
    )  # fmt: skip


def ratio(name: WindowName) -> Measure:
    """First series over second, time averages in a window."""
    w = phrase(name)
    return Measure(
        f"ratio of the time averages over {w}, first to second,",
        f"{{0}} is {{v:.3g}} times {{1}}, averaged over {w}",
        lambda c, s: s.average(c[0], name) / s.average(c[1], name),
    )


def difference_factor(name: WindowName) -> Measure:
    """Factor between two series, whichever is larger."""
    w = phrase(name)

    def compute(c: Curves, s: StudyClock) -> Array:
        r = s.average(c[0], name) / s.average(c[1], name)
        return np.maximum(r, 1.0 / r)

    return Measure(
        f"factor between the time averages over {w}, larger to smaller,",
        f"{{0}} and {{1}} differ by a factor of {{v:.3g}}, averaged over {w}", compute, name,
    )  # fmt: skip


def growth_at_closure() -> Measure:
    """Mean of the 10 s after the lap ends, over 60-70 s.

    With a range of 6 m the first landmarks come back into view some 6 s before the lap ends; the 10 s
    between the windows are left out because the loop closes somewhere in them.
    """
    after, before = phrase("after closure"), phrase("before closure")
    return Measure(
        f"time average over {after} divided by that over {before}",
        f"{{0}} is {{v:.3g}} times as large over {after}, after the loop closure, as over {before}, before "
        "it",
        lambda c, s: s.average(c[0], "after closure") / s.average(c[0], "before closure"),
    )


def _rise(curve: Array, s: StudyClock) -> Array:
    return s.average(curve, "end") - s.average(curve, "after closure")


def rise_in_lap_2() -> Measure:
    """Last 10 s of lap 2 less its first 10 s."""
    return Measure(
        "rise in lap 2, time average over 150-160 s less that over 80-90 s,",
        "{0} rises by {v:.3g} in lap 2, from its first to its last 10 s", lambda c, s: _rise(c[0], s),
    )  # fmt: skip


def rise_difference() -> Measure:
    """Rise of the first series in lap 2 less that of the second."""
    return Measure(
        "difference of the rises in lap 2 (150-160 s less 80-90 s), first less second,",
        "{0} rises by {v:.3g} more in lap 2 than {1}", lambda c, s: _rise(c[0], s) - _rise(c[1], s),
    )  # fmt: skip


def ratio_of_ratios(name: WindowName) -> Measure:
    """(first / second) / (third / fourth), time averages in a window."""
    w = phrase(name)

    def compute(c: Curves, s: StudyClock) -> Array:
        a, b, p, q = (s.average(curve, name) for curve in c)
        return (a / b) / (p / q)

    return Measure(
        f"first/second divided by third/fourth, time averages over {w},",
        f"the ratio of {{0}} to {{1}} is {{v:.3g}} times that of {{2}} to {{3}}, averaged over {w}", compute,
    )  # fmt: skip


def least_ratio(name: WindowName) -> Measure:
    """Smaller of first/third and second/fourth."""
    w = phrase(name)

    def compute(c: Curves, s: StudyClock) -> Array:
        a, b, p, q = (s.average(curve, name) for curve in c)
        return np.minimum(a / p, b / q)

    return Measure(
        f"smaller of first/third and second/fourth, time averages over {w},",
        f"{{0}} and {{1}} are at least {{v:.3g}} times {{2}} and {{3}}, averaged over {w}", compute,
    )  # fmt: skip
