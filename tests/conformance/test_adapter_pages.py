"""The pages on adapters: their code runs, and what they say was found is in the lists."""

from __future__ import annotations

import dataclasses
import re
import sys
from pathlib import Path

import adapter_lists as lists
import pytest

from vslam_ref.conformance.conventions import Convention, read
from vslam_ref.conformance.program import Asked, InProcess, Program
from vslam_ref.conformance.runner import run

DOCS = Path(__file__).resolve().parents[2] / "docs"


def blocks(language: str) -> list[str]:
    """Code blocks of the page on adapters."""
    text = (DOCS / "adapters.md").read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def passes(program: Asked, wanted: set[str]) -> None:
    """All that is answered is right, and the wanted functions are answered."""
    try:
        report = run(program, lists.chosen(4, {"so3", "se3"}))
    finally:
        program.close()
    assert {o.case.function for o in report.outcomes if o.status == "passed"} == wanted
    assert report.passed


def test_the_pages_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = blocks("python")
    (tmp_path / "page_adapter.py").write_text(code, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    served = f"'{sys.executable}' -m vslam_ref.conformance.serve page_adapter"
    for program in (InProcess("page_adapter"), Program(served, 60.0)):
        passes(program, {"so3.exp", "se3.act"})


def test_the_pages_script_runs(tmp_path: Path) -> None:
    lists.need("node")
    (code,) = blocks("js")
    (tmp_path / "adapter.mjs").write_text(code, encoding="utf-8")
    passes(Program(f"node '{tmp_path / 'adapter.mjs'}'", 60.0), {"so3.exp"})


def test_the_pages_cpp_runs(tmp_path: Path) -> None:
    """Sections 1 to 3 and main of the adapter, with the page's function and table between."""
    lists.need("cpp")
    (code,) = blocks("cpp")
    whole = (lists.SHIPPED / "cpp" / "adapter.cpp").read_text("utf-8")
    kept = re.split(r"^// -+ \d .*$", whole, flags=re.MULTILINE)
    text = "".join(kept[:4]) + code + whole[whole.index("Json answer(const Json& request)") :]
    passes(Program(lists.compiled(text), 60.0), {"so3.exp"})


def test_the_pages_convention_is_one(tmp_path: Path) -> None:
    (code,) = blocks("json")
    (tmp_path / "mine.json").write_text(code, encoding="utf-8")
    assert read(tmp_path / "mine.json") == lists.convention("gtsam")
    text = (DOCS / "adapters.md").read_text("utf-8")
    for field in dataclasses.fields(Convention):
        assert f"| `{field.name}` | `{field.default}` |" in text


def test_what_the_page_says_was_found_is_listed() -> None:
    """Each case that the page names stands in the list of its section's adapter."""
    text = (DOCS / "what-the-vectors-found.md").read_text("utf-8")
    sections = {"OpenCV": "opencv", "SciPy": "scipy", "GTSAM": "gtsam", "filterpy": "filterpy", "evo": "evo"}
    found = 0
    for section in text.split("\n## ")[1:]:
        name = sections.get(section.split()[0])
        for line in section.splitlines():
            if name is None or not line.startswith("| "):
                continue
            adapter = f"{name}_usual" if f"`{name}_usual`" in line else name
            listed = lists.listed(adapter)
            for identity in re.findall(r"`(\w+\.\w+/[\w-]+-\d\d)`", line):
                found += 1
                assert identity in listed.exact or lists.regime(identity) in listed.within, identity
    assert found >= 30
