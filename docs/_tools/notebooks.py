"""Make ``notebooks/NN_name.ipynb`` from ``docs/chapters/NN_name.md``, and check that both are in step.

    python docs/_tools/notebooks.py --write              # generate, execute in full, store the outputs
    python docs/_tools/notebooks.py --check              # cell sources of page and notebook are equal
    python docs/_tools/notebooks.py --check --execute    # ... and every page runs (VSLAM_REF_QUICK=1)
    python docs/_tools/notebooks.py --write 16           # only the pages whose name begins with 16

A stored notebook holds what a reader sees and nothing else: no times, no counters, no addresses, no
metadata of the machine that ran it, so that a second run gives the same bytes.
"""

from __future__ import annotations

import argparse
import ast
import base64
import io
import os
import re
import sys
import tempfile
import time
from pathlib import Path

import book
import jupytext
import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError
from nbformat import NotebookNode
from PIL import Image

METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
INCLUDED = re.compile(r"^```\{literalinclude\} (\S+)\n((?::[\w-]+:.*\n)*)```$", re.MULTILINE)
OPTION = re.compile(r":([\w-]+):[ \t]*(.*)")
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")
KEPT_TYPES = ("image/png", "text/html", "text/latex", "text/markdown", "text/plain")
LARGEST = 2_000_000  # bytes of one stored notebook
CELL_SECONDS = 600


def notebook_path(page: Path) -> Path:
    """Where the notebook of a page lies."""
    return book.NOTEBOOKS / f"{page.stem}.ipynb"


def from_page(page: Path) -> NotebookNode:
    """Read a page as a notebook without outputs, with the same bytes every time."""
    notebook = jupytext.read(page, fmt="md:myst")
    for number, cell in enumerate(notebook.cells):
        cell["id"] = f"cell-{number:03d}"
        if cell.cell_type == "markdown":
            cell.source = INCLUDED.sub(lambda found: included(page, *found.groups()), cell.source)
    notebook.metadata = nbformat.from_dict(METADATA)
    notebook.nbformat, notebook.nbformat_minor = 4, 5
    return notebook


def included(page: Path, name: str, options: str) -> str:
    """Write a ``literalinclude`` as a block of code, since a notebook would show the directive raw.

    Options ``language``, ``pyobject`` (a function or class at the top level), ``start-after`` and
    ``end-before`` are understood, others refused.
    """
    path = (page.parent / name).resolve()
    if not path.is_file():
        raise ValueError(f"{page.name} includes {name}, which is no file")
    text = path.read_text(encoding="utf-8")
    given = dict(found.groups() for line in options.splitlines() if (found := OPTION.match(line)))
    for option, value in given.items():
        if option == "pyobject":
            found_at = [n for n in ast.parse(text).body if getattr(n, "name", None) == value]
            if not found_at:
                raise ValueError(f"{page.name}: {name} defines no {value!r}")
            node = found_at[0]
            first = min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])
            text = "\n".join(text.splitlines()[first - 1 : node.end_lineno])
        elif option == "start-after":
            text = text.split(value, 1)[1].partition("\n")[2]
        elif option == "end-before":
            text = text.split(value, 1)[0].rpartition("\n")[0]
        elif option not in ("language", "caption"):
            raise ValueError(f"{page.name}: option {option!r} of literalinclude is not understood here")
    return f"```{given.get('language', 'python')}\n{text.strip()}\n```"


def execute(notebook: NotebookNode, quick: bool) -> None:
    """Run all cells in a fresh kernel whose settings come from an empty folder."""
    with tempfile.TemporaryDirectory() as empty:
        environment = dict(os.environ, MPLBACKEND="module://matplotlib_inline.backend_inline")
        environment.pop("VSLAM_REF_QUICK", None)
        if quick:
            environment["VSLAM_REF_QUICK"] = "1"
        for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_DATA_DIR"):
            environment[name] = os.environ[name] = empty
        book.NOTEBOOKS.mkdir(exist_ok=True)
        client = NotebookClient(
            notebook,
            timeout=CELL_SECONDS,
            kernel_name="python3",
            record_timing=False,
            extra_arguments=["--IPKernelApp.log_level=40"],  # errors only
            resources={"metadata": {"path": str(book.NOTEBOOKS)}},
        )
        client.execute(env=environment)


def tidy(notebook: NotebookNode, name: str) -> None:
    """Keep what a reader sees; say on stderr what was left out."""
    notebook.metadata = nbformat.from_dict(METADATA)
    for cell in notebook.cells:
        cell.metadata = nbformat.from_dict({k: v for k, v in cell.metadata.items() if k == "tags"})
        if cell.cell_type != "code":
            continue
        cell.execution_count = None
        cell.outputs = _joined([kept for output in cell.outputs if (kept := _tidy_output(output, name))])


def _joined(outputs: list[NotebookNode]) -> list[NotebookNode]:
    """One output of what was printed in several pieces: how many there are depends on the machine's pace."""
    found: list[NotebookNode] = []
    for output in outputs:
        if found and output.output_type == found[-1].output_type == "stream":
            found[-1].text += output.text
        else:
            found.append(output)
    return found


def _tidy_output(output: NotebookNode, name: str) -> NotebookNode | None:
    if output.output_type == "stream":
        if output.name == "stderr":
            print(f"{name}: left out of the notebook: {output.text.strip()}", file=sys.stderr)
            return None
        output.text = ADDRESS.sub("", output.text)
        return output
    if "data" in output:
        kinds = [kind for kind in KEPT_TYPES if kind in output.data]
        if "image/png" in kinds:
            kinds = ["image/png"]
            output.data["image/png"] = small_png(output.data["image/png"])
        output.data = nbformat.from_dict({kind: _clean(output.data[kind]) for kind in kinds})
        output.metadata = nbformat.from_dict({})
    if output.output_type == "execute_result":
        output.execution_count = None
    return output


def small_png(text: str) -> str:
    """Give a picture (base64) a palette of 256 colours where that is smaller: plots lose nothing visible."""
    data = base64.b64decode(text)
    with Image.open(io.BytesIO(data)) as picture:
        flat = Image.new("RGB", picture.size, "white")
        flat.paste(picture, mask=picture.getchannel("A") if "A" in picture.getbands() else None)
    packed = io.BytesIO()
    flat.quantize(256, kmeans=4, dither=Image.Dither.NONE).save(packed, "PNG", optimize=True)
    return base64.b64encode(min(packed.getvalue(), data, key=len)).decode() + "\n"


def _clean(value: str) -> str:
    return ADDRESS.sub("", value).rstrip("\n")


def write(page: Path) -> None:
    """Execute a page in full and store its notebook."""
    notebook = from_page(page)
    execute(notebook, quick=False)
    tidy(notebook, page.stem)
    text = nbformat.writes(nbformat.from_dict(notebook), indent=1, ensure_ascii=False) + "\n"
    if len(text.encode()) > LARGEST:
        raise ValueError(f"{page.stem}: {len(text.encode())} bytes; a notebook may have {LARGEST}")
    notebook_path(page).write_text(text, encoding="utf-8")


def out_of_step(page: Path) -> str | None:
    """Say how a page and its stored notebook differ, or None when they are in step."""
    stored_path = notebook_path(page)
    if not stored_path.is_file():
        return f"{stored_path.name} is missing: run make notebooks"
    fresh = [(c.cell_type, c.source) for c in from_page(page).cells]
    stored = [(c.cell_type, c.source) for c in nbformat.read(stored_path, as_version=4).cells]
    if fresh == stored:
        return None
    if len(fresh) != len(stored):
        return f"{stored_path.name} has {len(stored)} cells, its page {len(fresh)}: run make notebooks"
    first = next(i for i, (a, b) in enumerate(zip(fresh, stored, strict=True)) if a != b)
    return f"{stored_path.name}: cell {first} differs from its page: run make notebooks"


def orphans() -> list[str]:
    """Notebooks without a page."""
    known = {page.stem for page in book.pages()}
    return [
        f"{p.name} has no page in docs/chapters/"
        for p in sorted(book.NOTEBOOKS.glob("*.ipynb"))
        if p.stem not in known
    ]


def main(arguments: list[str] | None = None) -> int:
    """Command line; returns 0 when all is well."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    mode = parser.add_mutually_exclusive_group(required=True)
    mode.add_argument("--write", action="store_true", help="generate, execute and store")
    mode.add_argument("--check", action="store_true", help="compare the cell sources")
    parser.add_argument("--execute", action="store_true", help="with --check: run every page, quick")
    parser.add_argument("only", nargs="*", help="beginnings of page names, e.g. 16")
    options = parser.parse_args(arguments)

    selected = [p for p in book.pages() if not options.only or p.name.startswith(tuple(options.only))]
    problems = orphans() if options.check and not options.only else []
    for page in selected:
        began = time.perf_counter()
        try:
            if options.write:
                write(page)
            else:
                problem = out_of_step(page)
                problems += [problem] if problem else []
                if options.execute:
                    execute(from_page(page), quick=True)
        except (CellExecutionError, CellTimeoutError, ValueError) as error:
            problems.append(f"{page.name}: {error}")
        print(f"{page.stem}: {time.perf_counter() - began:.1f} s", flush=True)
    for problem in problems:
        print(problem, file=sys.stderr)
    print(f"{len(selected)} pages, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    raise SystemExit(main())
