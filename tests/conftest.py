"""Grading of exercises: the tests that check the published solution also grade a student's file.

    pytest tests/<chapter>/test_exercise.py                      # the published solution
    pytest tests/<chapter>/test_exercise.py --student mine.py    # a student's file

Such a test module says ``EXERCISE = "16_name"`` and takes the fixture ``answer``: the module loaded from
``docs/chapters/solutions/16_name.py`` or from the student's file.

Property tests draw the same examples in every run.  ``make test-random`` draws fresh ones
(``--hypothesis-profile=fresh``); what it finds is mended, and pinned with ``@example``.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import hypothesis
import pytest

from vslam_ref import _kernels

hypothesis.settings.register_profile("repeatable", deadline=None, database=None, derandomize=True)
hypothesis.settings.register_profile("fresh", deadline=None, database=None, max_examples=1000)
hypothesis.settings.load_profile("repeatable")


@pytest.fixture(params=["numpy", "numba"])
def backend(request: pytest.FixtureRequest) -> Iterator[str]:
    """Run a test with both backends."""
    if request.param == "numba":
        pytest.importorskip("numba", reason="the twins need numba (extra `fast`)")
    with _kernels.use_backend(request.param):
        yield request.param


DOCS = Path(__file__).resolve().parents[1] / "docs"
SOLUTIONS = DOCS / "chapters" / "solutions"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--student", metavar="FILE", help="grade this file instead of the solution")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With ``--student``, exactly one exercise may be selected."""
    if config.getoption("--student", default=None) is None:
        return
    exercises = {getattr(getattr(item, "module", None), "EXERCISE", None) for item in items}
    if len(exercises) != 1 or None in exercises:
        raise pytest.UsageError("--student grades one exercise: name its test_exercise file")


@pytest.fixture(scope="module")
def answer(request: pytest.FixtureRequest) -> ModuleType:
    """Load the module under grading: the published solution, or the student's file."""
    name = request.module.EXERCISE
    student = request.config.getoption("--student", default=None)
    path = request.config.invocation_params.dir / student if student else SOLUTIONS / f"{name}.py"
    if not path.is_file():
        pytest.fail(f"no such file: {path}", pytrace=False)
    spec = importlib.util.spec_from_file_location(f"answer_{name}", path)
    assert spec is not None, path
    assert spec.loader is not None, path
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def book_tool() -> Callable[[str], ModuleType]:
    """Import a script of ``docs/_tools`` by its name; these import each other by theirs."""

    def load(name: str) -> ModuleType:
        with pytest.MonkeyPatch.context() as patch:
            patch.syspath_prepend(str(DOCS / "_tools"))
            return importlib.import_module(name)

    return load


@pytest.fixture(scope="session")
def index(book_tool: Callable[[str], ModuleType]) -> ModuleType:
    """The tool that knows which code cites which equation."""
    return book_tool("equation_index")


class _SignFlip(ast.NodeTransformer):
    """Change the sign of one sum, difference or negative number: the one with this number."""

    def __init__(self, number: int) -> None:
        self.left, self.line = number, 0

    def visit(self, node: ast.AST) -> ast.AST:
        node = super().generic_visit(node)
        sums = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)
        negative = isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub)
        if not (sums or negative):
            return node
        self.left -= 1
        if self.left != -1:
            return node
        self.line = node.lineno
        if isinstance(node, ast.UnaryOp):
            return node.operand
        node.op = ast.Sub() if isinstance(node.op, ast.Add) else ast.Add()
        return node


def sign_flips(module: ModuleType) -> Iterator[tuple[str, ModuleType]]:
    """The module once for every sign in its functions, that sign changed: (the line, the module)."""
    source = inspect.getsource(module)
    number = 0
    while True:
        flip = _SignFlip(number)
        tree = flip.visit(ast.parse(source))
        if not flip.line:
            return
        number += 1
        line = source.splitlines()[flip.line - 1].strip()
        twin = ModuleType(module.__name__)
        exec(compile(ast.fix_missing_locations(tree), f"{module.__name__} with a flip", "exec"), vars(twin))
        yield line, twin


@pytest.fixture(scope="session")
def flips() -> Callable[[ModuleType], Iterator[tuple[str, ModuleType]]]:
    return sign_flips
