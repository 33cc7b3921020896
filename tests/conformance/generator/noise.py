"""Gaussian noise: the first four moments of what a program draws, each within its band."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import norm

from generator.building import Topic, tolerance

TOPIC, CHAPTER = "noise", 4
SAMPLES = 4000
FALSE_ALARM = 2e-4
"""Of each band.  The band holds a Gaussian with 1 - 1e-4; the skewness of a mean of 4000 fourth powers,
10.1 / sqrt(4000) = 0.16, raises its upper tail beyond 3.9 sigma by 2.3 (Edgeworth), to 1.2e-4 in all."""

NOTES = {
    "uniform-noise": (
        "your noise is uniform with the right variance; its fourth moment is 9/5 sigma^4, a Gaussian's 3",
        "sigma sqrt(12) (u - 1/2)",
    ),
    "uniform-half-width": (
        "your noise is uniform between -sigma and sigma: its variance is sigma^2/3",
        "sigma (2 u - 1)",
    ),
    "variance-for-deviation": (
        "you scale by the variance where the standard deviation belongs",
        "sigma^2 n",
    ),
    "positive-uniform": ("your noise is uniform between 0 and sigma: it has a mean", "sigma u"),
}

MOMENTS = {  # measure -> mean and variance of one sample's power, for a Gaussian with sigma = 1
    "mean": (0.0, 1.0, 1),
    "mean_square": (1.0, 2.0, 2),
    "mean_fourth": (3.0, 96.0, 4),
}
UNIFORM = {  # the same for other distributions: note -> measure -> mean, variance
    "uniform-noise": {"mean_fourth": (9 / 5, 9 - 81 / 25)},
    "uniform-half-width": {"mean_square": (1 / 3, 1 / 5 - 1 / 9), "mean_fourth": (1 / 5, 1 / 9 - 1 / 25)},
    "positive-uniform": {
        "mean": (1 / 2, 1 / 12),
        "mean_square": (1 / 3, 1 / 5 - 1 / 9),
        "mean_fourth": (1 / 5, 1 / 9 - 1 / 25),
    },
}


def build(rng: np.random.Generator) -> Topic:
    """Three moments for two standard deviations."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    for sigma, size in ((0.5, "half_a_pixel"), (2.0, "two_pixels")):
        for measure in MOMENTS:
            topic.group(
                "noise.gaussian",
                "eq-mad",
                "moments of the Gaussian, closed form",
                tolerance(0.0, "a band: the mean of 4000 powers is Gaussian to a few parts in a hundred"),
                [{"inputs": {"N": SAMPLES, "sigma": sigma}, "expected": {"x": []}}],
                flags=("statistical", measure, size),
                statistic=_statistic(measure, sigma),
            )
    return topic


def _statistic(measure: str, sigma: float) -> dict[str, Any]:
    mean, variance, power = MOMENTS[measure]
    low, high = _band(mean, variance, sigma**power)
    mistakes = {}
    for note, moments in UNIFORM.items():
        # even moments of the two narrow uniform distributions are the same: only the mean tells them apart
        if measure in moments and not (note == "positive-uniform" and measure != "mean"):
            mistakes[note] = _band(*moments[measure], sigma**power)
    if power == 2:
        mistakes["variance-for-deviation"] = _band(mean, variance, sigma ** (2 * power))
    return {
        **{"output": "x", "measure": measure, "samples": SAMPLES},
        **{"low": low, "high": high, "false_alarm": FALSE_ALARM},
        "mistakes": {note: {"low": a, "high": b} for note, (a, b) in mistakes.items()},
    }


def _band(mean: float, variance: float, unit: float) -> tuple[float, float]:
    """Two-sided band of the mean of many."""
    z = float(norm.isf(1e-4 / 2)) * (variance / SAMPLES) ** 0.5
    return unit * (mean - z), unit * (mean + z)
