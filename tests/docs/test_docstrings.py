"""The check of docstrings finds what is missing, and lets pass what is there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

HEAD = '"""Module."""\n\n'
FUNCTION = '''def f({given}) -> Array:
    """Do it{words}."""
    return {body}
'''


@pytest.fixture
def tool(
    book_tool: Callable[[str], ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> ModuleType:
    """The check, working on a package of one module in a folder of its own."""
    module = book_tool("docstrings")
    (tmp_path / "vslam_ref" / "geometry").mkdir(parents=True)
    monkeypatch.setattr(module.book, "PACKAGE", tmp_path / "vslam_ref")
    monkeypatch.setattr(module, "KNOWN", tmp_path / "known.txt")
    monkeypatch.setattr(module, "EXCEPTIONS", tmp_path / "exceptions.txt")
    monkeypatch.setattr(module, "_sections", lambda name: [])
    return module


def kinds(tool: ModuleType, source: str) -> set[str]:
    (tool.book.PACKAGE / "geometry" / "code.py").write_text(HEAD + source, encoding="utf-8")
    return {kind for kind, _ in tool.misses()}


@pytest.mark.parametrize(
    ("given", "words", "body", "missing"),
    [
        ("x: Array", "", "x", {"shape", "unit"}),
        ("x: Array", " to ``x (N, 2)``", "x", {"unit"}),
        ("x: Array", " to points (..., 3) in metres", "x", set()),
        ("x: Array, y: Array", " to points (..., 3) in metres", "x", {"shape"}),
        ("x: Array", " to x (N,) in metres", "x * x + x / 2 - x", {"equation"}),
        ("x: Array", " to x (N,), no unit.\n\n    Implements :eq:`eq-b4` (B4)", "x * x + x / 2 - x", set()),
        ("x: Array", " to x (N,) in pixels", "x * x + x / 2 - x  # eq-gain", set()),
    ],
)
def test_what_is_missing_is_found(
    tool: ModuleType, given: str, words: str, body: str, missing: set[str]
) -> None:
    assert kinds(tool, FUNCTION.format(given=given, words=words, body=body)) == missing


def test_the_list_of_known_misses_only_becomes_shorter(tool: ModuleType) -> None:
    bad = FUNCTION.format(given="x: Array", words="", body="x")
    assert kinds(tool, bad) == {"shape", "unit"}
    assert tool.main(["--check"]) == 1  # new
    assert tool.main(["--write"]) == 0
    assert tool.main(["--check"]) == 0  # known
    assert kinds(tool, bad.replace("Do it", "Do it to x (N,)")) == {"unit"}
    assert tool.main(["--check"]) == 1  # one is mended, and still on the list
    tool.EXCEPTIONS.write_text("unit vslam_ref.geometry.code.f\n", encoding="utf-8")
    tool.main(["--write"])
    assert tool.main(["--check"]) == 1  # an exception without a reason
    tool.EXCEPTIONS.write_text("unit vslam_ref.geometry.code.f bare numbers\n", encoding="utf-8")
    assert tool.main(["--check"]) == 0
