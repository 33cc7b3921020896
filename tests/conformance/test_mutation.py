"""Mutants: every change is one change, in what computes; and the vectors notice them."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest
from mutation.sites import mutants, mutated

SOURCE = '''
import numpy as np

def helper(x):
    return x + 1

def f(a, b=2 + 3):
    """One line.

    Implements :eq:`eq-x`.
    """
    if a < 0:
        raise ValueError(f"a={a - 1}")
    c: float = np.sin(a) - 2 * b
    M = (a @ b).T
    return -c + M ** 2

class C:
    def g(self, a, b):
        """Implements :eq:`eq-y`."""
        a += b
        return np.cross(a, b)
'''
WANTED = [
    ("f", "- to +"), ("f", "sin to cos"), ("f", "* to /"), ("f", "2 to 4"), ("f", "a transpose left out"),
    ("f", "factors exchanged"), ("f", "+ to -"), ("f", "a minus sign left out"), ("f", "a power left out"),
    ("f", "2 to 4"), ("C.g", "the sign of an addition in place"),
    ("C.g", "factors of a cross product exchanged"),
]  # fmt: skip


def test_all_that_computes_is_changed_and_nothing_else() -> None:
    """No helper without a citation, no default value, no message, no check."""
    found = [(m.function, m.text) for m in mutants("m", SOURCE)]
    assert sorted(found) == sorted(WANTED)


def test_every_mutant_is_one_change() -> None:
    """Another text each, valid Python, and the original apart from one node."""
    plain = ast.unparse(ast.parse(SOURCE))
    texts = [mutated(SOURCE, m.number) for m in mutants("m", SOURCE)]
    assert len(set(texts)) == len(texts)
    for text in texts:
        ast.parse(text)
        differing = [a != b for a, b in zip(plain.splitlines(), text.splitlines(), strict=True)]
        assert sum(differing) == 1


def test_words_say_what_is_done() -> None:
    by_text = {(m.function, m.text): mutated(SOURCE, m.number) for m in mutants("m", SOURCE)}
    assert "np.sin(a) + 2 * b" in by_text["f", "- to +"]
    assert "(b @ a).T" in by_text["f", "factors exchanged"]
    assert "return +c + M" in by_text["f", "a minus sign left out"]
    assert "np.cross(b, a)" in by_text["C.g", "factors of a cross product exchanged"]
    assert "a -= b" in by_text["C.g", "the sign of an addition in place"]


STUDY = """
from mutation import child, study
study._names = lambda: ["02/so3.json"]
found = study.study(4, 0, 2)
those = [name for name in found.functions if name.startswith("vslam_ref.geometry.so3")]
print(found.killed, len(found.sample), len(those))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="mutants need os.fork")
def test_the_vectors_notice_mutants_of_rotations() -> None:
    """In an interpreter of its own, which has not imported what is changed."""
    here = str(Path(__file__).parent)
    path = os.pathsep.join(filter(None, [here, os.environ.get("PYTHONPATH", "")]))
    done = subprocess.run(
        [sys.executable, "-c", STUDY],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"PYTHONPATH": path},
    )
    assert done.stdout.split() == ["4", "4", "4"]


def test_every_equivalent_mutant_exists() -> None:
    """A reason for a line that was rewritten would hide a mutant that nobody thought about."""
    from mutation.child import source_of
    from mutation.equivalent import EQUIVALENT
    from mutation.study import modules

    known = set()
    for module in modules():
        source = source_of(module)[0]
        lines = source.splitlines()
        for m in mutants(module, source):
            name = f"{module.removeprefix('vslam_ref.')}.{m.function}"
            known.add((name, lines[m.line - 1].strip(), m.text))
    assert set(EQUIVALENT) <= known
    assert all(len(reason) > 10 for reason in EQUIVALENT.values())
