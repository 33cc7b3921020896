"""What the grid as a whole says: the rules, fixed before it was run.

*Statements.*  Each statement of B 4.1 is carried to the grid: it holds over the grid when it is reproduced,
by its own rule with its own setting's thresholds, at every setting where it can be tested.

*Mechanisms.*  Six sentences about why B's picture looks as it does, which single settings cannot test.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, judged
from vslam_ref.experiments.iekf.grid import BASELINE, NUMERIC
from vslam_ref.experiments.iekf.rules import APART
from vslam_ref.experiments.iekf.sentences import SENTENCES, Sentence
from vslam_ref.experiments.iekf.settings import Grid, Judged
from vslam_ref.experiments.iekf.verdicts import LEAST_STUDY
from vslam_ref.metrics.consistency import bootstrap_interval, percentile_interval, resample_weights

GAP = (
    "ekf-high-exceeds-in-lap1",
    "ekf-high-inconsistent",
    "ekf-p0-amplifies",
    "iekf-high-much-better",
    "iekf-p0-less-than-ekf",
)
"""Statements that say: a high P0 harms the EKF, and the IEKF much less."""

EKF_LOW = (
    "ekf-low-lap1-consistent",
    "ekf-low-exceeds-at-closure",
    "ekf-low-lap2-inconsistent",
    "ekf-fails-at-end",
)
"""Statements on the EKF at low P0."""

SPREAD = 0.5
"""A share depends on something when that moves it by at least a half."""

SOURCE = "iekf-sensitivity; not in B"


def statement_claim(sentence: Sentence, grid: Grid) -> Claim:
    """Carry one statement of B 4.1 to the grid."""
    found = list(grid.verdicts(sentence.id))
    tested = [(j, v) for j, v in found if v != "not testable"]
    shares = {j.setting.name: j.claims[sentence.id].share for j, _ in tested}
    base = grid.baseline.claims[sentence.id]
    measured: dict[str, object] = {
        "baseline": base.verdict,
        "baseline_share": base.share,
        "settings_reproduced": sum(v == "reproduced" for _, v in tested),
        "settings_tested": len(tested),
    }
    if shares:
        least, most = min(shares, key=lambda n: shares[n] or 0.0), max(shares, key=lambda n: shares[n] or 0.0)
        measured |= {"least_share": [least, shares[least]], "largest_share": [most, shares[most]]}
    measured |= {axis: along_axis(sentence.id, axis, grid) for axis in grid.axes()}
    lost = [j.setting.name for j, v in tested if v == "not reproduced"]
    if lost:
        measured["reason"] = f"not reproduced at {len(lost)} of {len(tested)} settings: {', '.join(lost)}"
    nulls = [j.claims[sentence.id].null_rate for j, _ in tested]
    untestable = len(tested) < 2 or base.verdict == "not testable"
    good = sum(v == "reproduced" for _, v in tested)
    words = f"The statement is {base.verdict} at the baseline, and holds at {good} of {len(tested)} settings"
    return judged(
        sentence.id,
        sentence.source,
        f"{sentence.text} [Here: at every setting of the grid.]",
        "reproduced by its own rule (thresholds from each setting's own control) at the baseline and at "
        "every setting where it can be tested; share: of these settings; null rate: the largest of a setting",
        None if untestable else good == len(tested),
        words + (f"; it fails at {', '.join(lost)}" if lost else ""),
        measured,
        null_rate=max((n for n in nulls if n is not None), default=None),
        share=good / len(tested) if tested else None,
        least_runs=LEAST_STUDY,
    )


def along_axis(claim: str, axis: str, grid: Grid) -> str:
    """Say in words where on an axis a claim holds; the baseline counts as one of the values."""
    rows = [(j.setting.label, j.claims[claim].verdict) for j in grid.axis(axis)]
    whole = [grid.baseline.claims[claim].verdict, *(v for _, v in rows)]
    untested = [label for label, v in rows if v == "not testable"]
    note = f"; untested: {', '.join(untested)}" if untested else ""
    tested = [v for v in whole if v != "not testable"]
    if not tested:
        return "untested"
    if all(v == "reproduced" for v in tested):
        return "holds over the whole axis" + note
    if all(v == "not reproduced" for v in tested):
        return "holds nowhere" + note
    if whole[0] == "reproduced":
        return "stops at: " + ", ".join(label for label, v in rows if v == "not reproduced") + note
    return "holds only at: " + ", ".join(label for label, v in rows if v == "reproduced") + note


def mechanism_claims(grid: Grid, baseline_at: dict[str, float], rng: np.random.Generator) -> list[Claim]:
    """Judge the six sentences about the grid as a whole.

    Parameters
    ----------
    grid : Grid
    baseline_at : dict
        Place of the baseline on the numeric axes.
    rng : Generator
        For intervals over whole runs.
    """
    return [
        gap_everywhere(grid),
        low_depends_on_layout(grid),
        anchored_not_worse(grid, rng),
        rises_along(
            "ekf-end-grows-with-p0", "heading_variance", "ekf/high", grid, baseline_at, rng,
            "The larger the heading's initial variance, the larger the EKF's NEES after both loops",
        ),
        rises_along(
            "iekf-end-grows-with-steering-noise", "sigma_phi", "iekf/low", grid, baseline_at, rng,
            "What inconsistency the IEKF has at low P0 comes from the odometry: it grows with steering noise",
        ),
        small_noises_keep_gap(grid),
    ]  # fmt: skip


def gap_everywhere(grid: Grid) -> Claim:
    """The high-P0 gap needs no particular setting."""
    failed, tested = [], 0
    for claim in GAP:
        for j, v in grid.verdicts(claim):
            tested += v != "not testable"
            failed += [f"{claim} at {j.setting.name}"] if v == "not reproduced" else []
    return judged(
        "high-p0-gap-everywhere",
        SOURCE,
        "A high P0 harms the EKF, and the IEKF much less, at every setting of the grid",
        f"{', '.join(GAP)}: reproduced wherever they can be tested",
        not failed if tested else None,
        f"Of {tested} tests (five statements at every setting) {len(failed)} failed",
        {"tested": tested, "failed": failed},
        share=1.0 - len(failed) / tested if tested else None,
        least_runs=LEAST_STUDY,
    )


def low_depends_on_layout(grid: Grid) -> Claim:
    """Layout decides what is seen of the EKF at low P0; another draw of the noises decides less."""
    measured: dict[str, object] = {}
    telling, spreads = [], []
    for claim in EKF_LOW:
        layouts, draws = (_spread(claim, axis, grid) for axis in ("layout", "draw"))
        if layouts is None or draws is None:
            continue
        changes = len({j.claims[claim].verdict for j in (grid.baseline, *grid.axis("layout"))}) > 1
        spreads.append((claim, layouts, draws))
        measured[claim] = {"spread_layouts": layouts, "spread_draws": draws, "verdict_changes": changes}
        telling.append(changes and layouts >= SPREAD and layouts >= 2.0 * draws)
    if telling and not any(telling):
        measured["reason"] = "no share moves far more from layout to layout than from draw to draw"
    moved = "; ".join(
        f"{claim}: {100 * layouts:.0f} points over the layouts, {100 * draws:.0f} over the draws"
        for claim, layouts, draws in spreads
    )
    return judged(
        "ekf-low-depends-on-layout",
        SOURCE,
        "What B says of the EKF at low P0 depends on where the landmarks lie, not on the draw of the noises",
        f"for at least one of {', '.join(EKF_LOW)} the verdict changes over the layouts, the share varies by "
        f"at least {SPREAD:g} over them, and by at most half of that over the draws",
        any(telling) if telling else None,
        f"How far the share of studies that show B's picture moves, in percent, is for {moved}"
        if moved
        else "Layouts or draws were not run, or could not be judged",
        measured,
        least_runs=LEAST_STUDY,
    )


def _spread(claim: str, axis: str, grid: Grid) -> float | None:
    """Largest less smallest share on an axis, baseline included."""
    if not grid.axis(axis):
        return None
    shares = [j.claims[claim].share for j in (grid.baseline, *grid.axis(axis))]
    known = [s for s in shares if s is not None]
    return max(known) - min(known) if len(known) == len(shares) else None


def anchored_not_worse(grid: Grid, rng: np.random.Generator) -> Claim:
    """P0 that never meets a measurement is enough, wherever B's filter is good."""
    ratio, upper = {}, {}
    for j in grid.judged:
        pair = np.stack([j.end["ekf-anchored/high"], j.end["iekf/high"]], 1)
        ratio[j.setting.name] = float(pair[:, 0].mean() / pair[:, 1].mean())
        upper[j.setting.name] = bootstrap_interval(pair, lambda c: c[:, 0] / c[:, 1], rng)[1]
    worst = max(upper, key=lambda n: upper[n])
    few = len(grid.baseline.end["iekf/high"]) < 4 * grid.baseline.setting.study.runs
    return judged(
        "anchored-not-worse",
        SOURCE,
        "At high P0 the anchored EKF, an ordinary EKF that keeps P0 away from the measurements, is at least "
        "as consistent as the IEKF after both loops, at every setting of the grid",
        f"NEES over 150-160 s, anchored EKF over IEKF: upper end of the 95 % whole-run interval <= {APART:g} "
        "at every setting",
        None if few else all(u <= APART for u in upper.values()),
        f"The anchored EKF's NEES over the IEKF's is at most {max(ratio.values()):.3g}; the interval's "
        "upper end is "
        f"largest, {upper[worst]:.3g}, at {worst.replace('_', ' ')}, and {APART:g} is allowed",
        {"largest_upper_end": [worst, upper[worst]], "largest_ratio": max(ratio.values())},
        share=sum(u <= APART for u in upper.values()) / len(upper),
        least_runs=LEAST_STUDY,
    )


def rises_along(
    id: str,
    axis: str,
    key: str,
    grid: Grid,
    baseline_at: dict[str, float],
    rng: np.random.Generator,
    text: str,
) -> Claim:
    """Mean NEES at the end rises from each value of an axis to the next, and from first to last surely."""
    if axis not in NUMERIC:
        raise ValueError(f"axis {axis!r} has no order; those that have: {', '.join(NUMERIC)}")
    rows = [(j.setting.value, j) for j in grid.axis(axis)] + [(baseline_at[axis], grid.baseline)]
    ordered: Sequence[Judged] = [j for _, j in sorted(rows, key=lambda r: r[0])]
    means = [float(j.end[key].mean()) for j in ordered]
    low, high = _ratio_interval(ordered[-1].end[key], ordered[0].end[key], rng)
    few = len(ordered) < 3 or len(grid.baseline.end[key]) < 4 * grid.baseline.setting.study.runs
    steps = ", ".join(f"{m:.3g}" for m in means)
    return judged(
        id,
        SOURCE,
        text,
        f"mean NEES of {key} over 150-160 s rises at each step of {axis}, and its ratio from the first to "
        "the last value has a 95 % whole-run interval above 1",
        None if few else bool(np.all(np.diff(means) > 0)) and low > 1.0,
        f"From the smallest to the largest value the mean NEES is {steps}; the last over the first lies "
        "between "
        f"{low:.3g} and {high:.3g} (95 %)",
        {
            "values": [j.setting.label if j.setting.axis != BASELINE else BASELINE for j in ordered],
            "nees": means,
        },
        ci=[low, high],
        least_runs=LEAST_STUDY,
    )


def _ratio_interval(a: Array, b: Array, rng: np.random.Generator) -> tuple[float, float]:
    """95 % interval of mean(a) / mean(b), the runs of each resampled by themselves."""
    top = resample_weights(len(a), 2000, rng) @ a
    return percentile_interval(top / (resample_weights(len(b), 2000, rng) @ b))


def small_noises_keep_gap(grid: Grid) -> Claim:
    """The gap is no matter of large noises."""
    claims = [j.claims["iekf-high-much-better"] for j in grid.axis("small_noises")]
    tested = [c for c in claims if c.verdict != "not testable"]
    ends = [{key: float(j.end[f"{key}/high"].mean()) for key in ("ekf", "iekf", "ekf-anchored")}
            for j in grid.axis("small_noises")]  # fmt: skip
    share = min((c.share for c in tested if c.share is not None), default=None)
    return judged(
        "small-noises-keep-gap",
        SOURCE,
        "With all noises small the IEKF at high P0 is still much better than the EKF",
        f"iekf-high-much-better at small_noises: {SENTENCES['iekf-high-much-better'].rule.text()}",
        all(c.verdict == "reproduced" for c in tested) if tested else None,
        "No setting with small noises was run, or none could be tested" if share is None else
        f"With small noises {share:.0%} of studies show the IEKF much better than the EKF",
        {"nees_end": ends},
        null_rate=max((c.null_rate for c in tested if c.null_rate is not None), default=None),
        share=share,
        least_runs=LEAST_STUDY,
    )  # fmt: skip
