"""``vslam-ref bench filters``: EKF-SLAM and IEKF-SLAM on this machine, beside filterpy.

===== =========================================================================================
goal  what is measured
===== =========================================================================================
EKF-1 one step (a prediction and five known landmarks) against filterpy's ExtendedKalmanFilter
EKF-2 a cycle of ten predictions and one update: the reduced IEKF against the EKF (the paper: 1.20)
EKF-3 the runs of figures 2-4: 50 runs, 2 filters, 2 P0, 1600 steps
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

from vslam_ref.bench.filterpy_peer import WAYS, filterpy_step
from vslam_ref.bench.imports import imports
from vslam_ref.bench.rows import Row, measured, on_each_backend, row
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import EkfSlam, ekf_predict_in_place, ekf_update_in_place
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.support.timing import paired
from vslam_ref.worlds.drive import Drive, field_drive, follow
from vslam_ref.worlds.mapped_vehicle import PAPER_POSE_RATIO, SEEN, MappedVehicle, cycle_ratios
from vslam_ref.worlds.vehicle_field import VehicleFieldConfig, draw_noise, make_field

SIZES = (10, 20, 50, 100, 200)
P0_LOW, P0_HIGH = (1.0, 1.0, 0.001), (1.0, 1.0, 0.03)
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
    parts = on_each_backend(quick, steps, cycles, study) | {"imports": lambda: imports(quick)}
    return {"rows": measured("filters", parts), "paper_pose_step_ratio": PAPER_POSE_RATIO, "threads": 1}


def steps(backend: str, quick: bool) -> list[Row]:
    """EKF-1 and EKF-4."""
    rows, seconds = [], {}
    ways = WAYS if importlib.util.find_spec("filterpy") else ()
    for n in SIZES:
        world = MappedVehicle(n)
        things = {"ours": array_step(world), "EkfSlam class": class_step(world)}
        things |= {f"filterpy, {way}": filterpy_step(world, way) for way in ways}
        result = paired(things, 3 if quick else 9)
        seconds[n] = result.seconds["ours"]
        rows.append(row("EKF-1", f"step, n = {n}", backend, 1e6 * seconds[n], "µs"))
        goal = GOALS_EKF_1[n] if backend == "numpy" else GOAL_EKF_1_NUMBA
        for name in list(things)[1:]:
            bound = goal if name == "filterpy, users" else None
            case = f"{name} / ours, n = {n}"
            rows.append(row("EKF-1", case, backend, result.ratio[name], "x", bound, below=False))
    growth = float(np.log(seconds[200] / seconds[50]) / np.log(4.0))
    return [*rows, row("EKF-4", "exponent of n, 50 to 200", backend, growth, "", GOAL_EKF_4)]


def class_step(world: MappedVehicle) -> Callable[[], object]:
    """One prediction and one joint update of five landmarks by :class:`EkfSlam`, all checks included."""
    slam, z = world.start(EkfSlam), world.z[None, world.seen]

    def step() -> None:
        slam.predict(world.increment())
        slam.update(world.seen, z, world.cov_z)

    return step


def array_step(world: MappedVehicle) -> Callable[[], object]:
    """The same step by the functions on plain arrays, without the class."""
    b = world.start(EkfSlam).blocks
    columns, z, cov_z = b.columns(world.seen), world.z[None, world.seen], np.tile(world.cov_z, (SEEN, 1, 1))
    state, increment = b.state, world.increment()

    def step() -> None:
        ekf_predict_in_place(state, increment)
        ekf_update_in_place(state, columns, z, cov_z, np.inf)

    return step


def cycles(backend: str, quick: bool) -> list[Row]:
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


def study(backend: str, quick: bool) -> list[Row]:
    """EKF-3: the runs of figures 2-4 with the reduced and with the lifted form, in this process."""
    rows, runs, config = [], 5 if quick else 50, VehicleFieldConfig()
    for form in ("reduced", "lifted"):
        drive(dataclasses.replace(config, laps=1), form, 2)  # compile, fill caches
        start = time.perf_counter()
        drive(config, form, runs)
        bound = None if quick else GOALS_EKF_3[backend, form]
        case = f"study of {runs} runs, IEKF {form}"
        rows.append(row("EKF-3", case, backend, time.perf_counter() - start, "s", bound))
    return rows


def drive(config: VehicleFieldConfig, form: str, runs: int) -> None:
    """Take the EKF and the IEKF through the whole course from both P0, the pose read at every step."""
    world = make_field(config, np.random.default_rng(0))
    noise = draw_noise(world, [np.random.default_rng(k) for k in range(runs)])
    for variances in (P0_LOW, P0_HIGH):
        start, P0 = world.T_world_vehicle[0] + noise.start * np.sqrt(variances), np.diag(variances)
        _to_the_end(EkfSlam(start, P0), field_drive(world, noise))
        _to_the_end(carleman_ekf(start, P0, form), field_drive(world, noise))


def _to_the_end(slam: SlamFilter, course: Drive) -> None:
    for _ in follow(slam, course):
        pass
