"""Grading of exercises: the tests that check the published solution also grade a student's file.

    pytest tests/<chapter>/test_exercise.py                      # the published solution
    pytest tests/<chapter>/test_exercise.py --student mine.py    # a student's file

Such a test module says ``EXERCISE = "16_name"`` and takes the fixture ``answer``: the module loaded from
``docs/chapters/solutions/16_name.py`` or from the student's file.

Property tests draw the same examples in every run.  ``make test-random`` draws fresh ones
(``--hypothesis-profile=fresh``); what it finds is mended, and pinned with ``@example``.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import hypothesis
import pytest

hypothesis.settings.register_profile("repeatable", deadline=None, database=None, derandomize=True)
hypothesis.settings.register_profile("fresh", deadline=None, database=None, max_examples=1000)
hypothesis.settings.load_profile("repeatable")

SOLUTIONS = Path(__file__).resolve().parents[1] / "docs" / "chapters" / "solutions"


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
