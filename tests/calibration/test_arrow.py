"""Elimination of the poses, against dense linear algebra and the dense solver of the room beside."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.estimation import least_squares
from vslam_ref.estimation.calibration import Board, CalibrationState, Free, calibrate, stack
from vslam_ref.estimation.calibration.arrow import Arrow, ArrowVector, arrow, damped_step, promised, reduce
from vslam_ref.estimation.calibration.problem import residual, residual_with_jacobians
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Radtan
from vslam_ref.worlds import boards

SIZE = (640, 480)
BOARD = Board(6, 5, 0.04)
CAMERA = Radtan(500, 505, 322, 238, k1=-0.25, k2=0.06, p1=1e-3, p2=-5e-4)
COUNTS = (3, 7, 2, 5)  # measurements a view: views of different lengths


def dense() -> tuple[np.ndarray, np.ndarray, Arrow, np.ndarray]:
    """A random Jacobian with an arrow's pattern, (2M, 6V + 4), residual, and its blocks; weights in both."""
    rng = np.random.default_rng(5)
    counts = np.array(COUNTS) * 4
    view = np.repeat(np.arange(4), counts)
    P, F = rng.standard_normal((len(view), 2, 6)), rng.standard_normal((len(view), 2, 4))
    r, w = rng.standard_normal((len(view), 2)), rng.uniform(0.1, 1.0, len(view))
    J = np.zeros((len(view), 2, 28))
    for i, v in enumerate(view):
        J[i, :, 6 * v : 6 * v + 6] = P[i]
    J[:, :, 24:] = F
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    root = np.sqrt(np.repeat(w, 2))
    return J.reshape(-1, 28) * root[:, None], r.ravel() * root, arrow(P, F, r, w, first), root


@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0])
def test_the_step_is_the_dense_one(damping: float) -> None:
    """QR of the augmented Jacobian against Cholesky of the reduced system: square of a condition of 10."""
    J, r, normal, _ = dense()
    scale = normal.lengths()
    step = damped_step(normal, damping, scale)
    assert step is not None
    D = np.concatenate([scale.pose.ravel(), scale.free])
    wanted = least_squares.damped_step(J, r, damping, D)
    assert wanted is not None
    found = np.concatenate([step.pose.ravel(), step.free])
    assert np.abs(found - wanted).max() < 1e-12 * np.abs(wanted).max()
    model = 0.5 * float(np.sum(r**2)) - 0.5 * float(np.sum((r + J @ wanted) ** 2))
    # the solver's promise counts the damping's share too, as that of the dense solver
    assert abs(promised(normal, step, damping, scale) - model) < 1e-10
    assert np.abs(scale.norm - np.linalg.norm(J)) < 1e-12 * np.linalg.norm(J)


def test_the_reduced_system_is_the_inverse_of_the_block_of_the_inverse() -> None:
    """Schur: inv(S) is the camera's block of inv(J^T J), the marginal covariance."""
    J, _, normal, _ = dense()
    reduced = reduce(normal)
    assert reduced is not None
    wanted = np.linalg.inv(J.T @ J)[24:, 24:]
    assert np.abs(np.linalg.inv(reduced.S) - wanted).max() < 1e-11 * np.abs(wanted).max()
    conditional = np.linalg.inv(normal.C)  # the mistake: the poses taken as known
    assert np.abs(conditional - wanted).max() > 0.1 * np.abs(wanted).max()


def test_singular_systems_are_none() -> None:
    _, _, normal, _ = dense()
    lost = normal._replace(A=np.zeros_like(normal.A), B=np.zeros_like(normal.B))
    assert reduce(lost) is None
    assert damped_step(lost, 0.0, ArrowVector(np.ones((4, 6)), np.ones(4))) is None


def test_the_dense_solver_finds_the_same_camera_and_covariance() -> None:
    """The same sum over 6V + 9 unknowns by QR; both stop at gradient cosines of 1e-10."""
    rng = np.random.default_rng(11)
    T = boards.poses(BOARD, CAMERA, SIZE, 5, rng)
    views = boards.views(BOARD, CAMERA, T, 0.3, rng)
    ours = calibrate(views, SIZE)
    corners = stack(views)
    free = Free(Radtan)

    def unpack(x: np.ndarray) -> CalibrationState:
        return CalibrationState(x[:9], x[9:].reshape(-1, 4, 4))

    def plus(x: np.ndarray, step: np.ndarray) -> np.ndarray:
        s = unpack(x)
        T = se3.perturb(s.T_cam_board, step[9:].reshape(-1, 6))
        return np.concatenate([s.params + step[:9], T.ravel()])

    def call(function: object, x: np.ndarray) -> object:
        s = unpack(x)
        return function(  # type: ignore[operator]
            s.params, s.T_cam_board[corners.view], corners.X_board, corners.uv, lens=Radtan.lens
        )

    def linear(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        r, P, F = call(residual_with_jacobians, x)  # type: ignore[misc]
        J = np.zeros((len(r), 2, 9 + 6 * 5))
        J[:, :, :9] = F
        for v in range(5):
            J[corners.view == v, :, 9 + 6 * v : 15 + 6 * v] = P[corners.view == v]
        return r.ravel(), J.reshape(-1, J.shape[-1])

    start = np.concatenate([free.apply(ours.start.camera.params), ours.start.T_cam_board.ravel()])
    found = least_squares.minimise(
        lambda x: call(residual, x).ravel(),
        start,
        with_jacobian=linear,
        plus=plus,
        coordinates=39,  # type: ignore[attr-defined]
    )
    assert found.converged
    assert abs(found.cost - ours.history[-1].cost) < 1e-10 * found.cost
    deviation = np.array(list(ours.std.values()))
    assert (np.abs(found.x[:9] - ours.camera.params) < 1e-6 * deviation).all()
    cov = found.covariance().matrix
    assert cov is not None
    assert ours.covariance is not None
    size = np.outer(deviation, deviation)
    assert np.abs((cov[:9, :9] - ours.covariance) / size).max() < 1e-8
