"""The gauge of bundle adjustment: one minimum, one set of images, and as many covariances as one likes.

Six cameras see thirty points.  The scene is measured and adjusted again and again, each time with nothing
held (``free``), with seven coordinates held (``fixed``), with seven held between two neighbours
(``badly``), and with two whole views held (``tied``), which is five numbers too many.  What the covariances
say is compared with what the repetitions show.

Bands are two-sided, with the false-alarm rate of the whole claim fixed beforehand and divided among its
parts.  Thresholds were fixed on a pilot of fifty repetitions with another seed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vslam_ref.experiments.bundle.gauges import (
    CHOSEN,
    INVARIANTS,
    GaugeConfig,
    Predicted,
    Repetitions,
    predict,
    simulate,
    world,
)
from vslam_ref.experiments.framework import Claim, Experiment, Study, batches, between, child_seeds, judged
from vslam_ref.experiments.framework.statistics import interval_of_means, interval_of_ratio
from vslam_ref.metrics.consistency import mean_band

if TYPE_CHECKING:
    from matplotlib.figure import Figure


FALSE_ALARM = 0.01
"""Of a whole claim that rests on bands."""
LEAST_FOR_BAND = 200
"""Repetitions from which a band detects INFLATED variances of three numbers in most studies."""
INFLATED = 1.25
"""Factor on all variances for which a band's null rate is reported."""
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


Runs = Study[Repetitions]
SOURCE = "A, eqs. 1.4 and 2.9"


def series(study: Runs) -> dict[str, object]:
    """Standard deviations predicted and found, by gauge."""
    predicted: Predicted = study.once
    return {
        "gauges": CHOSEN,
        "sd_predicted": np.sqrt(np.einsum("gii->gi", predicted.cov)),
        "sd_found": study.data.error.std(axis=0, ddof=1),
        "invariant_sd_predicted": dict(zip(CHOSEN, predicted.invariant_sd.tolist(), strict=True)),
        "invariant_sd_found": study.data.invariants.std(axis=0, ddof=1),
        "singular_values": predicted.singular[-9:],
        "nees": {gauge: nees(study, k) for k, gauge in enumerate(CHOSEN)},
    }


def nees(study: Runs, gauge: int) -> dict[str, float]:
    """Mean squared error in the predicted covariance, of each block."""
    found = {}
    for name, part in BLOCKS.items():
        e, cov = study.data.error[:, gauge, part], study.once.cov[gauge][part, part]
        found[name] = float(np.mean(np.einsum("ni,in->n", e, np.linalg.solve(cov, e.T))))
    return found


FIXED = "With a view held, points far from it are less sure than in the free gauge"
BADLY = "With the scale held on a short baseline, every coordinate is far less sure"


def claims(study: Runs) -> list[Claim]:
    """Judge what the gauge changes, and what it does not."""
    return [
        _seven(study.once),
        _same_minimum(study.data),
        _more(study, "fixed", "free", MORE, FIXED),
        _more(study, "badly", "fixed", MUCH_MORE, BADLY),
        _invariants(study),
        _calibrated(study),
        _tied(study),
    ]


def _seven(predicted: Predicted) -> Claim:
    values = np.sort(predicted.singular)
    zeros, seventh, eighth = int(np.sum(values <= ZERO)), float(values[6]), float(values[7])
    return judged(
        "seven-directions-are-invisible",
        SOURCE,
        "Images show a scene up to a motion and a scale: seven directions, and no other, change no pixel",
        f"of the singular values of the free Jacobian (columns of length 1, the largest 1), exactly 7 are <= "
        f"{ZERO:g} and the eighth is >= {SEEN:g}; moving and enlarging the world changes no pixel by 1e-9",
        zeros == 7 and eighth >= SEEN and predicted.invisible < 1e-9,
        f"Of the Jacobian's singular values {zeros} are zero to rounding (the seventh is {seventh:.1e}, the "
        f"eighth {eighth:.1e} of the largest), and moving the whole world changes no pixel by more than "
        f"{predicted.invisible:.1e}",
        {"zeros": zeros, "eighth": eighth, "seventh": seventh, "px": predicted.invisible},
    )


def _same_minimum(data: Repetitions) -> Claim:
    cost = data.cost[:, : len(CHOSEN)]
    apart = np.ptp(cost, axis=1) / cost.min(axis=1)
    good = (apart < SAME_COST) & (data.apart < SAME_PX)
    return judged(
        "one-minimum-one-set-of-images",
        SOURCE,
        "Whatever seven coordinates are held, or none, the minimum and every predicted pixel are the same",
        f"in every repetition: costs differ by less than {SAME_COST:g} of themselves, pixels by less than "
        f"{SAME_PX:g}",
        bool(good.all()),
        f"Over {len(good)} repetitions the costs of the gauges differ by at most {apart.max():.1e} of "
        "themselves and "
        f"the pixels by {data.apart.max():.1e} px; {SAME_COST:g} and {SAME_PX:g} are allowed",
        {"cost": float(apart.max()), "px": float(data.apart.max())},
        share=float(good.mean()),
    )


def _more(study: Runs, above: str, below: str, factor: float, text: str) -> Claim:
    """Variances of the points in one gauge over those in another."""
    a, b = (np.sum(study.data.error[:, CHOSEN.index(g), POINTS] ** 2, axis=1) for g in (above, below))
    interval = interval_of_ratio(a, b, study.rng(CHOSEN.index(above)))
    trace = dict(zip(CHOSEN, np.einsum("gii->g", study.once.cov[:, POINTS, POINTS]), strict=True))
    ratio, predicted = float(a.mean() / b.mean()), float(trace[above] / trace[below])
    return judged(
        f"{above}-over-{below}",
        SOURCE,
        text,
        f"mean square error of three points, {above} over {below}: 95 % whole-run interval > {factor:g}",
        interval[0] > factor,
        f"The mean square error of three points in the gauge “{above}” is {ratio:.3g} times that in "
        f"“{below}”, with 95 % {between(interval)}; {predicted:.3g} is predicted, and more than {factor:g} "
        "is "
        "asked for",
        {"ratio": ratio, "predicted": predicted},
        ci=interval,
        null_rate=0.025,
    )


def _band_null(runs: int, dof: int, level: float) -> float:
    """How often a mean NEES is in its band where all variances are INFLATED times those predicted."""
    from scipy.stats import chi2

    band = mean_band(runs, dof, level)
    low, high = (chi2.cdf(runs * edge / INFLATED, runs * dof) for edge in band)
    return float(high - low)


def _invariants(study: Runs) -> Claim:
    sd, runs = study.once.invariant_sd, study.config.runs
    same = float(np.max(np.ptp(sd, axis=0) / sd.min(axis=0)))
    level = 1.0 - FALSE_ALARM / len(INVARIANTS)
    band = mean_band(runs - 1, 1, level)
    ratio = np.var(study.data.invariants[:, 0], axis=0, ddof=1) / sd[0] ** 2
    return judged(
        "what-images-show-is-as-sure-in-every-gauge",
        SOURCE,
        "Ratios of lengths and angles have one covariance, that of the repetitions",
        f"predicted standard deviations of a ratio and an angle agree to {SAME_SD:g} in all gauges; found "
        f"over predicted variance in the two-sided band of {runs} repetitions (false alarm {FALSE_ALARM:g}; "
        f"null: {INFLATED:g} times the variance)",
        same < SAME_SD and bool(np.all((ratio > band[0]) & (ratio < band[1]))),
        f"The predicted standard deviations of a length ratio and an angle agree to {same:.1e} in all "
        "gauges; the "
        f"variances found are {ratio[0]:.3f} and {ratio[1]:.3f} times those predicted, and {runs} honest "
        "repetitions "
        f"lie {between(band)}",
        {"largest_difference": same, "variance_ratio": ratio.tolist(), "band": list(band)},
        null_rate=_band_null(runs - 1, 1, level) ** len(INVARIANTS),
        least_runs=LEAST_FOR_BAND,
    )


def _calibrated(study: Runs) -> Claim:
    parts, runs = len(CHOSEN) * len(BLOCKS), study.config.runs
    inside, measured, null = [], {}, 1.0
    for k, gauge in enumerate(CHOSEN):
        for name, value in nees(study, k).items():
            dof = BLOCKS[name].stop - BLOCKS[name].start
            band = mean_band(runs, dof, 1.0 - FALSE_ALARM / parts)
            inside.append(band[0] < value < band[1])
            measured[f"{gauge}, {name}"] = value
            null = min(null, _band_null(runs, dof, 1.0 - FALSE_ALARM / parts))
    return judged(
        "covariances-are-those-of-the-repetitions",
        SOURCE,
        "The covariance computed in a gauge is that of its coordinates when everything is measured again",
        f"mean NEES of two views (6) and three points (3), in three gauges: all {parts} in their two-sided "
        f"bands (false alarm {FALSE_ALARM:g} in all; null: {INFLATED:g} times the variance)",
        all(inside),
        f"Over {runs} repetitions {sum(inside)} of {parts} mean squared errors, each measured by its "
        "predicted "
        "covariance, lie where honest covariances would put them",
        measured,
        null_rate=null,
        share=float(np.mean(inside)),
        least_runs=LEAST_FOR_BAND,
    )


def _tied(study: Runs) -> Claim:
    """Twelve numbers held are five statements about the scene."""
    rise = 2.0 * (study.data.cost[:, 3] - study.data.cost[:, 0]) / study.config.sigma**2
    band = mean_band(study.config.runs, 5, 1.0 - FALSE_ALARM)
    mean = float(rise.mean())
    return judged(
        "two-views-held-are-five-numbers-too-many",
        SOURCE,
        "Holding two whole views is no choice of gauge: five of their twelve numbers bend the scene",
        "twice the rise of the cost over sigma squared has the mean of chi-squared with 12 - 7 = 5 degrees "
        f"of freedom: two-sided band, false alarm {FALSE_ALARM:g} (null: 6 instead of 5)",
        band[0] < mean < band[1],
        f"Holding two views raises twice the cost, in units of sigma squared, by {mean:.2f} on average; "
        "five numbers "
        f"too many predict 5, and {study.config.runs} repetitions lie {between(band)}",
        {"mean": mean, "band": list(band)},
        ci=interval_of_means(rise, study.rng(9)),
        null_rate=_dof_null(study.config.runs),
        least_runs=LEAST_FOR_BAND,
    )


def _dof_null(runs: int) -> float:
    """How often a mean of chi-squared with 6 degrees of freedom falls into the band of 5."""
    from scipy.stats import chi2

    band = mean_band(runs, 5, 1.0 - FALSE_ALARM)
    return float(chi2.cdf(runs * band[1], 6 * runs) - chi2.cdf(runs * band[0], 6 * runs))


def figure(study: Runs) -> Figure:
    """Ellipses and repetitions seen from above, in three gauges; and predicted against found."""
    from vslam_ref.plot.bundle_gauge import gauge_figure

    bundle, chosen = world(study.config)
    found = study.data.error.std(axis=0, ddof=1)
    predicted = np.sqrt(np.einsum("gii->gi", study.once.cov))
    return gauge_figure(
        bundle.truth,
        chosen.points,
        {g: study.once.cov[k][POINTS, POINTS] for k, g in enumerate(CHOSEN)},
        {g: study.data.error[:, k, POINTS] for k, g in enumerate(CHOSEN)},
        {g: (predicted[k], found[k]) for k, g in enumerate(CHOSEN)},
        (study.once.invariant_sd[0], study.data.invariants[:, 0].std(axis=0, ddof=1)),
    )


EXPERIMENT = Experiment(
    id="bundle-gauge",
    title="The gauge of bundle adjustment",
    source="A, equations 1.4 and 2.9",
    config_type=GaugeConfig,
    simulate=simulate,
    seeds=lambda config, point: batches(child_seeds(config, point), config.batch),
    once=predict,
    series=series,
    claims=claims,
    figure=figure,
    about={
        "cost": "half the sum of squares, pixels squared; (runs, free/fixed/badly/tied)",
        "apart": "largest difference of a predicted pixel between gauges that choose, pixels; (runs,)",
        "error": "displacement of two views (6 each) and three points (3 each); (runs, free/fixed/badly, 21)",
        "invariants": "a ratio of lengths and an angle in radians; (runs, free/fixed/badly, 2)",
        "converged": "whether every gauge reached a minimum; (runs,)",
    },
    quick={"runs": 40, "batch": 20},  # fewer repetitions: the bands are wider
)
