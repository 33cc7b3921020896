"""Lay out the sources that Sphinx reads: ``docs/``, with each page replaced by its executed notebook.

    python docs/_tools/stage.py docs/_build/source

A page whose notebook is missing stays as it is, its code shown but not run. The API reference gets
one page for every public module of the package.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import book

LEFT_OUT = ("_build", "_tools", "__pycache__", ".gitkeep")


def public_modules() -> list[str]:
    """Dotted names of all modules without a leading underscore, found without importing them."""
    names = []
    for path in sorted(book.PACKAGE.rglob("*.py")):
        parts = path.relative_to(book.PACKAGE.parent).with_suffix("").parts
        if parts[-1] == "__init__":
            parts = parts[:-1]
        if not any(part.startswith("_") for part in parts):
            names.append(".".join(parts))
    return sorted(names)


def stage(target: Path) -> list[str]:
    """Fill ``target`` afresh; returns the pages that have no notebook yet."""
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(book.DOCS, target, ignore=shutil.ignore_patterns(*LEFT_OUT))
    missing = []
    for page in book.pages():
        notebook = book.NOTEBOOKS / f"{page.stem}.ipynb"
        if notebook.is_file():
            (target / "chapters" / page.name).unlink()
            shutil.copy(notebook, target / "chapters" / notebook.name)
        else:
            missing.append(page.name)
    _write_reference(target / "reference")
    return missing


def _write_reference(folder: Path) -> None:
    folder.mkdir()
    names = public_modules()
    listing = "\n".join(f"   {name}" for name in names)
    (folder / "index.rst").write_text(
        "Reference\n=========\n\nEvery public module, with the equations that it computes.\n\n"
        f".. toctree::\n   :maxdepth: 1\n\n{listing}\n",
        encoding="utf-8",
    )
    for name in names:
        title = name.replace("_", r"\_")
        (folder / f"{name}.rst").write_text(
            f"{title}\n{'=' * len(title)}\n\n.. automodule:: {name}\n   :members:\n"
            "   :ignore-module-all:\n   :show-inheritance:\n",  # an object is described where it is defined
            encoding="utf-8",
        )


if __name__ == "__main__":
    for page_name in stage(Path(sys.argv[1])):
        print(f"warning: {page_name} has no notebook, its cells are shown without results", file=sys.stderr)
