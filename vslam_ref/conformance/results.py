"""What became of the cases: outcomes, and the report with its numbers."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, Literal, NamedTuple

from vslam_ref.conformance.compare import Difference
from vslam_ref.conformance.vectors_format import Case, VectorFile

Status = Literal["passed", "lost digits", "failed", "unsupported", "error"]
NOTHING = "nothing that is known fits"
"""What is said of a function whose failures have no name."""
KEYS: dict[Status, str] = {
    "passed": "passed",
    "failed": "failed",
    "unsupported": "unsupported",
    "error": "errors",
    "lost digits": "digits_lost",
}
"""Status -> its key in ``--json``."""


class Outcome(NamedTuple):
    """What became of a case.

    Attributes
    ----------
    file : VectorFile
    case : Case
    status : str
        ``passed``, ``lost digits``, ``failed``, ``unsupported``, or ``error`` (no usable reply).
    difference : Difference or None
        Of a case that failed or lost digits.
    cause : str
        Probable cause, or what went wrong with the reply; of a passed case of the kind "convention", which
        other convention it was.
    digits : float
        Right digits of an answer with numbers, of passed cases, too; NaN where there are none.
    got : dict or None
        What was compared: the outputs by name, in the house's convention.
    """

    file: VectorFile
    case: Case
    status: Status
    difference: Difference | None
    cause: str
    digits: float = math.nan
    got: dict[str, Any] | None = None

    @property
    def bad(self) -> bool:
        """Whether it failed or had no usable reply."""
        return self.status in ("failed", "error")


def is_name(text: str) -> bool:
    """Whether a sentence names a mistake; that nothing fits, and where it is wrong, is no name."""
    return bool(text) and not text.startswith(NOTHING)


class Report(NamedTuple):
    """All outcomes of one program.

    Attributes
    ----------
    program : str
    outcomes : list of Outcome
        In the order in which they were asked.
    seconds : float
    not_asked : int
        Cases that were chosen and not asked.
    stopped : str
        Why the run ended early; empty if it did not.
    notes : tuple of str
        What was odd and did no harm.
    functions_named : dict of str to str
        Function -> the sentence that names what is wrong with it, from all its failures together.
    """

    program: str
    outcomes: list[Outcome]
    seconds: float
    not_asked: int = 0
    stopped: str = ""
    notes: tuple[str, ...] = ()
    functions_named: dict[str, str] = {}  # noqa: RUF012 - never changed in place

    def count(self, status: Status) -> int:
        """Number of cases with a status."""
        return sum(outcome.status == status for outcome in self.outcomes)

    @property
    def passed(self) -> bool:
        """Whether all was asked, nothing failed, and something passed; lost digits are no failure."""
        right = self.count("passed") + self.count("lost digits")
        return right > 0 and not self.not_asked and not any(o.bad for o in self.outcomes)

    @property
    def diagnoses(self) -> list[dict[str, Any]]:
        """Causes of failures, the commonest first, each with how often and where first."""
        bad = [(o, self.name(o)) for o in self.outcomes if o.status == "failed" and is_name(self.name(o))]
        first = {(o.case.function, name): o.case.id for o, name in reversed(bad)}
        often = Counter((o.case.function, name) for o, name in bad)
        return [
            {"function": function, "cause": cause, "cases": count, "first": first[function, cause]}
            for (function, cause), count in often.most_common()
        ]

    @property
    def unexplained(self) -> dict[str, int]:
        """Failures without a name, by function."""
        those = [o for o in self.outcomes if o.status == "failed" and not is_name(self.name(o))]
        return dict(Counter(o.case.function for o in those).most_common())

    def name(self, outcome: Outcome) -> str:
        """What is wrong in a failed case: what all cases of its function bear out, if they were looked at.

        What one case alone suggests may be chance; it stands where nobody looked at all of them.
        """
        if outcome.status not in ("failed", "lost digits"):
            return ""
        return self.functions_named.get(outcome.case.function, "") or outcome.cause

    def numbers(self) -> dict[str, Any]:
        """The content of ``--json``."""
        from vslam_ref.conformance.regimes import rows

        chapters = sorted({o.file.chapter for o in self.outcomes})
        return {
            "program": self.program,
            "cases": len(self.outcomes),
            **{key: self.count(status) for status, key in KEYS.items()},
            "not_asked": self.not_asked,
            "stopped": self.stopped,
            "notes": list(self.notes),
            "by_chapter": {f"{chapter:02d}": self._chapter(chapter) for chapter in chapters},
            "first_failure": self._first(),
            "diagnoses": self.diagnoses,
            "unexplained": self.unexplained,
            "functions": [row._asdict() for row in rows(self.outcomes, self.functions_named)],
            "failures": [self._failure(o) for o in self.outcomes if o.bad],
            "lost": [self._failure(o) for o in self.outcomes if o.status == "lost digits"],
            "seconds": self.seconds,
        }

    def _chapter(self, chapter: int) -> dict[str, int]:
        those = [o.status for o in self.outcomes if o.file.chapter == chapter]
        return {key: those.count(status) for status, key in KEYS.items()}

    @property
    def first(self) -> Outcome | None:
        """The failure to look at first: the most basic function's, in its plainest case."""
        from vslam_ref.conformance.regimes import basic_first

        return next(iter(basic_first(o for o in self.outcomes if o.bad)), None)

    def _first(self) -> dict[str, Any] | None:
        """The first failure, with all that is needed to look into it."""
        o = self.first
        if o is None:
            return None
        d = o.difference
        return {
            "id": o.case.id,
            "file": o.file.name,
            "function": o.case.function,
            "equation": o.case.equation,
            "inputs": o.case.inputs,
            "where": d.where if d else "",
            "expected": d.expected if d else o.case.expected,
            "got": bounded(d.got) if d else None,
            "difference": d.size if d else None,
            "allowed": d.allowed if d else None,
            "cause": o.cause,
        }

    def _failure(self, o: Outcome) -> dict[str, Any]:
        from vslam_ref.conformance.regimes import regime

        d = o.difference
        return {
            "id": o.case.id,
            "function": o.case.function,
            "regime": regime(o.case),
            "expected": o.case.expected if o.case.result != "invalid" else "a refusal",
            "answered": bounded(o.got) if o.got is not None else o.cause,
            "error": d.size if d else None,
            "allowed": d.allowed if d and math.isfinite(d.size) else None,
            "name": self.name(o),
        }


MOST_NUMBERS = 5000


def bounded(value: Any) -> Any:
    """A value as it is written to a report: words for what is not finite, and never endless."""
    count = _count(value)
    if count > MOST_NUMBERS:
        return f"an answer of {count} numbers and words, too long to be written"
    return _worded(value)


def _count(value: Any) -> int:
    if isinstance(value, dict):
        return sum(map(_count, value.values()))
    if isinstance(value, list | tuple):
        return 1 + sum(map(_count, value))
    return 1 + len(value) // 100 if isinstance(value, str) else 1


def _worded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _worded(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_worded(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return value
