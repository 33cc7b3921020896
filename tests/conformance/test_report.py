"""The report: a table of functions and regimes, what to look at first, pictures, a page of bounded size."""

from __future__ import annotations

import json
import math
import re
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from vslam_ref.commands.verify_text import text
from vslam_ref.conformance import report as page_module
from vslam_ref.conformance import vectors_format as form
from vslam_ref.conformance.adapters import itself
from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.pictures import angle, angle_between, off_axis, pictures
from vslam_ref.conformance.program import InProcess
from vslam_ref.conformance.regimes import basic_first, place, regime, rows
from vslam_ref.conformance.report import verification_page
from vslam_ref.conformance.results import MOST_NUMBERS, Report, bounded
from vslam_ref.conformance.runner import run
from vslam_ref.conformance.selection import select
from vslam_ref.geometry import se3, sim3, so3
from vslam_ref.plot.verification import error_figure


def altered(change: dict[str, Any], *topics: str) -> Report:
    """The library with some functions replaced by a change of their answer."""
    module = ModuleType("altered")

    def answer(function: str, inputs: dict[str, Any]) -> Any:
        found = itself.answer(function, inputs)
        outputs = functions()[function].outputs
        named = found if isinstance(found, dict) else dict.fromkeys(outputs, found)
        return change[function](named, inputs) if function in change else found

    module.answer = answer  # type: ignore[attr-defined]
    return run(InProcess(module), select(topics=topics))


def transposed(found: Any, inputs: Any) -> Any:
    return {name: np.transpose(x).tolist() for name, x in found.items()}


def near_pi_off(found: Any, inputs: Any) -> Any:
    near = abs(np.pi - np.linalg.norm(inputs["phi"])) < 1e-2
    return {"R": (np.array(found["R"]) + (1e-6 if near else 0.0)).tolist()}


@pytest.fixture(scope="module")
def wrong() -> Report:
    """A transposed so3.exp and se3.exp, and a camera that refuses everything."""

    def refuses(found: Any, inputs: Any) -> Any:
        raise RuntimeError("no camera")

    change = {"so3.exp": transposed, "se3.exp": transposed, "camera.project": refuses}
    return altered(change, "so3", "se3", "camera")


# --- order --------------------------------------------------------------------------------------------


def test_basic_functions_come_first() -> None:
    """Rotations before motions before cameras before several views, filters after all these."""
    order = ["so2.exp", "so3.exp", "so3.log", "se3.exp", "camera.project", "multiview.pnp", "loss.cost"]
    order += ["bundle.schur", "ekf.predict", "ekf.trace", "carleman.predict"]
    assert sorted(order, key=place) == order
    assert len({place(name) for name in functions()}) == len(functions())


def test_the_first_failure_is_the_most_basic_functions_in_its_plainest_case(wrong: Report) -> None:
    first = wrong.first
    assert first is not None
    assert first.case.function == "so3.exp"
    assert regime(first.case) == "generic"
    assert wrong.numbers()["first_failure"]["id"] == first.case.id
    files = [file._replace(cases=file.cases[::-1]) for file in select(functions=["se3.exp", "so3.exp"])[::-1]]
    module = ModuleType("transposed")
    module.answer = lambda f, i: np.transpose(itself.answer(f, i)).tolist()  # type: ignore[attr-defined]
    turned = run(InProcess(module), files).first
    assert turned is not None
    assert (turned.case.function, regime(turned.case)) == ("so3.exp", "generic")


def test_sizes_and_refusals_come_after_plain_cases() -> None:
    report = altered({"ekf.update": lambda found, inputs: {"x": [0.0], "P": [[0.0]]}}, "ekf")
    order = [len(o.case.inputs["ids"]) for o in basic_first(o for o in report.outcomes if o.bad)]
    first = report.first
    assert first is not None
    assert len(json.dumps(first.case.inputs)) <= 1.2 * min(
        len(json.dumps(o.case.inputs)) for o in report.outcomes if o.bad
    )
    assert order[0] <= min(order) + 1


# --- the table ----------------------------------------------------------------------------------------


def test_the_table_has_a_row_for_each_function_and_regime_and_adds_up(wrong: Report) -> None:
    numbers = wrong.numbers()
    table = numbers["functions"]
    keys = ["function", "regime", "cases", "passed", "digits_lost", "digits_median", "digits_worst", "name"]
    assert all(list(row) == keys for row in table)
    assert len({(row["function"], row["regime"]) for row in table}) == len(table)
    assert {row["function"] for row in table} == {
        f for f in functions() if f.partition(".")[0] in ("so3", "se3", "camera")
    }
    assert sum(row["cases"] for row in table) == numbers["cases"] - numbers["unsupported"]
    assert sum(row["passed"] for row in table) == numbers["passed"]
    bad = sum(row["cases"] - row["passed"] - row["digits_lost"] for row in table)
    assert bad == numbers["failed"] + numbers["errors"] == len(numbers["failures"])
    assert [row["function"] for row in table] == sorted((r["function"] for r in table), key=place)


def test_a_regime_that_is_off_is_the_only_row_with_failures() -> None:
    report = altered({"so3.exp": near_pi_off}, "so3")
    wrong_rows = [row for row in rows(report.outcomes, {}) if row.bad]
    assert [(row.function, row.regime) for row in wrong_rows] == [("so3.exp", "near_pi")]
    (row,) = wrong_rows
    assert 5.8 < row.digits_worst <= row.digits_median < 6.1  # type: ignore[operator]
    right = next(r for r in rows(report.outcomes, {}) if (r.function, r.regime) == ("so3.exp", "generic"))
    assert right.digits_worst is not None
    assert right.digits_worst > 14


def test_failures_have_what_is_needed_to_look_into_them(wrong: Report) -> None:
    failures = wrong.numbers()["failures"]
    assert all(
        list(f) == ["id", "function", "regime", "expected", "answered", "error", "allowed", "name"]
        for f in failures
    )
    cases = {case.id: case for file in select() for case in file.cases}
    for found in failures:
        case = cases[found["id"]]
        assert found["regime"] == found["id"].partition("/")[2][:-3]
        assert found["expected"] == (case.expected if case.result != "invalid" else "a refusal")
        if found["function"] == "so3.exp":
            expected = np.array(case.expected["R"])
            assert np.allclose(found["answered"]["R"], expected.T, atol=1e-12)
            assert abs(found["error"] - np.abs(expected - expected.T).max()) < 1e-9
            assert 0 < found["allowed"] < found["error"]
        if found["function"] == "camera.project":
            assert found["answered"] == "error: RuntimeError: no camera"
            assert found["error"] is found["allowed"] is None


def test_what_has_no_name_is_counted() -> None:
    report = altered({"so3.exp": near_pi_off}, "so3")
    if not report.functions_named:
        assert report.unexplained == {"so3.exp": report.count("failed")}
    assert sum(report.unexplained.values()) <= report.count("failed")


# --- the terminal -------------------------------------------------------------------------------------


def test_the_terminal_says_what_is_wrong_and_what_to_do_next(wrong: Report) -> None:
    shown = text(wrong, "vslam-ref verify --module mine.py")
    first = wrong.first
    assert first is not None
    assert f"look here first: {first.case.id}" in shown
    assert "next: mend so3.exp" in shown
    assert "vslam-ref verify --module mine.py --function so3.exp" in shown
    assert f"--case {first.case.id}" in shown
    lines = shown.splitlines()
    assert any(re.match(r"so3\.exp +generic +12 +0 +0 ", line) for line in lines)
    assert not any(
        re.match(r"so3\.log +generic ", line) for line in lines
    )  # all pass: one line for all these
    assert re.search(r"all cases pass in \d+ regimes of \d+ functions; fewest right digits: ", shown)
    assert max(map(len, lines)) < 500
    assert len(lines) < 140


def test_the_terminal_shows_all_rows_of_a_few_functions() -> None:
    shown = text(run(InProcess(itself), select(functions=["so3.log"])), "")
    assert len(re.findall(r"^so3\.log ", shown, re.MULTILINE)) == len(
        {regime(case) for file in select(functions=["so3.log"]) for case in file.cases}
    )
    assert shown.endswith("all answered cases pass")


def test_the_terminal_says_when_nothing_was_answered_or_not_all_was_asked() -> None:
    module = ModuleType("empty")

    def answer(function: str, inputs: Any) -> Any:
        raise NotImplementedError

    module.answer = answer  # type: ignore[attr-defined]
    shown = text(run(InProcess(module), select(topics=["so2"])), "")
    assert "nothing passed" in shown
    assert "vslam-ref vectors list" in shown
    part = run(InProcess(itself), select(topics=["so2"]))._replace(not_asked=3, stopped="interrupted")
    shown = text(part, "")
    assert "not asked: 3 cases more: interrupted" in shown
    assert "all answered cases pass" not in shown


# --- pictures -----------------------------------------------------------------------------------------


def test_angles_of_inputs_are_those_of_the_rotation() -> None:
    phi = np.array([0.3, -0.5, 0.7])
    size = float(np.linalg.norm(phi))
    xi = [9.0, 8.0, 7.0, *phi]
    R, T, S = so3.exp(phi), se3.exp(np.array(xi)), sim3.exp(np.array([*xi, 0.4]))
    q = [np.cos(size / 2), *(np.sin(size / 2) * phi / size)]
    given: list[dict[str, Any]] = [
        {"phi": phi.tolist()},
        {"xi": xi},
        {"xi": [*xi, 0.4]},
        {"R": R.tolist()},
        {"T": T.tolist(), "x": [1.0, 2.0, 3.0]},
        {"S": S.tolist()},
        {"q": q},
        {"q": (-np.array(q)).tolist()},
        {"angle": -size},
        {"xi": [1.0, 2.0, -size]},
        {"x": [1.0, 2.0, -size]},
    ]
    for inputs in given:
        assert abs(angle(inputs) - size) < 1e-12, inputs
    assert abs(angle_between({"a": R.tolist(), "b": (R @ so3.exp([0, 0, 0.25])).tolist()}) - 0.25) < 1e-12
    assert abs(off_axis({"X_cam": [0.0, 2.0, 2.0]}) - np.pi / 4) < 1e-12
    pose = np.eye(4)
    pose[:3, 3] = 0.0, 2.0, 0.0
    assert abs(off_axis({"pose": pose.tolist(), "X_world": [0.0, 0.0, 2.0]}) - np.pi / 4) < 1e-12


def test_pictures_are_of_functions_that_fail_and_show_where() -> None:
    report = altered({"so3.exp": near_pi_off}, "so3", "ekf")
    (found,) = pictures(report.outcomes)
    assert found.function == "so3.exp"
    for at, error, verdict in zip(found.at, found.errors, found.verdicts, strict=True):
        near = abs(np.pi - at) < 1e-2
        assert (verdict == "failed") == near
        assert (error > 1e-7) == near


def test_there_is_a_number_for_every_case_of_the_groups_that_can_fail() -> None:
    for topic in ("so2", "se2", "so3", "se3", "sim3", "quaternion", "camera"):
        for file in select(topics=[topic]):
            for case in file.cases:
                if case.function in ("so3.random", "camera.unproject", "camera.jacobian_ray"):
                    continue
                if case.function.endswith("interpolate"):
                    value = angle_between(case.inputs)
                elif topic == "camera":
                    value = off_axis(case.inputs)
                else:
                    value = angle(case.inputs)
                assert math.isnan(value) or value >= 0.0, case.id


def test_the_figure_has_each_point_where_it_belongs() -> None:
    """Zero stands left of all, a full turn and a half is half a turn, and each verdict has its own marker."""
    at, errors = [0.0, 1e-3, 3.0, 3 * np.pi + 0.01], [1e-20, 1e-10, 0.1, 5.0]
    verdicts = ["passed", "lost digits", "failed", "failed"]
    figure = error_figure(at, errors, verdicts, axis="angle (rad)", half_turn=True)
    left, right = figure.axes
    drawn = {
        line.get_label(): line.get_xydata() for line in left.lines if not line.get_label().startswith("_")
    }
    assert set(drawn) == {"passed", "lost digits", "failed"}
    assert 0 < drawn["passed"][0][0] < 1e-3
    assert drawn["passed"][0][1] == 1e-16
    assert drawn["lost digits"].tolist() == [[1e-3, 1e-10]]
    assert np.allclose(drawn["failed"], [[3.0, 0.1], [3 * np.pi + 0.01, 1.0]])
    turned = {line.get_label(): line.get_xydata() for line in right.lines}
    assert np.allclose(turned["failed"][:, 0], [np.pi - 3.0, 0.01])
    assert np.allclose(turned["passed"][:, 0], np.pi)
    assert left.get_xscale() == left.get_yscale() == right.get_xscale() == "log"
    assert len(error_figure(at, errors, verdicts, axis="x", half_turn=False).axes) == 1


# --- the page -----------------------------------------------------------------------------------------


def test_the_page_is_whole_and_escapes(wrong: Report) -> None:
    shown = verification_page(wrong._replace(program="<b>mine</b>", notes=("a <i>note</i>",)))
    assert "&lt;b&gt;mine" in shown
    assert "&lt;i&gt;note" in shown
    assert "src=" not in shown
    assert "<script" not in shown
    for head in (
        "Look here first",
        "Functions and regimes",
        "Errors over the inputs",
        "Failures",
        "By chapter",
    ):
        assert f"<h2>{head}</h2>" in shown
    assert shown.count("<svg") == 2  # so3.exp and se3.exp; the camera gave no answer
    first = wrong.first
    assert first is not None
    assert shown.index(first.case.id) < shown.index("Functions and regimes")
    ids = re.findall(r'<g id="([^"]+)"', shown)
    assert ids


def test_the_page_says_what_was_not_asked(wrong: Report) -> None:
    shown = verification_page(wrong._replace(not_asked=17, stopped="interrupted"))
    assert "17 more cases were not asked (interrupted)" in shown


def test_the_page_is_of_bounded_size() -> None:
    """Everything fails, with long answers: the page is cut and says so, the JSON is not."""
    module = ModuleType("large")
    module.answer = lambda function, inputs: "long " * 1000  # type: ignore[attr-defined]
    report = run(InProcess(module), select(), names=False)
    bad = sum(o.bad for o in report.outcomes)
    assert bad > 2000
    shown = verification_page(report)
    assert f"{bad} in all. {page_module.MOST_FAILURES} are shown: --json has all." in shown
    assert len(shown) < 3_000_000  # failures are cut; the table has a line for each of some 700 regimes
    assert len(report.numbers()["failures"]) == bad
    assert len(text(report, "")) < 30_000


def test_answers_are_cut_where_they_are_endless() -> None:
    assert bounded([1.0, float("nan"), -math.inf]) == [1.0, "nan", "-inf"]
    assert "10001 numbers" in bounded([0.0] * (2 * MOST_NUMBERS))
    assert "too long" in bounded("x" * 10_000_000)


# --- selection ----------------------------------------------------------------------------------------


def chosen(**words: Any) -> set[str]:
    return {case.id for file in select(**words) for case in file.cases}


def test_selections_add_up() -> None:
    everything = chosen()
    assert len(everything) == sum(len(form.load(name).cases) for name in form.names())
    topic, function, case = (
        {"topics": ["so2"]},
        {"functions": ["se3.log"]},
        {"cases": ["ekf.trace/generic-01"]},
    )
    case["cases"] = [next(i for i in sorted(everything) if i.startswith("ekf.trace/"))]
    chapter = {"chapters": [4]}
    parts = [chosen(**part) for part in (topic, function, case, chapter)]
    assert all(parts)
    assert chosen(**topic, **function, **case, **chapter) == set().union(*parts)
    assert chosen(topics=["so2", "so3"]) == chosen(topics=["so2"]) | chosen(topics=["so3"])
    assert chosen(functions=["so2.exp"], topics=["so2"]) == parts[0]


UNKNOWN = [
    ({"chapters": [18]}, "no vectors of that chapter or topic: chapter 18"),
    ({"chapters": [2, 18]}, "chapter 18"),
    ({"topics": ["so2", "so4"]}, "topic so4"),
    ({"functions": ["so3.epx"]}, "did you mean so3.exp"),
    ({"functions": ["so2.exp", "zzzzzz"]}, "no function 'zzzzzz'"),
    (
        {"topics": ["so2"], "cases": ["so3.exp/generic-99"]},
        "no case 'so3.exp/generic-99'.*did you mean so3.exp",
    ),
]


@pytest.mark.parametrize(("words", "told"), UNKNOWN)
def test_an_unknown_name_is_refused_also_beside_known_ones(words: dict[str, Any], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        select(**words)
