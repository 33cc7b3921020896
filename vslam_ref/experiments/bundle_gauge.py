"""The gauge of bundle adjustment: one minimum, one set of images, and as many covariances as one likes.

Six cameras see thirty points.  The scene is measured and adjusted again and again, each time with nothing
held (``free``), with seven coordinates held (``fixed``), with seven held between two neighbours
(``badly``), and with two whole views held (``tied``), which is five numbers too many.  What the covariances
say is compared with what the repetitions show.

Bands are two-sided, with the false-alarm rate of the whole claim fixed beforehand and divided among its
parts.  Thresholds were fixed on a pilot of fifty repetitions with another seed.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.experiments.bundle.gauges import (
    CHOSEN,
    INVARIANTS,
    GaugeConfig,
    GaugeTask,
    Predicted,
    Repetitions,
    predict,
    repeat,
    world,
)
from vslam_ref.experiments.framework import Claim, Experiment, Result, RunContext, verdict
from vslam_ref.metrics.consistency import mean_band, percentile_interval, resample_weights

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FALSE_ALARM = 0.01
"""Of a whole claim that rests on bands."""
INFLATED = 1.25
"""Factor on all variances that a band's null rate is told for."""
ZERO, SEEN = 1e-10, 1e-5
"""Relative singular values: at most the former counts as zero, at least the latter as none."""
SAME_COST, SAME_PX = 1e-9, 1e-4
"""Relative difference of costs, and pixels, up to which minima are the same."""
MORE, MUCH_MORE = 2.0, 4.0
"""Ratio of variances of points: fixed gauge over free one, badly fixed over fixed."""
SAME_SD = 1e-6
"""Relative difference of standard deviations that are the same."""
BLOCKS = {"view a": slice(0, 6), "view b": slice(6, 12)} | {
    f"point {name}": slice(12 + 3 * k, 15 + 3 * k) for k, name in enumerate("abc")
}
"""Rows of an error: two views, three points."""
POINTS = slice(12, 21)


class Study(NamedTuple):
    """Everything measured and predicted."""

    config: GaugeConfig
    runs: Repetitions
    predicted: Predicted


def run(config: GaugeConfig, context: RunContext) -> Result:
    """Predict, and repeat."""
    seeds = np.random.SeedSequence(config.seed).spawn(config.runs)
    batches = [
        GaugeTask(config, tuple(seeds[a : a + config.batch])) for a in range(0, config.runs, config.batch)
    ]
    done = context.map(repeat, batches, "bundle-gauge")
    runs = Repetitions(*(np.concatenate(columns) for columns in zip(*done, strict=True)))
    study = Study(config, runs, predict(config))
    series = {
        "gauges": CHOSEN,
        "sd_predicted": np.sqrt(np.einsum("gii->gi", study.predicted.cov)),
        "sd_found": runs.error.std(axis=0, ddof=1),
        "invariant_sd_predicted": dict(zip(CHOSEN, study.predicted.invariant_sd.tolist(), strict=True)),
        "invariant_sd_found": runs.invariants.std(axis=0, ddof=1),
        "singular_values": study.predicted.singular[-9:],
        "nees": {gauge: nees(study, k) for k, gauge in enumerate(CHOSEN)},
    }
    return Result(series=series, seed=config.seed, runs=config.runs, arrays=runs._asdict(), payload=study)


def nees(study: Study, gauge: int) -> dict[str, float]:
    """Mean squared error in the predicted covariance, of each block."""
    found = {}
    for name, part in BLOCKS.items():
        e, cov = study.runs.error[:, gauge, part], study.predicted.cov[gauge][part, part]
        found[name] = float(np.mean(np.einsum("ni,in->n", e, np.linalg.solve(cov, e.T))))
    return found


def claims(result: Result) -> list[Claim]:
    """Judge what the gauge changes, and what it does not."""
    study: Study = result.payload
    return [
        _seven(study),
        _same_minimum(study),
        _more(study, "fixed", "free", MORE),
        _more(study, "badly", "fixed", MUCH_MORE),
        _invariants(study),
        _calibrated(study),
        _tied(study),
    ]


SOURCE = "A, eqs. 1.4 and 2.9"


def _seven(study: Study) -> Claim:
    values = study.predicted.singular
    zeros, eighth = int(np.sum(values <= ZERO)), float(np.sort(values)[7])
    holds = zeros == 7 and eighth >= SEEN and study.predicted.invisible < 1e-9
    return Claim(
        "seven-directions-are-invisible",
        SOURCE,
        "Images show a scene up to a motion and a scale: seven directions, and no other, change no pixel",
        f"of the singular values of the free Jacobian (columns of length 1, the largest 1), exactly 7 are <= "
        f"{ZERO:g} and the eighth is >= {SEEN:g}; moving and enlarging the world changes no pixel by 1e-9",
        {
            "zeros": zeros,
            "eighth": eighth,
            "seventh": float(np.sort(values)[6]),
            "px": study.predicted.invisible,
        },
        None,
        None,
        None,
        verdict(holds),
    )


def _same_minimum(study: Study) -> Claim:
    cost = study.runs.cost[:, : len(CHOSEN)]
    apart = np.ptp(cost, axis=1) / cost.min(axis=1)
    good = (apart < SAME_COST) & (study.runs.apart < SAME_PX)
    return Claim(
        "one-minimum-one-set-of-images",
        SOURCE,
        "Whatever seven coordinates are held, or none, the minimum and every predicted pixel are the same",
        f"in every repetition: costs differ by less than {SAME_COST:g} of themselves, pixels by less than "
        f"{SAME_PX:g}",
        {"cost": float(apart.max()), "px": float(study.runs.apart.max())},
        None,
        None,
        float(good.mean()),
        verdict(bool(good.all())),
    )


def _more(study: Study, above: str, below: str, factor: float) -> Claim:
    """Variances of the points in one gauge over those in another."""
    a, b = (np.sum(study.runs.error[:, CHOSEN.index(g), POINTS] ** 2, axis=1) for g in (above, below))
    rng = np.random.default_rng([study.config.seed, CHOSEN.index(above)])
    sums = resample_weights(len(a), 2000, rng) @ np.stack([a, b], axis=1)
    interval = percentile_interval(sums[:, 0] / sums[:, 1])
    trace = dict(zip(CHOSEN, np.einsum("gii->g", study.predicted.cov[:, POINTS, POINTS]), strict=True))
    predicted = float(trace[above] / trace[below])
    told = {
        "fixed": "With a view held, points far from it are less sure than in the free gauge",
        "badly": "With the scale held on a short baseline, every coordinate is far less sure",
    }
    return Claim(
        f"{above}-over-{below}",
        SOURCE,
        told[above],
        f"mean square error of three points, {above} over {below}: 95 % whole-run interval > {factor:g}",
        {"ratio": float(a.mean() / b.mean()), "predicted": predicted},
        list(interval),
        0.025,
        None,
        verdict(interval[0] > factor),
    )


def _band_null(runs: int, dof: int, level: float) -> float:
    """How often a mean NEES is in its band where all variances are INFLATED times those predicted."""
    from scipy.stats import chi2

    band = mean_band(runs, dof, level)
    low, high = (chi2.cdf(runs * edge / INFLATED, runs * dof) for edge in band)
    return float(high - low)


def _invariants(study: Study) -> Claim:
    sd, runs = study.predicted.invariant_sd, study.config.runs
    same = float(np.max(np.ptp(sd, axis=0) / sd.min(axis=0)))
    level = 1.0 - FALSE_ALARM / len(INVARIANTS)
    band = mean_band(runs - 1, 1, level)
    ratio = np.var(study.runs.invariants[:, 0], axis=0, ddof=1) / sd[0] ** 2
    holds = same < SAME_SD and bool(np.all((ratio > band[0]) & (ratio < band[1])))
    return Claim(
        "what-images-show-is-as-sure-in-every-gauge",
        SOURCE,
        "Ratios of lengths and angles have one covariance, that of the repetitions",
        f"predicted standard deviations of a ratio and an angle agree to {SAME_SD:g} in all gauges; found "
        f"over predicted variance in the two-sided band of {runs} repetitions (false alarm {FALSE_ALARM:g}; "
        f"null: {INFLATED:g} times the variance)",
        {"largest_difference": same, "variance_ratio": ratio.tolist(), "band": list(band)},
        None,
        _band_null(runs - 1, 1, level) ** len(INVARIANTS),
        None,
        verdict(holds),
    )


def _calibrated(study: Study) -> Claim:
    parts = len(CHOSEN) * len(BLOCKS)
    inside, measured, null = [], {}, 1.0
    for k, gauge in enumerate(CHOSEN):
        for name, value in nees(study, k).items():
            dof = BLOCKS[name].stop - BLOCKS[name].start
            band = mean_band(study.config.runs, dof, 1.0 - FALSE_ALARM / parts)
            inside.append(band[0] < value < band[1])
            measured[f"{gauge}, {name}"] = value
            null = min(null, _band_null(study.config.runs, dof, 1.0 - FALSE_ALARM / parts))
    return Claim(
        "covariances-are-those-of-the-repetitions",
        SOURCE,
        "The covariance computed in a gauge is that of its coordinates when everything is measured again",
        f"mean NEES of two views (6) and three points (3), in three gauges: all {parts} in their two-sided "
        f"bands (false alarm {FALSE_ALARM:g} in all; null: {INFLATED:g} times the variance)",
        measured,
        None,
        null,
        float(np.mean(inside)),
        verdict(all(inside)),
    )


def _tied(study: Study) -> Claim:
    """Twelve numbers held are five statements about the scene."""
    rise = 2.0 * (study.runs.cost[:, 3] - study.runs.cost[:, 0]) / study.config.sigma**2
    band = mean_band(study.config.runs, 5, 1.0 - FALSE_ALARM)
    rng = np.random.default_rng([study.config.seed, 9])
    interval = percentile_interval(resample_weights(len(rise), 2000, rng) @ rise)
    return Claim(
        "two-views-held-are-five-numbers-too-many",
        SOURCE,
        "Holding two whole views is no choice of gauge: five of their twelve numbers bend the scene",
        "twice the rise of the cost over sigma squared has the mean of chi-squared with 12 - 7 = 5 degrees "
        f"of freedom: two-sided band, false alarm {FALSE_ALARM:g} (null: 6 instead of 5)",
        {"mean": float(rise.mean()), "band": list(band)},
        list(interval),
        _dof_null(study.config.runs),
        None,
        verdict(band[0] < float(rise.mean()) < band[1]),
    )


def _dof_null(runs: int) -> float:
    """How often a mean of chi-squared with 6 degrees of freedom falls into the band of 5."""
    from scipy.stats import chi2

    band = mean_band(runs, 5, 1.0 - FALSE_ALARM)
    return float(chi2.cdf(runs * band[1], 6 * runs) - chi2.cdf(runs * band[0], 6 * runs))


def figure(result: Result) -> Figure:
    """Ellipses and repetitions seen from above, in three gauges; and predicted against found."""
    from vslam_ref.plot.bundle_gauge import gauge_figure

    study: Study = result.payload
    bundle, chosen = world(study.config)
    found = study.runs.error.std(axis=0, ddof=1)
    predicted = np.sqrt(np.einsum("gii->gi", study.predicted.cov))
    return gauge_figure(
        bundle.truth,
        chosen.points,
        {g: study.predicted.cov[k][POINTS, POINTS] for k, g in enumerate(CHOSEN)},
        {g: study.runs.error[:, k, POINTS] for k, g in enumerate(CHOSEN)},
        {g: (predicted[k], found[k]) for k, g in enumerate(CHOSEN)},
        (study.predicted.invariant_sd[0], study.runs.invariants[:, 0].std(axis=0, ddof=1)),
    )


def quick(config: GaugeConfig) -> GaugeConfig:
    """Fewer repetitions: the bands are wider."""
    return dataclasses.replace(config, runs=40, batch=20)


EXPERIMENT = Experiment(
    id="bundle-gauge",
    title="The gauge of bundle adjustment",
    source="A, equations 1.4 and 2.9",
    config_type=GaugeConfig,
    run=run,
    claims=claims,
    figure=figure,
    quick=quick,
)
