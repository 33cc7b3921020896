"""Random answers: what is measured of them, and the band it must lie in.

No seed is shared with a program, so its answer cannot be compared, but its distribution can.  A case says how
many samples to draw, what is measured, and a two-sided band with its false-alarm rate.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.compare import RIGHT, Difference, Profile, numbers, refused
from vslam_ref.conformance.vectors_format import Case


def mean_trace(x: Array) -> float:
    """Mean trace of matrices (N, d, d)."""
    return float(np.trace(x, axis1=1, axis2=2).mean())


def mean_squared_trace(x: Array) -> float:
    """Mean squared trace of matrices (N, d, d)."""
    return float((np.trace(x, axis1=1, axis2=2) ** 2).mean())


def mean_square(x: Array) -> float:
    """Mean square of all entries."""
    return float((x**2).mean())


def mean_fourth(x: Array) -> float:
    """Mean fourth power of all entries: it separates a uniform from a Gaussian distribution."""
    return float((x**4).mean())


def mean(x: Array) -> float:
    """Mean of all entries."""
    return float(x.mean())


def worst_orthogonality(x: Array) -> float:
    """Largest entry of R^T R - I over matrices (N, d, d)."""
    return float(np.abs(np.swapaxes(x, 1, 2) @ x - np.eye(x.shape[-1])).max())


MEASURES: dict[str, Callable[[Array], float]] = {
    function.__name__: function
    for function in (mean_trace, mean_squared_trace, mean_square, mean_fourth, mean, worst_orthogonality)
}


def judge(case: Case, got: dict[str, Any], profile: Profile = "float64") -> Difference:
    """Measure a random answer, and compare with the band.

    Parameters
    ----------
    case : Case
        ``statistic`` has ``output``, ``measure``, ``samples``, ``low``, ``high``, ``false_alarm``;
        where the measure is a rounding, ``float32`` has ``low`` and ``high`` of single precision.
    got : dict
        Outputs.
    profile : {"float64", "float32"}
    """
    rule = case.statistic or {}
    name = str(rule["output"])
    if name not in got:
        return refused(name, None, "samples")
    try:
        samples = numbers(got[name])
    except ValueError as error:
        return refused(f"{name}: {error}", None, "samples")
    if len(np.atleast_1d(samples)) != rule["samples"] or not np.isfinite(samples).all():
        what = f"{name}: {len(np.atleast_1d(samples))} finite samples, expected {rule['samples']}"
        return refused(what, None, None)
    try:
        value = MEASURES[str(rule["measure"])](samples)
    except (ValueError, IndexError) as error:
        return refused(f"{name}: {error}", list(samples.shape), None)
    band = rule.get("float32", rule) if profile == "float32" else rule
    low, high = float(band["low"]), float(band["high"])
    if low <= value <= high:
        return RIGHT
    what = f"{rule['measure']} of {name} (a right program fails with probability {rule['false_alarm']:g})"
    return Difference("failed", what, value, [low, high], min(abs(value - low), abs(value - high)), 0.0)


def mistaken(case: Case, got: dict[str, Any]) -> str:
    """Note of the wrong distribution in whose band the measure lies; empty if there is none.

    A case's ``statistic`` may have ``mistakes``: a note's id -> ``low`` and ``high``.
    """
    rule = case.statistic or {}
    if not rule.get("mistakes"):
        return ""
    try:
        value = MEASURES[str(rule["measure"])](numbers(got[str(rule["output"])]))
    except (KeyError, ValueError, IndexError):
        return ""
    bands = rule["mistakes"].items()
    return next((str(note) for note, band in bands if band["low"] <= value <= band["high"]), "")
