"""Whatever a foreign program does is a result of the run, not its failure."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from vslam_ref.conformance.program import InProcess, Program, Reply

PROGRAM = """
import json, sys, time
mode = sys.argv[1]
for line in sys.stdin:
    ask = json.loads(line)
    identity, x = ask["id"], ask["inputs"].get("x", 0)
    def say(text, end="\\n"):
        sys.stdout.write(text + end)
        sys.stdout.flush()
    if mode == "echo": say(json.dumps({"id": identity, "value": x}))
    elif mode == "silent": pass
    elif mode == "dies": sys.exit(3)
    elif mode == "dies_once" and x == 1: sys.exit(3)
    elif mode == "dies_once": say(json.dumps({"id": identity, "value": x}))
    elif mode == "rubbish": say("Segmentation fault (core dumped)")
    elif mode == "number": say("7")
    elif mode == "nan": say('{"id": "%s", "value": [NaN, Infinity]}' % identity)
    elif mode == "half": say('{"id": "%s", "va' % identity, end=""); sys.exit(0)
    elif mode == "unsupported": say(json.dumps({"id": identity, "unsupported": True}))
    elif mode == "error": say(json.dumps({"id": identity, "error": "no such angle"}))
    elif mode == "empty": say(json.dumps({"id": identity}))
    elif mode == "late": time.sleep(0.6 if x == 1 else 0.0); say(json.dumps({"id": identity, "value": x}))
    elif mode == "chatty": say("{}"); say(json.dumps({"id": identity, "value": x}))
"""


@pytest.fixture
def command(tmp_path: Path) -> str:
    path = tmp_path / "program.py"
    path.write_text(PROGRAM)
    return f"{sys.executable} {path}"


def ask_all(command: str, mode: str, xs: list[int], timeout: float = 5.0) -> list[Reply]:
    program = Program(f"{command} {mode}", timeout)
    try:
        return [program.ask(f"case-{k}", "test.f", {"x": x}) for k, x in enumerate(xs)]
    finally:
        program.close()


WANTED = [
    ("silent", "timeout", "no reply"),
    ("dies", "crash", "status 3"),
    ("rubbish", "garbage", "not JSON"),
    ("number", "garbage", "not an object"),
    ("half", "garbage", "half a line"),
    ("unsupported", "unsupported", ""),
    ("error", "error", "no such angle"),
    ("empty", "garbage", "neither value"),
]


@pytest.mark.parametrize(("mode", "what", "told"), WANTED)
def test_every_way_to_fail_is_told(mode: str, what: str, told: str, command: str) -> None:
    (reply,) = ask_all(command, mode, [1], timeout=0.5 if mode == "silent" else 5.0)
    assert reply.what == what
    assert told in reply.message


def test_values_come_back(command: str) -> None:
    assert [r.value for r in ask_all(command, "echo", [1, 2, 3])] == [1, 2, 3]
    assert [r.value for r in ask_all(command, "chatty", [4, 5])] == [4, 5]


def test_numbers_that_are_not_finite_are_values(command: str) -> None:
    (reply,) = ask_all(command, "nan", [1])
    assert reply.what == "value"
    assert json.dumps(reply.value) == "[NaN, Infinity]"


def test_a_program_that_died_is_started_again_but_not_for_ever(command: str) -> None:
    replies = ask_all(command, "dies_once", [1, 2, 1, 3])
    assert [r.what for r in replies] == ["crash", "value", "crash", "value"]
    replies = ask_all(command, "dies", list(range(9)))
    assert {r.what for r in replies} == {"crash"}
    assert "not started again" in replies[-1].message


def test_a_late_answer_is_not_taken_for_the_next(command: str) -> None:
    replies = ask_all(command, "late", [1, 2], timeout=0.4)
    assert [r.what for r in replies] == ["timeout", "value"]
    assert replies[1].value == 2


def test_a_program_that_reads_nothing_does_not_hang_the_runner(tmp_path: Path) -> None:
    """A megabyte does not fit the pipe; the program sleeps."""
    path = tmp_path / "sleeps.py"
    path.write_text("import time; time.sleep(60)")
    program = Program(f"{sys.executable} {path}", timeout=0.5)
    began = time.monotonic()
    reply = program.ask("case-1", "test.f", {"x": [0.0] * 300_000})
    program.close()
    assert reply.what in ("timeout", "crash")
    assert time.monotonic() - began < 20.0


@pytest.mark.parametrize("command", ["", "'", "/no/such/program --fast"])
def test_what_cannot_be_started_is_bad_use(command: str) -> None:
    with pytest.raises(ValueError, match="--program"):
        Program(command)


def test_a_module_is_asked_in_the_process() -> None:
    module = ModuleType("mine")

    def answer(function: str, inputs: dict[str, float]) -> float:
        if function == "test.none":
            raise NotImplementedError
        return 1.0 / inputs["x"]

    module.answer = answer  # type: ignore[attr-defined]
    asked = InProcess(module)
    assert asked.ask("1", "test.f", {"x": 2.0}) == Reply("value", 0.5, "")
    assert asked.ask("1", "test.none", {}).what == "unsupported"
    assert asked.ask("1", "test.f", {"x": 0.0}) == Reply(
        "error", None, "ZeroDivisionError: float division by zero"
    )
    with pytest.raises(ValueError, match="no function answer"):
        InProcess(ModuleType("empty"))
    with pytest.raises(ValueError, match="No module named"):
        InProcess("no_such_module_here")
