"""`import vslam_ref` stays as cheap as NumPy, and every module says what it is."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted((ROOT / "vslam_ref").rglob("*.py"))
HEAVY = ("scipy", "matplotlib", "cv2", "numba", "joblib", "tqdm", "dask", "distributed", "sympy")
PROBE = "import json, sys, vslam_ref; print(json.dumps(sorted({m.partition('.')[0] for m in sys.modules})))"


def test_importing_the_package_loads_no_heavy_package() -> None:
    done = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, check=True, cwd=ROOT)
    loaded = set(json.loads(done.stdout))
    assert "vslam_ref" in loaded
    assert loaded.isdisjoint(HEAVY), loaded & set(HEAVY)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_module_has_a_docstring(path: Path) -> None:
    docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert docstring, f"{path.name}: begin the file with what it holds"
