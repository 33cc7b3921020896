"""The pages on adapters: their code is compiled and runs, and what they say was found is in the lists.

Each recipe is followed as the page tells it: the named sections are kept, the page's code stands in place of
the others, and nothing else is added.
"""

from __future__ import annotations

import dataclasses
import json
import re
import shlex
import sys
from pathlib import Path

import adapter_lists as lists
import pytest

from vslam_ref.cli import main
from vslam_ref.conformance.conventions import Convention, read
from vslam_ref.conformance.program import Asked, InProcess, ModuleProgram, Program
from vslam_ref.conformance.runner import run

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "adapters.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    """Code blocks of the page on adapters."""
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def sections(name: str, comment: str) -> dict[int, str]:
    """Sections of a shipped file by the number in their heading; 0 is what stands before the first."""
    text = (lists.SHIPPED / name).read_text("utf-8")
    parts = re.split(rf"^{comment} -+ (\d+) .*\n", text, flags=re.MULTILINE)
    return {0: parts[0], **{int(n): part for n, part in zip(parts[1::2], parts[2::2], strict=True)}}


def passes(program: Asked, wanted: set[str]) -> None:
    """All that is answered is right, and the wanted functions are answered."""
    try:
        report = run(program, lists.chosen(4, {"so3", "se3"}))
    finally:
        program.close()
    assert {o.case.function for o in report.outcomes if o.status == "passed"} == wanted
    assert report.passed
    assert report.notes == ()


def test_the_pages_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = blocks("python")
    (tmp_path / "my_adapter.py").write_text(code, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    served = f"'{sys.executable}' -m vslam_ref.conformance.serve my_adapter.py"
    for program in (InProcess("my_adapter"), ModuleProgram("my_adapter.py"), Program(served, 60.0)):
        passes(program, {"so3.exp", "se3.act"})


def test_the_pages_script_runs(tmp_path: Path) -> None:
    lists.need("node")
    (code,) = blocks("js")
    (tmp_path / "adapter.mjs").write_text(code, encoding="utf-8")
    passes(Program(f"node '{tmp_path / 'adapter.mjs'}'", 60.0), {"so3.exp"})


def test_the_pages_cpp_runs() -> None:
    """Sections 1 to 3 and 10 are kept, the page's function and table stand between."""
    lists.need("cpp")
    assert "Keep the sections 1 to 3" in PAGE
    assert "and 10 (the" in PAGE
    (code,) = blocks("cpp")
    kept = sections("cpp/adapter.cpp", "//")
    assert sorted(kept) == list(range(11))
    passes(
        Program(lists.compiled("".join([*(kept[k] for k in range(4)), code, kept[10]])), 60.0), {"so3.exp"}
    )


def test_the_pages_rust_runs() -> None:
    lists.need("rust")
    (code,) = blocks("rust")
    kept = sections("rust/adapter.rs", "//")
    text = "".join([kept[0], code, kept[3].replace("    #[allow(dead_code)]\n", ""), kept[4]])
    passes(Program(lists.compiled_rust(f"#![allow(dead_code)]\n{text}"), 60.0), {"so3.exp"})


def test_the_pages_octave_runs() -> None:
    lists.need("octave")
    (code,) = blocks("matlab")
    kept = sections("octave/adapter.m", "%")
    passes(lists.octave(kept[0] + code + kept[3]), {"so3.exp"})


def test_the_pages_command_lines_can_be_read() -> None:
    """Every line with vslam-ref names options that exist."""
    lines = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("vslam-ref")]
    assert len(lines) == 7
    from vslam_ref.cli import build_parser

    for line in lines:
        build_parser().parse_args(shlex.split(line, comments=True)[1:])


def test_the_pages_keys_are_those_of_the_json(tmp_path: Path) -> None:
    """The table of keys names each key of --json, and the fields of its rows."""
    target = tmp_path / "numbers.json"
    main(["verify", "--self", "--function", "so2.exp", "--json", str(target)])
    told = set(
        re.findall(r"`(\w+)`", PAGE[PAGE.index("| key | what |") : PAGE.index("Choose what is asked")])
    )
    numbers = json.loads(target.read_text())
    assert set(numbers) - told == {"program", "seconds", "versions"}
    assert f"`{', '.join(numbers['functions'][0])}`" in PAGE


def test_the_pages_convention_is_one(tmp_path: Path) -> None:
    (code,) = blocks("json")
    (tmp_path / "mine.json").write_text(code, encoding="utf-8")
    assert read(tmp_path / "mine.json") == lists.convention("gtsam")
    for field in dataclasses.fields(Convention):
        assert f"| `{field.name}` | `{field.default}` |" in PAGE


def test_what_the_page_says_was_found_is_listed() -> None:
    """Each case that the page names stands in the list of its section's adapter."""
    text = (DOCS / "what-the-vectors-found.md").read_text("utf-8")
    names = {"OpenCV": "opencv", "SciPy": "scipy", "GTSAM": "gtsam", "filterpy": "filterpy", "evo": "evo"}
    found = 0
    for section in text.split("\n## ")[1:]:
        name = names.get(section.split()[0])
        for line in section.splitlines():
            if name is None or not line.startswith("| "):
                continue
            adapter = f"{name}_usual" if f"`{name}_usual`" in line else name
            listed = lists.listed(adapter)
            for identity in re.findall(r"`(\w+\.\w+/[\w-]+-\d\d)`", line):
                found += 1
                assert identity in listed.exact or lists.regime(identity) in listed.within, identity
    assert found >= 30
