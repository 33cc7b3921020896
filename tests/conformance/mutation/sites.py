"""Where a function can be changed, and how.

Only what computes is changed: not documentation, annotations, default values, messages, nor the checks that
lead to them.  Nothing inside a comparison is changed either: where a series takes over near its
threshold, or how small a singular value counts as zero, makes no difference that anybody could see.  Nor are
the axes of arrays, nor the order of a matrix and itself.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from typing import NamedTuple

SWAPPED_CALLS = {"sin": "cos", "cos": "sin", "minimum": "maximum", "maximum": "minimum", "tan": "sin"}
TRANSPOSING = ("transpose", "swapaxes")
LEFT_ALONE = (ast.Raise, ast.Assert, ast.JoinedStr, ast.With, ast.ImportFrom, ast.Import, ast.Compare)


class Mutant(NamedTuple):
    """One change.

    Attributes
    ----------
    module : str
    function : str
        With the class's name, if any.
    line : int
    number : int
        Of the change within the module, in the order of :func:`mutants`.
    text : str
        The change, in words.
    """

    module: str
    function: str
    line: int
    number: int
    text: str


Changes = Callable[..., Iterator[tuple[str, ast.AST, str]]]
"""A walk through a module: function, node and text of every change; with a number, it makes that one."""


def mutants(module: str, source: str) -> list[Mutant]:
    """All changes of the functions of a module that cite an equation."""
    return listed(module, source, _changes)


def mutated(source: str, number: int) -> str:
    """Source with one change made."""
    return changed(source, number, _changes)


def listed(module: str, source: str, changes: Changes) -> list[Mutant]:
    """All changes that a walk through a module's tree finds."""
    return [
        Mutant(module, function, getattr(node, "lineno", 0), number, text)
        for number, (function, node, text) in enumerate(changes(ast.parse(source)))
    ]


def changed(source: str, number: int, changes: Changes) -> str:
    """Source with one of them made."""
    tree = ast.parse(source)
    for at, _ in enumerate(changes(tree, number)):
        if at == number:
            break
    return ast.unparse(ast.fix_missing_locations(tree))


def cites(function: ast.FunctionDef) -> bool:
    """Whether a function says which equation it computes."""
    return "Implements :eq:" in (ast.get_docstring(function) or "")


def _changes(tree: ast.Module, make: int | None = None) -> Iterator[tuple[str, ast.AST, str]]:
    """Yield function, node and text of every change; carry out the one with the number ``make``."""
    number = 0
    for name, function in _functions(tree):
        for node in _computing(function):
            for text, change in _of(node):
                if number == make:
                    change()
                yield name, node, text
                number += 1


def _functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and cites(node):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            for inner in node.body:
                if isinstance(inner, ast.FunctionDef) and cites(inner):
                    yield f"{node.name}.{inner.name}", inner


def _computing(function: ast.FunctionDef) -> Iterator[ast.AST]:
    """Nodes of a function's statements that compute."""
    for statement in function.body[1:]:
        yield from _walk(statement)


def _walk(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(
        node, ast.Raise | ast.Assert | ast.JoinedStr | ast.With | ast.ImportFrom | ast.Import | ast.Compare
    ):
        return
    if isinstance(node, ast.If) and all(isinstance(s, ast.Raise) for s in node.body):
        for statement in node.orelse:
            yield from _walk(statement)
        return
    if isinstance(node, ast.Call) and _called(node) in ("as_array", "zeros", "empty", "ones"):
        return  # shapes and names
    if isinstance(node, ast.AnnAssign):
        if node.value is not None:
            yield from _walk(node.value)
        return
    yield node
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Call | ast.keyword) and _is_axis(child)):
            yield from _walk(child)


def _is_axis(node: ast.AST) -> bool:
    """A negative whole number as an argument: which axis, from the end."""
    negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
    operand = getattr(node, "operand", None)
    return negative and isinstance(operand, ast.Constant) and isinstance(operand.value, int)


Change = tuple[str, "Carry"]


class Carry:
    """A change that can be carried out: sets attributes of a node."""

    def __init__(self, node: ast.AST, **values: object) -> None:
        self.node, self.values = node, values

    def __call__(self) -> None:
        """Make the change."""
        for name, value in self.values.items():
            setattr(self.node, name, value)


def _of(node: ast.AST) -> Iterator[Change]:
    """Changes of one node."""
    if isinstance(node, ast.BinOp):
        yield from _operator(node)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "a minus sign left out", Carry(node, op=ast.UAdd())
    elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
        other = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
        yield "the sign of an addition in place", Carry(node, op=other)
    elif isinstance(node, ast.Attribute) and node.attr == "T":
        yield "a transpose left out", Carry(node, attr="real")
    elif isinstance(node, ast.Call):
        yield from _call(node)


def _operator(node: ast.BinOp) -> Iterator[Change]:
    if isinstance(node.op, ast.Add):
        yield "+ to -", Carry(node, op=ast.Sub())
    elif isinstance(node.op, ast.Sub):
        yield "- to +", Carry(node, op=ast.Add())
    elif isinstance(node.op, ast.Mult):
        yield "* to /", Carry(node, op=ast.Div())
    elif isinstance(node.op, ast.Div):
        yield "/ to *", Carry(node, op=ast.Mult())
    elif isinstance(node.op, ast.MatMult) and ast.dump(node.left) != ast.dump(node.right):
        yield "factors exchanged", Carry(node, left=node.right, right=node.left)
    elif isinstance(node.op, ast.Pow):
        yield "a power left out", Carry(node, op=ast.Mult(), right=ast.Constant(1))
    for side in ("left", "right"):
        value = getattr(node, side)
        if (
            isinstance(value, ast.Constant)
            and isinstance(value.value, int | float)
            and value.value not in (0, True)
        ):
            yield f"{value.value} to {2 * value.value}", Carry(node, **{side: ast.Constant(2 * value.value)})


def _call(node: ast.Call) -> Iterator[Change]:
    name = _called(node)
    if name in SWAPPED_CALLS and isinstance(node.func, ast.Attribute):
        other = SWAPPED_CALLS[name]
        yield f"{name} to {other}", Carry(node.func, attr=other)
    elif name in TRANSPOSING and node.args:
        identity = ast.Name("_same", ast.Load())
        yield "a transpose left out", Carry(node, func=identity, args=node.args[:1], keywords=[])
    elif name == "cross" and len(node.args) == 2:
        yield "factors of a cross product exchanged", Carry(node, args=node.args[::-1])
    elif name == "inverse" and len(node.args) == 1:
        yield "an inverse left out", Carry(node, func=ast.Name("_same", ast.Load()))


def _called(node: ast.Call) -> str:
    return node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
