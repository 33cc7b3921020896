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

Our step is ``ekf_step`` on plain arrays; what the checks and book-keeping of :class:`EkfSlam` cost is shown
beside it.  filterpy is given the same state, models and measurements, its models written with plain
floats.  Two ways of using it are timed: one landmark at a time, as its users do (the goal's), and all five
stacked, which is the mathematics of our update.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import math
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from vslam_ref import _kernels
from vslam_ref.bench.timing import paired
from vslam_ref.experiments.iekf.study import StudyConfig, run_study
from vslam_ref.filters import observation, vehicle
from vslam_ref.filters.carleman_ekf import carleman_ekf
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.ekf_step import ekf_step
from vslam_ref.filters.estimates import SlamFilter

Array = NDArray[np.float64]

SIZES = (10, 20, 50, 100, 200)
SEEN = 5
PAPER_POSE_RATIO = 23.05 / 19.26
"""B, table 1: camera pose estimation, IEKF over EKF."""
GOALS_EKF_1 = {10: 2.0, 20: 2.0, 50: 6.0, 100: 20.0, 200: 30.0}
GOAL_EKF_1_NUMBA = 50.0
GOAL_EKF_2, GOAL_EKF_4, GOAL_IMPORT, GOAL_FIRST_CALL = 1.1, 2.1, 1.5, 0.6
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


def _row(
    goal: str, case: str, backend: str, value: float, unit: str, bound: float | None, below: bool
) -> dict[str, Any]:
    met = None if bound is None else (value <= bound if below else value >= bound)
    sign = "<=" if below else ">="
    return {
        "goal": goal,
        "case": case,
        "backend": backend,
        "value": value,
        "unit": unit,
        "bound": None if bound is None else f"{sign} {bound:g}",
        "met": {None: None, True: "yes", False: "no"}[met],
    }


# -- EKF-1 and EKF-4 -----------------------------------------------------------------------------


class _World:
    """A vehicle among n landmarks with a dense covariance, and what one step is given."""

    def __init__(self, n: int) -> None:
        rng = np.random.default_rng(n)
        self.n = n
        self.landmarks = rng.uniform(-10, 10, (n, 2))
        self.pose = np.array([0.0, 0.0, 0.1])
        self.seen = rng.permutation(n)[:SEEN]
        self.z = observation.vehicle_from_world(self.pose, self.landmarks)
        self.control = np.array([[1.0, 0.1]])
        self.cov_u, self.cov_z = np.diag([0.04, 0.003]), 0.01 * np.eye(2)

    def increment(self) -> vehicle.Increment:
        return vehicle.ackermann_increment(self.control, self.cov_u, 1.0, 0.1)

    def start(self, make: Callable[[Array, Array, int], SlamFilter], batch: int = 1) -> SlamFilter:
        """A filter that has all n landmarks in its map."""
        slam = make(np.tile(self.pose, (batch, 1)), np.diag([0.1, 0.1, 0.01]), self.n)
        for first in range(0, self.n, 10):
            ids = np.arange(first, min(self.n, first + 10))
            slam.update(ids, np.tile(self.z[ids], (batch, 1, 1)), self.cov_z)
        return slam


def class_step(world: _World) -> Callable[[], object]:
    """One prediction and one joint update of five landmarks by :class:`EkfSlam`, all checks included."""
    slam, z = world.start(EkfSlam), world.z[None, world.seen]

    def step() -> None:
        slam.predict(world.increment())
        slam.update(world.seen, z, world.cov_z)

    return step


def array_step(world: _World) -> Callable[[], object]:
    """The same step by :func:`ekf_step` on plain arrays."""
    slam = world.start(EkfSlam)
    assert isinstance(slam, EkfSlam)
    b = slam.blocks
    columns, z, cov_z = b.columns(world.seen), world.z[None, world.seen], np.tile(world.cov_z, (SEEN, 1, 1))
    increment = world.increment()

    def step() -> None:
        ekf_step(b.x_p, b.x_m, b.P_pp, b.P_pm, b.P_mm, *increment, columns, z, cov_z)

    return step


def filterpy_step(world: _World, stacked: bool) -> Callable[[], object]:
    """The same step with filterpy's ExtendedKalmanFilter, its models written for speed with plain floats.

    Dense F, Q and H, as its interface asks.
    """
    from filterpy.kalman import ExtendedKalmanFilter

    d = 3 + 2 * world.n
    slam = world.start(EkfSlam)
    assert isinstance(slam, EkfSlam)
    mean, cov = slam.blocks.full()
    groups = [world.seen.tolist()] if stacked else [[i] for i in world.seen.tolist()]
    measured = [world.z[ids].ravel() for ids in groups]
    kalman = ExtendedKalmanFilter(dim_x=d, dim_z=2 * len(groups[0]))
    kalman.R = np.kron(np.eye(len(groups[0])), world.cov_z)
    kalman.x, kalman.P = mean[0].copy(), cov[0].copy()
    increment = world.increment()
    ds, dalpha, cov_inc = increment.ds[0], increment.dalpha[0], increment.cov[0]

    def h(x: Array, ids: list[int]) -> Array:
        c, s, out = math.cos(x[2]), math.sin(x[2]), []
        for i in ids:
            dx, dy = x[3 + 2 * i] - x[0], x[4 + 2 * i] - x[1]
            out += [c * dx + s * dy, c * dy - s * dx]
        return np.array(out)

    def jacobian(x: Array, ids: list[int]) -> Array:
        H = np.zeros((2 * len(ids), d))
        c, s = math.cos(x[2]), math.sin(x[2])
        for k, i in enumerate(ids):
            dx, dy = x[3 + 2 * i] - x[0], x[4 + 2 * i] - x[1]
            H[2 * k, :3] = -c, -s, c * dy - s * dx
            H[2 * k + 1, :3] = s, -c, -c * dx - s * dy
            H[2 * k, 3 + 2 * i : 5 + 2 * i] = c, s
            H[2 * k + 1, 3 + 2 * i : 5 + 2 * i] = -s, c
        return H

    def step() -> None:
        x = kalman.x.copy()
        c, s = math.cos(x[2]), math.sin(x[2])
        F, Q = np.eye(d), np.zeros((d, d))
        F[0, 2], F[1, 2] = -ds * s, ds * c
        G = np.array([[c, 0.0], [s, 0.0], [0.0, 1.0]])
        Q[:3, :3] = G @ cov_inc @ G.T
        kalman.F, kalman.Q = F, Q
        x[0] += ds * c
        x[1] += ds * s
        x[2] += dalpha
        kalman.predict_x = lambda u=0: setattr(kalman, "x", x)
        kalman.predict()
        for ids, z in zip(groups, measured, strict=True):
            kalman.update(z, jacobian, h, args=(ids,), hx_args=(ids,))

    return step


def steps(backend: str, quick: bool) -> list[dict[str, Any]]:
    """EKF-1 and EKF-4."""
    rows, seconds = [], {}
    have_peer = importlib.util.find_spec("filterpy") is not None
    for n in SIZES:
        world = _World(n)
        things: dict[str, Callable[[], object]] = {
            "ours": array_step(world),
            "EkfSlam class": class_step(world),
        }
        if have_peer:
            things |= {
                "filterpy one at a time": filterpy_step(world, False),
                "filterpy stacked": filterpy_step(world, True),
            }
        result = paired(things, 3 if quick else 9)
        seconds[n] = result.seconds["ours"]
        rows.append(_row("EKF-1", f"step, n = {n}", backend, 1e6 * seconds[n], "us", None, True))
        for way in list(things)[1:]:
            bound = GOALS_EKF_1[n] if backend == "numpy" else GOAL_EKF_1_NUMBA
            bound_here = bound if way == "filterpy one at a time" else None
            rows.append(
                _row("EKF-1", f"{way} / ours, n = {n}", backend, result.ratio[way], "x", bound_here, False)
            )
    growth = float(np.log(seconds[200] / seconds[50]) / np.log(4.0))
    rows.append(_row("EKF-4", "exponent of n, 50 to 200", backend, growth, "", GOAL_EKF_4, True))
    return rows


# -- EKF-2 ---------------------------------------------------------------------------------------


def _cycle(slam: SlamFilter, world: _World, batch: int) -> Callable[[], object]:
    """Ten predictions and one update of five landmarks."""
    increment = vehicle.ackermann_increment(np.tile(world.control, (batch, 1)), world.cov_u, 1.0, 0.1)
    z = np.tile(world.z[world.seen], (batch, 1, 1))

    def go() -> None:
        for _ in range(10):
            slam.predict(increment)
        slam.update(world.seen, z, world.cov_z)

    return go


def cycle_ratios(batch: int, landmarks: int, repeats: int = 9) -> dict[str, float]:
    """Time of a cycle of each form of the IEKF over the EKF's: median of paired ratios, one thread."""
    world = _World(landmarks)
    things = {"ekf": _cycle(world.start(EkfSlam, batch), world, batch)}
    for form in ("reduced", "reduced-map", "lifted"):
        slam = world.start(lambda x, P, c, form=form: carleman_ekf(x, P, form, c), batch)  # type: ignore[misc]
        things[form] = _cycle(slam, world, batch)
    with threadpool_limits(1):
        ratio = paired(things, repeats).ratio
    return {form: ratio[form] for form in list(things)[1:]}


def cycles(backend: str, quick: bool) -> list[dict[str, Any]]:
    """EKF-2: ten predictions and one update, forms of the IEKF against the EKF."""
    rows = []
    for batch, n in ((1, 10), (1, 30), (1, 100), (1, 200), (50, 30)):
        for form, ratio in cycle_ratios(batch, n, 3 if quick else 9).items():
            bound = GOAL_EKF_2 if form == "reduced" else None
            case = f"{form} / EKF, cycle, n = {n}, {batch} run{'s' * (batch > 1)}"
            rows.append(_row("EKF-2", case, backend, ratio, "x", bound, True))
    return rows


# -- EKF-3 ---------------------------------------------------------------------------------------


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
        rows.append(_row("EKF-3", case, backend, time.perf_counter() - start, "s", bound, True))
    return rows


# -- IM-1 ----------------------------------------------------------------------------------------

_FIRST_CALL = """
import time, numpy as np
from vslam_ref.filters.ekf_slam import EkfSlam
from vslam_ref.filters.ekf_step import ekf_step
from vslam_ref.filters.vehicle import Increment
slam = EkfSlam(np.zeros((1, 3)), np.eye(3))
start = time.perf_counter()
slam.predict(Increment(np.ones(1), np.zeros(1), np.zeros((1, 2, 2))))
print(time.perf_counter() - start)
"""


def imports(quick: bool) -> list[dict[str, Any]]:
    """IM-1, in fresh interpreters."""

    def seconds(code: str) -> float:
        timed = f"import time; start = time.perf_counter(); {code}; print(time.perf_counter() - start)"
        return float(
            subprocess.run([sys.executable, "-c", timed], capture_output=True, text=True, check=True).stdout
        )

    ratios = []
    for _ in range(3 if quick else 9):
        base = seconds("import numpy")
        ratios.append(seconds("import vslam_ref, numpy") / base)
    rows = [
        _row("IM-1", "import vslam_ref / import numpy", "-", float(np.median(ratios)), "x", GOAL_IMPORT, True)
    ]
    if importlib.util.find_spec("numba"):
        call = [sys.executable, "-c", _FIRST_CALL]
        done = [subprocess.run(call, capture_output=True, text=True, check=True).stdout for _ in range(4)]
        first = float(np.median([float(text) for text in done[1:]]))  # the first one may compile
        rows.append(
            _row("IM-1", "first accelerated call, warm cache", "numba", first, "s", GOAL_FIRST_CALL, True)
        )
    return rows
