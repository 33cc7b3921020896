"""Pages are read in a column: cells of at most 76 characters, few imports before the first picture."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGES = sorted((Path(__file__).resolve().parents[2] / "docs" / "chapters").glob("[0-9]*.md"))
CELL = re.compile(r"```\{code-cell\}[^\n]*\n(.*?)```", re.DOTALL)
WIDTH, IMPORTS = 76, 8


def cells(page: Path) -> list[str]:
    return CELL.findall(page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_code_cells_fit_the_column(page: Path) -> None:
    wide = [line for cell in cells(page) for line in cell.splitlines() if len(line) > WIDTH]
    assert not wide, f"lines of more than {WIDTH} characters scroll sideways on the page: {wide}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_first_cell_has_few_imports(page: Path) -> None:
    lines = [line for line in cells(page)[0].splitlines() if line.startswith(("import ", "from "))]
    assert 1 <= len(lines) <= IMPORTS, lines
