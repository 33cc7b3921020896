"""Where a function treats some arguments apart, and what a program gets wrong there.

A formula may be right in the middle and wrong at an edge.  So branches are changed, not operators::

    if a < 1e-4: series      a branch always, or never, taken; its threshold a hundred times larger or smaller
    else:        closed      a series shortened by its last term; <= for <, where both sides are not the same
    where(q > 0, ...)        a special value mishandled: one side for both
    clip(x, -1, 1)           a guard left out
    for k in range(n)        from the third on the block of the second

All functions are changed, whether they cite an equation or not: a series is often a helper.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from typing import TypeGuard

from mutation.sites import Carry, Change, Mutant, changed, listed

GUARDS = ("clip", "maximum", "minimum", "copysign", "nan_to_num")
FLIPS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
}


def regime_mutants(module: str, source: str) -> list[Mutant]:
    """All changes of the regimes of a module's functions."""
    return listed(module, source, _changes)


def with_regime(source: str, number: int) -> str:
    """Source with one change made."""
    return changed(source, number, _changes)


def _changes(tree: ast.Module, make: int | None = None) -> Iterator[tuple[str, ast.AST, str]]:
    number = 0
    for name, function in _functions(tree):
        refusals = [node for node in ast.walk(function) if _only_checks(node)]
        tests = {id(part) for refusal in refusals for part in ast.walk(refusal.test)}
        for node in ast.walk(function):
            if node is function or _only_checks(node) or id(node) in tests:
                continue
            for text, change in _of(node):
                if number == make:
                    change()
                yield name, node, text
                number += 1


def _functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from ((f"{node.name}.{f.name}", f) for f in node.body if isinstance(f, ast.FunctionDef))


def _only_checks(node: ast.AST) -> TypeGuard[ast.If]:
    """A refusal of bad input: another test has it."""
    return isinstance(node, ast.If) and all(isinstance(s, ast.Raise) for s in node.body)


def _of(node: ast.AST) -> Iterator[Change]:
    if isinstance(node, ast.If | ast.IfExp):
        yield "a branch always taken", Carry(node, test=ast.Constant(True))
        yield "a branch never taken", Carry(node, test=ast.Constant(False))
    elif isinstance(node, ast.Call):
        yield from _call(node)
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        yield from _comparison(node)
    elif isinstance(node, ast.Tuple | ast.List) and _is_series(node):
        yield "a series shortened", Carry(node, elts=[*node.elts[:-1], ast.Constant(0.0)])
    elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub) and _is_sum(node.left):
        yield "a sum's last term left out", Carry(node, op=ast.Add(), right=ast.Constant(0.0))
    elif isinstance(node, ast.For):
        yield from _loop(node)


def _call(node: ast.Call) -> Iterator[Change]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    if name == "where" and len(node.args) == 3:
        condition, a, b = node.args
        yield "one side for both, the first", Carry(node, args=[condition, a, copy.deepcopy(a)])
        yield "one side for both, the second", Carry(node, args=[condition, copy.deepcopy(b), b])
    elif name in GUARDS and node.args:
        same = ast.Name("_same", ast.Load())
        yield f"{name} left out", Carry(node, func=same, args=node.args[:1], keywords=[])


def _comparison(node: ast.Compare) -> Iterator[Change]:
    op, right = node.ops[0], node.comparators[0]
    if type(op) in FLIPS:
        yield "the limit itself on the other side", Carry(node, ops=[FLIPS[type(op)]()])
        for factor, text in (
            (100.0, "a threshold 100 times larger"),
            (0.01, "a threshold 100 times smaller"),
        ):
            if not (isinstance(right, ast.Constant) and right.value == 0):
                scaled = ast.BinOp(copy.deepcopy(right), ast.Mult(), ast.Constant(factor))
                yield text, Carry(node, comparators=[scaled])


def _is_series(node: ast.Tuple | ast.List) -> bool:
    """Coefficients: three numbers and more, not all whole."""
    values = [_number(e) for e in node.elts]
    return len(values) >= 3 and None not in values and any(v != int(v) for v in values if v is not None)


def _number(node: ast.expr) -> float | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _number(node.operand)
        return None if value is None else -value
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        a, b = _number(node.left), _number(node.right)
        return None if a is None or not b else a / b
    return None


def _is_sum(node: ast.expr) -> bool:
    """A sum of two terms and more, before the last one."""
    return isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)


def _loop(node: ast.For) -> Iterator[Change]:
    """The first whole number of a loop over range or enumerate stays at 1."""
    called = (
        node.iter.func.id if isinstance(node.iter, ast.Call) and isinstance(node.iter.func, ast.Name) else ""
    )
    target = node.target.elts[0] if isinstance(node.target, ast.Tuple) else node.target
    if called in ("range", "enumerate") and isinstance(target, ast.Name) and _uses(node.body, target.id):
        least = ast.parse(f"{target.id} = min({target.id}, 1)").body
        yield "from the third on the second block", Carry(node, body=[*least, *node.body])


def _uses(body: list[ast.stmt], name: str) -> bool:
    """Whether a loop looks at its number at all."""
    return any(isinstance(n, ast.Name) and n.id == name for part in body for n in ast.walk(part))
