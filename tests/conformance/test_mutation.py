"""Mutants: every change is one change, in what computes; and the vectors notice them."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest
from mutation.regimes import regime_mutants, with_regime
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


REGIMES = """
import numpy as np

def f(a, q, n):
    if a < 0:
        raise ValueError("negative")
    if a < 1e-4:
        return 1.0 - q / 6 + q * q / 120
    b = np.where(q > 0.0, q, 1.0)
    c = np.clip(b, -1, 1)
    for k in range(n):
        c = c + k
    return np.polyval((0.5, -0.25, 0.125), c)
"""
WANTED_REGIMES = [
    "a branch always taken", "a branch never taken", "a series shortened", "a sum's last term left out",
    "a threshold 100 times larger", "a threshold 100 times smaller", "clip left out",
    "from the third on the second block", "one side for both, the first", "one side for both, the second",
    *["the limit itself on the other side"] * 2,
]  # fmt: skip


def test_regimes_are_changed_one_at_a_time_and_checks_are_not() -> None:
    found = regime_mutants("m", REGIMES)
    assert sorted(m.text for m in found) == sorted([*WANTED_REGIMES])
    texts = {m.text: with_regime(REGIMES, m.number) for m in found}
    assert "if True:\n        return 1.0" in texts["a branch always taken"]
    assert "np.where(q > 0.0, 1.0, 1.0)" in texts["one side for both, the second"]
    assert "1.0 - q / 6 + 0.0" in texts["a sum's last term left out"]
    assert "(0.5, -0.25, 0.0)" in texts["a series shortened"]
    assert "c = _same(b)" in texts["clip left out"]
    assert "k = min(k, 1)" in texts["from the third on the second block"]
    assert "a < 0.0001 * 100.0" in texts["a threshold 100 times larger"]
    for text in texts.values():
        ast.parse(text)


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
        for m in (*mutants(module, source), *regime_mutants(module, source)):
            name = f"{module.removeprefix('vslam_ref.')}.{m.function}"
            known.add((name, lines[m.line - 1].strip(), m.text))
    assert set(EQUIVALENT) <= known
    assert all(len(reason) > 10 for reason in EQUIVALENT.values())
