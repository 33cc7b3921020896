"""Exercise 10.1: one reweighted step."""

import numpy as np

from vslam_ref.geometry import se3


def scale(e: np.ndarray) -> float:
    """Half of all norms are below sqrt(2 ln 2) = 1.1774 standard deviations of a coordinate."""
    return max(float(np.median(np.hypot(e[:, 0], e[:, 1]))) / np.sqrt(2 * np.log(2)), 0.4)


def weights(e: np.ndarray, sigma: float) -> np.ndarray:
    """One weight for both coordinates, from the norm; the constant is that of two dimensions."""
    x = np.hypot(e[:, 0], e[:, 1]) / (5.1230 * sigma)
    return np.where(x < 1, (1 - x**2) ** 2, 0.0)


def step(e: np.ndarray, J: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Minus, because e grows along J."""
    H = np.einsum("n,nai,naj->ij", w, J, J)
    return -np.linalg.solve(H, np.einsum("n,nai,na->i", w, J, e))


def pose(X_world: np.ndarray, xn: np.ndarray, f: float, T: np.ndarray, steps: int = 10) -> np.ndarray:
    """X moves by rho + phi x X; the pixel by f/z (dx - x/z dz), and likewise for y."""
    for _ in range(steps):
        X = X_world @ T[:3, :3].T + T[:3, 3]
        x, y, z = X.T
        zero, one = np.zeros(len(X)), np.ones(len(X))
        of_point = (
            f / z[:, None, None] * np.stack([one, zero, -x / z, zero, one, -y / z], 1).reshape(-1, 2, 3)
        )
        cross = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], 1).reshape(-1, 3, 3)  # phi x X = cross phi
        J = np.concatenate([of_point, of_point @ cross], 2)
        e = f * (X[:, :2] / X[:, 2:] - xn)
        T = se3.exp(step(e, J, weights(e, scale(e)))) @ T
    return T
