"""``make vectors`` and ``make vectors-check``; the generator knows nothing of the rooms that it tests."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

pytest.importorskip("mpmath", reason="the generator needs mpmath (extra `test`)")

from generate import main

GENERATOR = Path(__file__).parent / "generator"
ALLOWED = ("vslam_ref.arrays", "vslam_ref.conformance")


def test_one_topic_is_generated(tmp_path: Path) -> None:
    assert main(["--topic", "so2", "--out", str(tmp_path)]) == 0
    written = tmp_path / "02" / "so2.json"
    assert main(["--topic", "so2", "--out", str(tmp_path), "--check"]) == 0
    written.write_text(written.read_text() + " ")
    assert main(["--topic", "so2", "--out", str(tmp_path), "--check"]) == 1
    assert main(["--topic", "so4", "--out", str(tmp_path)]) == 2


def imported(path: Path) -> set[str]:
    """Modules of the library that a file imports, anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return {name for name in names if name.split(".")[0] == "vslam_ref"}


@pytest.mark.parametrize("path", sorted(GENERATOR.glob("*.py")), ids=lambda p: p.stem)
def test_vectors_are_not_made_with_what_they_test(path: Path) -> None:
    strangers = {name for name in imported(path) if not name.startswith(ALLOWED)}
    assert not strangers, f"{path.name} imports {strangers}: an oracle must not use what it judges"


def test_the_check_sees_an_import_inside_a_function(tmp_path: Path) -> None:
    path = tmp_path / "bad.py"
    path.write_text("def f():\n    from vslam_ref.geometry import so3\n")
    assert imported(path) == {"vslam_ref.geometry.so3"}
