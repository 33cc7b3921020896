"""Every erratum on the page names a test that exists, or the chapter that will bring it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from vslam_ref.chapters import CHAPTERS

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8")
ENTRIES = re.findall(r"^### (.+?)\n(.*?)(?=^##|\Z)", PAGE, re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")


def test_errata_of_both_documents_are_listed() -> None:
    told = " ".join(title for title, _ in ENTRIES)
    for item in ("B18", "B26", "B17", "B19", "B6", "B10", "B16", "B20", "B22", "B figures 2-4", "B29"):
        assert item in told, item
    for item in ("A1.4", "A2.1", "A2.5", "A2.8", "A2.9", "2.2.2", "3.1", "4.2", "4.3"):
        assert item in told, item


@pytest.mark.parametrize(("title", "body"), ENTRIES, ids=[title for title, _ in ENTRIES])
def test_an_erratum_shows_print_correction_and_test(title: str, body: str) -> None:
    assert re.search(r"^Printed:", body, re.MULTILINE)
    assert re.search(r"^Right:", body, re.MULTILINE)
    (line,) = re.findall(r"^Test: (.+?)(?:\n\n|\Z)", body, re.MULTILINE | re.DOTALL)
    if line.startswith("none, "):
        return
    named = NAMED.findall(line)
    planned = re.match(r"comes with chapter (\d\d)\.", line)
    assert named or planned, line
    for path, name in named:
        source = (ROOT / path).read_text(encoding="utf-8")
        assert re.search(rf"^\s*def {name}\(", source, re.MULTILINE), f"{path}::{name}"
    if planned:
        assert int(planned[1]) in planned_chapters(), f"chapter {planned[1]} is here: name its test"


def planned_chapters() -> set[int]:
    """Chapters without a page: only these may still owe a test."""
    return {chapter.number for chapter in CHAPTERS if not chapter.page}
