# ruff: noqa: E501
"""What is known about one function: its cases, what the program answered, and how a guess is tested.

A guess is a function of a case.  It gives the answer that would be right if the guess were true (a repair of
the program's answer, judged against the expected one), or the answer that a wrong formula gives (judged against
the program's).  Either is tested on *all* cases: one that speaks against a guess ends it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.catalogue import Function, functions
from vslam_ref.conformance.compare import Profile, compare, numbers
from vslam_ref.conformance.results import Outcome
from vslam_ref.conformance.vectors_format import Case, VectorFile

Answer = dict[str, Any]
Ask = Callable[[str, dict[str, Any]], Any]
Guess = Callable[[Case, Answer], Answer | None]
MOST = 0.5
"""A name explains more than this share of the failures."""
CARRYING = 2
"""Failures that carry a known mistake, at least: each mistake stands in some cases only."""
FEW = 5
"""Of so few failures one is enough: the cases of such functions are long."""
NEARER = 0.1
"""An answer that explains another is nearer to it than the right one by this factor."""
SCREENED = 3
"""Failed cases that are looked at first."""
ALL_EFFORT = 5
"""Functions that may be looked at with all effort; where more are wrong, they share it."""
CASES_TRIED = 60
"""Cases of a function on which a guess is tested, failed ones and passed ones each."""


class AnsweredCase(NamedTuple):
    """A case with the program's answer."""

    case: Case
    got: Answer


class Evidence(NamedTuple):
    """All that a program said about one function.

    Attributes
    ----------
    function : Function
    file : VectorFile
    failed, passed : list of AnsweredCase
        Cases with an answer that can be compared.
    not_refused, refused : list of Case
        Cases without an answer: answered all the same, and refused.
    errors : list of Outcome
        Without a usable reply.
    random : list of Outcome
        Statistical cases.
    ask : callable
        Asks the program once more: (function, inputs) -> outputs or None.
    effort : float
        Share of the tries that a single function gets: where many are wrong, each gets less.
    """

    function: Function
    file: VectorFile
    failed: list[AnsweredCase]
    passed: list[AnsweredCase]
    not_refused: list[Case]
    refused: list[Case]
    errors: list[Outcome]
    random: list[Outcome]
    ask: Ask
    effort: float = 1.0

    @property
    def plain(self) -> list[AnsweredCase]:
        """Failed cases first."""
        return [*self.failed, *self.passed]

    @property
    def wrong(self) -> int:
        """Number of cases that went wrong, of every kind."""
        random = sum(o.status == "failed" for o in self.random)
        return int(len(self.failed) + len(self.not_refused) + len(self.errors) + random)


def gather(outcomes: Iterable[Outcome], ask: Ask, profile: Profile = "float64") -> list[Evidence]:
    """Evidence about every function of which something went wrong."""
    those = defaultdict(list)
    for outcome in outcomes:
        if outcome.status != "unsupported":
            those[outcome.case.function].append(_in_profile(outcome, profile))
    found = (_of(functions()[name], group, ask) for name, group in those.items() if name in functions())
    wrong = [evidence for evidence in found if evidence.wrong]
    effort = min(1.0, ALL_EFFORT / max(1, len(wrong)))
    return [evidence._replace(effort=effort) for evidence in wrong]


def _in_profile(outcome: Outcome, profile: Profile) -> Outcome:
    """The outcome with the profile's tolerance in its case."""
    if profile == "float64":
        return outcome
    case = outcome.case
    tolerance = {**case.tolerance, **case.tolerance[profile]}
    return outcome._replace(case=case._replace(tolerance=tolerance))


def _answered(outcomes: list[Outcome]) -> list[AnsweredCase]:
    return [AnsweredCase(o.case, o.got) for o in outcomes if isinstance(o.got, dict)]


def _of(function: Function, group: list[Outcome], ask: Ask) -> Evidence:
    valid = [o for o in group if o.case.result == "valid" and o.case.statistic is None]
    invalid = [o for o in group if o.case.result == "invalid"]
    wrong = [o for o in valid if o.status == "failed"] or [o for o in valid if o.status == "lost digits"]
    return Evidence(
        function,
        group[0].file,
        _answered(wrong),
        _answered([o for o in valid if o.status == "passed"]),
        [o.case for o in invalid if o.status == "failed"],
        [o.case for o in invalid if o.status == "passed"],
        [o for o in group if o.status == "error"],
        [o for o in group if o.case.statistic is not None],
        ask,
    )


def like(case: Case, answer: Answer | None, times: float = 10.0) -> Case:
    """The case as if this answer were the right one, with a wider tolerance, as for known mistakes."""
    wider = {key: times * value for key, value in case.tolerance.items() if key in ("relative", "absolute")}
    return case._replace(expected=answer or {}, accept=[], tolerance={**case.tolerance, **wider})


class Test(NamedTuple):
    """How many failures a guess explains, and the passed cases that speak against it."""

    explained: int
    against: list[AnsweredCase]


NO = Test(0, [])


def repairs(evidence: Evidence, repair: Guess) -> Test:
    """Test a repair of the program's answer.

    A passed case must stay right, too: a program whose every sign is flipped passes nothing but zeros.
    """
    return _count(evidence, lambda seen: agrees(seen.case, repair(seen.case, seen.got)))


def mostly(evidence: Evidence, repair: Guess) -> Test:
    """As :func:`repairs`, where other mistakes may stand beside: an undeclared convention."""
    return _count(evidence, lambda seen: agrees(seen.case, repair(seen.case, seen.got)), share=0.0)


def carried(evidence: Evidence, note: Guess) -> Test:
    """Test a known mistake, whose answer only some cases carry: as :func:`predicts`, by these cases alone."""
    those = [seen for seen in evidence.failed if note(seen.case, seen.got)]
    if len(those) < (1 if len(evidence.failed) <= FEW else CARRYING):
        return NO
    found = predicts(evidence._replace(failed=those), note)
    return found if found is NO else found._replace(explained=len(evidence.failed))


def predicts(evidence: Evidence, formula: Guess) -> Test:
    """Test a wrong formula: it would have failed no case that passed.

    Where a formula says nothing about a case, the case speaks neither for nor against it.  A failure is explained
    by an answer that is itself wrong, and far nearer to the program's than the right one is.
    """

    def same(seen: AnsweredCase) -> bool | None:
        answer = formula(seen.case, seen.got)
        if not answer:
            return None
        return agrees(like(seen.case, answer), seen.got)

    def explained(seen: AnsweredCase) -> bool | None:
        answer = formula(seen.case, seen.got)
        if not answer:
            return None
        if not agrees(like(seen.case, answer), seen.got):
            return False
        if _right(seen.case, answer):
            return False
        far = distance(answer, seen.got) > NEARER * distance(seen.case.expected, seen.got)
        return None if far else True

    return _count(evidence, explained, same)


def _count(
    evidence: Evidence,
    agrees: Callable[[AnsweredCase], bool | None],
    stays: Callable[[AnsweredCase], bool | None] | None = None,
    share: float = 1.0,
) -> Test:
    """How many failures agree, if that is most of them and a share of those that say something."""
    tried = spread(evidence.failed, CASES_TRIED)
    said: list[bool | None] = []
    for seen in spread(tried, SCREENED):
        said.append(agrees(seen))
        if said[-1] is False and share == 1.0:
            return NO
    if not any(said):
        return NO
    said = [agrees(seen) for seen in tried]
    count = said.count(True)
    if count <= MOST * len(tried) or count < share * (count + said.count(False)):
        return NO
    against = [seen for seen in spread(evidence.passed, CASES_TRIED) if (stays or agrees)(seen) is False]
    return Test(round(count * len(evidence.failed) / len(tried)), against)


def distance(a: Answer, b: Answer) -> float:
    """Largest difference of two answers, over the largest entry of each output; infinity where none is told."""
    worst = 0.0
    for name, value in a.items():
        x, y = array(value), array(b.get(name))
        if x is None or y is None:
            if value != b.get(name):
                return float("inf")
            continue
        if x.shape != y.shape or not np.array_equal(np.isfinite(x), np.isfinite(y)):
            return float("inf")
        fine = np.isfinite(x)
        size = float(np.abs(x[fine]).max(initial=0.0)) or 1.0
        worst = max(worst, float(np.abs(x - y)[fine].max(initial=0.0)) / size)
    return worst


def spread(seen: list[AnsweredCase], most: int) -> list[AnsweredCase]:
    """Some of a list, from all of it."""
    return seen[:: max(1, -(-len(seen) // most))]


def _right(case: Case, answer: Answer | None) -> bool:
    return _verdict(case, answer) == "passed"


def agrees(case: Case, answer: Answer | None) -> bool:
    """Whether an answer is right but for digits that common formulas lose: they may be lost beside a mistake."""
    return _verdict(case, answer) != "failed"


def _verdict(case: Case, answer: Answer | None) -> str:
    if answer is None:
        return "failed"
    try:
        with np.errstate(all="ignore"):
            return compare(case, answer).verdict
    except (ValueError, TypeError, KeyError, IndexError, AttributeError):
        return "failed"


def outputs(value: Any, function: Function) -> Answer | None:
    """Outputs by name, from the bare value where there is one."""
    if isinstance(value, dict) and set(value) & set(function.outputs):
        return value
    return {next(iter(function.outputs)): value} if len(function.outputs) == 1 and value is not None else None


def array(value: Any) -> Array | None:
    """Numbers, or None for what is not numbers."""
    if isinstance(value, str | dict) or value is None:
        return None
    try:
        found = numbers(value)
    except (ValueError, TypeError, RecursionError, OverflowError):
        return None
    return found if found.size else None
