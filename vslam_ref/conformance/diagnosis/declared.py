"""Would the program be right in another convention?  It is asked once more, in each."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import product
from typing import Any, get_args, get_type_hints

from vslam_ref.conformance import conventions
from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess, outputs
from vslam_ref.conformance.vectors_format import Case

MOST_TOGETHER = 4
"""Choices that are changed together."""


def choices() -> dict[str, tuple[Any, ...]]:
    """What a program may declare: name -> values, the house's first."""
    hints = {name: get_args(hint) for name, hint in get_type_hints(Convention).items()}
    return {
        name: values for name, values in hints.items() if name in Convention.__dataclass_fields__ and values
    }


def declared(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Other conventions, those with few changes first."""
    case = (evidence.failed or evidence.passed)[0].case
    names = [name for name in choices() if _matters(evidence, case, name)]
    for chosen in _combinations(names):
        words = f"declare {json.dumps(chosen)}: in this convention the answers are right"
        yield words, _asked(evidence, Convention(**chosen))


def _combinations(names: list[str]) -> list[dict[str, Any]]:
    values = choices()
    every = [
        {name: value for name, value in zip(names, row, strict=True) if value != values[name][0]}
        for row in product(*(values[name] for name in names))
    ]
    return sorted((c for c in every if 0 < len(c) <= MOST_TOGETHER), key=len)


def _matters(evidence: Evidence, case: Case, name: str) -> bool:
    """Whether a choice changes the question or the answer, alone or beside another place of the pose."""
    values, function = choices(), evidence.function
    got = (evidence.failed or evidence.passed)[0].got
    for value in values[name][1:]:
        other = Convention(**{name: value})
        try:
            if other.inputs(function, case.inputs) != Convention().inputs(function, case.inputs):
                return True
            if other.outputs(function, got, case.inputs) != Convention().outputs(function, got, case.inputs):
                return True
        except (ValueError, TypeError, IndexError, KeyError):
            return False
    return False


def _asked(evidence: Evidence, convention: Convention) -> Guess:
    """The answer in another convention: the question is turned, and the answer turned back."""
    function = evidence.function

    def repair(case: Case, got: Answer) -> Answer | None:
        try:
            sent = convention.inputs(function, case.inputs)
            same = sent == conventions.Convention().inputs(function, case.inputs)
            found = got if same else outputs(evidence.ask(function.name, sent), function)
            return None if found is None else {**found, **convention.outputs(function, found, case.inputs)}
        except (ValueError, TypeError, IndexError, KeyError, AttributeError):
            return None

    return repair
