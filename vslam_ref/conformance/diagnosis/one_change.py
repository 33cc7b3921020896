# ruff: noqa: E501
"""The library with one sign changed, asked whether it answers as the program does.

Every function that the library runs for an answer is changed in one place at a time: plus for minus, sine for
cosine, a transpose left out, two factors exchanged, a factor doubled, a power or a minus sign left out.  If the
changed library answers all cases as the program does, the program has this mistake, in whatever words.

The text of the library's function is parsed again, changed and compiled; its code is exchanged while one
question is asked, then put back.  Nothing else may run meanwhile.
"""

from __future__ import annotations

import ast
import copy
import functools
import gc
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, NamedTuple

from vslam_ref._kernels import use_backend
from vslam_ref.conformance.diagnosis.changes import library
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess
from vslam_ref.conformance.vectors_format import Case

ROOMS = ("vslam_ref.geometry", "vslam_ref.estimation", "vslam_ref.filters", "vslam_ref.features", "vslam_ref.grids", "vslam_ref.metrics", "vslam_ref.systems", "vslam_ref.conformance.adapters.itself")  # fmt: skip
MOST_CHANGES = 400
"""Changes of one function of the catalogue that are tried."""
ALL_LINES = 150_000
"""Lines that all changes together may run for one case: the slower a function, the fewer changes are tried."""
MOST_LINES = 100_000
"""Lines of the library that changed code may run for one answer."""
MOST_MEMORY = 2**30
"""Bytes that changed code may take."""
CALLS = {
    "sin": "cos",
    "cos": "sin",
    "minimum": "maximum",
    "maximum": "minimum",
    "tan": "sin",
    "arctan2": "arctan2",
}
LEFT_ALONE = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Compare, ast.Subscript)


class ChangedLine(NamedTuple):
    """One changed line: the function, its new code, and what is said of it."""

    target: Any
    code: CodeType
    text: str


def one_change(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Wrong formulas: the library's own, with one change."""
    first = evidence.failed[0].case
    those = ran(evidence, first)
    most = min(MOST_CHANGES, ALL_LINES // max(1, _lines(evidence, first)))
    for change in changes(those)[:most]:
        yield change.text, _changed(evidence, change)


def _changed(evidence: Evidence, change: ChangedLine) -> Guess:
    def guess(case: Case, got: Answer) -> Answer | None:
        with exchanged(change.target, change.code), use_backend("numpy"), bounded():
            return library(evidence, case.inputs)

    return guess


@contextmanager
def exchanged(function: FunctionType, code: CodeType) -> Iterator[None]:
    """Let a function run other code, and forget what was remembered from it."""
    before = function.__code__
    function.__code__ = code
    try:
        _forget()
        yield
    finally:
        function.__code__ = before
        _forget()


def _lines(evidence: Evidence, case: Case) -> int:
    """How many lines of the library run for a case."""
    with use_backend("numpy"), bounded() as left:
        library(evidence, case.inputs)
    return MOST_LINES - left[0]


@contextmanager
def bounded() -> Iterator[list[int]]:
    """Keep changed code from running for ever, or into all memory: it fails instead, as any wrong code may."""
    before = sys.gettrace()
    left = [MOST_LINES]

    def count(frame: Any, event: str, _: Any) -> Any:
        if not str(frame.f_globals.get("__name__", "")).startswith(ROOMS):
            return None
        left[0] -= 1
        if left[0] < 0:
            raise RuntimeError("the changed code does not end")
        return count

    sys.settrace(count)
    try:
        with _memory():
            yield left
    finally:
        sys.settrace(before)


@contextmanager
def _memory() -> Iterator[None]:
    """At most :data:`MOST_MEMORY` more than now, where the system can tell and limit it."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError, ValueError):
        yield
        return
    wanted = pages * resource.getpagesize() + MOST_MEMORY
    if 0 <= soft < wanted:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _forget() -> None:
    for remembered in _remembering():
        remembered.cache_clear()


@functools.cache
def _remembering() -> list[Any]:
    """Functions of the numeric rooms that remember their results."""
    kind = type(_remembering)
    return [x for x in gc.get_objects() if type(x) is kind and x.__module__.startswith(ROOMS)]


def ran(evidence: Evidence, case: Case) -> list[FunctionType]:
    """The library's functions that run for a case, in the order of their first call."""
    codes: dict[CodeType, None] = {}

    def note(frame: Any, event: str, _: Any) -> None:
        if event == "call" and str(frame.f_globals.get("__name__", "")).startswith(ROOMS):
            codes.setdefault(frame.f_code)

    library(evidence, case.inputs)  # whatever is imported late is imported now
    _forget()
    before = sys.getprofile()
    with use_backend("numpy"):
        sys.setprofile(note)
        try:
            library(evidence, case.inputs)
        finally:
            sys.setprofile(before)
    found = ((_function_of(code), code) for code in codes)
    return [function for function, code in found if function is not None and not code.co_freevars]


def _function_of(code: CodeType) -> FunctionType | None:
    owners = (x for x in gc.get_referrers(code) if isinstance(x, FunctionType) and x.__code__ is code)
    return next(owners, None)


def changes(those: list[FunctionType]) -> list[ChangedLine]:
    """All single changes of some functions."""
    return [change for function in those for change in _of(function)]


def _of(function: FunctionType) -> list[ChangedLine]:
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, TypeError, SyntaxError):
        return []
    if not isinstance(tree.body[0], ast.FunctionDef):
        return []
    tree.body[0].decorator_list = []
    found = []
    for number in range(len(list(_sites(tree)))):
        changed = copy.deepcopy(tree)
        site, (words, act) = list(_sites(changed))[number]
        line = ast.unparse(_statement(tree, site.lineno))
        act()
        code = _compiled(changed, function)
        if code is not None:
            found.append(ChangedLine(function, code, f"as if in '{_cut(line)}' ({_name(function)}) {words}"))
    return found


def _name(function: FunctionType) -> str:
    return f"{function.__module__.removeprefix('vslam_ref.')}.{function.__name__}"


def _cut(line: str, most: int = 90) -> str:
    line = line.partition("\n")[0]
    return line if len(line) <= most else line[: most - 1] + "…"


def _statement(tree: ast.Module, line: int) -> ast.stmt:
    """The innermost statement at a line."""
    those = [
        n for n in ast.walk(tree) if isinstance(n, ast.stmt) and n.lineno <= line <= (n.end_lineno or line)
    ]
    return those[-1]


def _compiled(tree: ast.Module, function: FunctionType) -> CodeType | None:
    body = tree.body[0]
    assert isinstance(body, ast.FunctionDef)
    body.decorator_list = []
    body.returns, body.args.defaults, body.args.kw_defaults = None, [], [None] * len(body.args.kwonlyargs)
    for argument in (*body.args.args, *body.args.kwonlyargs, *body.args.posonlyargs):
        argument.annotation = None
    module = compile(ast.fix_missing_locations(tree), function.__code__.co_filename, "exec")
    codes = [c for c in module.co_consts if isinstance(c, CodeType) and c.co_name == function.__name__]
    return codes[0] if codes and codes[0].co_freevars == function.__code__.co_freevars else None


Site = tuple[ast.expr | ast.stmt, tuple[str, Callable[[], None]]]


def _sites(tree: ast.AST) -> Iterator[Site]:
    """Every place that can be changed, in the order of the text, and what is done there."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, LEFT_ALONE) or (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        ):
            continue
        if isinstance(node, ast.arguments):
            continue
        if isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
            yield node, _in_place(node)
        if isinstance(node, ast.expr):
            yield from ((node, change) for change in _at(node))
        if isinstance(node, ast.IfExp):
            for part in (node.body, node.orelse):
                yield from _sites(ast.Expression(part))
            continue
        if isinstance(node, ast.If):
            for statement in (*node.body, *node.orelse):
                yield from _sites(ast.Module([statement], []))
            continue
        yield from _sites(node)


def _in_place(node: ast.AugAssign) -> tuple[str, Callable[[], None]]:
    other = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
    return f"{_short(node)} had the other sign", lambda: setattr(node, "op", other)


def _at(node: ast.expr) -> Iterator[tuple[str, Callable[[], None]]]:
    """What can be done at a node."""
    if isinstance(node, ast.BinOp):
        yield from _operator(node)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield f"the minus sign of {_short(node)} were left out", lambda: setattr(node, "op", ast.UAdd())
    elif isinstance(node, ast.Call):
        yield from _call(node)
    elif isinstance(node, ast.Attribute) and node.attr == "T":
        yield f"{_short(node)} were not transposed", lambda: _become(node, node.value)
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield from _constant(node, float(node.value))  # type: ignore[arg-type]


def _constant(node: ast.Constant, value: float) -> Iterator[tuple[str, Callable[[], None]]]:
    """Doubled, halved, one more, one less; 0 and the whole number 1 are mostly counts."""
    whole = isinstance(node.value, int)
    if value == 0 or (whole and value <= 1):
        return
    kind = int if whole else float
    for other in (2 * value, value / 2, value + 1, value - 1):
        if other == kind(other):
            yield (
                f"{node.value!r} were {kind(other)!r}",
                functools.partial(setattr, node, "value", kind(other)),
            )


def _operator(node: ast.BinOp) -> Iterator[tuple[str, Callable[[], None]]]:
    left, right, text = node.left, node.right, _short(node)
    other = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}.get(type(node.op))
    if other is not None:
        yield f"{text} had the other sign of operation", lambda: setattr(node, "op", other())
        yield f"{text} were {_short(left)} alone", lambda: _become(node, left)
    if isinstance(node.op, ast.Add | ast.Sub):
        yield f"{text} were {_short(right)} alone", lambda: _become(node, right)
        yield (
            f"{text} were one less",
            lambda: _become(node, ast.BinOp(copy.deepcopy(node), ast.Sub(), ast.Constant(1))),
        )
        yield (
            f"{text} were one more",
            lambda: _become(node, ast.BinOp(copy.deepcopy(node), ast.Add(), ast.Constant(1))),
        )
    if isinstance(node.op, ast.Mult):
        yield f"{text} were {_short(right)} alone", lambda: _become(node, right)
    if isinstance(node.op, ast.MatMult):
        yield f"{text} had its factors exchanged", lambda: _swap(node)
        yield f"{text} were a product of entries", lambda: setattr(node, "op", ast.Mult())
        yield f"{text} had its first factor transposed", lambda: setattr(node, "left", _transposed(left))
        yield f"{text} had its second factor transposed", lambda: setattr(node, "right", _transposed(right))
    if isinstance(node.op, ast.Pow):
        yield f"{text} were without its power", lambda: _become(node, left)


def _call(node: ast.Call) -> Iterator[tuple[str, Callable[[], None]]]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if name in CALLS and isinstance(node.func, ast.Attribute) and CALLS[name] != name:
        func = node.func
        yield f"{_short(node)} were {CALLS[name]}", lambda: setattr(func, "attr", CALLS[name])
    if name in ("cross", "arctan2", "einsum", "times", "matmul") and len(node.args) >= 2 and name != "einsum":
        yield (
            f"{_short(node)} had its arguments exchanged",
            lambda: node.args.__setitem__(slice(0, 2), node.args[1::-1]),
        )
    if name in ("transpose", "swapaxes", "sqrt", "abs", "inv") and node.args:
        yield f"{name} were left out of {_short(node)}", lambda: _become(node, node.args[0])


def _become(node: ast.expr, other: ast.expr) -> None:
    """Turn a node into +other, in place."""
    copied = copy.deepcopy(other)
    node.__class__ = ast.UnaryOp
    node.__dict__.clear()
    node.__dict__.update(vars(ast.copy_location(ast.UnaryOp(ast.UAdd(), copied), copied)))


def _swap(node: ast.BinOp) -> None:
    node.left, node.right = node.right, node.left


def _transposed(x: ast.expr) -> ast.expr:
    return ast.Attribute(copy.deepcopy(x), "T", ast.Load())


def _short(node: ast.AST) -> str:
    text = ast.unparse(node)
    return f"'{text}'" if len(text) <= 50 else f"'{text[:49]}…'"
