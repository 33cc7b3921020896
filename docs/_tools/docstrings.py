"""Check the docstrings of the numeric rooms: sections, shapes, units, equations.

    python docs/_tools/docstrings.py --check            # exit status 1 for a miss that is not known
    python docs/_tools/docstrings.py --list geometry    # all misses of a room, the known ones too
    python docs/_tools/docstrings.py --write            # store the misses of today as the known ones
    python docs/_tools/docstrings.py --share            # how many say their shapes, units, equations

For every public function and class of a room:

``section``   numpydoc finds the sections valid: names, order, parameters that exist;
``shape``     each array that is given has a shape: ``x : ndarray, shape (N, 2)``, ``x (N, 2)``, or as many
              shapes as there are arrays; the module's docstring and a function referred to count too;
``unit``      numbers that are given or returned have a unit, or the words that there is none;
``equation``  a function that calculates cites what it computes, in a sentence that begins with "Implements"
              or in a comment at the line.

``docstrings_known.txt`` lists what is still missing; it only becomes shorter.  ``docstrings_exceptions.txt``
lists what need not be there, each line with its reason.
"""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import book
import equation_index

HERE = Path(__file__).resolve().parent
KNOWN = HERE / "docstrings_known.txt"
EXCEPTIONS = HERE / "docstrings_exceptions.txt"
ROOMS = (
    "geometry",
    "interop",
    "estimation",
    "filters",
    "features",
    "metrics",
    "worlds",
    "grids",
    "systems",
    "testing",
)
ARRAYS = re.compile(r"\b(?:\w*Array|ArrayLike|NDArray|ndarray)\b")
NUMBERS = re.compile(r"\b(?:\w*Array|ArrayLike|NDArray|ndarray|float)\b")
UNITS = re.compile(
    r"\b(?:met(?:re|er)s?|cm|mm|km|radians?|rad|degrees?|deg|pixels?|px|seconds?|ms|Hz|sigmas?|log-odds|counts?"
    r"|shares?|probabilit(?:y|ies)|ratios?|quaternions?|rotations?|(?:any|same|no|own|a) units?|unitless"
    r"|dimensionless|units? of|normali[sz]ed)\b|m/s|\bin [ms]\b|\d [ms]\b|\u00b2|\^2"
)
SHAPES = re.compile(r"\((?:\.\.\.|\*shape|\d+|[A-Za-z])(?:, ?[^()]*)?\)")
REFERRED = re.compile(r":(?:func|class):`\.?(\w+)`")
SECTIONS = ("GL06", "GL07", "PR02", "PR03", "PR04", "RT02", "YD01")  # names, order, parameters that exist
LEAST_OPERATIONS = 4
"""Operations from which a function calculates something that a text could have a formula for."""


class Item(NamedTuple):
    """Something public with a docstring; ``around``: what else gives its shapes and units."""

    name: str
    node: ast.FunctionDef | ast.ClassDef
    source: str
    around: str

    @property
    def own(self) -> str:
        """Its docstring."""
        return ast.get_docstring(self.node) or ""

    @property
    def text(self) -> str:
        """All that gives a reader its shapes and units."""
        return f"{self.own}\n{self.around}"


def items(room: str) -> Iterator[Item]:
    """Public functions and classes of a room, found without importing it."""
    folder = book.PACKAGE / room
    paths = sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]
    for path in paths:
        parts = path.relative_to(book.PACKAGE.parent).with_suffix("").parts
        parts = parts[:-1] if parts[-1] == "__init__" else parts
        if path.is_file() and not any(part.startswith("_") for part in parts):
            yield from _of_module(path.read_text(encoding="utf-8"), ".".join(parts))


def _of_module(source: str, name: str) -> Iterator[Item]:
    tree = ast.parse(source)
    texts = {n.name: ast.get_docstring(n) for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)}
    for node in tree.body:
        if not isinstance(node, ast.FunctionDef | ast.ClassDef) or node.name.startswith("_"):
            continue
        if text := texts[node.name]:
            others = [texts.get(other) or "" for other in REFERRED.findall(text)]
            remarks = [n.value.value for n in node.body[1:] if isinstance(n, ast.Expr) and _is_text(n.value)]
            around = "\n".join([ast.get_docstring(tree) or "", *others, *remarks])
            yield Item(f"{name}.{node.name}", node, source, around)


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def fields(item: Item) -> list[tuple[str, str]]:
    """Names and annotations of what is given: parameters, or a class's declared fields."""
    if isinstance(item.node, ast.ClassDef):
        declared = [
            n for n in item.node.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)
        ]
        return [(n.target.id, ast.unparse(n.annotation)) for n in declared if not n.target.id.startswith("_")]  # type: ignore[union-attr]
    arguments = item.node.args
    every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return [(a.arg, ast.unparse(a.annotation)) for a in every if a.annotation is not None]


def without_shape(item: Item) -> list[str]:
    """Arrays whose name is followed by no shape, where not all have one in the words."""
    arrays = [name for name, kind in fields(item) if ARRAYS.search(kind) and "Callable" not in kind]
    if len(SHAPES.findall(item.own)) >= len(arrays):
        return []
    return [name for name in arrays if not _has_shape(name, item.text)]


def _has_shape(name: str, text: str) -> bool:
    one = rf"(?<![\w.]){re.escape(name)}(?!\w)"
    beside = rf"{one}(?:, \w+)*`*\s*\([^)]*[\d.N]*\)"  # x (N, 2); x, y (N,)
    section = (
        rf"^\s*(?:\w+, )*{one}(?:, \w+)* ?:[^\n]*(?:\([^)]*\)|shape|scalar)"  # x : ndarray, shape (N, 2)
    )
    return bool(re.search(beside, text) or re.search(section, text, re.MULTILINE))


def has_numbers(item: Item) -> bool:
    """Whether numbers are given or returned."""
    kinds = [kind for _, kind in fields(item)]
    if isinstance(item.node, ast.FunctionDef) and item.node.returns is not None:
        kinds.append(ast.unparse(item.node.returns))
    return any(NUMBERS.search(kind) for kind in kinds)


def calculates(item: Item) -> bool:
    """Whether a function does arithmetic of its own."""
    if isinstance(item.node, ast.ClassDef):
        return False
    operations = [
        n for n in ast.walk(item.node) if isinstance(n, ast.BinOp) and not isinstance(n.op, ast.BitOr)
    ]
    return len(operations) >= LEAST_OPERATIONS


def cites(item: Item) -> bool:
    """Whether it says which equation it computes."""
    if equation_index.CITATION.search(item.own):
        return True
    lines = item.source.splitlines()[item.node.lineno - 1 : item.node.end_lineno]
    return any(equation_index.REMARK.search(line) for line in lines)


def misses_of(item: Item) -> list[tuple[str, str]]:
    """What is missing: kind and words."""
    found = []
    if arrays := without_shape(item):
        found.append(("shape", f"no shape of {', '.join(arrays)}"))
    if has_numbers(item) and not UNITS.search(item.text):
        found.append(("unit", "no unit, and not said that there is none"))
    if calculates(item) and not cites(item):
        found.append(("equation", "calculates, and cites no equation"))
    return [*found, *_sections(item.name)]


def _sections(name: str) -> list[tuple[str, str]]:
    """What numpydoc has against the sections; nothing where it is not installed."""
    if importlib.util.find_spec("numpydoc") is None:
        return []
    from numpydoc.validate import validate

    return [("section", f"{code} {words}") for code, words in validate(name)["errors"] if code in SECTIONS]


def entries(path: Path) -> dict[tuple[str, str], str]:
    """Kind and name of every line of a file, with the rest of the line."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    split = [line.split(None, 2) for line in lines if line.strip() and not line.startswith("#")]
    return {(words[0], words[1]): " ".join(words[2:]) for words in split}


def misses(rooms: tuple[str, ...] = ROOMS) -> dict[tuple[str, str], str]:
    """Everything that is missing and no exception: kind and name -> words."""
    excepted = entries(EXCEPTIONS)
    return {key: words for key, words in _all_misses(rooms).items() if key not in excepted}


def _all_misses(rooms: tuple[str, ...]) -> dict[tuple[str, str], str]:
    every = (item for room in rooms for item in items(room))
    return {(kind, item.name): words for item in every for kind, words in misses_of(item)}


def share() -> str:
    """How many docstrings say what they should, and how many could."""
    every = [item for room in ROOMS for item in items(room)]
    arrays = [i for i in every if any(ARRAYS.search(kind) for _, kind in fields(i))]
    numbers, formulas = [i for i in every if has_numbers(i)], [i for i in every if calculates(i)]
    needless = {name for kind, name in entries(EXCEPTIONS) if kind == "equation"}
    with_equation = [i for i in formulas if i.name not in needless]
    rows = (
        ("shape", sum(not without_shape(i) for i in arrays), arrays),
        ("unit", sum(bool(UNITS.search(i.text)) for i in numbers), numbers),
        ("equation", sum(map(cites, formulas)), formulas),
        ("equation, exceptions apart", sum(map(cites, with_equation)), with_equation),
    )
    return f"{len(every)} public docstrings\n" + "\n".join(
        f"{kind:<28}{have} of {len(need)} ({have / max(1, len(need)):.0%})" for kind, have, need in rows
    )


def write() -> None:
    """Store the misses of today."""
    found = sorted(misses())
    head = "# What docstrings still lack (docs/_tools/docstrings.py): this list only becomes shorter.\n"
    KNOWN.write_text(head + "".join(f"{kind} {name}\n" for kind, name in found), encoding="utf-8")
    print(f"{len(found)} known misses")


def check() -> int:
    """Compare with what is known; returns an exit status."""
    every, known, excepted = _all_misses(ROOMS), entries(KNOWN), entries(EXCEPTIONS)
    found = {key: words for key, words in every.items() if key not in excepted}
    new = [f"{name}: {found[kind, name]}" for kind, name in sorted(found.keys() - known.keys())]
    done = [
        key
        for key in known.keys() - found.keys()
        if key[0] != "section" or importlib.util.find_spec("numpydoc")
    ]
    wrong = [f"{name}: an exception needs a reason" for (_, name), reason in excepted.items() if not reason]
    wrong += [
        f"{name}: misses no {kind}, the exception goes" for kind, name in excepted.keys() - every.keys()
    ]
    for line in [*new, *wrong]:
        print(line, file=sys.stderr)
    if done:
        print(
            f"{len(done)} known misses are no more: 'docstrings.py --write' takes them out", file=sys.stderr
        )
    print(f"docstrings: {len(found)} misses, {len(known)} known, {len(new)} new")
    return 1 if new or done or wrong else 0


def main(arguments: list[str]) -> int:
    """Command line."""
    if arguments == ["--check"]:
        return check()
    if arguments == ["--write"]:
        write()
        return 0
    if arguments == ["--share"]:
        print(share())
        return 0
    if len(arguments) == 2 and arguments[0] == "--list" and arguments[1] in ROOMS:
        found = misses((arguments[1],))
        print("\n".join(f"{kind:<9}{name}: {words}" for (kind, name), words in sorted(found.items())))
        return 0
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
