"""Whatever a foreign program does is a result of the run, not its failure."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest

from vslam_ref.conformance.hints import unquoted
from vslam_ref.conformance.lines import last_words
from vslam_ref.conformance.program import InProcess, Program, Reply

PROGRAM = """
import json, os, sys, time
mode = sys.argv[1]
if mode == "slow_start": time.sleep(1.0)
for line in sys.stdin:
    ask = json.loads(line)
    identity, x = ask["id"], ask["inputs"].get("x", 0)
    def say(text, end="\\n"):
        sys.stdout.write(text + end)
        sys.stdout.flush()
    def answer(text): say('{"id": "%s", "value": %s}' % (identity, text))
    def echo(): answer(json.dumps(x))
    if mode in ("echo", "slow_start"): echo()
    elif mode == "silent": pass
    elif mode == "dies": sys.exit(3)
    elif mode == "dies_once" and x == 1: sys.exit(3)
    elif mode == "dies_once": echo()
    elif mode == "dies_loudly": raise RuntimeError("the matrix is singular")
    elif mode == "one_shot": echo(); sys.exit(0)
    elif mode == "aborts": os.abort()
    elif mode == "hangs_once" and x == 1: time.sleep(60)
    elif mode == "hangs_once": echo()
    elif mode == "closes": os.close(1); time.sleep(60)
    elif mode == "rubbish": say("Segmentation fault (core dumped)")
    elif mode == "binary": sys.stdout.buffer.write(bytes(range(256)) + b"\\n"); sys.stdout.flush()
    elif mode == "flood":
        while True: say("y")
    elif mode == "long": say("x" * 20_000_000)
    elif mode == "endless":
        while True: say("x" * 100_000, end="")
    elif mode == "number": say("7")
    elif mode == "no_id": say('{"value": 7}')
    elif mode == "other_id": say('{"id": "x", "value": 7}')
    elif mode == "bad_bytes":
        sys.stdout.buffer.write(b'{"id": "%s", "value": "\\xff"}\\n' % identity.encode())
        sys.stdout.flush()
    elif mode == "nan": answer("[NaN, Infinity]")
    elif mode == "bare_nan": answer("NaN")
    elif mode == "digits": answer("[%s, %s, -%s]" % ("1" * 200, "1" * 400, "1" * 5000))
    elif mode == "nested": answer("[" * 600 + "1" + "]" * 600)
    elif mode == "nested_more": answer("[" * 200_000 + "1" + "]" * 200_000)
    elif mode == "surrogate": answer('{"a\\\\ud800": "\\\\udfff"}')
    elif mode == "half": say('{"id": "%s", "va' % identity, end=""); sys.exit(0)
    elif mode == "unsupported": say(json.dumps({"id": identity, "unsupported": True}))
    elif mode == "error": say(json.dumps({"id": identity, "error": "no such\\nangle \\x1b[1m"}))
    elif mode == "empty": say(json.dumps({"id": identity}))
    elif mode == "late": time.sleep(0.6 if x == 1 else 0.0); echo()
    elif mode == "chatty": say("{}"); say("computing"); echo()
    elif mode == "thinks": say("computing"); time.sleep(1.4); echo()
"""


@pytest.fixture
def command(tmp_path: Path) -> str:
    path = tmp_path / "program.py"
    path.write_text(PROGRAM)
    return f"{sys.executable} {path}"


def ask_all(
    command: str, mode: str, xs: list[int], timeout: float = 5.0
) -> tuple[list[Reply], tuple[str, ...]]:
    program = Program(f"{command} {mode}", timeout)
    try:
        return [program.ask(f"case-{k}", "test.f", {"x": x}) for k, x in enumerate(xs)], program.notes
    finally:
        program.close()


WANTED = [
    ("silent", "timeout", "no reply within"),
    ("dies", "crash", "ended with status 3"),
    ("dies_loudly", "crash", "RuntimeError: the matrix is singular (%program, line 18)"),
    ("aborts", "crash", "SIGABRT"),
    ("closes", "crash", "closed its standard output"),
    ("rubbish", "garbage", "not JSON"),
    ("binary", "garbage", "not JSON"),
    ("flood", "garbage", "10000 lines that are no reply, the first not JSON: 'y'"),
    ("long", "garbage", "a line that is too long"),
    ("endless", "garbage", "a line that is too long"),
    ("number", "garbage", "not an object"),
    ("no_id", "garbage", "without the id 'case-0'"),
    ("other_id", "garbage", "another id than 'case-0'"),
    ("bad_bytes", "garbage", "not JSON"),
    ("half", "garbage", "half a line"),
    ("nested", "garbage", "lists in lists, more than 32 deep"),
    ("nested_more", "garbage", "lists in lists, too deep"),
    ("unsupported", "unsupported", ""),
    ("error", "error", "no such angle \\x1b[1m"),
    ("empty", "garbage", "neither value"),
]


@pytest.mark.parametrize(("mode", "what", "told"), WANTED)
def test_every_way_to_fail_is_told(mode: str, what: str, told: str, command: str) -> None:
    (reply,), _ = ask_all(command, mode, [1], timeout=0.5 if mode == "silent" else 3.0)
    assert reply.what == what
    assert told.replace("%program", command.split()[1]) in reply.message
    assert len(reply.message) < 800


def test_only_what_answers_no_question_is_silent(command: str) -> None:
    """Garbage under the question's id is an answer; it does not make the runner lose its patience."""
    for mode, silent in (
        ("bad_bytes", False),
        ("empty", False),
        ("nested", False),
        ("number", True),
        ("dies", True),
    ):
        assert ask_all(command, mode, [1], timeout=1.0)[0][0].silent == silent, mode


def test_values_come_back(command: str) -> None:
    replies, notes = ask_all(command, "echo", [1, 2, 3])
    assert [r.value for r in replies] == [1, 2, 3]
    assert notes == ()


def test_numbers_that_are_not_finite_are_values(command: str) -> None:
    (reply,), _ = ask_all(command, "nan", [1])
    assert reply.what == "value"
    assert json.dumps(reply.value) == "[NaN, Infinity]"
    assert str(ask_all(command, "bare_nan", [1])[0][0].value) == "nan"


def test_numbers_of_hundreds_of_digits_are_finite_or_infinite(command: str) -> None:
    (reply,), _ = ask_all(command, "digits", [1])
    assert reply.value == [int("1" * 200), float("inf"), float("-inf")]


def test_half_a_surrogate_pair_can_be_written(command: str) -> None:
    (reply,), _ = ask_all(command, "surrogate", [1])
    assert str(reply.value).encode() == str({"a\\ud800": "\\udfff"}).encode()


def test_stray_lines_are_passed_over_and_told(command: str) -> None:
    replies, notes = ask_all(command, "chatty", [4, 5])
    assert [r.value for r in replies] == [4, 5]
    assert len(notes) == 1
    assert "no replies, passed over: 4, the first a reply without the id" in notes[0]


def test_a_program_that_talks_before_it_thinks_is_waited_for_the_second_time(command: str) -> None:
    """After a stray line a second is enough, until a reply came after one."""
    replies, _ = ask_all(command, "thinks", [1, 2, 3])
    assert [r.what for r in replies] == ["garbage", "value", "value"]
    assert [r.value for r in replies[1:]] == [2, 3]


def test_a_program_that_died_is_started_again(command: str) -> None:
    replies, notes = ask_all(command, "dies_once", [1, 2, 1, 3])
    assert [r.what for r in replies] == ["crash", "value", "crash", "value"]
    assert notes == ("the program was started 3 times: it ended, or hung and was stopped",)


def test_a_program_that_ends_after_each_reply_answers_all_the_same(command: str) -> None:
    replies, notes = ask_all(command, "one_shot", [1, 2, 3])
    assert [r.value for r in replies] == [1, 2, 3]
    assert "started 3 times" in notes[0]


def test_a_program_that_hangs_is_stopped_and_started_again(command: str) -> None:
    """Also where the first question hangs: the second may be slow to start, and is asked again later."""
    replies, notes = ask_all(command, "hangs_once", [2, 1, 3, 4], timeout=0.7)
    assert [r.what for r in replies] == ["value", "timeout", "value", "value"]
    assert "started 2 times" in notes[0]
    replies, _ = ask_all(command, "hangs_once", [1, 2, 3], timeout=0.7)
    assert [r.what for r in replies] == ["timeout", "timeout", "value"]


def test_a_late_answer_is_not_taken_for_the_next(command: str) -> None:
    replies, notes = ask_all(command, "late", [2, 1, 3], timeout=0.4)
    assert [r.what for r in replies] == ["value", "timeout", "value"]
    assert replies[2].value == 3
    replies, notes = ask_all(command, "slow_start", [1, 2], timeout=0.7)
    assert [r.what for r in replies] == ["timeout", "value"]
    assert replies[1].value == 2
    assert notes == ("replies that came too late: 1 (--timeout 0.7)",)


def test_a_question_that_timed_out_can_be_asked_again(command: str) -> None:
    """The late answer to the first time is not the answer to the second."""
    program = Program(f"{command} slow_start", 0.7)
    first, second = (program.ask("case", "test.f", {"x": x}) for x in (1, 2))
    program.close()
    assert (first.what, second.value) == ("timeout", 2)


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


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="process groups are of POSIX")
def test_what_a_program_starts_ends_with_it(tmp_path: Path) -> None:
    """A shell script starts a program that hangs; its child is ended, too."""
    path = tmp_path / "run.sh"
    path.write_text(f"sleep 61 & echo $! > {tmp_path}/child; read line; sleep 62; echo")
    program = Program(f"sh {path}", timeout=0.5)
    for k in range(2):
        program.ask(f"case-{k}", "test.f", {})
    program.close()
    child = int((tmp_path / "child").read_text())
    for _ in range(50):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        state = Path(f"/proc/{child}/stat")
        if state.is_file() and state.read_text().split()[2] == "Z":
            return  # ended; nobody has asked how
        time.sleep(0.1)
    pytest.fail("the child lives")


# --- what cannot be started ---------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["", "'", "/no/such/program --fast"])
def test_what_cannot_be_started_is_bad_use(command: str) -> None:
    with pytest.raises(ValueError, match="--program"):
        Program(command)


def test_a_path_with_spaces_says_how_to_quote_it(tmp_path: Path) -> None:
    path = tmp_path / "my slam" / "the adapter.py"
    path.parent.mkdir()
    path.write_text("print()")
    with pytest.raises(ValueError, match=f"quoted twice: --program \"'{path}' --fast\""):
        Program(f"{path} --fast")
    program = Program(f"{sys.executable} {path}", 20.0)
    reply = program.ask("case", "test.f", {})
    program.close()
    assert reply.what == "crash"
    assert f"quoted twice: --program \"{sys.executable} '{path}'\"" in reply.message
    assert unquoted(f"python '{path}'", ["python", str(path)]) == ""


def test_a_file_that_is_no_program_says_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "adapter.py"
    path.write_text("print()")
    with pytest.raises(ValueError, match=r"chmod \+x.*python"):
        Program(str(path))


def test_last_words_are_the_error() -> None:
    node = (
        "file:///a.mjs:3\nfoo bar\n    ^^^\n\nSyntaxError: Unexpected identifier\n    at x\n\nNode.js v20\n"
    )
    assert last_words(node) == "SyntaxError: Unexpected identifier"
    assert last_words(
        "terminate called after throwing\n  what():  no field x\n"
    ) == "what():  no field x".replace("  ", " ")
    assert last_words("loading\nready\n") == "ready"
    assert last_words("") == ""


# --- modules in the process ---------------------------------------------------------------------------


def test_a_module_is_asked_in_the_process() -> None:
    module = ModuleType("mine")

    def answer(function: str, inputs: dict[str, float]) -> object:
        if function == "test.none":
            raise NotImplementedError
        if function == "test.exit":
            sys.exit(3)
        return {1, 2} if function == "test.set" else 1.0 / inputs["x"]

    module.answer = answer  # type: ignore[attr-defined]
    asked = InProcess(module)
    assert asked.ask("1", "test.f", {"x": 2.0}) == Reply("value", 0.5, "")
    assert asked.ask("1", "test.none", {}).what == "unsupported"
    assert asked.ask("1", "test.f", {"x": 0.0}) == Reply(
        "error", None, "ZeroDivisionError: float division by zero"
    )
    assert asked.ask("1", "test.exit", {}).what == "crash"
    assert "a set is no number" in asked.ask("1", "test.set", {}).message
    with pytest.raises(ValueError, match="no function answer"):
        InProcess(ModuleType("empty"))
    with pytest.raises(ValueError, match="No module named"):
        InProcess("no_such_module_here")
