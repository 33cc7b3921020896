"""Functions and regimes: the order from basic to built upon, the plainest case, what became of them.

A *regime* is what stands between the function's name and the number in a case's id: ``near_pi`` in
``so3.exp/near_pi-03``.
"""

from __future__ import annotations

import functools
import math
import statistics as stats
from collections.abc import Iterable
from typing import Any, NamedTuple

from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.results import Outcome
from vslam_ref.conformance.vectors_format import Case

BUILT_ON = {1: 3}
"""Chapter -> the chapter after which it comes here: chapter 01 uses the motions and cameras of 02 and 03."""


class RegimeRow(NamedTuple):
    """What became of a function's cases of one regime.

    Attributes
    ----------
    function, regime : str
    cases : int
        Those that the program did not call unsupported.
    passed, digits_lost : int
        The others failed, or had no usable reply.
    digits_median, digits_worst : float or None
        Right digits of the answers with numbers; None where there is none.
    name : str
        What is wrong, where one name was found.
    """

    function: str
    regime: str
    cases: int
    passed: int
    digits_lost: int
    digits_median: float | None
    digits_worst: float | None
    name: str

    @property
    def bad(self) -> int:
        """Cases that failed or had no usable reply."""
        return self.cases - self.passed - self.digits_lost


def regime(case: Case) -> str:
    """The regime of a case, from its id.

    >>> from types import SimpleNamespace
    >>> regime(SimpleNamespace(id="so3.exp/near_pi-03"))
    'near_pi'
    """
    return case.id.partition("/")[2].rpartition("-")[0] or "generic"


@functools.cache
def _places() -> dict[str, tuple[float, int]]:
    return {
        name: (BUILT_ON[f.chapter] + 0.5 if f.chapter in BUILT_ON else f.chapter, number)
        for number, (name, f) in enumerate(functions().items())
    }


def place(function: str) -> tuple[float, int]:
    """Place of a function in the order from basic to built upon: by chapter, then as in the catalogue."""
    return _places().get(function, (math.inf, 0))


def plainness(case: Case) -> tuple[bool, int, bool]:
    """Order of cases from plain to special: few numbers, generic; refusals last."""
    return case.result == "invalid", _count(case.inputs), regime(case).partition("-")[0] != "generic"


def _count(value: Any) -> int:
    """How many numbers and words a value has."""
    if isinstance(value, dict):
        return sum(map(_count, value.values()))
    return sum(map(_count, value)) if isinstance(value, list) else 1


def basic_first(outcomes: Iterable[Outcome]) -> list[Outcome]:
    """Outcomes in the order in which one should look at them.

    Basic functions first, plain cases first, and of these the ones with a named cause and a large error.
    """

    def key(o: Outcome) -> tuple[Any, ...]:
        digits = 0.0 if math.isnan(o.digits) else o.digits
        return (place(o.case.function), *plainness(o.case), not o.cause, digits, o.case.id)

    return sorted(outcomes, key=key)


def rows(outcomes: Iterable[Outcome], named: dict[str, str]) -> list[RegimeRow]:
    """The table function x regime, basic functions first, regimes in the order of the vectors.

    Parameters
    ----------
    outcomes : iterable of Outcome
    named : dict of str to str
        Function -> the sentence that names its mistake.
    """
    groups: dict[tuple[str, str], list[Outcome]] = {}
    for o in outcomes:
        if o.status != "unsupported":
            groups.setdefault((o.case.function, regime(o.case)), []).append(o)
    found = [_row(*key, those, named.get(key[0], "")) for key, those in groups.items()]
    return sorted(found, key=lambda row: place(row.function))  # stable: regimes stay in order


def _row(function: str, name: str, outcomes: list[Outcome], sentence: str) -> RegimeRow:
    digits = [o.digits for o in outcomes if not math.isnan(o.digits)]
    wrong = [o for o in outcomes if o.status != "passed"]
    causes = {o.cause for o in wrong}
    return RegimeRow(
        function,
        name,
        len(outcomes),
        sum(o.status == "passed" for o in outcomes),
        sum(o.status == "lost digits" for o in outcomes),
        stats.median(digits) if digits else None,
        min(digits) if digits else None,
        (sentence or (causes.pop() if len(causes) == 1 else "")) if wrong else "",
    )
