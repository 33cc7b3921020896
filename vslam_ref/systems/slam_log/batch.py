"""Batch least squares over a whole log: the bound no filter of it can pass.

Unknown are the pose at every sighting time, every landmark and, if asked for, gains and offsets of the
calibration, all at once; nothing is linearised only once.  The cost is::

    sum |L_o^-1 (x_k^-1 x_{k+1} - odometry_k)|^2 / 2 + sum rho(|L_z^-1 (predicted - measured)|^2)

    rho(s) = (nu + 2) / 2 log(1 + s / nu),      nu = 4

rho is the negative logarithm of Student's density in two dimensions: a misread barcode pulls ever less the
further off it is, and nothing is switched on or off.  (A flat loss above a gate was tried: from a poor
start it gives up half of the sightings.)  Minimised by Levenberg-Marquardt on sparse normal equations with
weights rho'; the first pose is held.  residual = predicted - measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.least_squares import Ceres, Descent, Options, Step, descend
from vslam_ref.estimation.least_squares.result import CONVERGED
from vslam_ref.filters import observation
from vslam_ref.geometry import se2, so2
from vslam_ref.systems.slam_log import LogRun, RobotCalibration, SlamLog, build_timeline
from vslam_ref.systems.slam_log.preintegration import RelativePoses, preintegrate
from vslam_ref.systems.slam_log.timeline import sighting_times

STEPS = {
    "distance_gain": 1e-4,
    "turn_gain": 1e-4,
    "drift": 1e-4,
    "steering_offset": 1e-5,
    "sighting_delay": 1e-2,
    "sensor_ahead": 1e-4,
    "bearing_offset": 1e-5,
    "range_offset": 1e-4,
    "range_cosine": 1e-3,
}
"""Calibration values that can be unknowns, and the step of their numeric derivatives."""
TOLERANCE = 1e-7
"""Relative decrease of the cost at which the search ends."""
STUDENT = 4.0
"""Degrees of freedom nu of the sightings' loss."""
PLAUSIBLE = 13.816
"""Chi-squared, 2 degrees of freedom, 1 in 1000."""
SENSOR_ONLY = ("sensor_ahead", "bearing_offset", "range_offset", "range_cosine")
"""Those that say nothing about odometry."""


Place = tuple[Array, Array, RobotCalibration]
"""Poses (K, 3), landmarks (n, 2), and the calibration."""


class Batch(NamedTuple):
    """A batch solution.

    Attributes
    ----------
    times : ndarray, shape (K,)
        Node times, seconds.
    poses : ndarray, shape (K, 3)
    ids, landmarks : ndarray, shapes (n,), (n, 2)
    calibration : RobotCalibration
        With the values that were unknown.
    cost : float
    odometry : ndarray, shape (K - 1, 3)
        Odometry residuals, metres and radians.
    sightings : ndarray, shape (N, 2)
        Sighting residuals in range and bearing, metres and radians.
    used : ndarray of bool, shape (N,)
        Normalised square under ``PLAUSIBLE``; for reports only.
    iterations : int
        Steps tried.
    converged : bool
    free : tuple of str
    free_cov : ndarray, shape (f, f)
        Covariance of the free calibration values, as the noises claim it.
    """

    times: Array
    poses: Array
    ids: IntArray
    landmarks: Array
    calibration: RobotCalibration
    cost: float
    odometry: Array
    sightings: Array
    used: NDArray[np.bool_]
    iterations: int
    converged: bool
    free: tuple[str, ...]
    free_cov: Array


class _Problem:
    """The residuals of a log as functions of poses, landmarks and calibration."""

    def __init__(self, log: SlamLog, free: Sequence[str]) -> None:
        self.log, self.free = log, tuple(free)
        self._kept: tuple[RobotCalibration, RelativePoses, Array] | None = None
        self.node = np.repeat(np.arange(len(log.sightings)), [len(s.ids) for s in log.sightings])
        all_ids = np.concatenate([s.ids for s in log.sightings])
        self.ids, self.landmark = np.unique(all_ids, return_inverse=True)
        self.polar = np.concatenate([s.polar for s in log.sightings])

    def odometry(self, calibration: RobotCalibration) -> tuple[RelativePoses, Array]:
        """Odometry between sightings and the inverse Cholesky factors of its covariance; the last kept."""
        key = replace(calibration, **dict.fromkeys(SENSOR_ONLY, 0.0))
        if self._kept is None or self._kept[0] != key:
            self._kept = (key, *self._odometry(calibration))
        return self._kept[1:]

    def _odometry(self, calibration: RobotCalibration) -> tuple[RelativePoses, Array]:
        line = build_timeline(self.log, calibration, np.zeros(0))
        relative = preintegrate(line, line.sighting_at)
        floor = np.diag([1e-4, 1e-4, 1e-4]) ** 2  # a vehicle at rest would have none at all
        return relative, np.linalg.inv(np.linalg.cholesky(relative.cov + floor))

    def seen(
        self, poses: Array, landmarks: Array, calibration: RobotCalibration
    ) -> tuple[Array, Array, Array]:
        """Predicted (range, bearing) (N, 2) and Jacobians in pose (N, 2, 3) and landmark (N, 2, 2)."""
        at = observation.vehicle_from_world_with_jacobians(poses[self.node], landmarks[self.landmark])
        x, y = at.value[:, 0] - calibration.sensor_ahead, at.value[:, 1]
        r = np.hypot(x, y)
        J = np.stack([np.stack([x / r, y / r], -1), np.stack([-y, x], -1) / (r * r)[:, None]], 1)
        return np.stack([r, np.arctan2(y, x)], -1), J @ at.J_pose, J @ at.J_landmark

    def residuals(self, poses: Array, landmarks: Array, calibration: RobotCalibration) -> tuple[Array, Array]:
        """Whitened residuals of odometry (K - 1, 3) and of sightings (N, 2)."""
        relative, whiten = self.odometry(calibration)
        e = se2.between(poses[:-1], poses[1:]) - relative.mean
        e[:, 2] = so2.wrap(e[:, 2])
        predicted, _, _ = self.seen(poses, landmarks, calibration)
        s = predicted - calibration.correct(self.polar)
        s[:, 1] = so2.wrap(s[:, 1])
        scale = np.array([calibration.sigma_range, calibration.sigma_bearing])
        return np.einsum("kij,kj->ki", whiten, e), s / scale

    def costs(self, place: Place) -> Array:
        """Cost of each odometry step and of each sighting, (K - 1 + N,)."""
        return self._costs(*self.residuals(*place))

    def _costs(self, o: Array, s: Array) -> Array:
        squares = np.sum(s**2, 1)
        return np.concatenate([np.sum(o**2, 1) / 2, (STUDENT + 2) / 2 * np.log1p(squares / STUDENT)])

    def linearise(self, place: Place, before: _Here | None = None) -> _Here:
        """Weighted normal equations."""
        o, s = self.residuals(*place)
        root = _root_weights(s)
        J = self.jacobian(*place, root)
        r = np.concatenate([o.ravel(), (s * root[:, None]).ravel()])
        N, g = (J.T @ J).tocsc(), J.T @ r
        diagonal = N.diagonal()
        cosine = np.abs(g) / np.sqrt(np.maximum(diagonal, 1e-300) * max(float(r @ r), 1e-300))
        return _Here(place, self._costs(o, s), N, g, diagonal, float(cosine.max(initial=0.0)))

    def step(self, here: _Here, damping: float) -> Step | None:
        """Damped step, (N + damping diag N) step = -g."""
        damped = here.N + sparse.diags(damping * here.diagonal + 1e-12, format="csc")
        try:
            change = splu(damped).solve(-here.g)
        except RuntimeError:  # exactly singular
            return None
        square = float(here.diagonal @ change**2)
        return Step(change, np.sqrt(square), 0.5 * float(damping * square - here.g @ change))

    def move(self, here: _Here, step: Step) -> Place:
        """Poses, landmarks and free calibration values after a step; the first pose is held."""
        poses, landmarks, calibration = here.place
        split = 3 * (len(poses) - 1)
        end = split + landmarks.size
        poses = poses.copy()
        poses[1:] += step.change[:split].reshape(-1, 3)
        changes = zip(self.free, step.change[end:], strict=True)
        values = {name: getattr(calibration, name) + float(d) for name, d in changes}
        return poses, landmarks + step.change[split:end].reshape(-1, 2), replace(calibration, **values)

    def jacobian(
        self, poses: Array, landmarks: Array, calibration: RobotCalibration, root: Array
    ) -> sparse.csr_matrix:
        """Whitened Jacobian: columns are poses 1.., landmarks, free calibration values.

        ``root`` (N,) is the square root of each sighting's weight.
        """
        K, n = len(poses), len(landmarks)
        _, whiten = self.odometry(calibration)
        J_a = np.zeros((K - 1, 3, 3))
        J_b = np.zeros((K - 1, 3, 3))
        at = observation.vehicle_from_world_with_jacobians(poses[:-1], poses[1:, :2])
        J_a[:, :2], J_a[:, 2, 2] = at.J_pose, -1.0
        J_b[:, :2, :2], J_b[:, 2, 2] = at.J_landmark, 1.0
        k = np.arange(K - 1)
        top = _blocks(whiten @ J_a, k, k, (K - 1, K)) + _blocks(whiten @ J_b, k, k + 1, (K - 1, K))
        _, J_x, J_l = self.seen(poses, landmarks, calibration)
        weight = (
            root[:, None, None]
            / np.array([calibration.sigma_range, calibration.sigma_bearing])[None, :, None]
        )
        rows = np.arange(len(self.node))
        below = _blocks(weight * J_x, rows, self.node, (len(rows), K))
        right = _blocks(weight * J_l, rows, self.landmark, (len(rows), n))
        whole = sparse.bmat([[top[:, 3:], sparse.csr_matrix((3 * (K - 1), 2 * n))], [below[:, 3:], right]])
        border = self._calibration_columns(poses, landmarks, calibration, root)
        return sparse.hstack([whole, border]).tocsr()

    def _calibration_columns(
        self, poses: Array, landmarks: Array, calibration: RobotCalibration, root: Array
    ) -> sparse.csr_matrix:
        columns = []
        for name in self.free:
            sides = []
            for sign in (1, -1):
                moved = replace(calibration, **{name: getattr(calibration, name) + sign * STEPS[name]})
                o, s = self.residuals(poses, landmarks, moved)
                sides.append(np.concatenate([o.ravel(), (s * root[:, None]).ravel()]))
            columns.append((sides[0] - sides[1]) / (2 * STEPS[name]))
        size = 3 * (len(poses) - 1) + 2 * len(self.node)
        return sparse.csr_matrix(np.array(columns).T if columns else np.zeros((size, 0)))


def _root_weights(sightings: Array) -> Array:
    """Square roots (N,) of the weights 2 rho' of whitened sighting residuals (N, 2)."""
    return np.asarray(np.sqrt((STUDENT + 2) / (STUDENT + np.sum(sightings**2, 1))))


def _blocks(values: Array, rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> sparse.csr_matrix:
    """Sparse matrix of small dense blocks (m, a, b) at block rows and columns."""
    m, a, b = values.shape
    i = np.broadcast_to(a * rows[:, None, None] + np.arange(a)[:, None], (m, a, b))
    j = np.broadcast_to(b * columns[:, None, None] + np.arange(b), (m, a, b))
    return sparse.csr_matrix((values.ravel(), (i.ravel(), j.ravel())), shape=(a * shape[0], b * shape[1]))


def solve_batch(
    log: SlamLog,
    calibration: RobotCalibration,
    start: LogRun,
    free: Sequence[str] = (),
    max_iterations: int = 60,
) -> Batch:
    """Solve a log in one piece.

    Parameters
    ----------
    log : SlamLog
    calibration : RobotCalibration
        Values held, and start values of the free ones.
    start : LogRun
        A filter's run of the same log, from which the solution starts.
    free : sequence of str
        Names of :data:`STEPS` to solve for.
    max_iterations : int
    """
    problem = _Problem(log, free)
    place = dict(zip(start.map.ids.tolist(), start.map.mean[0], strict=True))
    landmarks = np.array([place[int(i)] for i in problem.ids])
    whole = np.column_stack([start.T_run_vehicle[:, :2], np.unwrap(start.T_run_vehicle[:, 2])])
    times = sighting_times(log, calibration)
    poses = np.stack([np.interp(times, start.times, column) for column in whole.T], -1)
    start_here = problem.linearise((poses, landmarks, calibration))
    options = Options(0.0, 0.0, TOLERANCE, max_iterations, Ceres(1e6))  # a filter's run is near
    end = descend(problem, start_here, options, polish=False)  # a landmark may hang on a single sighting
    return _result(problem, end)


class _Here(NamedTuple):
    """The problem at a place: costs, rows of the Jacobian, normal equations N and g, their diagonal."""

    place: Place
    costs: Array
    N: sparse.csc_matrix
    g: Array
    diagonal: Array
    gradient_norm: float
    stiffness: float = 1.0


def _result(problem: _Problem, end: Descent[_Here]) -> Batch:
    poses, landmarks, calibration = end.here.place
    _, s = problem.residuals(*end.here.place)
    relative, _ = problem.odometry(calibration)
    e = se2.between(poses[:-1], poses[1:]) - relative.mean
    e[:, 2] = so2.wrap(e[:, 2])
    scale = np.array([calibration.sigma_range, calibration.sigma_bearing])
    used = np.sum(s**2, 1) <= PLAUSIBLE
    size, f = len(end.here.g), len(problem.free)
    N = (end.here.N + 1e-12 * sparse.eye(size)).tocsc()
    free_cov = splu(N).solve(np.eye(size)[:, size - f :])[size - f :] if f else np.zeros((0, 0))
    poses = np.column_stack([poses[:, :2], so2.wrap(poses[:, 2])])
    return Batch(
        times=sighting_times(problem.log, calibration),
        poses=poses,
        ids=problem.ids,
        landmarks=landmarks,
        calibration=calibration,
        cost=float(end.here.costs.sum()),
        odometry=e,
        sightings=s * scale,
        used=used,
        iterations=len(end.history),
        converged=end.reason in CONVERGED,
        free=problem.free,
        free_cov=free_cov,
    )
