"""Make ``docs/equation-index.md`` from the citations in the package's docstrings.

    python docs/_tools/equation_index.py --write      # store the index
    python docs/_tools/equation_index.py --check      # exit status 1 when the stored index is out of date
    python docs/_tools/equation_index.py --labels     # cited labels that no page defines
    python docs/_tools/equation_index.py --uncited    # labels of chapters that no code cites; status 1 if any

A citation counts only in a sentence that begins with the word "Implements", in the docstring of the
function, class or module that computes the equation: ``Implements :eq:`eq-b16` (B16).`` Names without a
link count there too (``B23``, ``B1-B3``), and what has no equation number is cited in words: ``A§2.2.1``,
``B fig 2``.  For ``--uncited``, a comment at the line that computes an equation counts as well, if it begins
with the label: ``# eq-gain``, ``# eq-gain, eq-b16: why``.  A label ``eq-step-...`` is a step of a derivation
and needs no citation.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

import book
import seed_rows

INDEX = book.DOCS / "equation-index.md"
LABEL = re.compile(r":eq:`([^`]+)`")
SEED_LABEL = re.compile(r"eq-([ab])(\d+(?:-\d+)?)$")
CITATION = re.compile(r"\bImplements\b(.*?)(?:\.(?=\s|$)|\n\s*\n|$)", re.DOTALL)
SPAN = re.compile(r"\b([AB])(\d+)\s?[-–]\s?\1?(\d+)\b")
PLAIN = re.compile(r"\b[AB](?:\d+(?:\.\d+)?\b|§\d+(?:\.\d+)*| (?:fig|table) \d+(?:\.\d+)?)")
REMARK = re.compile(r"#\s*(eq-[\w-]+(?:,\s*eq-[\w-]+)*)(?![\w-])")
STEP = "eq-step-"
DEFINED = re.compile(r"\$\$[ \t]*\(([\w-]+)\)\s*$|:label:[ \t]*([\w-]+)", re.MULTILINE)

HEAD = """\
# Equation index

Every equation, figure, table and named system of the two seed documents, and the code that computes it.
A is the report on visual SLAM, B the paper on IEKF-SLAM. This page is generated from the citations
in the code: a row is *covered* when everything in it is computed somewhere, *partly* when some of it is.
Rows marked **E** have a slip in print; see the [errata](errata.md).

"""


def docstrings(path: Path) -> Iterator[tuple[str, str]]:
    """Dotted name and docstring of a module and of everything defined in it."""
    parts = path.relative_to(book.PACKAGE.parent).with_suffix("").parts
    module = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)

    def visit(node: ast.AST, name: str) -> Iterator[tuple[str, str]]:
        if isinstance(node, ast.Module | ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield name, ast.get_docstring(node) or ""
        for child in ast.iter_child_nodes(node):
            if isinstance(child, kinds):
                yield from visit(child, f"{name}.{child.name}")

    yield from visit(ast.parse(path.read_text(encoding="utf-8")), module)


def item_of_label(label: str) -> str | None:
    """Name of the seed's equation behind a label: ``eq-a2-8`` is A2.8; None for other labels."""
    match = SEED_LABEL.match(label)
    return match and match[1].upper() + match[2].replace("-", ".")


def cited_items(docstring: str) -> set[str]:
    """What the sentences that begin with "Implements" say is computed."""
    items: set[str] = set()
    for sentence in CITATION.findall(docstring):
        items |= {item for label in LABEL.findall(sentence) if (item := item_of_label(label))}
        words = LABEL.sub("", sentence)
        items |= set(PLAIN.findall(words))
        for seed, first, last in SPAN.findall(words):
            items |= {f"{seed}{number}" for number in range(int(first), int(last) + 1)}
    return items


def citations() -> dict[str, list[str]]:
    """Who computes each item, over the whole package."""
    found: dict[str, list[str]] = {}
    for path in sorted(book.PACKAGE.rglob("*.py")):
        for name, docstring in docstrings(path):
            for item in cited_items(docstring):
                found.setdefault(item, []).append(name)
    return {item: sorted(set(names)) for item, names in found.items()}


def unknown_items(found: dict[str, list[str]]) -> list[str]:
    """Citations of things that the seeds do not have."""
    known = {item for row in seed_rows.ROWS for item in row.items}
    strangers = {item: names for item, names in found.items() if item not in known}
    return [f"{', '.join(names)} cites {item}, which is in no row" for item, names in strangers.items()]


def index_text() -> str:
    """The whole page."""
    found = citations()
    lines = ["| seed | | what | chapter | state | computed by |", "|---|---|---|---|---|---|"]
    for row in seed_rows.ROWS:
        covered = [item for item in row.items if item in found]
        state = "covered" if len(covered) == len(row.items) else "partly" if covered else "planned"
        shown = ", ".join(row.items) if len(row.items) < 3 else f"{row.items[0]}-{row.items[-1]}"
        by = "; ".join(f"{item}: " + ", ".join(f"{{py:obj}}`{n}`" for n in found[item]) for item in covered)
        mark = "**E**" if row.erratum else ""
        lines.append(f"| {shown} | {mark} | {row.about} | {row.chapter:02d} | {state} | {by} |")
    return HEAD + "\n".join(lines) + "\n"


def labels_at_lines(source: str) -> set[str]:
    """Labels in the comments of a file, each comment beginning with its labels."""
    found: set[str] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and (match := REMARK.match(token.string)):
            found |= {label.strip() for label in match[1].split(",")}
    return found


def computed_labels() -> tuple[set[str], set[str]]:
    """Labels that the library says it computes, and the seeds' items that it names without a label."""
    labels: set[str] = set()
    for path in sorted(book.PACKAGE.rglob("*.py")):
        labels |= labels_at_lines(path.read_text(encoding="utf-8"))
        for _, docstring in docstrings(path):
            for sentence in CITATION.findall(docstring):
                labels |= set(LABEL.findall(sentence))
    return labels, set(citations())


def defined_labels(page: Path) -> list[str]:
    """Labels that a page defines, in its order."""
    return [next(filter(None, groups)) for groups in DEFINED.findall(page.read_text(encoding="utf-8"))]


def uncited_labels() -> dict[str, list[str]]:
    """Chapter -> labels that no library code cites, steps of derivations left out."""
    labels, items = computed_labels()
    found = {}
    for page in book.pages():
        missing = [
            label
            for label in defined_labels(page)
            if label not in labels and item_of_label(label) not in items and not label.startswith(STEP)
        ]
        if missing:
            found[page.stem[:2]] = missing
    return found


def undefined_labels() -> list[str]:
    """Labels that docstrings cite and no page defines."""
    defined = {label for page in [*book.DOCS.glob("*.md"), *book.pages()] for label in defined_labels(page)}
    cited = {
        label
        for path in book.PACKAGE.rglob("*.py")
        for _, docstring in docstrings(path)
        for label in LABEL.findall(docstring)
    }
    return sorted(cited - defined)


def main(arguments: list[str]) -> int:
    """Command line."""
    if arguments == ["--labels"]:
        print("\n".join(undefined_labels()))
        return 0
    if arguments == ["--uncited"]:
        uncited = uncited_labels()
        for number, labels in uncited.items():
            print(*(f"{number}  {label}" for label in labels), sep="\n")
        return 1 if uncited else 0
    problems = unknown_items(citations())
    if arguments == ["--write"]:
        INDEX.write_text(index_text(), encoding="utf-8")
    elif arguments == ["--check"]:
        stored = INDEX.read_text(encoding="utf-8") if INDEX.is_file() else ""
        if stored != index_text():
            problems.append("docs/equation-index.md is out of date: run make docs-index")
    else:
        print(__doc__, file=sys.stderr)
        return 2
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
