"""``vslam-ref bench bundle``: bundle adjustment on this machine, beside SciPy, Ceres and GTSAM.

===== =============================================================================================
goal  what is measured, on one thread, in CPU seconds, medians of paired ratios
===== =============================================================================================
BA-1  the SciPy cookbook's recipe over ours, to equal or lower cost
BA-2  an iteration of ours over one of Ceres (pyceres, compiled costs, dense Schur complement)
BA-3  steps until the cost is within 1e-4 of the best peer's, ours over Ceres'
BA-4  time of an iteration when a chain of views is doubled; extra memory per observation
===== =============================================================================================

Building a problem is not timed.  All solutions are judged by one cost function,
:func:`cost`.  Peers that are not installed are named and left out (``pip install ".[peers]"``).
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from vslam_ref import _kernels
from vslam_ref._kernels import available
from vslam_ref.bench.bundle import peers
from vslam_ref.bench.rows import Part, Row, each_backend, measured, row
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import read_bal
from vslam_ref.estimation.bundle import BundleProblem, Options, Scene, bundle_adjust
from vslam_ref.estimation.bundle.families import model_of_set
from vslam_ref.geometry.cameras import projection
from vslam_ref.worlds.view_chain import chain

CERES_TOLERANCE = Options(cost=1e-6)
"""Ceres ends where a step decreases the cost by less than a millionth: so do we, here."""
FIVE = Options(max_iterations=5, cost=0.0)
GOALS_BA_1 = {
    ("chain", "numpy"): 10.0,
    ("BAL", "numpy"): 20.0,
    ("chain", "numba"): 40.0,
    ("BAL", "numba"): 80.0,
}
GOALS_BA_2 = {"numpy": 0.8, "numba": 0.25}
GOAL_BA_3, GOAL_BA_4, GOAL_MEMORY = 1.2, 2.6, 2000.0
NEAR = 1.0001
SOLVERS = ("scipy.linalg", "scipy.optimize", "scipy.sparse.linalg", "pyceres", "pycolmap", "gtsam")
"""What brings thread pools of its own; a limit holds for what is loaded."""


class Timed(NamedTuple):
    """CPU seconds of a call, and what it returned."""

    seconds: float
    value: Any


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything; ``rows`` is a list of flat records, one per figure."""
    problems = {"chain": chain(20 if quick else 49)}
    if folder := catalogue.find("bal"):
        problems["BAL"] = read_bal(folder / "problem-16-22106-pre.txt.bz2").problem
    for name in SOLVERS:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    for backend in each_backend():
        if backend == "numba":
            _kernels.warm("bundle", "bundle_schur")
        bundle_adjust(chain(5), options=Options(max_iterations=2))
    sizes, few = (25, 50, 100, 200), 2 if quick else 7
    parts: dict[str, Part] = {"SciPy": lambda: against_scipy(problems, 1 if quick else 7)}
    if "pyceres" not in peers.missing():
        parts["Ceres"] = lambda: against_ceres(problems, few)
        parts["steps"] = lambda: steps_to_best((20,) if quick else sizes)
    parts["growth"] = lambda: growth((10, 20) if quick else sizes, few)
    parts["memory"] = lambda: memory(20 if quick else 200)
    with threadpool_limits(1):
        rows = measured("bundle", parts)
    return {"rows": rows, "threads": 1, "missing peers": ", ".join(peers.missing()) or "none"}


def cost(problem: BundleProblem, scene: Scene) -> float:
    """Half the sum of squares of a scene: the one function that judges every solver's result.

    A point behind its camera makes it infinite, whatever the solver made of it.
    """
    seen = problem.seen
    model, _ = model_of_set(problem.model, 0)  # no problem of this bench mixes families
    at = projection.pixel_from_world(
        scene.intrinsics[problem.lens_of_view[seen.view]],
        scene.T_cam_world[seen.view],
        scene.X_world[seen.point],
        lens=model.lens,
    )
    return 0.5 * float(np.sum((at.uv - seen.uv) ** 2)) if at.valid.all() else float("inf")


def cpu(call: Callable[[], Any]) -> Timed:
    """Run once and count the process's CPU seconds."""
    began = time.process_time()
    value = call()
    return Timed(time.process_time() - began, value)


def ours(problem: BundleProblem, backend: str, options: Options = CERES_TOLERANCE) -> Timed:
    """Our adjustment from the start, sorting included."""
    with _kernels.use_backend(backend):
        return cpu(lambda: bundle_adjust(problem, options=options))


def against_scipy(problems: dict[str, BundleProblem], pairs: int) -> list[Row]:
    """BA-1."""
    rows = []
    for name, problem in problems.items():
        ratios, excess = defaultdict(list), defaultdict(list)
        for _ in range(pairs):
            peer = cpu(peers.scipy_cookbook(problem))
            reached = cost(problem, peer.value.scene)
            history = ours(problem, available()[-1]).value.history
            enough = next((k for k, step in enumerate(history, 1) if step.cost <= reached), len(history))
            for backend in available():
                mine = ours(problem, backend, Options(max_iterations=enough))
                ratios[backend].append(peer.seconds / mine.seconds)
                excess[backend].append(cost(problem, mine.value.problem.scene) / reached - 1.0)
        for backend in available():
            value, goal = median(ratios[backend]), GOALS_BA_1[name, backend]
            rows.append(row("BA-1", f"SciPy recipe / ours, {name}", backend, value, "x", goal, below=False))
            worst = max(excess[backend])
            rows.append(row("BA-1", f"our cost over SciPy's, less 1, {name}", backend, worst, "", 1e-9))
    return rows


def against_ceres(problems: dict[str, BundleProblem], pairs: int) -> list[Row]:
    """BA-2; GTSAM beside it, once, where it is installed."""
    rows = []
    for name, problem in problems.items():
        each, whole = defaultdict(list), defaultdict(list)
        for _ in range(pairs):
            peer = cpu(peers.ceres(problem))
            for backend in available():
                mine = ours(problem, backend)
                step = mine.seconds / mine.value.iterations
                each[backend].append(step * peer.value.iterations / peer.seconds)
                whole[backend].append(mine.seconds / peer.seconds)
        for backend in available():
            value, goal = median(each[backend]), GOALS_BA_2[backend]
            rows.append(row("BA-2", f"iteration, ours / Ceres, {name}", backend, value, "x", goal))
            value = median(whole[backend])
            rows.append(row("BA-2", f"whole solution, ours / Ceres, {name}", backend, value, "x"))
        rows.append(_excess("Ceres", name, problem, peer, mine))
        if "gtsam" not in peers.missing():
            other = cpu(peers.gtsam_lm(problem))
            ratio, case = other.seconds / mine.seconds, f"whole solution, GTSAM / ours, {name}"
            rows.append(row("BA-2", case, available()[-1], ratio, "x"))
            rows.append(_excess("GTSAM", name, problem, other, mine))
    return rows


def _excess(peer: str, name: str, problem: BundleProblem, theirs: Timed, mine: Timed) -> Row:
    excess = cost(problem, theirs.value.scene) / mine.value.cost - 1
    return row("BA-2", f"{peer}'s cost over ours, less 1, {name}", "-", excess, "")


def steps_to_best(sizes: tuple[int, ...]) -> list[Row]:
    """BA-3: steps until within 1e-4 of the lowest cost that anyone reached."""
    rows = []
    for views in sizes:
        problem = chain(views)
        result = ours(problem, available()[-1], Options(cost=1e-9)).value
        peer = peers.ceres(problem, 100)()
        best = min(result.cost, cost(problem, peer.scene))
        mine = next(k for k, step in enumerate(result.history, 1) if step.cost <= NEAR * best)
        counts = range(1, peer.iterations + 1)
        near = (k for k in counts if cost(problem, peers.ceres(problem, k)().scene) <= NEAR * best)
        theirs = next(near, None)
        case = f"steps to the best cost, chain of {views}: ours {mine}, Ceres {theirs or 'never'}"
        ratio = mine / theirs if theirs else 0.0
        rows.append(row("BA-3", case, "-", ratio, "x", GOAL_BA_3))
    return rows


def growth(sizes: tuple[int, ...], repeats: int) -> list[Row]:
    """BA-4: time of an iteration, each size over the one before."""
    rows = []
    problems = [chain(views) for views in sizes]
    for backend in available():
        found = [[ours(problem, backend, FIVE) for problem in problems] for _ in range(repeats)]
        each = np.array([[timed.seconds / timed.value.iterations for timed in once] for once in found])
        ratios = each[:, 1:] / each[:, :-1]
        for (before, after), value in zip(itertools.pairwise(sizes), np.median(ratios, 0), strict=True):
            case = f"iteration, chain of {after} / {before}"
            rows.append(row("BA-4", case, backend, float(value), "x", GOAL_BA_4))
    return rows


_MEMORY = """
import gc, sys
from vslam_ref import _kernels
from vslam_ref.worlds.view_chain import chain
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


def memory(views: int) -> list[Row]:
    """BA-4: growth of the process's peak, in a fresh interpreter; Linux only."""
    rows = []
    for backend in available():
        call = [sys.executable, "-c", _MEMORY, backend, str(views)]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            case = f"extra memory per observation, chain of {views}"
            rows.append(row("BA-4", case, backend, float(done.stdout), "bytes", GOAL_MEMORY))
    return rows
