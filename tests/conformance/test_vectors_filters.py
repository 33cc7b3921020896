"""Vectors of chapters 15 to 17 and 19: an independent program passes, every known mistake is told by name."""

from __future__ import annotations

import copy
from pathlib import Path
from types import ModuleType
from typing import Any

import plain_filters as ekf
import plain_grids as grids
import plain_lift as lifted
import plain_sigma as sigma
import pytest
from generator.writing import generate
from vector_cases import listed, loaded, mistakes, size, some

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.adapters.table import plain
from vslam_ref.conformance.compare import matches
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.runner import Report, run

PAGES = Path(__file__).resolve().parents[2] / "docs" / "chapters"
PROGRAM = {
    "vehicle.ackermann": ekf.ackermann,
    "vehicle.front_wheel": ekf.front_wheel,
    "vehicle.yaw_rate": ekf.yaw_rate,
    "vehicle.velocity_arc": ekf.velocity_arc,
    "ekf.predict_additive": ekf.predict_additive,
    "ekf.gate": ekf.gate,
    "range_bearing.update": ekf.update_polar,
    "sigma_points.points": sigma.points,
    "sigma_points.predict": sigma.predict,
    "sigma_points.update": sigma.update,
    "ekf.predict": ekf.predict,
    "ekf.update": ekf.update,
    "ekf.augment": ekf.augment,
    "ekf.from_polar": ekf.from_polar,
    "ekf.trace": ekf.trace,
    "vehicle.relative": ekf.relative,
    "vehicle.place": ekf.place,
    "ekf.ideal_trace": ekf.ideal_trace,
    "lift.vehicle": lifted.vehicle,
    "lift.landmark": lifted.landmark,
    "lift.gaussian": lifted.gaussian,
    "lift.gaussian_predict": lifted.gaussian_predict,
    "reduced.start": lifted.start,
    "reduced.gaussian_predict": lifted.reduced_gaussian_predict,
    "consistency.anchored_trace": ekf.anchored_trace,
    "grid.history": grids.history,
    "grid.recursion": grids.recursion,
    "grid.explained": grids.explained,
    "lift.pose": lifted.pose,
    "carleman.predict": lifted.predict,
    "carleman.update": lifted.update,
    "carleman.augment": lifted.augment,
    "carleman.trace": lifted.trace,
    "reduced.predict": lifted.reduced_predict,
    "reduced.trace": lifted.trace,
    "consistency.nees": grids.nees,
    "consistency.pose_error": grids.pose_error,
    "consistency.band": grids.band,
    "consistency.bound": grids.bound,
    "consistency.runs": grids.runs,
    "grid.log_odds": grids.log_odds,
    "grid.probability": grids.probability,
    "grid.update": grids.grid_update,
    "grid.follow": grids.follow,
    "grid.static_dynamic": grids.static_dynamic,
    "grid.ray_cells": grids.ray_cells,
}
FILES = [
    "15/ekf.json",
    "15/range_bearing.json",
    "15/sigma_points.json",
    "15/vehicle.json",
    "16/carleman.json",
    "16/lift.json",
    "16/reduced.json",
    "17/consistency.json",
    "19/grid.json",
]

LONG = ("15/ekf.json", "16/carleman.json", "16/reduced.json")
"""These take seconds to make."""
MISTAKES = mistakes(FILES)


def program(**more: Any) -> InProcess:
    """The plain program, its functions called with one more argument."""
    module = ModuleType("plain")

    def answer(function: str, inputs: dict[str, Any]) -> Any:
        return plain(PROGRAM[function](**inputs, **more))  # type: ignore[operator]

    module.answer = answer  # type: ignore[attr-defined]
    return InProcess(module)


def failures(report: Report) -> list[str]:
    bad = [o for o in report.outcomes if o.status != "passed"]
    return [f"{o.case.id}: {o.cause} {o.difference and o.difference[:1] + o.difference[4:]}" for o in bad]


@pytest.mark.parametrize("name", FILES)
def test_a_program_of_closed_formulas_passes(name: str) -> None:
    """A second oracle: Jacobians typed in where the generator differentiates, in doubles."""
    assert failures(run(program(), [loaded(name)], names=False)) == []


@pytest.mark.parametrize(("name", "function", "note"), MISTAKES)
def test_every_mistake_is_told_by_its_name(name: str, function: str, note: str) -> None:
    file = some(name, lambda case: case.function == function and note in listed(case))
    outcomes = run(program(wrong=note), [file], names=False).outcomes
    for o in outcomes:
        if o.case.result != "convention":
            assert o.status == "failed", f"{o.case.id} does not tell {note} from the right answer"
        assert o.cause == f"{note}: {file.notes[note]['meaning']}", o.case.id
    assert outcomes


@pytest.mark.parametrize("name", FILES)
def test_every_note_belongs_to_a_case_and_every_topic_has_mistakes(name: str) -> None:
    file = loaded(name)
    used = {note for case in file.cases for note in listed(case)}
    assert used == set(file.notes)
    assert used


@pytest.mark.parametrize(("name", "function"), sorted({row[:2] for row in MISTAKES}))
def test_no_mistake_equals_another_or_the_right_answer(name: str, function: str) -> None:
    for case in some(name, lambda case: case.function == function).cases:
        answers = [case.expected, *case.mistakes.values()]
        pairs = [(a, b) for i, a in enumerate(answers) for b in answers[:i]]
        assert not any(matches(a, b, case) for a, b in pairs), case.id


@pytest.mark.parametrize("name", ["15/ekf.json", "16/carleman.json", "16/reduced.json"])
@pytest.mark.parametrize("step", [0, 3, 5])
def test_a_trace_that_goes_astray_is_told_with_its_step_and_quantity(name: str, step: int) -> None:
    file = some(name, lambda case: case.function.endswith("trace"))
    for outcome in run(program(spoiled=step), [file], names=False).outcomes:
        assert outcome.status == "failed"
        assert outcome.difference is not None
        assert outcome.difference.where == f"step {step}, P"


def flipped(value: Any) -> Any:
    """The answer with the sign of its largest number changed."""
    if isinstance(value, dict):
        return {key: flipped(v) for key, v in value.items()}
    if isinstance(value, list):
        if value and isinstance(value[0], dict):
            return [*value[:-1], flipped(value[-1])]
        sizes = [size(v) for v in value]
        at = sizes.index(max(sizes)) if sizes else 0
        return [flipped(v) if k == at else v for k, v in enumerate(value)]
    return -value if isinstance(value, int | float) else value


@pytest.mark.parametrize("name", FILES)
def test_an_answer_with_a_flipped_sign_fails(name: str) -> None:
    file = some(name, lambda case: case.result == "valid" and case.statistic is None)
    answers = {case.id: flipped(copy.deepcopy(case.expected)) for case in file.cases}
    zero = {case.id for case in file.cases if answers[case.id] == case.expected}
    module = ModuleType("flipped")
    ids = iter(file.cases)
    module.answer = lambda function, inputs: answers[next(ids).id]  # type: ignore[attr-defined]
    outcomes = run(InProcess(module), [file], names=False).outcomes
    assert {o.case.id for o in outcomes if o.status == "passed"} == zero
    assert len(zero) <= 5  # log odds of 1/2, cells at the origin: nothing to flip


def test_there_are_enough_cases() -> None:
    assert sum(form.counted(loaded(name).cases) for name in FILES) >= 450


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in FILES])
def test_files_are_what_the_generator_makes(name: str) -> None:
    assert generate(None, [name.split("/")[1].removesuffix(".json")], write=False) == []


@pytest.mark.parametrize("name", FILES[:-1])
def test_equations_stand_on_the_chapters_page(name: str) -> None:
    chapter = name.split("/")[0]
    (page,) = PAGES.glob(f"{chapter}_*.md")
    text = page.read_text(encoding="utf-8")
    assert [case.equation for case in loaded(name).cases if f"({case.equation})" not in text] == []
