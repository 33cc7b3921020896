"""The library with one change, asked whether it answers as the program does.

Every function that the library runs for an answer is changed in one place at a time (:mod:`.rewriting`).  If
the changed library answers all cases as the program does, the program has this mistake, in whatever words.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from itertools import islice
from types import CodeType, FunctionType
from typing import Any

from vslam_ref._kernels import use_backend
from vslam_ref.conformance.diagnosis.changes import library
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess
from vslam_ref.conformance.diagnosis.exchange import MOST_LINES, ROOMS, bounded, exchanged, forget
from vslam_ref.conformance.diagnosis.rewriting import ChangedLine, names, signs
from vslam_ref.conformance.vectors_format import Case

MOST_CHANGES = 400
"""Changes of one function of the catalogue that are tried, of each kind."""
ALL_LINES = 150_000
"""Lines that all changes of a kind may run for one case: the slower a function, the fewer are tried."""


def one_change(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Wrong formulas: the library's own, with one change."""
    first = evidence.failed[0].case
    those = ran(evidence, first)
    most = int(evidence.effort * min(MOST_CHANGES, ALL_LINES // max(1, lines_of(evidence, first))))
    for kind in (signs, names):
        changes = (change for function in those for change in kind(function))
        for change in islice(changes, most):
            yield change.text, _changed(evidence, change)


def _changed(evidence: Evidence, change: ChangedLine) -> Guess:
    def guess(case: Case, got: Answer) -> Answer | None:
        with exchanged(change.target, change.code), use_backend("numpy"), bounded():
            return library(evidence, case.inputs)

    return guess


def lines_of(evidence: Evidence, case: Case) -> int:
    """How many lines of the library run for a case."""
    with use_backend("numpy"), bounded() as left:
        library(evidence, case.inputs)
    return MOST_LINES - left[0]


def ran(evidence: Evidence, case: Case) -> list[FunctionType]:
    """The library's functions that run for a case, in the order of their first call."""
    codes: dict[CodeType, None] = {}

    def note(frame: Any, event: str, _: Any) -> None:
        if event == "call" and str(frame.f_globals.get("__name__", "")).startswith(ROOMS):
            codes.setdefault(frame.f_code)

    library(evidence, case.inputs)  # whatever is imported late is imported now
    forget()
    before = sys.getprofile()
    with use_backend("numpy"):
        sys.setprofile(note)
        try:
            library(evidence, case.inputs)
        finally:
            sys.setprofile(before)
    found = ((_owner(code), code) for code in codes)
    return [function for function, code in found if function is not None and not code.co_freevars]


def _owner(code: CodeType) -> FunctionType | None:
    """The function that has a code; all objects are looked through only where it is not yet known."""
    if code not in _OWNERS:
        functions = (x for x in gc.get_objects() if isinstance(x, FunctionType))
        _OWNERS.update((x.__code__, x) for x in functions if str(x.__module__).startswith(ROOMS))
        _OWNERS.setdefault(code, None)
    return _OWNERS[code]


_OWNERS: dict[CodeType, FunctionType | None] = {}
"""Code -> the library's function, as far as they were asked for."""
