"""Off by one, by a half, by a factor that is another input: small displacements, each tried everywhere.

::

    an input, or an entry of it    + 1/2 (a pixel's corner for its centre), + 1 (counted from 1)
    an input times another         a covariance times the time step, a length times the focal length
    rows of an answer              each the one before it: taken before the step, not after
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import permutations

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.changes import Change, entry, on, reference, short
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess, array
from vslam_ref.conformance.vectors_format import Case

STEPS = {"0.5 too large": 0.5, "0.5 too small": -0.5, "one too large": 1.0, "one too small": -1.0}


def shifted(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Wrong formulas: the library's answer where an input is displaced, or its own with rows moved."""
    names = list(evidence.function.inputs)
    for name in names:
        for words, step in STEPS.items():
            yield f"the input {name} is taken {words}", reference(evidence, on(name, _further(step)))
        for k in range(short(evidence, name)):
            for words, step in STEPS.items():
                change = on(name, entry(k, _further(step)))
                yield f"entry {k} of the input {name} is taken {words}", reference(evidence, change)
    for a, b in permutations(names, 2):
        yield f"the input {a} is multiplied by {b}", reference(evidence, _by(a, b, 1))
        yield f"the input {a} is divided by {b}", reference(evidence, _by(a, b, -1))
    for name in evidence.function.outputs:
        yield f"{name}: each row is the one before", _moved_rows(name, 1)
        yield f"{name}: each row is the next one", _moved_rows(name, -1)


def _further(step: float) -> Callable[[Array], Array]:
    return lambda x: np.asarray(x + step)


def _by(a: str, b: str, power: int) -> Change:
    """Input a times a power of the single number b."""

    def changed(given: dict[str, object]) -> dict[str, object]:
        factor = array(given[b])
        if factor is None or factor.ndim or isinstance(given[b], bool) or factor == 0:
            raise ValueError("no factor")
        return on(a, lambda x: x * factor**power)(given)

    return changed


def _moved_rows(name: str, by: int) -> Guess:
    """The right rows, one further on; where none comes from, the program's own stays."""

    def formula(case: Case, got: Answer) -> Answer | None:
        want, have = array(case.expected.get(name)), array(got.get(name))
        if want is None or have is None or want.shape != have.shape or want.ndim == 0 or len(want) < 4:
            return None
        rows: list[Array] = [have[:1], want[:-1]] if by > 0 else [want[1:], have[-1:]]
        return {**case.expected, name: np.concatenate(rows).tolist()}

    return formula
