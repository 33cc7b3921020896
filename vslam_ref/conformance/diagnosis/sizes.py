# ruff: noqa: E501
"""How wrong is it?  Digits that are left, and how the error grows; answers that are no numbers, or always the same."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.evidence import Answer, AnsweredCase, Evidence, array, distance
from vslam_ref.conformance.diagnosis.places import where

ROUNDING = 1e-13
"""Differences, to numbers of order 1, that need no wrong formula."""
ENOUGH = 3.0
"""Digits from which an answer counts as right with digits lost."""


def error(seen: AnsweredCase) -> float:
    """The largest error of all outputs, relative to the largest entry; infinity where nothing compares."""
    return distance(seen.case.expected, seen.got)


def rounding(evidence: Evidence) -> str:
    """Whether nothing but the last digits differs: then no formula can be told from another."""
    worst = 0.0
    for seen in evidence.failed:
        for name, value in seen.case.expected.items():
            want, have = array(value), array(seen.got.get(name))
            if want is None or have is None or want.shape != have.shape or not np.isfinite(want - have).all():
                return ""
            worst = max(
                worst,
                float(np.abs(want - have).max(initial=0.0)) / max(1.0, float(np.abs(want).max(initial=0.0))),
            )
    if not evidence.failed or worst > ROUNDING:
        return ""
    place = where(evidence)
    return f"only the last digits differ (by up to {worst:.1e}{f', {place}' if place else ''})"


def digits(evidence: Evidence) -> str:
    """Right to k digits, and where they are lost; empty if too few are left."""
    errors = np.array([error(seen) for seen in evidence.failed])
    if not errors.size or not np.isfinite(errors).all():
        return ""
    left = -np.log10(np.maximum(errors, 1e-300))
    if left.min() < ENOUGH:
        return _small(evidence)
    place = where(evidence) or _worst(evidence, errors)
    return f"right to {_whole(left.min())} digits, loses the others {f'in {place}' if place else 'everywhere'}".replace(
        "in only", "only in"
    )


def _small(evidence: Evidence) -> str:
    """Answers that are right to a fixed number, so that small ones lose all digits."""
    worst, small = 0.0, 0.0
    for seen in evidence.failed:
        for name, value in seen.case.expected.items():
            want, have = array(value), array(seen.got.get(name))
            if want is None or have is None or want.shape != have.shape:
                return ""
            worst, small = (
                max(worst, float(np.abs(want - have).max(initial=0.0))),
                max(small, float(np.abs(want).max(initial=0.0))),
            )
    if worst > 1e-5 * min(1.0, small) or small == 0:
        return ""
    place = where(evidence)
    return f"small answers lose their digits (errors up to {worst:.1e}{f', {place}' if place else ''})"


def single(evidence: Evidence) -> str:
    """Whether all numbers of the answers are of single precision, though the right ones are not."""
    have, want = (
        _numbers(seen.got for seen in evidence.failed),
        _numbers(seen.case.expected for seen in evidence.failed),
    )
    if have.size <= ENOUGH or want.size <= ENOUGH or not _is_single(have) or _is_single(want):
        return ""
    return "single precision: every number of the answers is one of 32 bits"


def _numbers(answers: Iterable[Answer]) -> Array:
    """All finite numbers that are not whole."""
    values = [array(value) for answer in answers for value in answer.values()]
    x = np.concatenate([v.ravel() for v in values if v is not None] or [np.zeros(0)])
    return np.asarray(x[np.isfinite(x) & (x != np.round(x))])


def _is_single(x: Array) -> bool:
    with np.errstate(over="ignore"):
        return bool(np.array_equal(x, x.astype(np.float32).astype(np.float64)))


def _worst(evidence: Evidence, errors: np.ndarray) -> str:
    flags = evidence.failed[int(errors.argmax())].case.flags
    return f"the cases with {' '.join(flags)} most" if flags else ""


def _whole(x: float) -> int:
    return int(np.floor(x))


def odd(evidence: Evidence) -> str:
    """Answers that are not finite, or one number for every question."""
    failed = evidence.failed
    values = [[array(v) for v in seen.got.values()] for seen in failed]
    infinite = [any(v is not None and not np.isfinite(v).all() for v in row) for row in values]
    if sum(infinite) > len(failed) / 2:
        place = where(evidence)
        return f"the answer is not a finite number{f': {place}' if place else ''}"
    everything = [str(seen.got) for seen in failed]
    everything += [str(seen.got) for seen in evidence.passed]
    if len(failed) > 3 and len(set(everything)) == 1 and len({str(s.case.expected) for s in failed}) > 1:
        return "the answer is the same whatever is asked"
    return ""
