"""``vslam-ref bench bundle``: bundle adjustment on this machine, beside SciPy, Ceres and GTSAM.

===== =============================================================================================
goal  what is measured, on one thread, in CPU seconds, medians of paired ratios
===== =============================================================================================
BA-1  the SciPy cookbook's recipe over ours, to equal or lower cost
BA-2  an iteration of ours over one of Ceres (pyceres, compiled costs, dense Schur complement)
BA-3  steps until the cost is within 1e-4 of the best peer's, ours over Ceres'
BA-4  time of an iteration when a chain of views is doubled; extra memory per observation
===== =============================================================================================

Building a problem is timed for nobody.  All solutions are judged by one cost function,
:func:`.problems.cost`.  Peers that are not installed are named and left out (``pip install ".[peers]"``).
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import itertools
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from vslam_ref import _kernels
from vslam_ref.bench.bundle import peers
from vslam_ref.bench.bundle.problems import chain, cost, published
from vslam_ref.bench.rows import row
from vslam_ref.estimation.bundle import BundleProblem, BundleResult, Options, bundle_adjust

Row = dict[str, Any]
CERES_TOLERANCE = Options(cost=1e-6)
"""Ceres ends where a step decreases the cost by less than a millionth: so do we, here."""

GOALS_BA_1 = {
    ("chain", "numpy"): 10.0,
    ("BAL", "numpy"): 20.0,
    ("chain", "numba"): 40.0,
    ("BAL", "numba"): 80.0,
}
GOALS_BA_2 = {"numpy": 0.8, "numba": 0.25}
GOAL_BA_3, GOAL_BA_4, GOAL_MEMORY = 1.2, 2.6, 2000.0
NEAR = 1.0001


class Timed(NamedTuple):
    """CPU seconds of a call, and what it returned."""

    seconds: float
    value: Any


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything; ``rows`` is a list of flat records, one per figure."""
    backends = [b for b in ("numpy", "numba") if b == "numpy" or importlib.util.find_spec("numba")]
    found: dict[str, BundleProblem | None] = {"chain": chain(20 if quick else 49), "BAL": published()}
    problems = {name: problem for name, problem in found.items() if problem is not None}
    rows: list[Row] = []
    load_libraries()  # a limit holds for what is loaded
    with threadpool_limits(1):
        for backend in backends:
            with _kernels.use_backend(backend):
                if backend == "numba":
                    _kernels.warm("bundle", "bundle_schur")
                bundle_adjust(chain(5), options=Options(max_iterations=2))
        rows += against_scipy(problems, backends, 1 if quick else 7)
        if "pyceres" not in peers.missing():
            rows += against_ceres(problems, backends, 2 if quick else 7)
            rows += steps_to_best((20,) if quick else (25, 50, 100, 200), backends)
        rows += growth((10, 20) if quick else (25, 50, 100, 200), backends, 2 if quick else 7)
    rows += memory(20 if quick else 200, backends)
    return {"rows": rows, "threads": 1, "missing peers": ", ".join(peers.missing()) or "none"}


def load_libraries() -> None:
    """Import what brings thread pools of its own."""
    for name in ("scipy.linalg", "scipy.optimize", "scipy.sparse.linalg", "pyceres", "pycolmap", "gtsam"):
        with contextlib.suppress(ImportError):
            importlib.import_module(name)


def cpu(call: Callable[[], Any]) -> Timed:
    """Run once and count the process's CPU seconds."""
    began = time.process_time()
    value = call()
    return Timed(time.process_time() - began, value)


def ours(problem: BundleProblem, backend: str, options: Options = CERES_TOLERANCE) -> Timed:
    """Our adjustment from the start, sorting included."""
    with _kernels.use_backend(backend):
        return cpu(lambda: bundle_adjust(problem, options=options))


def against_scipy(problems: dict[str, BundleProblem], backends: list[str], pairs: int) -> list[Row]:
    """BA-1."""
    rows = []
    for name, problem in problems.items():
        ratios: dict[str, list[float]] = {backend: [] for backend in backends}
        worst = dict.fromkeys(backends, -np.inf)
        for _ in range(pairs):
            peer = cpu(peers.scipy_cookbook(problem))
            reached = cost(problem, peer.value.scene)
            history = ours(problem, backends[-1]).value.history
            enough = next((k for k, step in enumerate(history, 1) if step.cost <= reached), len(history))
            for backend in backends:
                mine = ours(problem, backend, Options(max_iterations=enough))
                ratios[backend].append(peer.seconds / mine.seconds)
                worst[backend] = max(worst[backend], cost(problem, mine.value.problem.scene) / reached - 1.0)
        for backend in backends:
            goal = GOALS_BA_1[name, backend]
            value = float(np.median(ratios[backend]))
            rows.append(row("BA-1", f"SciPy recipe / ours, {name}", backend, value, "x", goal, below=False))
            excess = float(worst[backend])
            rows.append(row("BA-1", f"our cost over SciPy's, less 1, {name}", backend, excess, "", 1e-9))
    return rows


def against_ceres(problems: dict[str, BundleProblem], backends: list[str], pairs: int) -> list[Row]:
    """BA-2; GTSAM beside it, once, where it is installed."""
    rows = []
    for name, problem in problems.items():
        each: dict[str, list[float]] = {backend: [] for backend in backends}
        whole: dict[str, list[float]] = {backend: [] for backend in backends}
        for _ in range(pairs):
            peer = cpu(peers.ceres(problem))
            for backend in backends:
                mine = ours(problem, backend)
                step = mine.seconds / mine.value.iterations
                each[backend].append(step * peer.value.iterations / peer.seconds)
                whole[backend].append(mine.seconds / peer.seconds)
        peer_cost = cost(problem, peer.value.scene)
        for backend in backends:
            value = float(np.median(each[backend]))
            rows.append(
                row("BA-2", f"iteration, ours / Ceres, {name}", backend, value, "x", GOALS_BA_2[backend])
            )
            value = float(np.median(whole[backend]))
            rows.append(row("BA-2", f"whole solution, ours / Ceres, {name}", backend, value, "x"))
        rows.append(
            row("BA-2", f"Ceres' cost over ours, less 1, {name}", "-", peer_cost / mine.value.cost - 1, "")
        )
        if "gtsam" not in peers.missing():
            other = cpu(peers.gtsam_lm(problem))
            rows.append(
                row(
                    "BA-2",
                    f"whole solution, GTSAM / ours, {name}",
                    backends[-1],
                    other.seconds / mine.seconds,
                    "x",
                )
            )
            other_cost = cost(problem, other.value.scene) / mine.value.cost - 1
            rows.append(row("BA-2", f"GTSAM's cost over ours, less 1, {name}", "-", other_cost, ""))
    return rows


def steps_to_best(sizes: tuple[int, ...], backends: list[str]) -> list[Row]:
    """BA-3: steps until within 1e-4 of the lowest cost that anyone reached."""
    rows = []
    for views in sizes:
        problem = chain(views)
        result = ours(problem, backends[-1], Options(cost=1e-9)).value
        peer = peers.ceres(problem, 100)()
        best = min(result.cost, cost(problem, peer.scene))
        mine = next(k for k, step in enumerate(result.history, 1) if step.cost <= NEAR * best)
        theirs = None
        for k in range(1, peer.iterations + 1):
            if cost(problem, peers.ceres(problem, k)().scene) <= NEAR * best:
                theirs = k
                break
        case = f"steps to the best cost, chain of {views}: ours {mine}, Ceres {theirs or 'never'}"
        ratio = mine / theirs if theirs else 0.0
        rows.append(row("BA-3", case, "-", ratio, "x", GOAL_BA_3))
    return rows


def growth(sizes: tuple[int, ...], backends: list[str], repeats: int) -> list[Row]:
    """BA-4: time of an iteration, each size over the one before."""
    rows = []
    problems = [chain(views) for views in sizes]
    for backend in backends:
        ratios = np.empty((repeats, len(sizes) - 1))
        for k in range(repeats):
            each = []
            for problem in problems:
                timed = ours(problem, backend, Options(max_iterations=5, cost=0.0))
                result: BundleResult = timed.value
                each.append(timed.seconds / result.iterations)
            ratios[k] = np.array(each[1:]) / each[:-1]
        for (before, after), value in zip(itertools.pairwise(sizes), np.median(ratios, 0), strict=True):
            case = f"iteration, chain of {after} / {before}"
            rows.append(row("BA-4", case, backend, float(value), "x", GOAL_BA_4))
    return rows


_MEMORY = """
import gc, sys
from vslam_ref import _kernels
from vslam_ref.bench.bundle.problems import chain
from vslam_ref.estimation.bundle import Options, bundle_adjust

def status(name):
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith(name))

with _kernels.use_backend(sys.argv[1]):
    bundle_adjust(chain(5), options=Options(max_iterations=2))
    problem = chain(int(sys.argv[2]))
    gc.collect()
    open("/proc/self/clear_refs", "w").write("5")
    before = status("VmRSS")
    bundle_adjust(problem, options=Options(max_iterations=3))
    print(1024 * (status("VmHWM") - before) / problem.sizes[2])
"""


def memory(views: int, backends: list[str]) -> list[Row]:
    """BA-4: growth of the process's peak, in a fresh interpreter; Linux only."""
    rows = []
    for backend in backends:
        call = [sys.executable, "-c", _MEMORY, backend, str(views)]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            case = f"extra memory per observation, chain of {views}"
            rows.append(row("BA-4", case, backend, float(done.stdout), "bytes", GOAL_MEMORY))
    return rows
