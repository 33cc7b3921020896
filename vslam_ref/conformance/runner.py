"""The runner: every case is asked, compared, and explained."""

from __future__ import annotations

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any, Literal, NamedTuple

from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.compare import Difference, Profile, compare
from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.diagnosis import diagnose, known_mistake
from vslam_ref.conformance.program import Asked, Reply
from vslam_ref.conformance.statistics import judge
from vslam_ref.conformance.vectors_format import Case, VectorFile

Status = Literal["passed", "failed", "unsupported", "error"]


class Outcome(NamedTuple):
    """What became of a case.

    Attributes
    ----------
    file : str
    case : Case
    status : str
        ``passed``, ``failed``, ``unsupported``, or ``error`` (no usable reply).
    difference : Difference or None
        Of a failed case.
    cause : str
        Probable cause, or what went wrong with the reply; of a passed case of the kind "convention", which
        other convention it was.
    got : object
        What the program answered, in the house's convention.
    """

    file: VectorFile
    case: Case
    status: Status
    difference: Difference | None
    cause: str
    got: Any = None


class Report(NamedTuple):
    """All outcomes of one program."""

    program: str
    outcomes: list[Outcome]
    seconds: float

    def count(self, status: Status) -> int:
        """Number of cases with a status."""
        return sum(outcome.status == status for outcome in self.outcomes)

    @property
    def passed(self) -> bool:
        """Whether nothing failed and something passed."""
        return self.count("passed") > 0 and self.count("failed") == self.count("error") == 0

    @property
    def diagnoses(self) -> list[dict[str, Any]]:
        """Causes of failures, the commonest first, each with how often and where first."""
        bad = [o for o in self.outcomes if o.status == "failed" and o.cause]
        first = {(o.case.function, o.cause): o.case.id for o in reversed(bad)}
        often = Counter((o.case.function, o.cause) for o in bad)
        return [
            {"function": function, "cause": cause, "cases": count, "first": first[function, cause]}
            for (function, cause), count in often.most_common()
        ]

    def numbers(self) -> dict[str, Any]:
        """The content of ``--json``."""
        chapters = sorted({o.file.chapter for o in self.outcomes})
        return {
            "program": self.program,
            "cases": len(self.outcomes),
            "passed": self.count("passed"),
            "failed": self.count("failed"),
            "unsupported": self.count("unsupported"),
            "errors": self.count("error"),
            "by_chapter": {f"{chapter:02d}": self._chapter(chapter) for chapter in chapters},
            "first_failure": self._first(),
            "diagnoses": self.diagnoses,
            "seconds": self.seconds,
        }

    def _chapter(self, chapter: int) -> dict[str, int]:
        names: tuple[Status, ...] = ("passed", "failed", "unsupported", "error")
        those = [o.status for o in self.outcomes if o.file.chapter == chapter]
        return {("errors" if name == "error" else name): those.count(name) for name in names}

    def _first(self) -> dict[str, Any] | None:
        """The first case that went wrong, with all that is needed to look into it."""
        for o in self.outcomes:
            if o.status in ("failed", "error"):
                d = o.difference
                return {
                    "id": o.case.id,
                    "file": o.file.name,
                    "function": o.case.function,
                    "equation": o.case.equation,
                    "inputs": o.case.inputs,
                    "where": d.where if d else "",
                    "expected": d.expected if d else o.case.expected,
                    "got": d.got if d else None,
                    "difference": d.size if d else None,
                    "allowed": d.allowed if d else None,
                    "cause": o.cause,
                }
        return None


def run(
    asked: Asked,
    files: Iterable[VectorFile],
    convention: Convention | None = None,
    profile: Profile = "float64",
    progress: Callable[[Case], None] | None = None,
) -> Report:
    """Ask every case of some files.

    Parameters
    ----------
    asked : Asked
        A program or a module.
    files : iterable of VectorFile
    convention : Convention, optional
        The program's; the house's by default.
    profile : {"float64", "float32"}
        Which tolerances.
    progress : callable, optional
        Called before each case.
    """
    began, outcomes = time.perf_counter(), []
    for file in files:
        for case in file.cases:
            if progress is not None:
                progress(case)
            outcomes.append(ask(asked, file, case, convention or Convention(), profile))
    return Report(asked.name, outcomes, time.perf_counter() - began)


def ask(asked: Asked, file: VectorFile, case: Case, convention: Convention, profile: Profile) -> Outcome:
    """Ask one case and judge the reply."""
    function = functions()[case.function]
    reply = asked.ask(case.id, case.function, convention.inputs(function, case.inputs))
    if reply.what == "unsupported":
        return Outcome(file, case, "unsupported", None, "")
    if case.result == "invalid":
        return _refused(file, case, reply, convention, profile)
    if reply.what != "value":
        return Outcome(file, case, "error", None, f"{reply.what}: {reply.message}")
    try:
        got = convention.outputs(function, _named(reply.value, list(function.outputs)), case.inputs)
    except (ValueError, TypeError, IndexError) as error:
        return Outcome(file, case, "error", None, f"garbage: {error}")
    difference = judge(case, got) if case.statistic is not None else compare(case, got, profile)
    if difference.right:
        return Outcome(file, case, "passed", None, "", got)
    cause = diagnose(file, case, got, profile)
    if case.result == "convention" and cause:
        return Outcome(file, case, "passed", None, cause, got)
    return Outcome(file, case, "failed", difference, cause, got)


def _named(value: Any, outputs: list[str]) -> dict[str, Any]:
    """Outputs by name; the bare value of a function that has one."""
    if isinstance(value, dict) and set(value) & set(outputs):
        return value
    if len(outputs) == 1:
        return {outputs[0]: value}
    raise ValueError(f"expected an object with {', '.join(outputs)}")


def _refused(file: VectorFile, case: Case, reply: Reply, convention: Convention, profile: Profile) -> Outcome:
    """A case without an answer: an error or ``valid: false`` is right, a number is not."""
    said_no = isinstance(reply.value, dict) and reply.value.get("valid") in (False, 0)
    if reply.what == "error" or said_no:
        return Outcome(file, case, "passed", None, "")
    if reply.what != "value":
        return Outcome(file, case, "error", None, f"{reply.what}: {reply.message}")
    wrong = Difference(False, "an answer", reply.value, "a refusal", float("inf"), 0.0)
    cause = ""
    with contextlib.suppress(ValueError, TypeError, IndexError):
        function = functions()[case.function]
        got = convention.outputs(function, _named(reply.value, list(function.outputs)), case.inputs)
        cause = known_mistake(file, case, got, profile)
    return Outcome(file, case, "failed", wrong, cause or "there is no answer; the program gives one")
