"""``vslam-ref verify`` and ``vectors``: status, keys, page, and one clear line for bad use."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from vslam_ref.cli import main

KEYS = {
    *("program", "cases", "passed", "failed", "unsupported", "errors"),
    *("by_chapter", "first_failure", "diagnoses", "seconds"),
}
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


BAD = [
    (["--program", "/no/such/adapter"], "No such file"),
    (["--module", "no_such_module_here"], "no_such_module_here"),
    (["--self", "--chapter", "13"], "no vectors of that chapter"),
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
