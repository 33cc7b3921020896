"""The runner: every case is asked, compared, and explained, whatever the program does."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterable
from typing import Any

from vslam_ref.conformance.catalogue import Function, functions
from vslam_ref.conformance.compare import Profile, compare, is_asked, refused
from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.diagnosis import diagnose, known_mistake, name_functions
from vslam_ref.conformance.diagnosis.evidence import ALL_EFFORT
from vslam_ref.conformance.patience import Patience
from vslam_ref.conformance.replies import Asked, Reply, raised
from vslam_ref.conformance.results import Outcome, Report, Status
from vslam_ref.conformance.statistics import judge
from vslam_ref.conformance.vectors_format import Case, VectorFile

__all__ = ["Outcome", "Report", "Status", "ask", "run"]

INTERRUPTED = "interrupted"
MOST_LOST_AGAIN = 2
SHARED = "many functions are wrong, and fewer guesses were tried for each: --function NAME tries all for one"


def run(
    asked: Asked,
    files: Iterable[VectorFile],
    convention: Convention | None = None,
    profile: Profile = "float64",
    progress: Callable[[Outcome], None] | None = None,
    *,
    names: bool = True,
) -> Report:
    """Ask every case of some files.

    A program that is silent five times in a row is given up, and an interrupt (Ctrl-C) ends the run: in both
    cases the report has what was found until then, and says so.

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
        Called after each case.
    names : bool
        Whether each function that fails is looked at as a whole, and asked again, to name its mistake.
    """
    began, outcomes = time.perf_counter(), list[Outcome]()
    chosen = [(file, case) for file in files for case in file.cases if is_asked(case, profile)]
    declared, patience = convention or Convention(), Patience()
    named: dict[str, str] = {}
    notes: list[str] = []
    stopped = ""
    try:
        for file, case in chosen:
            if case.function in patience.left_out:
                continue
            outcome, reply = _asked(asked, file, case, declared, profile)
            outcomes.append(outcome)
            if progress is not None:
                progress(outcome)
            if stopped := patience.judge(case.function, reply, asked.alive):
                break
        if names and not stopped:
            named, notes = _named_functions(outcomes, _asking(asked, declared), profile)
    except KeyboardInterrupt:
        stopped = INTERRUPTED
    return Report(
        asked.name,
        outcomes,
        time.perf_counter() - began,
        len(chosen) - len(outcomes),
        stopped,
        (*patience.notes(case.function for _, case in chosen), *asked.notes, *notes),
        named,
    )


def ask(asked: Asked, file: VectorFile, case: Case, convention: Convention, profile: Profile) -> Outcome:
    """Ask one case and judge the reply."""
    return _asked(asked, file, case, convention, profile)[0]


def _asked(
    asked: Asked, file: VectorFile, case: Case, convention: Convention, profile: Profile
) -> tuple[Outcome, Reply]:
    function = functions()[case.function]
    reply = asked.ask(case.id, case.function, convention.inputs(function, case.inputs))
    if reply.what == "unsupported":
        return Outcome(file, case, "unsupported", None, ""), reply
    if reply.what == "value" or (reply.what == "error" and case.result == "invalid"):
        return _judged(file, case, reply, convention, profile), reply
    return Outcome(file, case, "error", None, f"{reply.what}: {reply.message}"), reply


def _judged(file: VectorFile, case: Case, reply: Reply, convention: Convention, profile: Profile) -> Outcome:
    """Judge a value, or a refusal of what must be refused."""
    try:
        if case.result == "invalid":
            return _refused(file, case, reply, convention, profile)
        got = _outputs(reply.value, functions()[case.function], case.inputs, convention)
        return _compared(file, case, got, profile)
    except (ValueError, TypeError, IndexError, ArithmeticError, RecursionError) as error:
        return Outcome(file, case, "error", None, f"garbage: {raised(error)}")


def _compared(file: VectorFile, case: Case, got: dict[str, Any], profile: Profile) -> Outcome:
    random = case.statistic is not None
    found = judge(case, got, profile) if random else compare(case, got, profile)
    digits = math.nan if random or not _has_numbers(case.expected) else found.digits
    if found.right:
        return Outcome(file, case, "passed", None, "", digits, got)
    cause = _cause(file, case, got, profile)
    if case.result == "convention" and cause:
        return Outcome(file, case, "passed", None, cause, math.nan, got)
    return Outcome(file, case, found.verdict, found, cause, digits, got)


def _cause(file: VectorFile, case: Case, got: dict[str, Any], profile: Profile) -> str:
    """The probable cause; an answer too strange to be looked into has none."""
    with contextlib.suppress(ValueError, TypeError, IndexError, ArithmeticError):
        return diagnose(file, case, got, profile)
    return ""


def _outputs(
    value: Any, function: Function, inputs: dict[str, Any], convention: Convention
) -> dict[str, Any]:
    """Outputs by name, in the house's convention."""
    try:
        return convention.outputs(function, _by_name(value, function), inputs)
    except OverflowError as error:
        raise ValueError(str(error)) from None


def _by_name(value: Any, function: Function) -> dict[str, Any]:
    """Outputs by name; the bare value of a function that has one."""
    outputs = list(function.outputs)
    if isinstance(value, dict) and set(value) & set(outputs):
        return value
    if len(outputs) == 1:
        return {outputs[0]: value}
    raise ValueError(f"expected an object with {', '.join(outputs)}")


def _has_numbers(value: Any) -> bool:
    if isinstance(value, dict):
        return any(map(_has_numbers, value.values()))
    if isinstance(value, list):
        return any(map(_has_numbers, value))
    return isinstance(value, int | float)


def _refused(file: VectorFile, case: Case, reply: Reply, convention: Convention, profile: Profile) -> Outcome:
    """A case without an answer: an error or ``valid: false`` is right, a number is not."""
    said_no = isinstance(reply.value, dict) and reply.value.get("valid") in (False, 0)
    if reply.what == "error" or said_no:
        return Outcome(file, case, "passed", None, "")
    wrong = refused("an answer", reply.value, "a refusal")
    cause, got = "", {"value": reply.value}
    with contextlib.suppress(ValueError, TypeError, IndexError, ArithmeticError):
        got = _outputs(reply.value, functions()[case.function], case.inputs, convention)
        cause = known_mistake(file, case, got, profile)
    cause = cause or "there is no answer; the program gives one"
    return Outcome(file, case, "failed", wrong, cause, got=got)


Again = Callable[[str, dict[str, Any]], dict[str, Any] | None]


def _asking(asked: Asked, convention: Convention) -> Again:
    """A function that asks the program once more, with other inputs; None where no value comes.

    A program that gives no reply twice in a row is not asked any more.
    """
    lost = 0

    def once_more(name: str, inputs: dict[str, Any]) -> dict[str, Any] | None:
        nonlocal lost
        if lost >= MOST_LOST_AGAIN:
            return None
        function = functions()[name]
        with contextlib.suppress(ValueError, TypeError, KeyError, IndexError, ArithmeticError):
            reply = asked.ask(f"{name}/again", name, convention.inputs(function, inputs))
            lost = lost + 1 if reply.silent else 0
            return _outputs(reply.value, function, inputs, convention) if reply.what == "value" else None
        return None

    return once_more


def _named_functions(
    outcomes: list[Outcome], once_more: Again, profile: Profile
) -> tuple[dict[str, str], list[str]]:
    """Function -> what is wrong with it; names are a help, and their failure must not lose the report."""
    try:
        named = name_functions(outcomes, once_more, profile)
        return named, [SHARED] if len(named) > ALL_EFFORT else []
    except Exception as error:
        return {}, [f"no names of whole functions: {raised(error)}"]
