"""Every exercise can be graded: its solution is checked, its stub fails, both offer the same names."""

from __future__ import annotations

import ast
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STUBS = ROOT / "docs" / "chapters" / "exercises"
SOLUTIONS = ROOT / "docs" / "chapters" / "solutions"


def declared_exercises() -> dict[str, list[Path]]:
    tools = ROOT / "docs" / "_tools"
    sys.path.insert(0, str(tools))
    try:
        spec = importlib.util.spec_from_file_location("grade", tools / "grade.py")
        assert spec is not None
        assert spec.loader is not None
        grade = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(grade)
    finally:
        sys.path.remove(str(tools))
    return grade.exercises()


DECLARED = declared_exercises()
NAMES = sorted(path.stem for path in STUBS.glob("[0-9]*.py"))


def signatures(path: Path) -> dict[str, str]:
    """Public functions of a file with their argument names."""
    return {
        node.name: ast.unparse(node.args)
        for node in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
    }


def run_pytest(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *arguments]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_stubs_solutions_and_tests_come_together() -> None:
    assert sorted(path.stem for path in SOLUTIONS.glob("[0-9]*.py")) == NAMES
    assert sorted(DECLARED) == NAMES
    assert all(len(modules) == 1 for modules in DECLARED.values())


@pytest.mark.parametrize("name", NAMES)
def test_stub_and_solution_offer_the_same_functions(name: str) -> None:
    wanted = signatures(STUBS / f"{name}.py")
    offered = signatures(SOLUTIONS / f"{name}.py")
    assert wanted
    assert {key: offered.get(key) for key in wanted} == wanted


@pytest.mark.parametrize("name", NAMES)
def test_unsolved_stub_fails(name: str) -> None:
    module = str(DECLARED[name][0].relative_to(ROOT))
    done = run_pytest(ROOT, module, "--student", str(STUBS / f"{name}.py"))
    assert done.returncode == 1, done.stdout + done.stderr  # 1: tests ran and failed; 2-5: nothing was graded
    assert "NotImplementedError" in done.stdout


# --- the mechanism itself, on a toy course of its own ---------------------------------------------

TOY_TEST = """
EXERCISE = "99_twice"

def test_twice(answer):
    assert answer.twice(4) == 8
"""


@pytest.fixture
def course(tmp_path: Path) -> Path:
    """Build a course with one exercise, graded by this project's own conftest."""
    (tmp_path / "tests" / "toy").mkdir(parents=True)
    (tmp_path / "docs" / "chapters" / "solutions").mkdir(parents=True)
    shutil.copy(ROOT / "tests" / "conftest.py", tmp_path / "tests")
    (tmp_path / "tests" / "toy" / "test_exercise.py").write_text(TOY_TEST)
    (tmp_path / "tests" / "toy" / "test_other.py").write_text("def test_nothing():\n    pass\n")
    solution = tmp_path / "docs" / "chapters" / "solutions" / "99_twice.py"
    solution.write_text("def twice(x):\n    return 2 * x\n")
    (tmp_path / "pytest.ini").write_text("[pytest]\ntestpaths = tests\n")
    return tmp_path


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("def twice(x):\n    return x + x\n", 0),
        ("def twice(x):\n    return -2 * x\n", 1),
        ("def twice(x):\n    raise NotImplementedError\n", 1),
        ("def twice(x:\n", 1),
    ],
    ids=["right", "wrong sign", "unsolved", "no Python"],
)
def test_a_students_file_is_graded_by_what_it_computes(course: Path, text: str, status: int) -> None:
    (course / "mine.py").write_text(text)
    done = run_pytest(course, "tests/toy/test_exercise.py", "--student", "mine.py")
    assert done.returncode == status, done.stdout + done.stderr


def test_without_a_students_file_the_solution_is_checked(course: Path) -> None:
    assert run_pytest(course, "tests").returncode == 0
    (course / "docs" / "chapters" / "solutions" / "99_twice.py").write_text("def twice(x):\n    return x\n")
    assert run_pytest(course, "tests").returncode == 1


def test_a_students_file_needs_one_exercise(course: Path) -> None:
    (course / "mine.py").write_text("def twice(x):\n    return 2 * x\n")
    done = run_pytest(course, "tests", "--student", "mine.py")
    assert done.returncode == 4  # usage error
    assert "name its test_exercise file" in done.stdout + done.stderr
    missing = run_pytest(course, "tests/toy/test_exercise.py", "--student", "none.py")
    assert missing.returncode == 1
