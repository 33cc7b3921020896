"""``vslam-ref verify`` and ``vectors``: status, keys, page, and one clear line for bad use."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vslam_ref.cli import main

KEYS = {
    *("program", "cases", "passed", "failed", "unsupported", "errors", "digits_lost", "not_asked", "stopped"),
    *("by_chapter", "first_failure", "diagnoses", "unexplained", "functions", "failures", "lost", "seconds"),
}
Verify = Callable[..., tuple[int, dict[str, Any], str]]
PROGRAM = """
import json, sys
import numpy as np
sign = float(sys.argv[1])
for line in sys.stdin:
    ask = json.loads(line)
    reply = {"id": ask["id"]}
    if ask["function"] == "so2.exp":
        a = sign * ask["inputs"]["angle"]
        reply["value"] = {"R": [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]}
    else:
        reply["unsupported"] = True
    print(json.dumps(reply), flush=True)
"""


@pytest.fixture
def program(tmp_path: Path) -> str:
    path = tmp_path / "adapter.py"
    path.write_text(PROGRAM)
    return f"{sys.executable} {path}"


def test_the_library_verifies_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = tmp_path / "numbers.json"
    assert main(["verify", "--self", "--topic", "so2", "--json", str(told)]) == 0
    numbers = json.loads(told.read_text())
    assert set(numbers) == KEYS | {"versions", "notes"}
    assert numbers["passed"] == numbers["cases"] > 50
    assert numbers["first_failure"] is None
    assert numbers["by_chapter"]["02"]["passed"] == numbers["passed"]
    assert "all" in capsys.readouterr().out


def test_a_right_program_passes_and_a_wrong_one_is_told_why(
    program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["verify", "--topic", "so2"]
    assert main([*words, "--program", f"{program} 1"]) == 0
    capsys.readouterr()
    told, page = tmp_path / "numbers.json", tmp_path / "page.html"
    wrong = [*words, "--program", f"{program} -1", "--json", str(told), "--report", str(page)]
    assert main(wrong) == 1
    numbers = json.loads(told.read_text())
    assert numbers["failed"] > 0
    assert numbers["first_failure"]["function"] == "so2.exp"
    assert numbers["diagnoses"][0]["function"] == "so2.exp"
    assert numbers["diagnoses"][0]["cause"] in capsys.readouterr().out
    assert numbers["first_failure"]["id"] in page.read_text()


def test_one_case_can_be_asked(program: str) -> None:
    assert main(["verify", "--program", f"{program} 1", "--case", "so2.exp/generic-01"]) == 0
    assert main(["verify", "--program", f"{program} -1", "--case", "so2.exp/generic-01"]) == 1


def test_a_program_that_answers_nothing_is_not_verified(program: str) -> None:
    assert main(["verify", "--program", f"{program} 1", "--topic", "loss"]) == 1


MODULE = """
import os, sys, time
import numpy as np
print("printed")
def answer(function, inputs):
    a, mode = inputs.get("angle", 0.0), os.environ["MODE"]
    if function != "so2.exp": raise NotImplementedError
    if mode == "hangs" and abs(a) > 1.0: time.sleep(60)
    if mode == "crashes" and abs(a) > 1.0: os.abort()
    if mode == "nan": return float("nan")
    os.write(1, b"native\\n")
    print("asked with", a, file=sys.stderr)
    return [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Verify:
    """Verify a module by its bare name, in the folder it lies in; the status, the numbers, the page."""
    (tmp_path / "mine.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)

    def verify(mode: str, *words: str) -> tuple[int, dict[str, Any], str]:
        monkeypatch.setenv("MODE", mode)
        out = ["--json", "numbers.json", "--report", "page.html", "--topic", "so2", *words]
        status = main(["verify", "--module", "mine", *out])
        return status, json.loads(Path("numbers.json").read_text()), Path("page.html").read_text()

    return verify


def test_a_module_is_found_where_one_stands_and_may_print(module: Verify) -> None:
    status, numbers, _ = module("right")
    assert (status, numbers["failed"], numbers["errors"], numbers["notes"]) == (0, 0, 0, [])
    assert numbers["passed"] > 30


def test_a_module_that_hangs_in_some_cases_is_asked_the_others(module: Verify) -> None:
    status, numbers, page = module("hangs", "--timeout", "0.4")
    assert status == 1
    told = {f["answered"] for f in numbers["failures"]}
    assert told == {"timeout: no reply within 0.4 s"}
    assert numbers["passed"] > 10
    assert "given up: silent 5 times in a row" in numbers["stopped"]
    assert numbers["not_asked"] > 0
    assert "were not asked" in page


def test_a_module_that_crashes_is_a_result(module: Verify, capsys: pytest.CaptureFixture[str]) -> None:
    status, numbers, page = module("crashes")
    assert status == 1
    assert "SIGABRT" in numbers["failures"][0]["answered"]
    assert "SIGABRT" in page
    assert numbers["passed"] > 10
    assert "next: " in capsys.readouterr().out


def test_nan_is_a_result(module: Verify) -> None:
    status, numbers, _ = module("nan")
    assert status == 1
    assert {str(f["answered"]) for f in numbers["failures"]} == {"{'R': 'nan'}"}
    assert all(f["error"] is None for f in numbers["failures"])


def test_a_single_case_shows_what_the_program_prints(
    module: Verify, capfd: pytest.CaptureFixture[str]
) -> None:
    module("right")
    assert "asked with" not in capfd.readouterr().err
    main(["verify", "--module", "mine", "--case", "so2.exp/generic-01"])
    error = capfd.readouterr().err
    assert "printed" in error
    assert error.count("asked with") == 1


def test_functions_can_be_chosen_and_add_up(module: Verify, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["verify", "--self", "--json", "numbers.json"]
    counts = []
    for choice in (
        ["--function", "so3.exp"],
        ["--topic", "so2"],
        ["--function", "so3.exp", "--topic", "so2"],
    ):
        assert main([*words, *choice]) == 0
        counts.append(json.loads(Path("numbers.json").read_text())["cases"])
    assert counts[0] + counts[1] == counts[2]
    capsys.readouterr()


def test_strict_counts_lost_digits_as_failures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A case whose tolerance allows lost digits, answered to nine digits."""
    from vslam_ref.conformance import selection, vectors_format

    rule = {"relative": 1e-12, "absolute": 0.0, "reason": "rounding"}
    rule["lost_digits"] = {"relative": 1e-6, "absolute": 0.0, "reason": "an arc cosine"}
    rule["float32"] = {"relative": 1e-4, "absolute": 0.0}
    case = {
        "id": "so2.exp/generic-01",
        "inputs": {"angle": 0.0},
        "expected": {"R": [[1.0, 1e-9], [0.0, 1.0]]},
    }
    group = {"function": "so2.exp", "equation": "eq-x", "oracle": "by hand", "flags": [], "tolerance": rule}
    content = {
        "chapter": 2,
        "topic": "so2",
        "version": "0",
        "notes": {},
        "groups": [{**group, "cases": [case]}],
    }
    file = vectors_format.parse("02/so2.json", content)
    monkeypatch.setattr(selection, "load", lambda name: file)
    monkeypatch.setattr(selection, "names", lambda: ["02/so2.json"])
    told = tmp_path / "numbers.json"
    assert main(["verify", "--self", "--json", str(told)]) == 0
    assert json.loads(told.read_text())["digits_lost"] == 1
    assert main(["verify", "--self", "--strict"]) == 1


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_writes_what_was_found(sent: signal.Signals, tmp_path: Path) -> None:
    """Ctrl-C while the program thinks about its third question."""
    path = tmp_path / "slow.py"
    path.write_text(
        "import json, sys, time\n"
        "for n, line in enumerate(sys.stdin):\n"
        "    if n == 2: open('here', 'w').close(); time.sleep(60)\n"
        "    print(json.dumps({'id': json.loads(line)['id'], 'unsupported': True}), flush=True)\n"
    )
    words = ["verify", "--program", f"{sys.executable} {path}", "--topic", "so2", "--timeout", "60"]
    words += ["--json", "numbers.json", "--report", "page.html"]
    command = [sys.executable, "-c", "import sys; from vslam_ref.cli import main; sys.exit(main())", *words]
    done = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    for _ in range(600):
        if (tmp_path / "here").exists():
            break
        time.sleep(0.1)
    done.send_signal(sent)
    out, error = done.communicate(timeout=60)
    assert done.returncode == 130, error
    assert error == ""
    numbers = json.loads((tmp_path / "numbers.json").read_text())
    assert (numbers["cases"], numbers["unsupported"], numbers["stopped"]) == (2, 2, "interrupted")
    assert f"not asked: {numbers['not_asked']} cases more: interrupted" in out
    assert "(interrupted)" in (tmp_path / "page.html").read_text()


BAD = [
    (["--self", "--function", "so3.epx"], "did you mean so3.exp"),
    (["--module", "no_such_file.py"], "no such file: no_such_file.py"),
    (["--program", "/no/such/adapter"], "No such file"),
    (["--module", "no_such_module_here"], "no_such_module_here"),
    (["--self", "--chapter", "18"], "no vectors of that chapter"),
    (["--self", "--topic", "so4"], "no vectors of that chapter or topic"),
    (["--self", "--case", "so3.exp/none-01"], "no case 'so3.exp/none-01'"),
    (["--self", "--timeout", "0"], "--timeout 0"),
    (["--self", "--convention", "none.json"], "none.json"),
    (["--self", "--report", "no_folder/page.html"], "no_folder"),
    ([], "one of the arguments"),
]


@pytest.mark.parametrize(("words", "told"), BAD)
def test_bad_use_is_one_line(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", *words]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1


def test_vectors_are_listed_and_checked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["vectors", "list", "--topic", "so2"]) == 0
    assert "so2.exp" in capsys.readouterr().out
    assert main(["vectors", "check"]) == 0
    assert "0 remarks" in capsys.readouterr().out


def test_there_are_enough_cases() -> None:
    """At least 1500, at most 20 of a regime counted."""
    from vslam_ref.conformance.vectors_format import counted, load, names

    assert sum(counted(load(name).cases) for name in names()) >= 1500


def test_help_says_how_a_module_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["verify", "--help"])
    shown = capsys.readouterr().out
    for words in (
        "def answer(function, inputs)",
        "NotImplementedError",
        "add up",
        "--strict",
        "quoted twice",
    ):
        assert words in shown
