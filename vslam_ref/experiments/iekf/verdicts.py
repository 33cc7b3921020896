"""From the arrays of a study to verdicts.

One rule decides all claims.  It was fixed before the runs:

**reproduced** when all three hold,

1. *true*: the 95 % interval of the statistic over whole-run bootstraps of the population lies
   entirely on the claim's side of the threshold;
2. *seen*: the claim holds in at least 80 % of the studies of B's size drawn from the population (``share``);
3. *telling*: the share exceeds the null rate, the rate at which the same rule says yes in a world where
   the claim is false, by at least one half (Youden's index of the rule).

**not testable** when no data could have met these: a series or the control is missing or has no value
somewhere, the study ends before the second lap does, the population is smaller than four studies or the
control than eight, or the null rate is above one half, so that not even a share of one would decide.

**not reproduced** otherwise.

Thresholds come from one half of the control (or one set of label swaps) and null rates from the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypedDict

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, judged
from vslam_ref.experiments.iekf.evaluation import ClaimEvaluation, evaluate_all
from vslam_ref.experiments.iekf.measures import StudyClock
from vslam_ref.experiments.iekf.rules import Rule
from vslam_ref.experiments.iekf.sentences import SENTENCES, Sentence
from vslam_ref.experiments.iekf.worlds import control_names

SEEN = 0.8
"""Least share of studies of B's size in which a reproduced claim holds."""

TELLING = 0.5
"""Least distance of that share from the null rate."""

POPULATION_STUDIES, CONTROL_STUDIES = 4, 8
"""Least population and control, in studies: with fewer, drawn studies are mostly the same runs."""

LEAST_STUDY = 50
"""Runs of B's own study: claims on figures of 50 runs are judged on studies of 50 runs."""


class StudyArrays(TypedDict):
    """What the judge is given.

    ``time`` (T,) in seconds; ``lap_seconds``; ``runs``, the size of B's study, whose runs are the first
    rows; ``nees`` and ``position_error`` [m], "filter/p0" -> (M, T), a row being the same run in every
    array.  ``nees`` also holds the consistent control, "control/low" and "control/high", (C, T), rows paired
    likewise.  More keys do no harm.
    """

    time: Array
    lap_seconds: float
    runs: int
    nees: Mapping[str, Array]
    position_error: Mapping[str, Array]


def judge(study: StudyArrays, claim_ids: Sequence[str], rng: np.random.Generator) -> list[Claim]:
    """Judge claims of B 4.1 on the arrays of a study.

    Parameters
    ----------
    study : StudyArrays
        Per-run arrays; see there.
    claim_ids : sequence of str
        Keys of :data:`~vslam_ref.experiments.iekf.sentences.SENTENCES`.
    rng : Generator
        Source of the draws.  A fresh generator of the same seed gives the same numbers for a claim,
        whatever else is asked.

    Returns
    -------
    list of Claim
        In the order of ``claim_ids``.

    Raises
    ------
    ValueError
        If an id is unknown, or an array does not fit the clock or the other arrays.
    """
    reasons = _obstacles(study, claim_ids)
    done = {e.sentence.id: e for e in evaluate(study, claim_ids, rng)}
    return [conclude(done[i]) if i in done else _not_testable(SENTENCES[i], reasons[i]) for i in claim_ids]


def evaluate(study: StudyArrays, claim_ids: Sequence[str], rng: np.random.Generator) -> list[ClaimEvaluation]:
    """Return what :func:`judge` concludes from, for the claims that can be tested; same draws."""
    reasons = _obstacles(study, claim_ids)
    sentences = [SENTENCES[i] for i in claim_ids if i not in reasons]
    names = dict.fromkeys(name for s in sentences for name in s.rule.series)
    calm = [s for s in sentences if s.rule.needs_control]
    controls = dict.fromkeys(name for s in calm for name in control_names(s.rule))
    data, control = _gather(study, names), _gather(study, controls)
    clock = StudyClock(np.asarray(study["time"], dtype=np.float64), study["lap_seconds"], study["runs"])
    return evaluate_all(sentences, data, control, clock, rng)


def conclude(e: ClaimEvaluation) -> Claim:
    """Turn an evaluation into a claim with its verdict."""
    rule, s = e.sentence.rule, e.sentence
    conditions = {
        "true": bool(np.all(rule.holds(np.asarray(e.interval), e.threshold))),
        "seen": e.share >= SEEN,
        "telling": e.share - e.null_rate >= TELLING,
    }
    low, median, high = (float(q) for q in np.quantile(e.subsets, [0.05, 0.5, 0.95]))
    measured: dict[str, object] = {
        "own_runs": e.own,
        "own_runs_hold": bool(rule.holds(np.asarray(e.own), e.threshold)),
        "population": e.population,
        "threshold": e.threshold,
        "samples_q05": low,
        "samples_q50": median,
        "samples_q95": high,
        "share_low": e.share_interval[0],
        "share_high": e.share_interval[1],
        **conditions,
    }
    if e.naive is not None:
        measured |= {"naive_share": float(np.mean(e.naive)), "naive_own_runs_hold": e.own_naive}
    undecidable = e.null_rate > 1.0 - TELLING
    if undecidable:
        measured["reason"] = "the rule says yes too often where the claim is false"
    elif not all(conditions.values()):
        measured["reason"] = _why_not(e, conditions)
    return judged(
        s.id, s.source, s.text, rule.text(), None if undecidable else all(conditions.values()),
        _found(e, conditions), measured,
        ci=e.interval, null_rate=e.null_rate, share=e.share, runs=e.study_runs, least_runs=LEAST_STUDY,
    )  # fmt: skip


def _found(e: ClaimEvaluation, conditions: Mapping[str, bool]) -> str:
    """Say what was found: the statistic of all runs, its bound, how many studies show it, and the rest."""
    rule = e.sentence.rule
    size = "B's size" if e.study_runs == LEAST_STUDY else f"{e.study_runs} runs"
    text = (
        f"Over {e.population_runs} runs {rule.found(e.population)}; {rule.bound(e.threshold)}; "
        f"{e.share:.0%} of studies of {size} show B's picture"
    )
    if not conditions["seen"]:
        text += f", where {SEEN:.0%} are asked for"
    elif not conditions["true"]:
        text += ", but all runs together do not settle on which side of the bound it lies"
    if e.null_rate > 1.0 - TELLING or (conditions["seen"] and not conditions["telling"]):
        text += f", but so do {e.null_rate:.0%} where it is false"
    return text


def _why_not(e: ClaimEvaluation, conditions: Mapping[str, bool]) -> str:
    """Say why a claim is not reproduced: not true of the filters, not seen by a study, or not telling."""
    low, high = e.interval
    side = ">" if e.sentence.rule.above else "<="
    yes, null = f"{e.share:.0%}", f"{e.null_rate:.0%}"
    reasons = {
        "true": f"over all runs it is in [{low:.3g}, {high:.3g}], not clearly {side} {e.threshold:.3g}",
        "seen": f"only {yes} of studies of B's size show it, so one figure may or may not",
        "telling": f"the rule says yes in {null} where the claim is false, too near to {yes}",
    }
    return "; ".join(text for name, text in reasons.items() if not conditions[name])


def all_at_once(evaluations: Sequence[ClaimEvaluation]) -> dict[str, float]:
    """Share of drawn studies in which every one of the claims holds, by the rules and read naively.

    A claim without a naive reading counts by its rule in both.
    """
    if not evaluations:
        raise ValueError("need at least one evaluated claim")
    naive = [e.holds if e.naive is None else e.naive for e in evaluations]
    return {
        "rules": float(np.mean(np.logical_and.reduce([e.holds for e in evaluations]))),
        "naive": float(np.mean(np.logical_and.reduce(naive))),
    }


def _not_testable(s: Sentence, reason: str) -> Claim:
    found = f"Nothing can be said: {reason}"
    return judged(
        s.id, s.source, s.text, s.rule.text(), None, found, {"reason": reason}, least_runs=LEAST_STUDY
    )


def _series(study: StudyArrays, name: str) -> Array | None:
    kind, _, key = name.partition(":")
    array = (study["nees"] if kind == "nees" else study["position_error"]).get(key)
    return None if array is None else np.asarray(array, dtype=np.float64)


def _gather(study: StudyArrays, names: Mapping[str, None]) -> dict[str, Array]:
    """Look the named series up; all must have the same runs."""
    found = {name: _series(study, name) for name in names}
    data = {name: x for name, x in found.items() if x is not None}
    if len({len(x) for x in data.values()}) > 1:
        sizes = ", ".join(f"{name} {len(x)}" for name, x in data.items())
        raise ValueError(f"series must hold the same runs, got {sizes}")
    return data


def _obstacles(study: StudyArrays, claim_ids: Sequence[str]) -> dict[str, str]:
    """Why claims cannot be tested, for those that cannot."""
    unknown = [i for i in claim_ids if i not in SENTENCES]
    if unknown:
        raise ValueError(f"unknown claim {unknown[0]!r}; known: {', '.join(SENTENCES)}")
    time = np.asarray(study["time"], dtype=np.float64)
    if time[-1] < 2 * study["lap_seconds"] * (1 - 1e-9):
        return dict.fromkeys(claim_ids, f"the study ends at {time[-1]:g} s, before the second lap does")
    found = {i: _obstacle(study, SENTENCES[i].rule, time.size) for i in claim_ids}
    return {i: reason for i, reason in found.items() if reason is not None}


def _obstacle(study: StudyArrays, rule: Rule, times: int) -> str | None:
    """Why a rule cannot be applied to a study, or None."""
    wanted = [(name, POPULATION_STUDIES) for name in rule.series]
    wanted += [(name, CONTROL_STUDIES) for name in control_names(rule)] if rule.needs_control else []
    for name, studies in wanted:
        data = _series(study, name)
        if data is None:
            return f"series {name} is missing"
        if data.ndim != 2 or data.shape[1] != times:
            raise ValueError(f"series {name} has shape {data.shape}, need (runs, {times})")
        if len(data) < studies * study["runs"]:
            return f"series {name} has {len(data)} runs, the rule needs {studies} times {study['runs']}"
        bad = int(np.count_nonzero(~np.all(np.isfinite(data), axis=1)))
        if bad:
            return f"series {name} has no value somewhere in {bad} of its runs"
    return None
