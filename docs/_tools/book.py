"""The book's files, and what the site shows of the table of contents in ``vslam_ref.chapters``."""

from __future__ import annotations

from pathlib import Path

from vslam_ref.chapters import CHAPTERS

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = DOCS / "chapters"
NOTEBOOKS = ROOT / "notebooks"
PACKAGE = ROOT / "vslam_ref"


def pages() -> list[Path]:
    """All chapter pages, in the order of their numbers."""
    return sorted(PAGES.glob("[0-9][0-9]_*.md"))


def toctrees() -> str:
    """One MyST toctree for every part of the book that has a page."""
    parts: dict[str, list[str]] = {}
    for chapter in CHAPTERS:
        if chapter.page:
            parts.setdefault(chapter.part, []).append(f"chapters/{chapter.page}")
    blocks = []
    for part, names in parts.items():
        listing = "\n".join(names)
        blocks.append(f"```{{toctree}}\n:caption: {part}\n:maxdepth: 1\n\n{listing}\n```\n")
    return "\n".join(blocks)


def chapter_table() -> str:
    """The whole table of contents as a Markdown table, pages linked, planned chapters named."""
    words = {"here": "here", "code": "code only", "planned": "planned"}
    lines = ["| | chapter | part | room of `vslam_ref` | state |", "|---|---|---|---|---|"]
    for chapter in CHAPTERS:
        title = f"{{doc}}`{chapter.title} <chapters/{chapter.page}>`" if chapter.page else chapter.title
        lines.append(
            f"| {chapter.number:02d} | {title} | {chapter.part} | `{chapter.room}` | {words[chapter.state]} |"
        )
    return "\n".join(lines) + "\n"
