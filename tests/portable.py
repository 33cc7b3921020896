"""Run the tests of the numeric rooms as other processors would compute them: ``make test-portable``.

    python tests/portable.py                       # both of the following
    python tests/portable.py prescott              # neither AVX nor FMA
    python tests/portable.py haswell -- -n 2       # AVX2 and FMA, no AVX-512; pytest's arguments behind --

OpenBLAS, NumPy and Numba are asked for the code of an older processor, and the run begins by checking that
each of them does so.  This needs x86 and OpenBLAS; elsewhere the tests run as they are, which is said.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
# What is not numeric: programs, files, pictures, the house itself.
OTHERS = {
    *(
        "bench",
        "cli",
        "conformance",
        "datasets",
        "docs",
        "experiments",
        "grid_command",
        "grids_experiments",
        "house",
    ),
    *("iekf_claims", "iekf_sensitivity", "iekf_study", "moving", "plot", "run_log"),
}
DOCTESTS = (
    "geometry",
    "interop.py",
    "estimation",
    "filters",
    "features",
    "metrics",
    "grids",
    "worlds",
    "systems",
)


class Processor(NamedTuple):
    """A processor: what OpenBLAS and Numba call it, and words in the features that NumPy must not use."""

    openblas: str
    shown: frozenset[str]  # by threadpoolctl: some of OpenBLAS' kernels have several names
    numba: str
    off: tuple[str, ...]


PROCESSORS = {
    "prescott": Processor("Prescott", frozenset({"Prescott", "Katmai"}), "generic", ("",)),
    "haswell": Processor("Haswell", frozenset({"Haswell"}), "haswell", ("V4", "AVX512")),
}
PROBE = """
import json, numba, numpy, scipy.linalg, threadpoolctl
try:
    from numpy._core._multiarray_umath import __cpu_features__ as features
except ImportError:
    from numpy.core._multiarray_umath import __cpu_features__ as features
blas = [p["architecture"] for p in threadpoolctl.threadpool_info() if p["internal_api"] == "openblas"]
print(json.dumps([[name for name, there in features.items() if there], blas, numba.config.CPU_NAME]))
"""


def dispatched() -> list[str]:
    """Features for which this NumPy has code of its own, by NumPy's names."""
    try:
        from numpy._core import _multiarray_umath as umath
    except ImportError:  # NumPy 1
        from numpy.core import _multiarray_umath as umath
    return list(umath.__cpu_dispatch__)


def settings(processor: Processor) -> dict[str, str]:
    """Environment of a run."""
    off = [name for name in dispatched() if any(word in name for word in processor.off)]
    return {
        "OPENBLAS_CORETYPE": processor.openblas,
        "NPY_DISABLE_CPU_FEATURES": " ".join(off),
        "NUMBA_CPU_NAME": processor.numba,
    }


def what_is_wrong(processor: Processor, environment: dict[str, str]) -> str:
    """Ask a process with this environment what it computes with; empty if that is what was asked for."""
    done = subprocess.run(
        [sys.executable, "-c", PROBE], env=environment, capture_output=True, text=True, check=True
    )
    features, blas, cpu = json.loads(done.stdout)
    left = set(environment["NPY_DISABLE_CPU_FEATURES"].split()) & set(features)
    if left:
        return f"NumPy still uses {', '.join(sorted(left))}"
    if not blas or not set(blas) <= processor.shown:
        return f"OpenBLAS runs {blas or 'not at all'}, asked for {processor.openblas}"
    return "" if cpu == processor.numba else f"Numba compiles for {cpu}"


def targets() -> list[str]:
    """Test folders and doctests of the numeric rooms."""
    rooms = sorted(p.name for p in (ROOT / "tests").iterdir() if p.is_dir() and p.name not in OTHERS)
    found = [f"tests/{name}" for name in rooms if not name.startswith(("_", "."))]
    return [*found, *(f"vslam_ref/{name}" for name in DOCTESTS if (ROOT / "vslam_ref" / name).exists())]


def run(name: str, extra: dict[str, str], arguments: list[str]) -> int:
    """Check the processor, then run the tests; returns pytest's exit status."""
    environment = os.environ | extra
    if extra and (wrong := what_is_wrong(PROCESSORS[name], environment)):
        print(f"{name}: {wrong}", file=sys.stderr)
        return 1
    print(
        f"{name}: " + (", ".join(f"{k}={v}" for k, v in extra.items()) or "as this machine computes"),
        flush=True,
    )
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--ignore=tests/kernels/test_digests.py",
    ]
    return subprocess.run(
        [*command, *arguments, *targets()], cwd=ROOT, env=environment, check=False
    ).returncode


def main(words: list[str]) -> int:
    """Command line."""
    cut = words.index("--") if "--" in words else len(words)
    names, arguments = words[:cut], words[cut + 1 :]
    if not set(names) <= set(PROCESSORS):
        print(__doc__, file=sys.stderr)
        return 2
    import numpy  # noqa: F401 - loads its BLAS
    from threadpoolctl import threadpool_info

    openblas = any(pool["internal_api"] == "openblas" for pool in threadpool_info())
    if platform.machine().lower() not in ("x86_64", "amd64") or not openblas:
        print("no x86 processor with OpenBLAS: the tests run once, as this machine computes")
        return run("this machine", {}, arguments)
    return max(run(name, settings(PROCESSORS[name]), arguments) for name in names or PROCESSORS)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
