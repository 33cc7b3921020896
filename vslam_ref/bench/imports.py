"""IM-1: what an import costs, and the first accelerated call, in fresh interpreters."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from vslam_ref._kernels import available
from vslam_ref.bench.rows import Row, row

GOAL_IMPORT, GOAL_FIRST_CALL = 1.5, 1.1

_FIRST_CALL = """
import time, numpy as np
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.vehicle import Increment
slam = EkfSlam(np.zeros((1, 3)), np.eye(3))
start = time.perf_counter()
slam.predict(Increment(np.ones(1), np.zeros(1), np.zeros((1, 2, 2))))
print(time.perf_counter() - start)
"""
_EMPTY_KERNEL = """
from numba import njit

@njit("void(float64[:])", cache=True)
def kernel(x):
    pass
"""
_NUMBA_ALONE = """
import time, numpy as np
start = time.perf_counter()
import empty_kernel
empty_kernel.kernel(np.zeros(1))
print(time.perf_counter() - start)
"""


def imports(quick: bool) -> list[Row]:
    """IM-1, and beside it the part of the first call that any program with one Numba kernel pays."""
    repeats = 3 if quick else 9
    ratios = []
    for _ in range(repeats):
        base = _seconds(_timed("import numpy"))
        ratios.append(_seconds(_timed("import vslam_ref, numpy")) / base)
    case = "import vslam_ref / import numpy"
    rows = [row("IM-1", case, "-", float(np.median(ratios)), "x", GOAL_IMPORT)]
    if "numba" not in available():
        return rows
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "empty_kernel.py").write_text(_EMPTY_KERNEL)
        pairs = [(_seconds(_FIRST_CALL), _seconds(_NUMBA_ALONE, folder)) for _ in range(repeats + 1)]
    first, alone = np.median(pairs[1:], 0)  # the first pair may compile
    ratio = float(np.median([a / b for a, b in pairs[1:]]))
    return [
        *rows,
        row(
            "IM-1", "first accelerated call / numba and an empty kernel", "numba", ratio, "x", GOAL_FIRST_CALL
        ),
        row("IM-1", "first accelerated call, warm cache", "numba", float(first), "s"),
        row("IM-1", "import numba and an empty kernel, warm cache", "numba", float(alone), "s"),
    ]


def _timed(code: str) -> str:
    return f"import time; start = time.perf_counter(); {code}; print(time.perf_counter() - start)"


def _seconds(code: str, folder: str | None = None) -> float:
    """What a fresh interpreter prints, started in ``folder``."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=folder
    )
    return float(done.stdout)
