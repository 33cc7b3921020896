"""A function of the library, written again with one slip of the hand in it.

::

    signs   a + b -> a - b, a alone, one more;   sin -> cos;   A @ B -> B @ A, A' @ B;   A @ A.T -> A.T @ A;
            2 -> 4, 1;   x**2 -> x;   a minus sign, a transpose, a root left out;   log -> log10
    names   one parameter of the function in the place of another

The text of the function is parsed once.  Each change is made in its tree, compiled, and taken back.
"""

from __future__ import annotations

import ast
import copy
import functools
import inspect
import textwrap
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType
from typing import Any, NamedTuple

CALLS = {
    **{"sin": ("cos",), "cos": ("sin",), "tan": ("sin",), "minimum": ("maximum",), "maximum": ("minimum",)},
    **{"min": ("max",), "max": ("min",), "argmin": ("argmax",), "argmax": ("argmin",)},
    **{"log": ("log10", "log2", "log1p"), "log1p": ("log",), "exp": ("expm1",), "expm1": ("exp",)},
    **{"mean": ("median", "sum"), "median": ("mean",), "sum": ("mean",), "floor": ("ceil", "rint")},
}
"""Functions that are taken for each other."""
PAIRS = ("cross", "arctan2", "times", "matmul")
"""Functions whose first two arguments are exchanged."""
WRAPPERS = ("transpose", "swapaxes", "sqrt", "abs", "inv")
"""Functions that are left out."""
LEFT_ALONE = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Compare, ast.Subscript)
New = ast.expr | dict[str, Any]
"""What stands there instead of an expression, or its changed attributes."""


class ChangedLine(NamedTuple):
    """One changed line: the function, its new code, and what is said of it."""

    target: Any
    code: CodeType
    text: str


class Slip(NamedTuple):
    """One change: the node, the statement it stands in, what is said, and what is new."""

    node: ast.AST
    statement: ast.stmt
    words: str
    new: New


class Remembered:
    """What an iterator gives, made when it is first asked for, and kept."""

    def __init__(self, source: Iterator[ChangedLine]) -> None:
        self._source, self._made = source, list[ChangedLine]()

    def __iter__(self) -> Iterator[ChangedLine]:
        yield from self._made
        for one in self._source:
            self._made.append(one)
            yield one


@functools.cache
def signs(function: FunctionType) -> Remembered:
    """All changes of single operations, numbers and calls."""
    return Remembered(_rewritten(function, _operations))


@functools.cache
def names(function: FunctionType) -> Remembered:
    """All exchanges of one parameter for another, in one place each."""
    return Remembered(_rewritten(function, _parameters))


def _rewritten(
    function: FunctionType, changes: Callable[[ast.FunctionDef, ast.expr], Iterator[tuple[str, New]]]
) -> Iterator[ChangedLine]:
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    except (OSError, TypeError, SyntaxError):
        return
    body = tree.body[0]
    if not isinstance(body, ast.FunctionDef):
        return
    _bare(body)
    place = f"{function.__module__.removeprefix('vslam_ref.')}.{function.__name__}"
    for statement, node in list(_places(body, body)):
        slips = [Slip(node, statement, words, new) for words, new in changes(body, node)]
        line = _cut(ast.unparse(statement)) if slips else ""
        for slip in slips:
            yield from _written(tree, function, slip, line, place)


def _written(
    tree: ast.Module, function: FunctionType, slip: Slip, line: str, place: str
) -> Iterator[ChangedLine]:
    code = _compiled(tree, function, slip)
    if code is not None:
        yield ChangedLine(function, code, f"as if in '{line}' ({place}) {slip.words}")


def _bare(body: ast.FunctionDef) -> None:
    """Leave out what is evaluated where a function is defined: decorators, defaults, annotations."""
    body.decorator_list, body.returns = [], None
    body.args.defaults, body.args.kw_defaults = [], [None] * len(body.args.kwonlyargs)
    for argument in (*body.args.args, *body.args.kwonlyargs, *body.args.posonlyargs):
        argument.annotation = None


def _compiled(tree: ast.Module, function: FunctionType, slip: Slip) -> CodeType | None:
    """Code of the function with the slip; the tree is as before afterwards."""
    kind, before = slip.node.__class__, dict(slip.node.__dict__)
    if isinstance(slip.new, dict):
        slip.node.__dict__.update(slip.new)
    else:
        new = copy.deepcopy(slip.new)
        slip.node.__class__ = new.__class__
        slip.node.__dict__ = {**before, **vars(new)}
    try:
        module = compile(ast.fix_missing_locations(tree), function.__code__.co_filename, "exec")
    finally:
        slip.node.__class__ = kind
        slip.node.__dict__ = before
    codes = [c for c in module.co_consts if isinstance(c, CodeType) and c.co_name == function.__name__]
    return codes[0] if codes and codes[0].co_freevars == function.__code__.co_freevars else None


def _places(node: ast.AST, statement: ast.stmt) -> Iterator[tuple[ast.stmt, ast.expr]]:
    """Every expression that may be changed, in the order of the text; conditions are left alone."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (*LEFT_ALONE, ast.arguments)):
            continue
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
            continue
        inside = child if isinstance(child, ast.stmt) else statement
        if isinstance(child, ast.AugAssign):
            yield inside, child  # type: ignore[misc]
        if isinstance(child, ast.expr):
            yield inside, child
        if isinstance(child, ast.IfExp | ast.If):
            parts = [child.body, child.orelse] if isinstance(child, ast.IfExp) else child.body + child.orelse
            for part in parts:
                within = part if isinstance(part, ast.stmt) else inside
                if isinstance(part, ast.expr):
                    yield within, part
                yield from _places(part, within)
            continue
        yield from _places(child, inside)


def _parameters(body: ast.FunctionDef, node: ast.expr) -> Iterator[tuple[str, New]]:
    """Another parameter for the one that stands there."""
    own = [argument.arg for argument in (*body.args.posonlyargs, *body.args.args) if argument.arg != "self"]
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in own:
        for other in own:
            if other != node.id:
                yield f"'{node.id}' were '{other}'", {"id": other}


def _operations(body: ast.FunctionDef, node: ast.AST) -> Iterator[tuple[str, New]]:
    """What can be done at a node."""
    text = _short(node)
    if isinstance(node, ast.BinOp):
        yield from _operator(node, text)
    elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
        other = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
        yield f"{text} had the other sign", {"op": other}
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield f"the minus sign of {text} were left out", {"op": ast.UAdd()}
    elif isinstance(node, ast.Call):
        yield from _call(node, text)
    elif isinstance(node, ast.Attribute) and node.attr == "T":
        yield f"{text} were not transposed", node.value
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield from _constant(node, float(node.value))  # type: ignore[arg-type]


def _constant(node: ast.Constant, value: float) -> Iterator[tuple[str, New]]:
    """Doubled, halved, one more, one less; 0 and the whole number 1 are mostly counts."""
    whole = isinstance(node.value, int)
    if value == 0 or (whole and value <= 1):
        return
    kind = int if whole else float
    for other in (2 * value, value / 2, value + 1, value - 1):
        if other == kind(other):
            yield f"{node.value!r} were {kind(other)!r}", {"value": kind(other)}


def _operator(node: ast.BinOp, text: str) -> Iterator[tuple[str, New]]:
    left, right = node.left, node.right
    other = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}.get(type(node.op))
    if other is not None:
        yield f"{text} had the other sign of operation", {"op": other()}
        yield f"{text} were {_short(left)} alone", left
    if isinstance(node.op, ast.Add | ast.Sub):
        yield f"{text} were {_short(right)} alone", right
        yield f"{text} were one less", ast.BinOp(node, ast.Sub(), ast.Constant(1))
        yield f"{text} were one more", ast.BinOp(node, ast.Add(), ast.Constant(1))
    if isinstance(node.op, ast.Mult):
        yield f"{text} were {_short(right)} alone", right
    if isinstance(node.op, ast.MatMult):
        yield f"{text} had its factors exchanged", {"left": right, "right": left}
        yield f"{text} were a product of entries", {"op": ast.Mult()}
        yield f"{text} had its first factor transposed", {"left": _transposed(left)}
        yield f"{text} had its second factor transposed", {"right": _transposed(right)}
    if isinstance(node.op, ast.Pow):
        yield f"{text} were without its power", left


def _call(node: ast.Call, text: str) -> Iterator[tuple[str, New]]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    for other in CALLS.get(name, ()):
        if isinstance(node.func, ast.Attribute):
            func: ast.expr = ast.Attribute(node.func.value, other, ast.Load())
        elif name in ("min", "max", "sum") and other in ("min", "max"):
            func = ast.Name(other, ast.Load())
        else:
            continue
        yield f"{text} were {other}", {"func": func}
    if name in PAIRS and len(node.args) >= 2:
        yield f"{text} had its arguments exchanged", {"args": [node.args[1], node.args[0], *node.args[2:]]}
    if name in WRAPPERS and node.args:
        yield f"{name} were left out of {text}", node.args[0]


def _transposed(x: ast.expr) -> ast.expr:
    return ast.Attribute(x, "T", ast.Load())


def _short(node: ast.AST) -> str:
    text = ast.unparse(node)
    return f"'{text}'" if len(text) <= 50 else f"'{text[:49]}…'"


def _cut(line: str, most: int = 90) -> str:
    line = line.partition("\n")[0]
    return line if len(line) <= most else line[: most - 1] + "…"
