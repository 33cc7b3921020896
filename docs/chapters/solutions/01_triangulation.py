"""Solution of exercise 1.1."""

import numpy as np


def project(P: np.ndarray, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (V, 2) of one point, and their derivatives (V, 2, 3)."""
    h = P[:, :, :3] @ X + P[:, :, 3]  # (V, 3)
    uv = h[:, :2] / h[:, 2:]
    # d(h_k / h_3) = (dh_k - uv_k dh_3) / h_3, and dh = P[:, :, :3] dX
    J = (P[:, :2, :3] - uv[:, :, None] * P[:, 2:, :3]) / h[:, 2, None, None]
    return uv, J


def triangulate(P: np.ndarray, uv: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray, str]:
    """Point, covariance and reason: the linear point, then Gauss-Newton with halved steps."""
    X, fixed = linear(P, uv)
    unknown = np.diag([np.inf] * 3)
    if not fixed:
        return X, unknown, "no depth"
    if (depths(P, X) <= 0).any():
        return X, unknown, "behind"
    for _ in range(50):
        seen, J = project(P, X)
        r, J = (seen - uv).ravel(), J.reshape(-1, 3)
        step = -np.linalg.solve(J.T @ J, J.T @ r)
        while (depths(P, X + step) <= 0).any() or error(P, uv, X + step) > error(P, uv, X) * (1 + 1e-12):
            step = 0.5 * step
            if np.linalg.norm(step) < 1e-15 * np.linalg.norm(X):
                break
        X = X + step
        if np.linalg.norm(step) <= 1e-12 * np.linalg.norm(X):
            break
    J = project(P, X)[1].reshape(-1, 3)
    return X, sigma**2 * np.linalg.inv(J.T @ J), ""


def linear(P: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, bool]:
    """Point with u (P_3 . h) = P_1 . h and v (P_3 . h) = P_2 . h in least squares; whether there is one."""
    centres = np.array([-np.linalg.solve(p[:, :3], p[:, 3]) for p in P])
    middle = centres.mean(axis=0)
    size = np.linalg.norm(centres - middle, axis=1).max()
    if size <= 1e-12 * (1 + np.abs(centres).max()):
        return np.zeros(3), False
    # the world moved and scaled, so that the fourth number is of the size of the others
    move = np.eye(4)
    move[:3, :3], move[:3, 3] = size * np.eye(3), middle
    Q = P @ move
    rows = (uv[:, :, None] * Q[:, 2:, :] - Q[:, :2, :]).reshape(-1, 4)
    rows = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    _, s, Vt = np.linalg.svd(rows)
    h = Vt[-1]
    if s[2] <= 1e-10 * s[0] or abs(h[3]) <= 1e-10:
        return np.zeros(3), False
    return size * h[:3] / h[3] + middle, True


def depths(P: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Depth (V,) of the point in every camera: the third row of [R t] has length 1."""
    return P[:, 2, :3] @ X + P[:, 2, 3]


def error(P: np.ndarray, uv: np.ndarray, X: np.ndarray) -> float:
    """Sum of squared pixel errors."""
    return float(np.sum((project(P, X)[0] - uv) ** 2))
