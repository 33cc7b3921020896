"""The same problem given to other solvers, as their users give it: SciPy, Ceres (pyceres), GTSAM.

Preparing a peer builds its problem, and is not timed: their users' Python loops are slow, and no part of the
solving.  It returns the function that solves.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import BundleProblem, Scene
from vslam_ref.geometry import quaternion, se3, so3


class Solved(NamedTuple):
    """Scene that a peer found, and the steps that it tried."""

    scene: Scene
    iterations: int


Solver = Callable[[], Solved]


def missing() -> list[str]:
    """Names of the peers that are not installed."""
    wanted = {"pyceres": ("pyceres", "pycolmap"), "gtsam": ("gtsam",)}
    return [name for name, parts in wanted.items() if not all(map(importlib.util.find_spec, parts))]


def scipy_cookbook(problem: BundleProblem, ftol: float = 1e-4) -> Solver:
    """SciPy's ``least_squares``, finite differences in the sparsity of the Jacobian: the cookbook's way."""
    from scipy.optimize import least_squares
    from scipy.sparse import lil_matrix

    V, N, n = problem.sizes
    view, point, uv = problem.seen.view, problem.seen.point, problem.seen.uv
    R = problem.scene.T_cam_world[:, :3, :3]
    lens = problem.scene.intrinsics[problem.lens_of_view]
    cameras = np.column_stack([so3.log(R), problem.scene.T_cam_world[:, :3, 3], lens[:, [0, 4, 5]]])
    x0 = np.concatenate([cameras.ravel(), problem.scene.X_world.ravel()])
    pattern = lil_matrix((2 * n, 9 * V + 3 * N), dtype=int)
    rows = np.arange(n)
    for s in range(9):
        pattern[2 * rows, 9 * view + s] = pattern[2 * rows + 1, 9 * view + s] = 1
    for s in range(3):
        pattern[2 * rows, 9 * V + 3 * point + s] = pattern[2 * rows + 1, 9 * V + 3 * point + s] = 1

    def residual(x: Array) -> Array:
        c, X = x[: 9 * V].reshape(V, 9)[view], x[9 * V :].reshape(N, 3)[point]
        angle = np.linalg.norm(c[:, :3], axis=1)[:, None]
        with np.errstate(invalid="ignore"):
            axis = np.nan_to_num(c[:, :3] / angle)
        dot = np.sum(X * axis, axis=1)[:, None]
        turned = np.cos(angle) * X + np.sin(angle) * np.cross(axis, X) + dot * (1 - np.cos(angle)) * axis
        seen = turned + c[:, 3:6]
        xn = seen[:, :2] / seen[:, 2:]
        q = np.sum(xn**2, axis=1)
        factor = c[:, 6] * (1 + c[:, 7] * q + c[:, 8] * q**2)
        error: Array = (xn * factor[:, None] - uv).ravel()
        return error

    def solve() -> Solved:
        found = least_squares(
            residual, x0, jac_sparsity=pattern, x_scale="jac", ftol=ftol, method="trf", max_nfev=100
        )
        c = found.x[: 9 * V].reshape(V, 9)
        T = se3.from_rt(so3.exp(c[:, :3]), c[:, 3:6])
        return Solved(_scene(problem, T, found.x[9 * V :], c[:, 6:]), int(found.njev))

    return solve


def ceres(problem: BundleProblem, max_iterations: int = 50) -> Solver:
    """Ceres through pyceres, with pycolmap's compiled costs and a dense Schur complement; solves once."""
    import pyceres
    from pycolmap import CameraModelId, cost_functions

    T, lens = problem.scene.T_cam_world, problem.scene.intrinsics[problem.lens_of_view]
    points = [x.copy() for x in problem.scene.X_world]
    turns = [q.copy() for q in quaternion.from_matrix(T[:, :3, :3])[:, [1, 2, 3, 0]]]
    moves = [t.copy() for t in T[:, :3, 3]]
    lenses = [np.array([k[0], 0.0, 0.0, k[4], k[5]]) for k in lens]
    task = pyceres.Problem()
    seen = problem.seen
    for i, j, uv in zip(seen.view.tolist(), seen.point.tolist(), seen.uv, strict=True):
        factor = cost_functions.ReprojErrorCost(CameraModelId.RADIAL, uv)
        task.add_residual_block(factor, None, [turns[i], moves[i], points[j], lenses[i]])
    for q, k in zip(turns, lenses, strict=True):
        task.set_manifold(q, pyceres.EigenQuaternionManifold())
        task.set_manifold(k, pyceres.SubsetManifold(5, [1, 2]))
    options = pyceres.SolverOptions()
    options.linear_solver_type = pyceres.LinearSolverType.DENSE_SCHUR
    options.num_threads = 1
    options.max_num_iterations = max_iterations
    options.logging_type = pyceres.LoggingType.SILENT

    def solve() -> Solved:
        summary = pyceres.SolverSummary()
        pyceres.solve(options, task, summary)
        R = quaternion.matrix(np.array(turns)[:, [3, 0, 1, 2]])
        scene = _scene(
            problem, se3.from_rt(R, np.array(moves)), np.array(points), np.array(lenses)[:, [0, 3, 4]]
        )
        return Solved(scene, summary.num_successful_steps + summary.num_unsuccessful_steps)

    return solve


def gtsam_lm(problem: BundleProblem, max_iterations: int = 50) -> Solver:
    """GTSAM's Levenberg-Marquardt with its settings like Ceres'; solves once."""
    import gtsam

    T, lens = problem.scene.T_cam_world, problem.scene.intrinsics[problem.lens_of_view]
    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    unit, key = gtsam.noiseModel.Unit.Create(2), gtsam.symbol
    seen = problem.seen
    for i, j, uv in zip(seen.view.tolist(), seen.point.tolist(), seen.uv, strict=True):
        graph.add(gtsam.GeneralSFMFactorCal3Bundler(uv, unit, i, key("P", j)))
    for i, (pose, k) in enumerate(zip(se3.inverse(T), lens, strict=True)):
        calibration = gtsam.Cal3Bundler(k[0], k[4], k[5], 0.0, 0.0)
        start.insert(i, gtsam.PinholeCameraCal3Bundler(gtsam.Pose3(pose), calibration))
    for j, X in enumerate(problem.scene.X_world):
        start.insert(key("P", j), np.asarray(X))
    options = gtsam.LevenbergMarquardtParams.CeresDefaults()
    options.setMaxIterations(max_iterations)
    optimiser = gtsam.LevenbergMarquardtOptimizer(graph, start, options)

    def solve() -> Solved:
        found = optimiser.optimize()
        cameras = [found.atPinholeCameraCal3Bundler(i) for i in range(len(T))]
        poses = se3.inverse(np.array([camera.pose().matrix() for camera in cameras]))
        lenses = np.array([[c.fx(), c.k1(), c.k2()] for c in (camera.calibration() for camera in cameras)])
        X = np.array([found.atPoint3(key("P", j)) for j in range(len(problem.scene.X_world))])
        return Solved(_scene(problem, poses, X, lenses), int(optimiser.iterations()))

    return solve


def _scene(problem: BundleProblem, T: Array, X: Array, lens: Array) -> Scene:
    """Scene from poses, points and (f, k1, k2) of each view."""
    intrinsics = problem.scene.intrinsics.copy()
    intrinsics[problem.lens_of_view, 0] = intrinsics[problem.lens_of_view, 1] = lens[:, 0]
    intrinsics[problem.lens_of_view, 4:6] = lens[:, 1:]
    return Scene(T, X.reshape(-1, 3), intrinsics)
