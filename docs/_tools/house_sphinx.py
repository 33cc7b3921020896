"""Sphinx extension of the book: equation numbers that say where an equation comes from.

* An equation labelled ``eq-b16`` is shown as (B16), ``eq-a2-8`` as (A2.8): the number that the seed
  document printed. A suffix is kept as a word: ``eq-b18-printed`` is (B18 printed).
* Any other label gets the chapter's number and a counter: (16.3).
* A docstring may say ``|x|`` and ``(*shape, 3)`` in plain words; the markup that these would be is escaped.
* ``{{ chapter_table }}``, ``{{ toctrees }}`` and ``{{ picture }}`` on the landing page are filled in.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import book
from sphinx.application import Sphinx
from sphinx.domains.math import MathDomain

# What keeps its meaning in a docstring: bullets, literals, roles, links, emphasis, what is escaped already.
MARKUP = re.compile(
    r"(^\s*\* |``.+?``|`[^`]+`_?|\*{1,2}\w(?:[^*\n]*\w)?\*{1,2}(?![\w*])|\\.)",
)
SEED_LABEL = re.compile(r"eq-(?P<seed>[ab])(?P<number>\d+(?:-\d+)?)(?:-(?P<suffix>[a-z-]+))?$")
CHAPTER_PAGE = re.compile(r"chapters/0?(\d+)_")


def equation_number(label: str, docname: str, serial: int) -> str:
    """Return the number that is shown for an equation label.

    >>> equation_number("eq-b16", "chapters/16_iekf", 3)
    'B16'
    >>> equation_number("eq-a2-8-corrected", "errata", 1)
    'A2.8 corrected'
    >>> equation_number("eq-gain", "chapters/15_ekf_slam", 4)
    '15.4'
    >>> equation_number("eq-order", "conventions", 2)
    '2'
    """
    if match := SEED_LABEL.match(label):
        number = match["seed"].upper() + match["number"].replace("-", ".")
        return f"{number} {match['suffix'].replace('-', ' ')}" if match["suffix"] else number
    page = CHAPTER_PAGE.match(docname)
    return f"{page[1]}.{serial}" if page else str(serial)


class BookMathDomain(MathDomain):
    """The math domain with the book's equation numbers."""

    def note_equation(self, docname: str, labelid: str, location: Any = None) -> None:
        """Register an equation, as Sphinx does, then give it its number."""
        super().note_equation(docname, labelid, location)
        serial = self.equations[labelid][1]
        shown: Any = equation_number(labelid, docname, serial)
        self.equations[labelid] = (docname, shown)


def fill_in(app: Sphinx, docname: str, source: list[str]) -> None:
    """Fill the landing page's marks."""
    if docname != "index":
        return
    picture = Path("_static/iekf-fig2.png")
    shown = f"![Figure 2 of the IEKF-SLAM paper, drawn again by this project]({picture})"
    marks = {
        "{{ chapter_table }}": book.chapter_table(),
        "{{ toctrees }}": book.toctrees(),
        "{{ picture }}": shown if (book.DOCS / picture).is_file() else "",
    }
    for mark, text in marks.items():
        source[0] = source[0].replace(mark, text)


def escape_plain(line: str) -> str:
    r"""Escape bars and lone asterisks of a docstring line.

    >>> print(escape_plain("|phi| < pi, shape (*shape, 3), the *improved* filter, ``a | b``"))
    \|phi\| < pi, shape (\*shape, 3), the *improved* filter, ``a | b``
    """
    pieces = MARKUP.split(line)
    pieces[::2] = [re.sub(r"([|*])", r"\\\1", piece) for piece in pieces[::2]]
    return "".join(pieces)


def escape_docstring(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Escape a docstring outside literal blocks and doctests; runs after napoleon."""
    literal: int | None = None  # indentation of the line that opened a block
    for number, line in enumerate(lines):
        text = line.lstrip()
        indent = len(line) - len(text)
        if not text:
            continue
        if literal is not None and indent > literal:
            continue
        literal = indent if text.endswith("::") or text.startswith((".. ", ">>>")) else None
        if literal is None:
            lines[number] = escape_plain(line)


def setup(app: Sphinx) -> dict[str, object]:
    """Register with Sphinx."""
    app.add_domain(BookMathDomain, override=True)
    app.connect("source-read", fill_in)
    app.connect("autodoc-process-docstring", escape_docstring, priority=600)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
