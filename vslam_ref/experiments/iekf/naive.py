"""The sentences read naively: pointwise against the line 3.592, or as a plain "higher".

These readings are reported beside the rules and never judged.  A consistent filter's curve crosses the line
somewhere in nearly half of all studies, and of two equal filters one is the higher.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vslam_ref.experiments.iekf.measures import Curves, Measure, StudyClock, WindowName, phrase
from vslam_ref.experiments.iekf.rules import BRIEF, Reading
from vslam_ref.metrics import consistency


def mostly_above(*names: WindowName) -> Reading:
    """More than half of every window above the line, for every series."""
    return Reading(
        f"above 3.592 for more than half of {phrase(*names)}",
        lambda c, s: np.logical_and.reduce(
            [consistency.fraction_above(curve, s.line, s.window(n)) > 0.5 for curve in c for n in names]
        ),
    )


def hardly_above(*names: WindowName) -> Reading:
    """At most 5 % of every window above the line."""
    return Reading(
        f"above 3.592 for at most 5 % of {phrase(*names)}",
        lambda c, s: np.logical_and.reduce(
            [consistency.fraction_above(c[0], s.line, s.window(n)) <= 0.05 for n in names]
        ),
    )


def at_times_above(name: WindowName) -> Reading:
    """Above the line at some time, for at most a quarter of the window."""

    def holds(c: Curves, s: StudyClock) -> NDArray[np.bool_]:
        f = consistency.fraction_above(c[0], s.line, s.window(name))
        return np.asarray((f > 0.0) & (f <= BRIEF))

    return Reading(f"above 3.592 somewhere, for at most a quarter of {phrase(name)}", holds)


def over(measure: Measure, threshold: float) -> Reading:
    """Whether a measure is above a fixed number, uncalibrated."""
    return Reading(
        f"{measure.says} > {threshold:g}", lambda c, s: np.asarray(measure.compute(c, s) > threshold)
    )
