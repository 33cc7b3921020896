"""Other libraries under the vectors: what passes, and an exact list of what does not."""

from __future__ import annotations

import dataclasses
import io
import json
import subprocess
import sys
from pathlib import Path

import adapter_lists as lists
import pytest

from vslam_ref.conformance import serve, vectors_format
from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.conventions import Convention, read
from vslam_ref.conformance.program import InProcess, Program, load_module
from vslam_ref.conformance.runner import Report, run

AT_LEAST_EIGHT = ("opencv", "scipy", "gtsam", "cpp", "node")


def judge(name: str, report: Report) -> None:
    """Compare a run with the adapter's list."""
    listed = lists.listed(name)
    bad = {o.case.id: o for o in report.outcomes if lists.is_wrong(o)}
    rounding = {k: o for k, o in bad.items() if lists.regime(k) in listed.within}
    asked = {o.case.id for o in report.outcomes if o.status != "unsupported"}
    told = {k: f"{o.status} {o.difference} {o.cause}" for k, o in bad.items() if k not in rounding}
    fresh = {k: text for k, text in told.items() if k not in listed.exact}
    assert not fresh, f"{len(fresh)} cases fail that are not listed: {dict(list(fresh.items())[:3])}"
    mended = (listed.exact & asked) - set(told)
    assert not mended, f"listed as failing, but they pass: {sorted(mended)}"
    far = {k: lists.ratio(o) for k, o in rounding.items() if lists.ratio(o) > listed.within[lists.regime(k)]}
    assert not far, f"off by more than rounding: {far}"


@pytest.mark.parametrize("name", lists.NAMES)
def test_deviations_are_exactly_those_listed(name: str) -> None:
    """A case that fails and is not listed is new; a listed one that passes was mended."""
    lists.need(name)
    if lists.other_version(name):
        pytest.skip(lists.other_version(name))
    entry = lists.LISTS[name]
    files = lists.chosen(entry.get("every", 1), set(entry["topics"]) | topics(name))
    report = lists.verified(name, files)
    judge(name, report)
    assert {o.case.topic for o in report.outcomes if o.status == "passed"} == set(entry["topics"])


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in lists.NAMES if "every" in lists.LISTS[name]])
def test_all_cases_of_the_slow_ones(name: str) -> None:
    lists.need(name)
    if lists.other_version(name):
        pytest.skip(lists.other_version(name))
    judge(name, lists.verified(name, lists.chosen()))


def topics(name: str) -> set[str]:
    """Topics in which something is listed."""
    return {row["regime"].partition(".")[0] for row in lists.LISTS[name]["deviations"]}


@pytest.mark.parametrize("name", AT_LEAST_EIGHT)
def test_each_covers_eight_topics(name: str) -> None:
    assert len(lists.LISTS[name]["topics"]) >= 8


def test_the_lists_name_cases_that_exist_and_say_why() -> None:
    ids = {case.id for file in lists.chosen() for case in file.cases}
    regimes = {lists.regime(identity) for identity in ids}
    for name in lists.NAMES:
        listed = lists.listed(name)
        assert listed.exact <= ids, sorted(listed.exact - ids)
        assert set(listed.within) <= regimes, sorted(set(listed.within) - regimes)
        assert all(row["why"] for row in lists.LISTS[name]["deviations"])


# --- conventions: each declaration is needed, and enough ---------------------------------------------


@pytest.mark.parametrize(
    ("name", "key", "topics"),
    [
        ("gtsam", "transform", {"camera", "multiview"}),
        ("gtsam", "perturbation", {"camera"}),
        ("gtsam", "tangent_order", {"se3", "sim3", "camera"}),
        ("scipy", "quaternion_order", {"quaternion"}),
        ("scipy", "tangent_order", {"se3", "sim3"}),
        ("node", "transform", {"camera"}),
        ("node", "tangent_order", {"se3", "sim3", "camera"}),
        ("node", "quaternion_order", {"quaternion"}),
    ],
)
def test_without_one_declaration_a_right_program_fails(name: str, key: str, topics: set[str]) -> None:
    """In every topic that the convention touches, and only because of it."""
    lists.need(name)
    house = getattr(Convention(), key)
    assert getattr(lists.convention(name), key) != house
    less = dataclasses.replace(lists.convention(name), **{key: house})
    files = lists.chosen(4, topics)
    known = {o.case.id for o in lists.verified(name, files).outcomes if o.status == "failed"}
    report = lists.verified(name, files, less)
    fresh = [o for o in report.outcomes if o.status == "failed" and o.case.id not in known]
    assert {o.case.topic for o in fresh} == topics


def test_an_undeclared_order_is_diagnosed() -> None:
    """GTSAM's logarithm, read as ours, is told to have the rotation first."""
    lists.need("gtsam")
    report = lists.verified("gtsam", lists.chosen(4, {"se3"}), Convention())
    causes = {o.cause for o in report.outcomes if o.case.function == "se3.log" and o.status == "failed"}
    assert any("rotation" in cause for cause in causes)


@pytest.mark.parametrize(
    "path",
    sorted([*lists.SHIPPED.rglob("*convention.json"), *lists.HERE.glob("*convention.json")]),
    ids=lambda p: p.name,
)
def test_convention_files_can_be_read(path: Path) -> None:
    assert read(path) != Convention()


# --- wrong programs are caught -----------------------------------------------------------------------


WRONG_SCRIPTS = [
    ("[F[0][2], F[1][2]] = [-v * dt * s,", "[F[0][2], F[1][2]] = [v * dt * s,", "ekf.predict"),
    ("mul(mul(F, P), transpose(F))", "mul(mul(transpose(F), P), F)", "ekf.predict"),
    ("return { x: [...x, x[0] + d[0]", "cross[0].fill(0); return { x: [...x, x[0] + d[0]", "ekf.augment"),
    ("[h - f, c - g, d - b, big],", "[f - h, g - c, b - d, big],", "quaternion.from_rotation"),
    ("(x * x) / 6) * (3 - 3 * u", "(x * x) / 3) * (3 - 3 * u", "loss.cost"),
    ("scale(-1, eye(3))", "eye(3)", "camera.jacobian_pose"),
    ("* 180) / Math.PI", "* 180) / 3.14159", "trajectory.rpe"),
    ("row[7], row[4]", "row[4], row[7]", "format.tum"),
]


@pytest.mark.parametrize(("right", "wrong", "function"), WRONG_SCRIPTS)
def test_one_wrong_sign_in_the_script_is_found(right: str, wrong: str, function: str, tmp_path: Path) -> None:
    lists.need("node")
    source = (lists.SHIPPED / "node" / "adapter.mjs").read_text("utf-8")
    assert right in source, right
    (tmp_path / "wrong.mjs").write_text(source.replace(right, wrong), encoding="utf-8")
    program = Program(f"node '{tmp_path / 'wrong.mjs'}'", 60.0)
    files = lists.chosen(3, {functions()[function].topic})
    try:
        report = run(program, files, lists.convention("node"))
    finally:
        program.close()
    failed = {o.case.function for o in report.outcomes if o.status == "failed"}
    assert failed == {function}


# --- the protocol, from the program's side ------------------------------------------------------------


STRANGE = [
    ("rubbish", None),
    ("", "skipped"),
    ('{"id": "a"}', None),
    ('{"id": "b", "function": "no.such", "inputs": {}}', "unsupported"),
    ('{"id": "c", "function": "so2.exp", "inputs": {}}', "error"),
    ('{"id": "d", "function": "so2.exp", "inputs": {"angle": 0.0}}', "value"),
    ('{"id": "é \\"q\\" \\\\", "function": "so2.exp", "inputs": {"angle": 0.0}}', "value"),
    (
        '{"id": "e", "function": "camera.project", "inputs": {"model": "no", "params": [], "X_cam": []}}',
        "bad",
    ),
]


@pytest.mark.parametrize("name", ["cpp", "node", "octave", "rust", "serve"])
def test_programs_survive_strange_lines(name: str) -> None:
    """One reply to each line but blank ones, in order, with its id."""
    command = [sys.executable, "-m", "vslam_ref.conformance.serve", str(lists.module_file("scipy"))]
    if name != "serve":
        lists.need(name)
        asked = lists.asked(name)
        assert isinstance(asked, Program)
        asked.close()
        command = asked.words
    lines = list(STRANGE)
    if name in ("octave", "rust"):  # these answer so3 only
        lines = [
            (line.replace("so2", "so3").replace('"angle": 0.0', '"phi": [0, 0, 0]'), what)
            for line, what in lines
        ]
    text = "\n".join(line for line, _ in lines) + "\n"
    done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=60)
    replies = [json.loads(line) for line in done.stdout.splitlines()]
    wanted = [(line, what) for line, what in lines if what != "skipped"]
    assert done.returncode == 0
    assert len(replies) == len(wanted)
    for (line, what), reply in zip(wanted, replies, strict=True):
        if what is not None:
            assert reply["id"] == json.loads(line)["id"]
        if what == "bad":
            assert "error" in reply or reply.get("unsupported") is True
        elif what is not None:
            assert what in reply


def test_served_answers_are_those_of_the_module(capsys: pytest.CaptureFixture[str]) -> None:
    name = str(lists.module_file("opencv"))
    cases = lists.chosen(9, {"so3"})[0].cases
    lines = [json.dumps({"id": c.id, "function": c.function, "inputs": c.inputs}) for c in cases]
    out = io.StringIO()
    module = InProcess(name)
    serve.serve(module._answer, lines, out)
    for case, line in zip(cases, out.getvalue().splitlines(), strict=True):
        reply, here = json.loads(line), module.ask(case.id, case.function, case.inputs)
        assert reply["id"] == case.id
        assert reply.get("unsupported", False) == (here.what == "unsupported")
        assert reply.get("value") == here.value


def test_what_a_module_prints_does_not_reach_the_replies(capsys: pytest.CaptureFixture[str]) -> None:
    def chatty(function: str, inputs: dict[str, float]) -> float:
        print("hello")
        return inputs["x"]

    out = io.StringIO()
    serve.serve(chatty, ['{"id": 1, "function": "f", "inputs": {"x": 2.0}}', " "], out)
    assert out.getvalue() == '{"id": 1, "value": 2.0}\n'
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("arguments", [[], ["no.such.module"], ["json"], ["a", "b"]])
def test_serve_wants_one_module_with_an_answer(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert serve.main(arguments) == 2
    assert "serve" in capsys.readouterr().err


def test_numbers_keep_their_digits() -> None:
    """The C++ reader and writer give back every bit: the identity times a matrix of awkward numbers."""
    lists.need("cpp")
    awkward = [
        [0.1, 1e-300, 1.7976931348623157e308],
        [5e-324, -0.1, 1.0 / 3.0],
        [1e22, 123456789.123456789, 2.0],
    ]
    program = lists.asked("cpp")
    try:
        unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        reply = program.ask("1", "sim3.compose", {"a": unit, "b": awkward})
    finally:
        program.close()
    assert reply.value == awkward


def test_every_function_of_an_adapter_is_in_the_catalogue() -> None:
    """A misspelt name would be silently unsupported."""
    modules = [
        load_module(str(lists.module_file(name)))
        for name in ("evo", "filterpy", "opencv", "opencv_usual", "scipy")
    ]
    names = {name for module in modules for name in module.TABLE}
    names |= set(load_module(str(lists.module_file("gtsam"))).table())
    for path in ("cpp/adapter.cpp", "node/adapter.mjs"):
        text = (lists.SHIPPED / path).read_text("utf-8")
        table = text[text.index("TABLE = {") :]
        found = {line.split('"')[1] for line in table.splitlines() if line.lstrip(" {").startswith('"')}
        names |= {name for name in found if "." in name}
    assert names <= set(functions()), sorted(names - set(functions()))
    assert vectors_format.names()


# --- adapters to start from ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["octave", "rust"])
def test_files_to_start_from_answer_rightly(name: str) -> None:
    """What they show passes: a matrix, a vector, an object with a refusal, another model unsupported."""
    lists.need(name)
    report = lists.verified(name, lists.chosen(3, {"so3", "se3", "camera"}), Convention())
    answered = {o.case.function for o in report.outcomes if o.status == "passed"}
    assert answered == {"so3.exp", "se3.act", "camera.project"}
    assert report.passed
    assert {o.case.result for o in report.outcomes if o.status == "passed"} == {"valid", "invalid"}


WRONG_STARTS = [
    ("rust", "b * x * y - a * z", "b * x * y + a * z"),
    ("octave", "W = [0, -phi(3), phi(2)", "W = [0, phi(3), phi(2)"),
]


@pytest.mark.parametrize(("name", "right", "wrong"), WRONG_STARTS)
def test_a_wrong_sign_in_them_is_found(name: str, right: str, wrong: str) -> None:
    lists.need(name)
    source = (lists.SHIPPED / ("rust/adapter.rs" if name == "rust" else "octave/adapter.m")).read_text(
        "utf-8"
    )
    assert source.count(right) == 1
    text = source.replace(right, wrong)
    program = Program(lists.compiled_rust(text), 60.0) if name == "rust" else lists.octave(text)
    try:
        report = run(program, lists.chosen(4, {"so3"}))
    finally:
        program.close()
    assert {o.case.function for o in report.outcomes if o.status == "failed"} == {"so3.exp"}
