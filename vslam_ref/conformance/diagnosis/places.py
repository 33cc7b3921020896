"""Where is it wrong?  Entries of the answer, and the cases that fail: a regime, a word, a size, a range.

::

    cases      |phi| 1e-9 ... 1e-3 | 0.1 ... 3.1      only the cases with |phi| above 0.05
               passed              | failed
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.evidence import AnsweredCase, Evidence, array
from vslam_ref.conformance.diagnosis.turns import both, numbers_of, places
from vslam_ref.conformance.vectors_format import Case

FEWEST = 3
"""Cases that a range needs on either side."""


def where(evidence: Evidence, passed_ones: list[AnsweredCase] | None = None) -> str:
    """What the failed cases have, and no passed one (or none of some); empty where there is no such thing."""
    others = evidence.passed if passed_ones is None else passed_ones
    failed, passed = [s.case for s in evidence.failed], [s.case for s in others]
    if not failed or not passed:
        return ""
    return _flags(failed, passed) or _words(failed, passed) or _ranges(failed, passed)


def _flags(failed: list[Case], passed: list[Case]) -> str:
    """A flag, or its absence, or a few flags."""
    bad, good = {flag for c in failed for flag in c.flags}, {flag for c in passed for flag in c.flags}
    for flag in sorted(bad):
        if all(flag in c.flags for c in failed) and flag not in good:
            return f"only the cases with the flag {flag}"
    for flag in sorted(good):
        if all(flag in c.flags for c in passed) and flag not in bad:
            return f"only the cases without the flag {flag}"
    regimes, others = {c.flags for c in failed}, {c.flags for c in passed}
    if len(regimes) <= 3 and not regimes & others:
        names = sorted(" ".join(flags) or "no flag" for flags in regimes)
        return f"only the cases with {', '.join(names)}"
    return ""


def _words(failed: list[Case], passed: list[Case]) -> str:
    """A word or a truth value among the inputs."""
    for name, value in failed[0].inputs.items():
        if isinstance(value, str | bool):
            bad, good = {c.inputs[name] for c in failed}, {c.inputs[name] for c in passed}
            if not bad & good:
                return f"only where {name} is {' or '.join(str(word) for word in sorted(bad))}"
    return ""


def _ranges(failed: list[Case], passed: list[Case]) -> str:
    """A size or a number of the inputs that tells failed from passed."""
    if len(failed) < FEWEST or len(passed) < FEWEST:
        return ""
    for name, bad, good in _features(failed, passed):
        if bad.min() > good.max():
            return f"only where {name} is above {_between(good.max(), bad.min())}"
        if bad.max() < good.min():
            return f"only where {name} is below {_between(bad.max(), good.min())}"
    return ""


def _features(failed: list[Case], passed: list[Case]) -> Iterator[tuple[str, Array, Array]]:
    """Numbers that both sides have: name, those of failed cases, those of passed ones."""
    rows = [dict(numbers_of(case)) for case in (*failed, *passed)]
    for name in rows[0]:
        if all(name in row for row in rows):
            values = np.array([row[name] for row in rows])
            yield name, values[: len(failed)], values[len(failed) :]


def _between(a: float, b: float) -> str:
    """A short number between two."""
    for digits in range(1, 17):
        middle = (a * b) ** 0.5 if a > 0 and b > 0 else (a + b) / 2
        text = f"{middle:.{digits}g}"
        if a <= float(text) <= b:
            return text
    return f"{b:.17g}"


def entries(evidence: Evidence) -> str:
    """Which outputs, rows or entries are wrong, the same in all failed cases; empty if all are."""
    truths = evidence.failed[0].case.expected
    names = [name for name in evidence.function.outputs if not isinstance(truths.get(name), bool)]
    said = []
    whole = 0
    for name in names:
        found = _masks(evidence, name)
        if found is None:
            return ""
        wrong, shapes = found
        if not wrong.any():
            continue
        if wrong.all() or not shapes:
            said.append(name)
            whole += 1
        else:
            said.append(f"{places(wrong)} of {name}{_how(evidence, name, wrong)}")
    if not said or (whole == len(names)):
        return ""
    many = len(said) > 1 or said[0].startswith("entries")
    return f"only {' and '.join(said)} {'are' if many else 'is'} wrong"


def _masks(evidence: Evidence, name: str) -> tuple[Array, bool] | None:
    """Entries that are wrong in any failed case, and whether all have one shape."""
    pairs = both(evidence, name, 60)
    if len(pairs) < min(len(evidence.failed), 60):
        return None
    relative = max(float(s.case.tolerance["relative"]) for s in evidence.failed)
    absolute = max(float(s.case.tolerance["absolute"]) for s in evidence.failed)
    wants = [w for w, _ in pairs]
    masks = [np.abs(w - h) > absolute + relative * np.abs(w).max(initial=0.0) for w, h in pairs]
    if len({m.shape for m in masks}) == 1:
        fixed = np.ptp(np.array(wants), axis=0) == 0 if len(wants) > 1 else np.zeros(wants[0].shape, bool)
        wrong = np.any(masks, axis=0)
        return (np.ones_like(wrong), True) if wrong.any() and (wrong | fixed).all() else (wrong, True)
    return np.array([m.any() for m in masks]), False


def _how(evidence: Evidence, name: str, wrong: Array) -> str:
    """What is wrong with the wrong entries: missing, flipped, by a factor."""
    pairs = [(w[wrong], h[wrong]) for w, h in both(evidence, name, 60)]
    want, have = (np.concatenate(part) for part in zip(*pairs, strict=True))
    big = np.abs(want) > 1e-9 * np.abs(want).max(initial=0.0)
    if not big.any():
        return ", which should be zero,"
    if not have.any():
        return ", left at zero,"
    ratio = have[big] / want[big]
    if np.ptp(ratio) < 1e-6 * abs(ratio[0]):
        return (
            ", of the other sign," if abs(ratio[0] + 1) < 1e-6 else f", {ratio[0]:.6g} times the right value,"
        )
    return ""


def shape(evidence: Evidence) -> str:
    """A wrong shape, the same kind in most failed cases."""
    odd: list[str] = []
    for seen in evidence.failed:
        for name, value in seen.case.expected.items():
            want, have = array(value), array(seen.got.get(name))
            if name not in seen.got:
                odd.append(f"the output {name} is missing")
                break
            if (
                want is not None
                and want.ndim
                and (have is None or have.shape[1:] == want.shape[1:])
                and _rows_vary(evidence, name)
            ):
                rows = 0 if have is None else len(have)
                if rows != len(want):
                    odd.append(f"rows of {name} are {'missing' if rows < len(want) else 'too many'}")
                    break
            elif want is not None and (have is None or have.shape != want.shape):
                odd.append(
                    f"wrong shape: {name} is {_shaped(seen.got[name], have)}, expected {list(want.shape)}"
                )
                break
    if len(odd) <= len(evidence.failed) / 2:
        return ""
    return max(set(odd), key=odd.count)


def _rows_vary(evidence: Evidence, name: str) -> bool:
    """Whether the number of rows of an output is part of the answer."""
    return len({len(seen.case.expected[name]) for seen in evidence.plain}) > 1


def _shaped(value: Any, x: Array | None) -> str:
    return str(list(x.shape)) if x is not None else ("empty" if value == [] else "no array of numbers")
