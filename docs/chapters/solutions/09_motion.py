"""Exercise 9.1: which way did it go?"""

import numpy as np

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def nearest_essential(M: np.ndarray) -> np.ndarray:
    """Keep the singular vectors, and make the values 1, 1, 0."""
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1.0, 1.0, 0.0]) @ Vt


def motions(E: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Two rotations, two signs; a mirror is turned over."""
    U, _, Vt = np.linalg.svd(E)
    both = [U @ W @ Vt for W in (QUARTER, QUARTER.T)]
    return [(R * np.linalg.det(R), t) for R in both for t in (U[:, 2], -U[:, 2])]


def cost(R: np.ndarray, t: np.ndarray, x_a: np.ndarray, x_b: np.ndarray) -> float:
    """In front: the distance from the line.  Behind: that from the image of infinity."""
    a, b = R @ x_a, x_b
    n = np.cross(a, b)
    if n @ np.cross(b, t) > 0 and n @ np.cross(a, t) > 0:
        hat = np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])
        E = hat @ R
        gradient = np.concatenate([(E @ x_a)[:2], (E.T @ x_b)[:2]])
        return float((x_b @ E @ x_a) ** 2 / (gradient @ gradient))
    e = a[:2] / a[2] - b[:2]
    J = (R[:2, :2] - np.outer(a[:2] / a[2], R[2, :2])) / a[2]
    return float(e @ np.linalg.solve(np.eye(2) + J @ J.T, e))


def find_motion(
    x_a: np.ndarray, x_b: np.ndarray, sigma: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Samples of eight pairs; the cheapest motion, fitted again to what fits it."""

    def price(R: np.ndarray, t: np.ndarray) -> np.ndarray:
        return np.array([cost(R, t, a, b) for a, b in zip(x_a, x_b, strict=True)]) / sigma**2

    def best_of(rows: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        A = np.array([np.kron(x_b[k], x_a[k]) for k in rows])
        E = nearest_essential(np.linalg.svd(A)[2][-1].reshape(3, 3))
        tried = [(np.minimum(price(R, t), 4.0).mean(), R, t) for R, t in motions(E)]
        return min(tried, key=lambda one: one[0])

    best = min((best_of(rng.choice(len(x_a), 8, replace=False)) for _ in range(60)), key=lambda one: one[0])
    for _ in range(3):
        fits = np.flatnonzero(price(*best[1:]) < 9.0)
        if len(fits) < 8:
            break
        again = best_of(fits)
        best = min(best, again, key=lambda one: one[0])
    return best[1], best[2]
