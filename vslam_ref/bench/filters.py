"""``vslam-ref bench filters``: EKF-SLAM and IEKF-SLAM on this machine, beside filterpy.

===== =========================================================================================
goal  what is measured
===== =========================================================================================
EKF-1 one step (a prediction and five known landmarks) against filterpy's ExtendedKalmanFilter
EKF-2 a cycle of ten predictions and one update: the reduced IEKF against the EKF (the paper: 1.20)
EKF-3 the whole study of figures 2-4: 50 runs, 2 filters, 2 P0, 1600 steps
EKF-4 growth of a step from 50 to 200 landmarks, as an exponent
IM-1  ``import vslam_ref`` against ``import numpy``; first accelerated call with a warm cache
===== =========================================================================================

Our step is that of ``filters.ekf_slam`` on plain arrays; what the checks and book-keeping of
:class:`EkfSlam` cost is shown beside it.  filterpy is used in three ways
(``filterpy_peer``): that of its users is the goal's peer; the two others have models written for speed and
are harder.

The reduced IEKF puts increments down and uses them together.  So its cycle is also measured with the pose
read after every prediction, by both filters, where it cannot.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from vslam_ref import _kernels
from vslam_ref.bench.ekf_world import World, array_step, class_step
from vslam_ref.bench.filterpy_peer import WAYS, filterpy_step
from vslam_ref.bench.imports import imports
from vslam_ref.bench.rows import row
from vslam_ref.bench.timing import paired
from vslam_ref.experiments.iekf.study import StudyConfig, run_study
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.estimates import SlamFilter

SIZES = (10, 20, 50, 100, 200)
PAPER_POSE_RATIO = 23.05 / 19.26
"""B, table 1: camera pose estimation, IEKF over EKF."""
GOALS_EKF_1 = {10: 2.0, 20: 2.0, 50: 6.0, 100: 20.0, 200: 30.0}
GOAL_EKF_1_NUMBA = 50.0
GOAL_EKF_2, GOAL_EKF_4 = 1.1, 2.1
GOALS_EKF_3 = {
    ("numpy", "reduced"): 15.0,
    ("numba", "reduced"): 4.0,
    ("numpy", "lifted"): 60.0,
    ("numba", "lifted"): 20.0,
}


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything on one thread; ``rows`` is a list of flat records, one per figure."""
    backends = [b for b in ("numpy", "numba") if b == "numpy" or importlib.util.find_spec("numba")]
    rows: list[dict[str, Any]] = []
    with threadpool_limits(1):
        for backend in backends:
            with _kernels.use_backend(backend):
                rows += steps(backend, quick) + cycles(backend, quick) + study(backend, quick)
    rows += imports(quick)
    return {"rows": rows, "paper_pose_step_ratio": PAPER_POSE_RATIO, "threads": 1}


def steps(backend: str, quick: bool) -> list[dict[str, Any]]:
    """EKF-1 and EKF-4."""
    rows, seconds = [], {}
    ways = WAYS if importlib.util.find_spec("filterpy") else ()
    for n in SIZES:
        world = World(n)
        things = {"ours": array_step(world), "EkfSlam class": class_step(world)}
        things |= {f"filterpy, {way}": filterpy_step(world, way) for way in ways}
        result = paired(things, 3 if quick else 9)
        seconds[n] = result.seconds["ours"]
        rows.append(row("EKF-1", f"step, n = {n}", backend, 1e6 * seconds[n], "us"))
        goal = GOALS_EKF_1[n] if backend == "numpy" else GOAL_EKF_1_NUMBA
        for name in list(things)[1:]:
            bound = goal if name == "filterpy, users" else None
            case = f"{name} / ours, n = {n}"
            rows.append(row("EKF-1", case, backend, result.ratio[name], "x", bound, below=False))
    growth = float(np.log(seconds[200] / seconds[50]) / np.log(4.0))
    rows.append(row("EKF-4", "exponent of n, 50 to 200", backend, growth, "", GOAL_EKF_4))
    return rows


def _cycle(slam: SlamFilter, world: World, batch: int, read_pose: bool) -> Callable[[], object]:
    """Ten predictions and one update of five landmarks."""
    increment = world.increment(batch)
    z = np.tile(world.z[world.seen], (batch, 1, 1))

    def go() -> None:
        for _ in range(10):
            slam.predict(increment)
            if read_pose:
                slam.pose()
        slam.update(world.seen, z, world.cov_z)

    return go


def cycle_ratios(batch: int, landmarks: int, repeats: int = 9, read_pose: bool = False) -> dict[str, float]:
    """Time of a cycle of each form of the IEKF over the EKF's: median of paired ratios, one thread."""
    world = World(landmarks)
    things = {"ekf": _cycle(world.start(EkfSlam, batch), world, batch, read_pose)}
    for form in ("reduced", "reduced-map", "lifted"):
        slam = world.start(lambda x, P, c, form=form: carleman_ekf(x, P, form, c), batch)  # type: ignore[misc]
        things[form] = _cycle(slam, world, batch, read_pose)
    with threadpool_limits(1):
        ratio = paired(things, repeats).ratio
    return {form: ratio[form] for form in list(things)[1:]}


def cycles(backend: str, quick: bool) -> list[dict[str, Any]]:
    """EKF-2: ten predictions and one update, forms of the IEKF against the EKF."""
    rows, repeats = [], 3 if quick else 9
    for batch, n in ((1, 10), (1, 30), (1, 100), (1, 200), (50, 30)):
        where = f"n = {n}, {batch} run{'s' * (batch > 1)}"
        for form, ratio in cycle_ratios(batch, n, repeats).items():
            bound = GOAL_EKF_2 if form == "reduced" else None
            rows.append(row("EKF-2", f"{form} / EKF, cycle, {where}", backend, ratio, "x", bound))
        ratio = cycle_ratios(batch, n, repeats, read_pose=True)["reduced"]
        rows.append(row("EKF-2", f"reduced / EKF, pose read ten times, {where}", backend, ratio, "x"))
    return rows


def study(backend: str, quick: bool) -> list[dict[str, Any]]:
    """EKF-3: the study of figures 2-4 with the reduced and with the lifted form, in this process."""
    rows = []
    for form in ("reduced", "lifted"):
        runs = 5 if quick else 50
        config = StudyConfig(
            runs=runs, population=runs, control_runs=0, filters=("ekf", "iekf"), iekf_form=form
        )
        warm_up = dataclasses.replace(
            config, runs=2, population=2, field=dataclasses.replace(config.field, laps=1)
        )
        run_study(warm_up)
        start = time.perf_counter()
        run_study(config)
        bound = None if quick else GOALS_EKF_3[backend, form]
        case = f"study of {runs} runs, IEKF {form}"
        rows.append(row("EKF-3", case, backend, time.perf_counter() - start, "s", bound))
    return rows
