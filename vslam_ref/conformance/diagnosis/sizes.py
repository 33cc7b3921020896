"""How wrong is it?  Digits that are left, and how the error grows; answers that are no numbers, or always the same."""

from __future__ import annotations

import numpy as np

from vslam_ref.conformance.diagnosis.evidence import Evidence, Seen, array
from vslam_ref.conformance.diagnosis.places import where

ENOUGH = 3.0
"""Digits from which an answer counts as right with digits lost."""
SINGLE = 2.0**-24


def error(seen: Seen) -> float:
    """The largest error of all outputs, relative to the largest entry; infinity where nothing compares."""
    worst = 0.0
    for name, value in seen.case.expected.items():
        want, have = array(value), array(seen.got.get(name))
        if want is None and value == seen.got.get(name):
            continue
        if want is None or have is None or want.shape != have.shape or not np.isfinite(have).all():
            return float("inf")
        size = float(np.abs(want[np.isfinite(want)]).max(initial=0.0)) or 1.0
        worst = max(worst, float(np.abs(want - have)[np.isfinite(want)].max(initial=0.0)) / size)
    return worst


def digits(evidence: Evidence) -> str:
    """Right to k digits, and where they are lost; empty if too few are left."""
    errors = np.array([error(seen) for seen in evidence.failed])
    if not errors.size or not np.isfinite(errors).all():
        return ""
    left = -np.log10(np.maximum(errors, 1e-300))
    if left.min() < ENOUGH:
        return ""
    if single(evidence, errors):
        return f"right to {_whole(left.min())} digits: it computes, or is passed on, in single precision"
    place = where(evidence) or _worst(evidence, errors)
    return f"right to {_whole(left.min())} digits, loses the others {f'in {place}' if place else 'everywhere'}".replace("in only", "only in")


def single(evidence: Evidence, errors: np.ndarray) -> bool:
    """Whether all numbers of the answers are of single precision, or all errors of its size."""
    values = [array(v) for seen in evidence.failed for v in seen.got.values()]
    x = np.concatenate([v.ravel() for v in values if v is not None] or [np.zeros(0)])
    x = x[np.isfinite(x) & (x != np.round(x))]
    with np.errstate(over="ignore"):
        return bool(x.size > 3 and np.array_equal(x, x.astype(np.float32).astype(np.float64)))


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
    if len(failed) > 3 and len(set(everything)) == 1 and len({str(s.case.expected) for s in failed}) > 1:
        return "the answer is the same whatever is asked"
    return ""


def echoes(evidence: Evidence) -> str:
    """An input given back as the answer."""
    for name in evidence.function.outputs:
        for given in evidence.function.inputs:
            same = [seen.got.get(name) == seen.case.inputs[given] for seen in evidence.failed]
            if sum(same) > len(same) / 2 and not isinstance(evidence.failed[0].case.inputs[given], bool | str):
                return f"{name} is the input {given}, unchanged"
    return ""
