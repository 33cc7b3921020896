"""Vectors of chapters 01-06, 08-11, 13, 14 and 23: a plain program passes, mistakes are told by name."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from types import ModuleType
from typing import Any

import plain_cameras
import plain_estimates
import plain_features
import plain_mapping
import plain_motions
import plain_orbslam
import plain_posegraph
import plain_tracking
import plain_two_views
import plain_views
import pytest
from vector_cases import listed, loaded, mistakes, size, some

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.adapters.table import answer_from, plain
from vslam_ref.conformance.compare import matches
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import Report, run

PROGRAM: dict[str, Callable[..., Any]] = {
    **plain_motions.PROGRAM,
    **plain_cameras.PROGRAM,
    **plain_estimates.PROGRAM,
    **plain_views.PROGRAM,
    **plain_features.PROGRAM,
    **plain_mapping.PROGRAM,
    **plain_tracking.PROGRAM,
    **plain_posegraph.PROGRAM,
    **plain_orbslam.PROGRAM,
    **plain_two_views.PROGRAM,
}
FILES = [
    name
    for name in form.names()
    if name[:2] in ("01", "02", "03", "04", "05", "06", "08", "09", "10", "11", "13", "14", "23")
]
MISTAKES = mistakes(FILES)
MOST_LOST = 3
"""Cases of a file in which the plain program, too, may lose digits: it takes the formulas as they stand."""


def program(wrong: str | None = None) -> InProcess:
    """The plain program, on demand with one of its mistakes."""
    module = ModuleType("plain")
    table = {name: functools.partial(function, wrong=wrong) for name, function in PROGRAM.items()}
    module.answer = lambda function, inputs: answer_from(table, function, inputs)  # type: ignore[attr-defined]
    return InProcess(module)


def failures(report: Report) -> list[str]:
    bad = [o for o in report.outcomes if o.status != "passed"]
    lost = [o for o in bad if o.difference is not None and o.difference.verdict == "lost digits"]
    assert len(lost) <= MOST_LOST
    bad = [o for o in bad if o not in lost]
    return [f"{o.case.id}: {o.status} {o.cause} {o.difference and o.difference[-2:]}" for o in bad]


def test_all_topics_are_there() -> None:
    topics = {name.partition("/")[2].removesuffix(".json") for name in FILES}
    assert topics >= {
        *("multiview", "so2", "se2", "so3", "quaternion", "se3", "sim3", "camera", "loss", "scale", "noise"),
        *("least_squares", "bundle", "trajectory", "format", "features", "two_views", "tracking"),
        *("mapping", "posegraph", "orb", "vocabulary", "loops"),
    }


@pytest.mark.parametrize("name", FILES)
def test_a_program_of_closed_formulas_passes(name: str) -> None:
    """A second oracle: Pade for series, SVD for eigenvectors, complex steps for differences, in doubles."""
    assert failures(run(program(), [loaded(name)], names=False)) == []


@pytest.mark.parametrize(("name", "function", "note"), MISTAKES)
def test_every_mistake_is_told_by_its_name(name: str, function: str, note: str) -> None:
    """A program that computes the wrong formula, not the number that the vectors hold."""
    file = some(name, lambda case: case.function == function and note in listed(case))
    outcomes = run(program(note), [file], names=False).outcomes
    for o in outcomes:
        assert o.status == "failed", f"{o.case.id} does not tell {note} from the right answer"
        assert o.cause == f"{note}: {file.notes[note]['meaning']}", o.case.id
    assert outcomes


@pytest.mark.parametrize("name", FILES)
def test_every_note_belongs_to_a_case_and_every_topic_has_mistakes(name: str) -> None:
    file = loaded(name)
    used = {note for case in file.cases for note in listed(case)}
    assert used == set(file.notes)
    assert used


@pytest.mark.parametrize("name", FILES)
def test_no_mistake_equals_another_or_the_right_answer(name: str) -> None:
    for case in loaded(name).cases:
        right = [case.expected, *case.accept] if case.result == "valid" else []
        answers = [*right, *case.mistakes.values()]
        pairs = [(a, b) for i, a in enumerate(answers) for b in answers[:i] if i >= len(right)]
        assert not any(matches(a, b, case) for a, b in pairs), case.id


def flipped(value: Any) -> Any:
    """The answer with the sign of its largest number changed; a text with that of its last number."""
    if isinstance(value, dict):
        return {key: flipped(v) for key, v in value.items()}
    if isinstance(value, list):
        if value and isinstance(value[0], dict):
            return [*value[:-1], flipped(value[-1])]
        sizes = [size(v) for v in value]
        at = sizes.index(max(sizes)) if sizes else 0
        return [flipped(v) if k == at else v for k, v in enumerate(value)]
    if isinstance(value, str):
        words = value.split()
        last = str(-float(words[-1]))
        return value.rstrip()[: -len(words[-1])] + last + "\n"
    return value if isinstance(value, bool) else -value


@pytest.mark.parametrize("name", FILES)
def test_an_answer_with_a_flipped_sign_fails(name: str) -> None:
    file = some(name, lambda case: case.result == "valid" and case.statistic is None)
    answers = {case.id: flipped(copy.deepcopy(case.expected)) for case in file.cases}
    module = ModuleType("flipped")
    ids = iter(file.cases)
    module.answer = lambda function, inputs: answers[next(ids).id]  # type: ignore[attr-defined]
    passed = {o.case.id for o in run(InProcess(module), [file], names=False).outcomes if o.status == "passed"}
    zero = {case.id for case in file.cases if answers[case.id] == case.expected}
    # zero is nothing to flip (the identity's logarithm, Tukey beyond c); of an axis or q both ends are right
    either = {case.id for case in file.cases if case.accept and _only_one(case)}
    assert passed - either == zero
    assert len(zero) <= 20


def _only_one(case: form.Case) -> bool:
    """Whether one number alone is not zero, so that flipping it is the whole answer's negative."""
    (value,) = case.expected.values()
    return not isinstance(value, list) or sum(abs(v) > 1e-12 for v in value) == 1


def test_there_are_enough_cases() -> None:
    assert sum(form.counted(loaded(name).cases) for name in FILES) >= 2000


def test_plain_answers_are_lists() -> None:
    """What the plain program answers is what a foreign program could send."""
    assert plain(plain_motions.so2_exp(0.0)) == [[1.0, 0.0], [0.0, 1.0]]
