"""A Python module in a process of its own: whatever it does is a result, and it is found where one stands."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from vslam_ref.conformance.loading import load_module
from vslam_ref.conformance.program import ModuleProgram, Reply

MODULE = """
import ctypes, os, sys, time
import numpy as np

print("printed while it is imported")
os.write(1, b"by the system, too\\n")


class Odd(Exception):
    def __str__(self):
        raise RuntimeError


def deep(n):
    x = 1.0
    for _ in range(n):
        x = [x]
    return x


def answer(function, inputs):
    x = inputs.get("x", 0)
    name = function.partition(".")[2]
    if name == "echo": return x
    if name == "array": return {"R": np.eye(2), "n": np.float32(0.5), "t": (1, True)}
    if name == "none": raise NotImplementedError
    if name == "refuses": raise ValueError("behind the\\ncamera \\ud800")
    if name == "odd": raise Odd
    if name == "prints": print("hello"); os.write(1, b"native\\n"); return x
    if name == "reads": return input()
    if name == "exits": sys.exit(4)
    if name == "exits_hard": os._exit(5)
    if name == "interrupts": raise KeyboardInterrupt
    if name == "aborts": os.abort()
    if name == "segfaults": ctypes.string_at(0)
    if name == "hangs": time.sleep(60)
    if name == "compiles":
        answer.slow = getattr(answer, "slow", 0) + 1
        if answer.slow == 1: time.sleep(3.0)
        return x
    if name == "spins":
        while True: pass
    if name == "recurses": return answer(function, inputs)
    if name == "set": return {1, 2}
    if name == "complex": return np.eye(2) * 1j
    if name == "deep": return deep(600)
    if name == "deeper": return deep(100_000)
    if name == "itself": y = []; y.append(y); return y
    if name == "huge": return [10**400, -(10**5000)]
    if name == "nan": return float("nan")
    if name == "surrogate": return {"R\\ud800": 1}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("with a blank")
    (path / "odd_module.py").write_text(MODULE)
    return path


@pytest.fixture(scope="module")
def module(folder: Path):  # type: ignore[no-untyped-def]
    program = ModuleProgram(str(folder / "odd_module.py"), 2.0)
    yield program
    program.close()


GOOD = [
    ("echo", [1, 2.5, "a"]),
    ("array", {"R": [[1.0, 0.0], [0.0, 1.0]], "n": 0.5, "t": [1, True]}),
    ("prints", [1, 2.5, "a"]),
    ("huge", [float("inf"), float("-inf")]),
    ("surrogate", {"R\\ud800": 1}),
]
BAD = [
    ("refuses", "error", "ValueError: behind the camera \\ud800"),
    ("odd", "error", "Odd: "),
    ("reads", "error", "EOFError"),
    ("recurses", "error", "RecursionError"),
    ("exits", "garbage", "it wants to end the program: SystemExit: 4"),
    ("interrupts", "garbage", "it wants to end the program: KeyboardInterrupt"),
    ("set", "garbage", "a set is no number"),
    ("complex", "garbage", "a complex is no number"),
    ("deep", "garbage", "more than 32 deep"),
    ("deeper", "garbage", "more than 32 deep"),
    ("itself", "garbage", "more than 32 deep"),
    ("exits_hard", "crash", "ended with status 5"),
    ("aborts", "crash", "SIGABRT: Fatal Python error: Aborted"),
    ("segfaults", "crash", "SIGSEGV: Fatal Python error: Segmentation fault"),
    ("hangs", "timeout", "no reply within 2 s"),
    ("spins", "timeout", "no reply within 2 s"),
]


@pytest.mark.parametrize(("name", "value"), GOOD)
def test_values_come_back(name: str, value: object, module: ModuleProgram) -> None:
    assert module.ask("1", f"test.{name}", {"x": [1, 2.5, "a"]}) == Reply("value", value, "")


@pytest.mark.parametrize(("name", "what", "told"), BAD)
def test_every_way_to_fail_is_told_and_the_next_question_is_answered(
    name: str, what: str, told: str, module: ModuleProgram
) -> None:
    reply = module.ask("1", f"test.{name}", {})
    assert reply.what == what
    assert told in reply.message
    assert module.ask("2", "test.echo", {"x": 3}) == Reply("value", 3, "")


def test_other_kinds_of_replies(module: ModuleProgram) -> None:
    assert module.ask("1", "test.none", {}) == Reply("unsupported", None, "")
    assert str(module.ask("1", "test.nan", {}).value) == "nan"
    assert not [note for note in module.notes if "standard output" in note]


def test_what_is_slow_once_is_not_stopped_for_it(folder: Path) -> None:
    """A first call that compiles for longer than the timeout; its late reply is passed over."""
    program = ModuleProgram(str(folder / "odd_module.py"), 2.0)
    replies = [program.ask(str(x), "test.compiles", {"x": x}) for x in (1, 2, 3)]
    notes = program.notes
    program.close()
    assert [r.what for r in replies] == ["timeout", "value", "value"]
    assert [r.value for r in replies[1:]] == [2, 3]
    assert notes == ("replies that came too late: 1 (--timeout 2)",)


# --- what cannot be imported --------------------------------------------------------------------------


IMPORTS = [
    ("x = = 1", r"SyntaxError: invalid syntax \(bad.py, line 1\)"),
    ("import sys\nsys.exit(3)", r"SystemExit: 3 \(bad.py, line 2\)"),
    ("import no_such_thing", r"ModuleNotFoundError: No module named 'no_such_thing' \(bad.py, line 1\)"),
    ("1 / 0", r"ZeroDivisionError: division by zero \(bad.py, line 1\)"),
    ("import os\nos.abort()", "the process that imports it was ended by the signal SIGABRT"),
    ("answer = 3", "no function answer"),
    ("x = 1", "no function answer"),
    ("\x00", "SyntaxError|ValueError"),
]


@pytest.mark.parametrize(("text", "told"), IMPORTS)
def test_a_module_that_cannot_be_imported_is_bad_use(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.py"
    path.write_text(text)
    with pytest.raises(ValueError, match=told) as caught:
        ModuleProgram(str(path))
    assert "--module" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_not_there_is_told() -> None:
    with pytest.raises(ValueError, match=r"no such file: nothing_here\.py"):
        ModuleProgram("nothing_here.py")
    with pytest.raises(ValueError, match="No module named 'nothing_here'"):
        ModuleProgram("nothing_here")


# --- where a module is found --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mine", "mine.py", "package.adapter", "package/adapter.py"])
def test_a_module_is_found_in_the_folder_one_stands_in(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also beside what it imports from its own folder."""
    (tmp_path / "package").mkdir()
    for place in (tmp_path / "mine.py", tmp_path / "package" / "adapter.py"):
        place.write_text("import beside_it\ndef answer(function, inputs): return beside_it.VALUE")
        (place.parent / "beside_it.py").write_text("VALUE = 7")
    monkeypatch.chdir(tmp_path)
    program = ModuleProgram(name, 20.0)
    value = program.ask("1", "test.f", {}).value
    program.close()
    assert value == 7


def test_a_file_comes_before_an_installed_module_of_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what else lies in the folder does not stand in for the library's modules."""
    (tmp_path / "statistics.py").write_text("def answer(function, inputs): return 8")
    (tmp_path / "json.py").write_text("raise ValueError('the wrong json')")
    monkeypatch.chdir(tmp_path)
    program = ModuleProgram("statistics", 20.0)
    value = program.ask("1", "test.f", {}).value
    program.close()
    assert value == 8


def test_loading_a_file_replaces_no_module(tmp_path: Path) -> None:
    import fractions

    path = tmp_path / "fractions.py"
    path.write_text("HERE = 1")
    assert load_module(str(path)).HERE == 1
    assert sys.modules["fractions"] is fractions
    sys.path.remove(str(tmp_path))
