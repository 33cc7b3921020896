"""Calibration as the chapter derives it: one view after the other, full matrices, the text's letters.

::

    for each view v:   r, P, F of its corners      residual, Jacobians in its pose and in the intrinsics
                       A_v = P'P   B_v = P'F   C += F'F   g_v = P'r   g_c += F'r
    eliminate poses    S = C - sum B_v' A_v^-1 B_v
    intrinsics         S theta' = -(g_c - sum B_v' A_v^-1 g_v)
    poses              xi_v = -A_v^-1 (g_v + B_v theta')

Residuals are in pixels; poses in the board's unit and radians.  A test asserts that the fast form takes the
same steps.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera


class BookCalibration(NamedTuple):
    """Camera, poses T_cam_board (V, 4, 4), the cost at the start and after each step, covariance (n, n)."""

    camera: Camera
    T: Array
    costs: list[float]
    covariance: Array


class Arrow(NamedTuple):
    """Blocks of the normal equations: A_v (6, 6), B_v (6, n), g_v (6,) of each view; C (n, n), g_c (n,)."""

    A: list[Array]
    B: list[Array]
    g: list[Array]
    C: Array
    g_c: Array


def residual(camera: Camera, T_v: Array, X: Array, z: Array) -> Array:
    """Predicted less measured pixels of one view's corners, (2 N,): pose T_v (4, 4), X (N, 3), z (N, 2)."""
    return np.asarray(camera.pixel_from_world(T_v, X).uv - z).ravel()  # eq-calibration-residual


def cost(camera: Camera, T: Array, views: list[tuple[Array, Array]]) -> float:
    """Half the sum of all squared residuals, px^2; poses T (V, 4, 4), views of X (N, 3) and z (N, 2) each."""
    squares = [np.sum(residual(camera, T[v], X, z) ** 2) for v, (X, z) in enumerate(views)]
    return 0.5 * float(np.sum(squares))  # eq-calibration-cost


def normal_equations(camera: Camera, T: Array, views: list[tuple[Array, Array]]) -> Arrow:
    """Add up the blocks, view by view; poses T (V, 4, 4), views of X (N, 3) and z (N, 2) each."""
    n = len(camera.params)
    A, B, g = list[Array](), list[Array](), list[Array]()
    C, g_c = np.zeros((n, n)), np.zeros(n)
    for v, (X, z) in enumerate(views):
        seen, r = camera.pixel_from_world_with_jacobians(T[v], X), residual(camera, T[v], X, z)
        P, F = seen.J_pose.reshape(-1, 6), seen.J_intrinsics.reshape(-1, n)
        A, B, g = [*A, P.T @ P], [*B, P.T @ F], [*g, P.T @ r]  # eq-calibration-arrow
        C, g_c = C + F.T @ F, g_c + F.T @ r
    return Arrow(A, B, g, C, g_c)


def reduced(N: Arrow) -> tuple[Array, Array]:
    """Return S and its right side: the camera's system, poses eliminated."""
    S, rhs = N.C.copy(), -N.g_c
    for A, B, g in zip(N.A, N.B, N.g, strict=True):
        S -= B.T @ np.linalg.inv(A) @ B  # eq-calibration-reduced
        rhs += B.T @ np.linalg.inv(A) @ g
    return S, rhs


def damped_step(N: Arrow, lam: float) -> tuple[Array, list[Array], float]:
    """Step of the intrinsics, of each pose, and the decrease that they promise."""
    damped = N._replace(A=[A + lam * np.diag(np.diag(A)) for A in N.A], C=N.C + lam * np.diag(np.diag(N.C)))
    theta = np.asarray(np.linalg.solve(*reduced(damped)))  # eq-damped
    xi = [np.asarray(-np.linalg.solve(A, g + B @ theta)) for A, B, g in zip(damped.A, N.B, N.g, strict=True)]
    square = sum(x @ np.diag(np.diag(A)) @ x for x, A in zip(xi, N.A, strict=True))
    square += theta @ np.diag(np.diag(N.C)) @ theta
    slope = sum(x @ g for x, g in zip(xi, N.g, strict=True)) + theta @ N.g_c
    return theta, xi, 0.5 * float(lam * square - slope)  # eq-gain-ratio: its denominator


def moved(T_v: Array, xi: Array) -> Array:
    """Exp(xi) T_v of a step xi (6,) and a pose T_v (4, 4)."""
    from scipy.linalg import expm

    x, y, z, a, b, c = xi
    return np.asarray(expm(np.array([[0, -c, b, x], [c, 0, -a, y], [-b, a, 0, z], [0, 0, 0, 0]])) @ T_v)


def calibrate_book(
    camera: Camera, T: Array, views: list[tuple[Array, Array]], iterations: int = 20
) -> BookCalibration:
    """Minimise the squared distances of all corners by Levenberg-Marquardt.

    Parameters
    ----------
    camera : Camera
        Start; all its intrinsics are free.
    T : ndarray, shape (V, 4, 4)
        Start of the poses T_cam_board; every corner is seen there and on the way.
    views : list of (X_board, z)
        Corners (N, 3) and their pixels (N, 2), for each view.
    iterations : int
        Steps to try.

    Returns
    -------
    BookCalibration
    """
    F, lam, nu = cost(camera, T, views), 1e-3, 2.0
    costs = [F]
    for _ in range(iterations):
        theta, xi, promised = damped_step(normal_equations(camera, T, views), lam)
        trial = type(camera).from_params(camera.params + theta)
        T_trial = np.array([moved(T_v, x) for T_v, x in zip(T, xi, strict=True)])
        F_trial = cost(trial, T_trial, views)
        gain = (F - F_trial) / promised  # eq-gain-ratio
        if gain > 1e-4:
            camera, T, F = trial, T_trial, F_trial
            lam, nu = lam * max(1 / 3, 1 - (2 * min(gain, 1.0) - 1) ** 3), 2.0  # eq-nielsen
        else:
            lam, nu = lam * nu, 2.0 * nu
        costs.append(F)
    S, _ = reduced(normal_equations(camera, T, views))
    spare = 2 * sum(len(X) for X, _ in views) - 6 * len(T) - len(camera.params)
    return BookCalibration(
        camera, T, costs, np.asarray(2 * F / spare * np.linalg.inv(S))
    )  # eq-calibration-covariance
