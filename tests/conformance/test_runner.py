"""The runner's judgement: right, wrong, why; on cases made for it."""

from __future__ import annotations

import json
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.conformance import runner
from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.compare import compare, numbers
from vslam_ref.conformance.conventions import Convention
from vslam_ref.conformance.program import InProcess, Reply
from vslam_ref.conformance.report import verification_page
from vslam_ref.conformance.results import NOTHING
from vslam_ref.conformance.runner import Report, run
from vslam_ref.support.json_text import to_json

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


# --- a run that ends early ----------------------------------------------------------------------------


class Scripted:
    """It replies as it is told: V a value, U unsupported, G garbage, T silence, C a crash, I Ctrl-C."""

    name = "scripted"
    notes = ()

    def __init__(self, script: str, alive: bool = True) -> None:
        self.script, self.asked, self.alive = script, 0, alive

    def ask(self, identity: str, function: str, inputs: dict[str, Any]) -> Reply:
        letter = self.script[self.asked % len(self.script)]
        self.asked += 1
        if letter == "I":
            raise KeyboardInterrupt
        self.alive = self.alive or letter in "VUG"
        value = Reply("value", R.tolist(), "")
        unsupported, garbage = Reply("unsupported", None, ""), Reply("garbage", None, "a set")
        silence, crash = Reply("timeout", None, "no reply", True), Reply("crash", None, "it ended", True)
        return {"V": value, "U": unsupported, "G": garbage, "T": silence, "C": crash}[letter]

    def close(self) -> None:
        pass


def many(*functions: str, cases: int = 10) -> form.VectorFile:
    inputs = {name: R.tolist() for name in ("phi", "R", "a", "b", "M", "fraction", "N")}
    one_case = {**EXP["cases"][0], "inputs": inputs, "mistakes": {}}  # type: ignore[dict-item]
    return file_of(
        *(
            {
                "function": name,
                "cases": [
                    {**one_case, "id": f"{name}/generic-{k:02d}", "mistakes": {}} for k in range(cases)
                ],  # type: ignore[dict-item]
            }
            for name in functions
        )
    )


def shortened(script: str, *functions: str, cases: int = 10, alive: bool = True) -> Report:
    return run(Scripted(script, alive), [many(*functions, cases=cases)])


def test_a_program_that_is_silent_five_times_in_a_row_is_given_up() -> None:
    report = shortened("VVTTTTTV", "so3.exp")
    assert (len(report.outcomes), report.not_asked) == (7, 3)
    assert "given up: silent 5 times in a row; the last: timeout, no reply" in report.stopped
    assert (report.count("passed"), report.count("error"), report.passed) == (2, 5, False)
    for script in ("TTTTV", "TTTTG", "TTTTU"):  # an answer of any kind is a sign of life
        assert shortened(script, "so3.exp").not_asked == 0


def test_a_program_that_never_replies_is_given_up_after_five() -> None:
    assert shortened("C", "so3.exp", alive=False).not_asked == 5
    assert shortened("CCCTT", "so3.exp", alive=False).not_asked == 5
    assert shortened("CCCCV", "so3.exp", alive=False).not_asked == 0


def test_a_function_that_ends_the_program_is_left_out_and_the_others_are_asked() -> None:
    report = shortened("CCCCCVVVVVVVVVV", "so3.exp", "so3.log", cases=10)
    assert [o.case.function for o in report.outcomes] == ["so3.exp"] * 5 + ["so3.log"] * 10
    assert report.not_asked == 5
    assert report.stopped == ""
    assert "so3.exp: the program ended 5 times in a row; not all of its 10 cases were asked" in report.notes
    assert not report.passed


def test_a_program_that_only_ends_is_given_up() -> None:
    names = [f"so3.{name}" for name in ("exp", "log", "left_jacobian", "interpolate", "nearest", "random")]
    report = shortened("C", *names)
    assert len(report.outcomes) == 25
    assert "no reply 25 times in a row" in report.stopped


def test_a_program_that_ends_at_every_other_question_is_asked_them_all() -> None:
    report = shortened("CV", "so3.exp", cases=80)
    assert (report.count("error"), report.count("passed"), report.not_asked) == (40, 40, 0)


def test_garbage_is_an_answer() -> None:
    report = shortened("G", "so3.exp", cases=40)
    assert (report.count("error"), report.not_asked) == (40, 0)


def test_an_interrupt_leaves_a_report_of_what_was_found() -> None:
    report = shortened("VVVI", "so3.exp")
    assert (report.count("passed"), report.not_asked, report.stopped) == (3, 7, "interrupted")
    assert not report.passed
    assert report.numbers()["stopped"] == "interrupted"


# --- strange answers ----------------------------------------------------------------------------------


STRANGE = [
    float("nan"),
    [[float("nan")] * 3] * 3,
    10**400,
    [[10**250] * 3] * 3,
    None,
    {},
    [],
    {"R": None},
    {"R": {"R": R.tolist()}},
    [[[1.0]]],
    "inf",
    [["nan"], 1],
    True,
    [None],
]


@pytest.mark.parametrize("answer", STRANGE, ids=str)
@pytest.mark.parametrize("result", ["valid", "invalid", "convention"])
def test_strange_answers_do_not_pass_and_can_be_written(answer: Any, result: str) -> None:
    """In every kind of case, and in a program's own conventions."""
    report = one(answer, result=result)
    assert report.count("passed") == 0
    assert json.loads(to_json(report.numbers()))["failures"][0]["id"] == "so3.exp/generic-01"
    assert "so3.exp/generic-01" in verification_page(report)


POSES = ["multiview.pnp", "se3.exp", "camera.jacobian_pose", "quaternion.from_rotation", "ekf.trace"]


@pytest.mark.parametrize("function", POSES)
def test_strange_answers_are_harmless_in_other_conventions(function: str) -> None:
    topic = next(name for name in form.names() if name.endswith(f"/{function.partition('.')[0]}.json"))
    whole = form.load(topic)
    file = whole._replace(cases=[c for c in whole.cases if c.function == function][:2])
    foreign = Convention(
        "world_from_cam", "right", "rotation_first", "xyzw", "corner", "measured_minus_predicted"
    )
    for answer in STRANGE:
        report = run(asked({function: lambda answer=answer, **_: answer}), [file], foreign, names=False)
        assert report.count("passed") == 0
        to_json(report.numbers())


# --- digits -------------------------------------------------------------------------------------------


def test_right_digits_are_told_of_passed_cases_too() -> None:
    report = one((R + 1e-13).tolist())
    (row,) = report.numbers()["functions"]
    assert row["passed"] == row["cases"] == 1
    assert abs(row["digits_worst"] - 13.0) < 0.01
    (row,) = one((R + 1e-5).tolist()).numbers()["functions"]
    assert abs(row["digits_median"] - 5.0) < 0.01
    assert row["passed"] == 0


def test_lost_digits_are_no_failure_and_counted_apart() -> None:
    rule = {**LOOSE, "lost_digits": {"relative": 1e-6, "absolute": 0.0, "reason": "an arc cosine"}}
    group = {**EXP, "tolerance": rule}
    report = run(asked({"so3.exp": lambda phi: (R + 1e-9).tolist()}), [file_of(group, notes=NOTES)])
    numbers_ = report.numbers()
    assert (report.count("lost digits"), report.count("failed"), numbers_["digits_lost"]) == (1, 0, 1)
    assert numbers_["functions"][0]["digits_lost"] == 1
    assert numbers_["failures"] == []
    assert [f["id"] for f in numbers_["lost"]] == ["so3.exp/generic-01"]
    assert numbers_["first_failure"] is None


# --- names of functions -------------------------------------------------------------------------------


def test_names_of_functions_are_asked_for_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    again = []

    def namer(outcomes: Any, ask: Any, profile: str) -> dict[str, str]:
        again.append(ask("so3.exp", {"phi": [0.0, 0.0, 0.0]}))
        assert outcomes[0].got == {"R": (R + 1.0).tolist()}
        return {"so3.exp": "one is added"}

    monkeypatch.setattr(runner, "name_functions", namer)
    report = one((R + 1.0).tolist())
    assert again == [{"R": (R + 1.0).tolist()}]
    told = report.numbers()
    assert told["functions"][0]["name"] == told["failures"][0]["name"] == "one is added"
    assert told["unexplained"] == {}
    assert "one is added" in verification_page(report)


def test_names_that_fail_or_do_not_fit_lose_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> dict[str, str]:
        raise ZeroDivisionError("no name")

    monkeypatch.setattr(runner, "name_functions", fails)
    report = one((R + 1.0).tolist())
    assert report.count("failed") == 1
    assert any("ZeroDivisionError" in note for note in report.notes)
    monkeypatch.setattr(runner, "name_functions", lambda *_: {"so3.exp": NOTHING})
    report = one((R + 1.0).tolist())
    assert report.unexplained == {"so3.exp": 1}
    assert report.numbers()["failures"][0]["name"] == NOTHING


def test_a_program_that_gives_no_reply_is_not_asked_again_for_names(monkeypatch: pytest.MonkeyPatch) -> None:
    program = Scripted("VT")

    def namer(outcomes: Any, ask: Any, profile: str) -> dict[str, str]:
        return {str(k): str(ask("so3.exp", {"phi": [0.0, 0.0, 0.0]})) for k in range(10)}

    program.script = "V" + 50 * "T"
    monkeypatch.setattr(runner, "name_functions", namer)
    run(program, [many("so3.exp", cases=1)])
    assert program.asked == 3
