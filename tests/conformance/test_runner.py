"""The runner's judgement: right, wrong, why; on cases made for it."""

from __future__ import annotations

import json
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.compare import compare, numbers
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.report import verification_page
from vslam_ref.conformance.runner import Report, run

LOOSE = {
    "relative": 1e-12,
    "absolute": 0.0,
    "reason": "rounding",
    "float32": {"relative": 1e-3, "absolute": 0.0},
}


def file_of(*groups: dict[str, Any], notes: dict[str, Any] | None = None) -> form.VectorFile:
    base = {"equation": "eq-x", "oracle": "by hand", "flags": [], "tolerance": LOOSE}
    content = {
        "chapter": 2,
        "topic": "so3",
        "version": "0.1.0",
        "notes": notes or {},
        "groups": [{**base, **group} for group in groups],
    }
    return form.parse("02/so3.json", content)


def asked(table: dict[str, Any]) -> InProcess:
    module = ModuleType("mine")

    def answer(function: str, inputs: dict[str, Any]) -> Any:
        if function not in table:
            raise NotImplementedError
        return table[function](**inputs)

    module.answer = answer  # type: ignore[attr-defined]
    return InProcess(module)


R = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
EXP = {
    "function": "so3.exp",
    "cases": [
        {
            "id": "so3.exp/generic-01",
            "inputs": {"phi": [0, 0, np.pi / 2]},
            "expected": {"R": R.tolist()},
            "mistakes": {"half": {"R": np.eye(3).tolist()}},
        }
    ],
}
NOTES = {"half": {"meaning": "you forget the angle", "formula": "I"}}


def one(answer: Any, *, result: str = "valid") -> Report:
    group = {**EXP, "cases": [{**EXP["cases"][0], "result": result}]}  # type: ignore[dict-item]
    return run(asked({"so3.exp": lambda phi: answer}), [file_of(group, notes=NOTES)])


def test_right_answers_pass_bare_or_named() -> None:
    for answer in (R.tolist(), {"R": R.tolist()}, {"R": (R + 1e-13).tolist()}):
        report = one(answer)
        assert report.count("passed") == 1
        assert report.passed


@pytest.mark.parametrize(
    ("answer", "cause"),
    [
        (np.eye(3).tolist(), "half: you forget the angle"),
        (R.T.tolist(), "R: the matrix is transposed (or column by column)"),
        ((-R).tolist(), "R: the sign is flipped"),
        ((0.5 * R).tolist(), "R: a factor 2 is missing"),
        ((R + 1e-6).tolist(), ""),
        (R[:2].tolist(), ""),
        ([[1.0, 2.0], [3.0]], ""),
        ([["nan"] * 3] * 3, ""),
        ("rubbish", ""),
    ],
)
def test_wrong_answers_fail_with_a_cause(answer: Any, cause: str) -> None:
    report = one(answer)
    assert report.count("failed") == 1
    assert report.outcomes[0].cause == cause
    first = report.numbers()["first_failure"]
    assert first["id"] == "so3.exp/generic-01"
    assert first["inputs"] == {"phi": [0, 0, np.pi / 2]}
    assert not report.passed


def test_convention_cases_tell_and_do_not_fail() -> None:
    report = one(R.T.tolist(), result="convention")
    assert report.count("passed") == 1
    assert "transposed" in report.outcomes[0].cause
    assert one((R + 0.1).tolist(), result="convention").count("failed") == 1


def test_cases_without_an_answer_want_a_refusal() -> None:
    group = {
        "function": "camera.project",
        "cases": [
            {
                "id": "c",
                "inputs": {"model": "pinhole", "params": [1, 1, 0, 0], "X_cam": [0, 0, -1]},
                "expected": {},
                "result": "invalid",
            }
        ],
    }
    file = file_of(group)

    def answers(reply: Any) -> Report:
        return run(asked({"camera.project": lambda **_: reply}), [file])

    def refuses(**_: Any) -> None:
        raise ValueError("behind")

    assert run(asked({"camera.project": refuses}), [file]).count("passed") == 1
    assert answers({"uv": [0, 0], "valid": False}).count("passed") == 1
    assert answers({"uv": [0, 0], "valid": True}).count("failed") == 1


def test_unsupported_is_no_failure_and_no_pass() -> None:
    report = run(asked({}), [file_of(EXP, notes=NOTES)])
    assert report.count("unsupported") == 1
    assert not report.passed  # a program that answers nothing is not verified


def test_errors_are_told() -> None:
    def fails(phi: Any) -> None:
        raise RuntimeError("lost")

    report = run(asked({"so3.exp": fails}), [file_of(EXP, notes=NOTES)])
    assert report.count("error") == 1
    assert "RuntimeError: lost" in report.outcomes[0].cause


def test_traces_name_the_first_step_that_differs() -> None:
    steps = [{"x": [float(k), 0.0], "P": [[1.0]]} for k in range(5)]
    group = {
        "function": "ekf.trace",
        "cases": [{"id": "t", "inputs": {}, "expected": {"steps": steps}}],
    }
    case = file_of(group).cases[0]
    got = json.loads(json.dumps(steps))
    assert compare(case, {"steps": got}).right
    got[3]["P"] = [[1.5]]
    assert compare(case, {"steps": got}).where == "step 3, P"
    assert compare(case, {"steps": got[:4]}).where == "steps: number of steps"
    assert compare(case, {"steps": [1, 2, 3, 4, 5]}).where == "step 0"


def test_profiles_have_their_own_tolerance() -> None:
    case = file_of(EXP, notes=NOTES).cases[0]
    off = {"R": (R + 1e-4).tolist()}
    assert not compare(case, off).right
    assert compare(case, off, "float32").right


def test_words_stand_for_what_is_not_finite() -> None:
    assert np.array_equal(numbers(["nan", "inf", "-inf", 1]), [np.nan, np.inf, -np.inf, 1], equal_nan=True)
    with pytest.raises(ValueError, match="'seven'"):
        numbers(["seven"])
    with pytest.raises(ValueError, match="different lengths"):
        numbers([[1, 2], [3]])


def test_statistics_are_judged_by_their_band() -> None:
    rule = {
        "output": "R",
        "measure": "mean_trace",
        "samples": 4,
        "low": -1.0,
        "high": 1.0,
        "false_alarm": 1e-4,
    }
    case = {"id": "s", "inputs": {"N": 4}, "expected": {"R": []}}
    file = file_of({"function": "so3.random", "statistic": rule, "cases": [case]})

    def report(matrices: Any) -> Report:
        return run(asked({"so3.random": lambda N: matrices}), [file])

    balanced = [np.diag([1.0, -1, -1]).tolist()] * 3 + [np.eye(3).tolist()]
    assert report(balanced).passed
    assert not report([np.eye(3).tolist()] * 4).passed
    assert "4 finite samples" not in str(report(balanced[:2]).outcomes[0].difference)
    assert report(balanced[:2]).count("failed") == 1
    assert report("none").count("failed") == 1


def test_lint_finds_what_a_schema_cannot_say() -> None:
    bad = {**EXP, "cases": [{**EXP["cases"][0], "inputs": {"psi": 1}}, EXP["cases"][0]]}  # type: ignore[dict-item]
    told = " ".join(form.lint(file_of(bad)))
    assert "this id stands twice" in told
    assert "inputs ['psi']" in told
    assert "note 'half' is not explained" in told
    assert list(form.lint(file_of(EXP, notes=NOTES))) == []


def test_at_most_twenty_of_a_regime_count() -> None:
    cases = [{**EXP["cases"][0], "id": f"c{k}"} for k in range(30)]  # type: ignore[dict-item]
    file = file_of({**EXP, "cases": cases}, {**EXP, "cases": cases[:5], "flags": ["near_pi"]}, notes=NOTES)
    assert form.counted(file.cases) == 25


def test_the_page_holds_causes_and_failures_and_escapes() -> None:
    report = one(np.eye(3).tolist())._replace(program="<b>mine</b>")
    text = verification_page(report)
    assert "&lt;b&gt;mine" in text
    assert "you forget the angle" in text
    assert "so3.exp/generic-01" in text
    assert "src=" not in text
