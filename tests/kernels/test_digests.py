"""No stale twin: who changes one of the two forms of a function sees the change, or is told what to do.

The package is copied, one line of the copy is changed, and a fresh process runs the copy.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vslam_ref._kernels import _digests

from . import bless

pytest.importorskip("numba", reason="the twins need numba (extra `fast`)")

ROOT = Path(__file__).resolve().parents[2]
PROBE = """
import json, sys, warnings
import numpy as np
from vslam_ref import _kernels
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.vehicle import Increment
from vslam_ref.support.errors import InputError

slam, error = EkfSlam(np.zeros((1, 3)), np.eye(3)), None
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    try:
        for _ in range(3):
            slam.predict(Increment(np.ones(1), np.full(1, 0.5), np.zeros((1, 2, 2))))
    except InputError as refused:
        error = str(refused)
said = [str(warning.message) for warning in said]
found = {"said": said, "error": error, "numba": "numba" in sys.modules, "aside": _kernels.set_aside()}
print(json.dumps(found | {"x": slam.pose().mean[0].round(9).tolist()}))
"""
STEPS = [0.0, 0.5, 1.0]  # the headings in which the three metres are driven
DRIVEN = np.array([np.cos(STEPS).sum(), np.sin(STEPS).sum(), 1.5])


def copy_of(folder: Path) -> Path:
    """Copy the package, its digests and the tests of the twins, without what was compiled."""
    left_out = shutil.ignore_patterns("__pycache__")
    for name in ("vslam_ref", "tests/kernels"):
        shutil.copytree(ROOT / name, folder / name, ignore=left_out)
    for name in ("pyproject.toml", "tests/conftest.py"):
        shutil.copy(ROOT / name, folder / name)
    return folder


def run(folder: Path, *arguments: str, **settings: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("VSLAM_REF", "NUMBA_CACHE"))}
    environment |= {"PYTHONPATH": str(folder), **settings}
    command = [sys.executable, *arguments]
    cwd = folder if folder.is_dir() else folder.parent  # an archive is imported as it is
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def probe(folder: Path, backend: str) -> dict[str, Any]:
    done = run(folder, "-c", PROBE, VSLAM_REF_BACKEND=backend)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)  # type: ignore[no-any-return]


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{path.name}: {old!r} is there {text.count(old)} times"
    path.write_text(text.replace(old, new), encoding="utf-8")


def test_the_stored_digests_are_those_of_the_sources() -> None:
    """After a change of a NumPy function or a kernel: ``make twins``."""
    assert bless.differences(_digests.stored(), bless.current()) == []


def test_a_pair_reaches_what_it_imports() -> None:
    """Also through a package's ``__init__``, but not what stands beside the imported name there."""
    pairs = dict(bless.pairs())
    assert {"filters/vehicle.py", "geometry/so2.py", "_kernels/slam.py", "_kernels/_blocks.py"} <= set(
        pairs["slam:ekf_update_in_place"]
    )
    assert not [name for name in pairs["slam:ekf_update_in_place"] if "cameras" in name]
    assert all("_kernels/__init__.py" not in files for files in pairs.values())


def test_a_changed_sign_is_seen(tmp_path: Path) -> None:
    """What runs is the changed NumPy function, with one warning; who demands Numba is refused."""
    folder, name = copy_of(tmp_path), "filters/vehicle.py"
    edit(
        folder / "vslam_ref" / name,
        "c, s = np.cos(theta), np.sin(theta)",
        "c, s = -np.cos(theta), np.sin(theta)",
    )
    found = probe(folder, "auto")
    assert np.abs(found["x"] - DRIVEN * [-1, 1, 1]).max() < 1e-8
    assert len(found["said"]) == 1
    assert name in found["said"][0]
    assert "make twins" in found["said"][0]
    assert "slam:ekf_predict_in_place" in found["aside"]  # what a result's provenance says
    assert "grids:apply_plain" not in found["aside"]
    assert not found["numba"]
    refused = probe(folder, "numba")
    assert name in refused["error"]
    assert "make twins" in refused["error"]
    assert refused["x"] == [0.0, 0.0, 0.0]


def test_remarks_and_line_ends_change_nothing(tmp_path: Path) -> None:
    """All sources get a first line and the line ends of another system: Numba runs, and nothing is said."""
    folder = copy_of(tmp_path)
    for path in (folder / "vslam_ref").rglob("*.py"):
        text = "# a remark\n" + path.read_text(encoding="utf-8").replace(
            '"""\n\nfrom', ' More words."""\n\nfrom'
        )
        path.write_text(text, encoding="utf-8", newline="\r\n")
    found = probe(folder, "numba")
    assert np.abs(found["x"] - DRIVEN).max() < 1e-8
    assert found["said"] == []
    assert found["error"] is None
    assert found["aside"] == []
    assert found["numba"]


def test_without_digests_or_sources(tmp_path: Path) -> None:
    """A pair that was never tested does not run; in a package without sources nothing was changed."""
    folder = copy_of(tmp_path / "first")
    (folder / "vslam_ref" / "_kernels" / "digests.json").unlink()
    found = probe(folder, "auto")
    assert len(found["said"]) == 1
    assert not found["numba"]
    whole = copy_of(tmp_path / "second")
    archive = shutil.make_archive(str(tmp_path / "package"), "zip", whole, "vslam_ref")
    found = probe(Path(archive), "numba")
    assert np.abs(found["x"] - DRIVEN).max() < 1e-8
    assert found["error"] is None


def test_a_warm_cache_does_not_hide_a_change_of_a_part(tmp_path: Path) -> None:
    """Numba alone would go on with the old machine code: the kernel's own file is as it was."""
    folder = copy_of(tmp_path)
    tests = "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/kernels/test_twins.py"
    one = "-k", "test_twin_does_what_numpy_does and reduced_apply and 1-1"
    assert run(folder, *tests, *one).returncode == 0
    edit(folder / "vslam_ref" / "_kernels" / "_blocks.py", "== P_mm.itemsize", "== -P_mm.itemsize")
    done = run(folder, *tests, *one)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "1 failed" in done.stdout


def test_the_users_cache_folder_is_respected(tmp_path: Path) -> None:
    folder = copy_of(tmp_path / "copy")
    code = "from vslam_ref._kernels._signature import cache_folder; print(cache_folder())"
    assert run(folder, "-c", code).stdout.startswith(str(folder / "vslam_ref" / "_kernels" / "__pycache__"))
    own = tmp_path / "own"
    before = run(folder, "-c", code, NUMBA_CACHE_DIR=str(own)).stdout
    assert before.startswith(str(own / "kernels-"))
    part = folder / "vslam_ref" / "_kernels" / "_blocks.py"
    part.write_text(part.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert run(folder, "-c", code, NUMBA_CACHE_DIR=str(own)).stdout != before


def test_kernels_are_declared_with_the_house_s_own_decorator() -> None:
    """Numba's own would keep the code in a folder that no digest names."""
    for path in sorted((ROOT / "vslam_ref" / "_kernels").glob("*.py")):
        assert "from numba import njit" not in path.read_text(encoding="utf-8"), path.name
