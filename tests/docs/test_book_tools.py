"""The book's tools: equation numbers, docstring escapes, notebooks that are the same bytes every time."""

from __future__ import annotations

import doctest
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

PAGE = """---
jupytext:
  text_representation:
    extension: .md
    format_name: myst
kernelspec:
  name: python3
  display_name: Python 3
---

# 99 · A page

```{code-cell} ipython3
:tags: [hide-input]
import sys
print("shown", flush=True)
print("noise", file=sys.stderr, flush=True)
print("later")
object()
```
"""


def test_the_examples_of_the_sphinx_extension_hold(book_tool: Callable[[str], ModuleType]) -> None:
    pytest.importorskip("sphinx", reason="Sphinx comes with the docs extra")
    result = doctest.testmod(book_tool("house_sphinx"))
    assert result.attempted >= 5
    assert result.failed == 0


@pytest.fixture
def workshop(
    book_tool: Callable[[str], ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> ModuleType:
    """The notebook tool, working on a book of one page in a folder of its own."""
    pytest.importorskip("jupytext", reason="jupytext comes with the docs extra")
    pytest.importorskip("nbclient", reason="nbclient comes with the docs extra")
    tool = book_tool("notebooks")
    (tmp_path / "chapters").mkdir()
    (tmp_path / "chapters" / "99_page.md").write_text(PAGE, encoding="utf-8")
    monkeypatch.setattr(tool.book, "PAGES", tmp_path / "chapters")
    monkeypatch.setattr(tool.book, "NOTEBOOKS", tmp_path / "notebooks")
    return tool


def test_a_notebook_is_deterministic_tidy_and_in_step(workshop, tmp_path: Path, capsys) -> None:  # type: ignore[no-untyped-def]
    stored = tmp_path / "notebooks" / "99_page.ipynb"
    page = tmp_path / "chapters" / "99_page.md"
    assert workshop.main(["--check"]) == 1  # no notebook yet
    assert workshop.main(["--write"]) == 0
    first = stored.read_bytes()
    assert workshop.main(["--write"]) == 0
    assert stored.read_bytes() == first
    assert workshop.main(["--check"]) == 0

    text = first.decode()
    assert '"shown\\n",' in text
    assert text.count('"name": "stdout"') == 1  # though it was printed in two pieces
    assert "<object>" in text  # without its address
    assert '"name": "stderr"' not in text  # what went there is told to the maker instead
    assert "left out of the notebook: noise" in capsys.readouterr().err
    assert "iopub" not in text  # no times
    assert str(tmp_path) not in text

    page.write_text(PAGE.replace('"shown"', '"changed"'), encoding="utf-8")
    assert workshop.main(["--check"]) == 1
    page.write_text(PAGE, encoding="utf-8")
    (tmp_path / "notebooks" / "98_orphan.ipynb").write_bytes(first)
    assert workshop.main(["--check"]) == 1


def test_a_page_that_fails_is_reported(workshop, tmp_path: Path, capsys) -> None:  # type: ignore[no-untyped-def]
    page = tmp_path / "chapters" / "99_page.md"
    page.write_text(PAGE.replace("object()", "assert 1 + 1 == 3, 'the claim fails'"), encoding="utf-8")
    assert workshop.main(["--check", "--execute"]) == 1
    assert "the claim fails" in capsys.readouterr().err


def test_a_notebook_shows_the_code_that_its_page_includes(workshop, tmp_path: Path, capsys) -> None:  # type: ignore[no-untyped-def]
    """A changed file puts the notebook out of step, as a changed page does."""
    page, code = tmp_path / "chapters" / "99_page.md", tmp_path / "book.py"
    include = "\n```{literalinclude} ../book.py\n:language: python\n:pyobject: second\n```\n"
    page.write_text(PAGE + include, encoding="utf-8")
    assert workshop.main(["--write"]) == 1
    assert "includes ../book.py, which is no file" in capsys.readouterr().err
    code.write_text("first = 1\n\n\ndef second():\n    return 2\n", encoding="utf-8")
    (cell,) = [c for c in workshop.from_page(page).cells if "second" in c.source]
    assert cell.source.endswith("```python\ndef second():\n    return 2\n```")
    assert workshop.main(["--write"]) == 0
    assert workshop.main(["--check"]) == 0
    code.write_text("def second():\n    return 3\n", encoding="utf-8")
    assert workshop.main(["--check"]) == 1
