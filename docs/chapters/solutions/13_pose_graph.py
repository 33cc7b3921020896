"""Exercise 13.1: a pose graph of the plane."""

import numpy as np


def solve(
    poses: np.ndarray, tail: np.ndarray, head: np.ndarray, measured: np.ndarray, information: np.ndarray
) -> np.ndarray:
    """Gauss-Newton with steps added to x, y, theta, until a step is nothing."""
    X = np.array(poses, dtype=float)
    n = len(X)
    for _ in range(50):
        H, g = np.zeros((3 * n, 3 * n)), np.zeros(3 * n)
        for i, j, Z, Omega in zip(tail, head, measured, information, strict=True):
            e, A, B = _edge(X[i], X[j], Z)
            at = np.r_[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
            J = np.hstack([A, B])
            H[np.ix_(at, at)] += J.T @ Omega @ J
            g[at] += J.T @ Omega @ e
        step = np.zeros(3 * n)
        step[3:] = np.linalg.solve(H[3:, 3:], -g[3:])  # the first pose is held
        X += step.reshape(n, 3)
        if np.abs(step).max() < 1e-12:
            break
    X[1:, 2] = _wrap(X[1:, 2])
    return X


def _edge(a: np.ndarray, b: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Error of an edge, and its derivatives in both poses."""
    R, Rz, S = _turn(a[2]), _turn(z[2]), np.array([[0.0, -1.0], [1.0, 0.0]])
    d = b[:2] - a[:2]
    e = np.append(Rz.T @ (R.T @ d - z[:2]), _wrap(b[2] - a[2] - z[2]))
    A, B = np.zeros((3, 3)), np.zeros((3, 3))
    B[:2, :2], B[2, 2] = Rz.T @ R.T, 1.0
    A[:2, :2], A[2, 2] = -B[:2, :2], -1.0
    A[:2, 2] = -Rz.T @ S @ R.T @ d  # R^T turns back when theta grows
    return e, A, B


def _turn(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _wrap(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi
