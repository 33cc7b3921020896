"""Bounds on PTAM's runs over recorded sequences, judged by the median of the runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, Study, judged
from vslam_ref.experiments.framework.claims import LEAST_FOR_EVERY_RUN
from vslam_ref.experiments.ptam.offset_runs import OffsetRun
from vslam_ref.experiments.ptam.recorded import RecordedSequence, recorded

HERE = "this library's bounds"


def claims(study: Study[dict[str, OffsetRun]]) -> list[Claim]:
    """Judge every bound of PTAM's table."""
    return judge(study, recorded())


def judge(study: Study[Any], table: Mapping[str, RecordedSequence]) -> list[Claim]:
    """Judge every bound of a table."""
    found: list[Claim] = []
    for name in study.config.sequences:
        each, runs = table[name], study.data.get(name)
        found += [_no_start(each, runs)] if each.must_not_start else _bounds(each, runs)
    return found


class Bound(NamedTuple):
    """A bound on the median of the runs."""

    key: str
    words: str
    limit: float | None
    value: Callable[[OffsetRun], Array]
    at_least: bool
    unit: str = ""
    scale: float = 1.0


def counted(share: Array) -> Array:
    """Shares (runs,), 0 for a run without a start: it tracked nothing."""
    return np.where(np.isfinite(share), share, 0.0)


def _judged_error(error: Array) -> Array:
    """Errors (runs,), infinite for a run without a path: it must not improve the median."""
    return np.where(np.isfinite(error), error, np.inf)


def _bounds(each: RecordedSequence, runs: OffsetRun | None) -> list[Claim]:
    percent = " %"
    rows = (
        Bound("all-pictures", "pictures with a pose, of all from the offset on", each.least_all,
              lambda r: np.where(r.started, counted(r.share_all), 0.0), True, percent, 100.0),
        Bound("after-the-start", "pictures with a pose, of those after the start", each.least_after,
              lambda r: counted(r.share_after), True, percent, 100.0),
        Bound("error", "error of the final path", each.most_error,
              lambda r: _judged_error(r.error), False, f" {each.error_unit}"),
        Bound("second-opinion", "distance of the final path from COLMAP's", each.most_second,
              lambda r: _judged_error(r.second_error), False, f" {each.error_unit}"),
        Bound("refined-error", "error of a second run, with the camera that a first one refined",
              each.most_refined, lambda r: _judged_error(r.refined_error), False, f" {each.error_unit}"),
    )  # fmt: skip
    claims = [_bound(each, runs, row) for row in rows if row.limit is not None]
    claims += [_drift(each, runs)] if each.refined_drift else []
    return [_all_start(each, runs), *claims] if each.all_start else claims


def _not_here(each: RecordedSequence, id: str, text: str, rule: str) -> Claim:
    """Without the pictures nothing can be tested."""
    why = f"The pictures of {each.name} (data set {each.data_set}) are not found here"
    return judged(id, HERE, text, rule, None, why, {}, runs=0)


def _all_start(each: RecordedSequence, runs: OffsetRun | None) -> Claim:
    """Every run must have a map in time."""
    text = f"{each.name}: every run has a map within {each.start_within} pictures"
    rule = "in every run"
    id = f"{each.name}-starts"
    if runs is None:
        return _not_here(each, id, text, rule)
    started = np.asarray(runs.started, bool)
    late = ", ".join(str(offset) for offset in np.asarray(runs.offset)[~started])
    return judged(
        id,
        HERE,
        text,
        rule,
        bool(started.all()),
        f"{each.name}: {int(started.sum())} of {len(started)} runs had a map within {each.start_within} "
        f"pictures{f'; those from {late} had none' if late else ''}{_seen(each)}",
        {"started": int(started.sum()), "runs": len(started)},
        share=float(started.mean()),
        runs=len(started),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _drift(each: RecordedSequence, runs: OffsetRun | None) -> Claim:
    """The drift with the refined camera, in a band."""
    low, high = each.refined_drift
    text = f"{each.name}: with the camera that a first run refined, the scale hardly drifts"
    rule = f"median over the runs of the drift of the second run within {low:g} to {high:g}"
    if runs is None:
        return _not_here(each, f"{each.name}-refined-drift", text, rule)
    values = np.asarray(runs.refined_drift, np.float64)
    given, middle = float(np.median(_judged_error(runs.drift))), float(np.median(_judged_error(values)))
    return judged(
        f"{each.name}-refined-drift",
        HERE,
        text,
        rule,
        low <= middle <= high,
        f"{each.name}: the last third's scale over the first's is {_said(given)} with the camera as given, "
        f"{_said(middle)} with the refined one, in the median; {low:g} to {high:g} asked for{_seen(each)}",
        {"given": _finite(given), "median": _finite(middle), "runs": [_finite(v) for v in values]},
        share=float(np.mean((values >= low) & (values <= high))),
        runs=len(values),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _bound(each: RecordedSequence, runs: OffsetRun | None, bound: Bound) -> Claim:
    """Median of the runs against a limit."""
    assert bound.limit is not None
    sign, word = (">=", "at least") if bound.at_least else ("<=", "at most")
    limit = bound.scale * bound.limit
    text = f"{each.name}: {bound.words}: {word} {limit:g}{bound.unit} in the median"
    rule = f"median over the runs {sign} {limit:g}{bound.unit}; a run without a start counts as the worst"
    id = f"{each.name}-{bound.key}"
    if runs is None:
        return _not_here(each, id, text, rule)
    values = bound.scale * bound.value(runs)
    holds = values >= limit if bound.at_least else values <= limit
    middle = float(np.median(values))
    worst = float(values.min() if bound.at_least else values.max())
    good = middle >= limit if bound.at_least else middle <= limit
    return judged(
        id,
        HERE,
        text,
        rule,
        bool(good),
        f"{each.name}, {bound.words}: {_said(middle)}{bound.unit} in the median of {len(values)} runs, worst "
        f"{_said(worst)}{bound.unit}, {word} {limit:g}{bound.unit} asked for{_seen(each)}",
        {"median": _finite(middle), "worst": _finite(worst), "runs": [_finite(v) for v in values]},
        share=float(np.mean(holds)),
        runs=len(values),
        least_runs=LEAST_FOR_EVERY_RUN,
    )


def _said(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "none"


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _seen(each: RecordedSequence) -> str:
    return "; settings were chosen with this sequence in sight" if each.seen else ""


def _no_start(each: RecordedSequence, runs: OffsetRun | None) -> Claim:
    """No run may start, and each must say why."""
    text = f"{each.name}: {each.what}: no run starts, and each says why"
    rule = "no run has a map; every run gives a reason"
    id = f"{each.name}-no-start"
    if runs is None:
        return _not_here(each, id, text, rule)
    started, silent = int(np.sum(runs.started)), int(np.sum(np.asarray(runs.reason) == ""))
    return judged(
        id,
        HERE,
        text,
        rule,
        started == 0 and silent == 0,
        f"{started} of {len(runs.started)} runs started; the first one's reason: "
        f'"{str(runs.reason[0]) or "none"}"',
        {"started": started, "without_reason": silent},
        share=float(np.mean(~np.asarray(runs.started, bool))),
        runs=len(runs.started),
        least_runs=LEAST_FOR_EVERY_RUN,
    )
