"""Exercise 9.1: find the motion."""

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
    """Samples of eight pairs, judged by their lines; a fit to what fits; the motion that is in front."""

    def fitted(rows: np.ndarray) -> np.ndarray:
        A = np.einsum("ni,nj->nij", x_b[rows], x_a[rows]).reshape(-1, 9)
        return nearest_essential(np.linalg.svd(A)[2][-1].reshape(3, 3))

    def distances(E: np.ndarray) -> np.ndarray:
        line_b, line_a = x_a @ E.T, x_b @ E
        gradient = np.sum(line_b[:, :2] ** 2 + line_a[:, :2] ** 2, axis=1)
        return np.sum(x_b * line_b, axis=1) ** 2 / gradient / sigma**2

    def judged(E: np.ndarray) -> float:
        return float(np.minimum(distances(E), 4.0).mean())

    samples = [fitted(rng.choice(len(x_a), 8, replace=False)) for _ in range(300)]
    best = min(samples, key=judged)
    for _ in range(5):
        fits = np.flatnonzero(distances(best) < 9.0)
        if len(fits) >= 8:
            best = min(best, fitted(fits), key=judged)

    def price(motion: tuple[np.ndarray, np.ndarray]) -> float:
        costs = [cost(*motion, a, b) / sigma**2 for a, b in zip(x_a, x_b, strict=True)]
        return float(np.minimum(costs, 4.0).mean())

    return min(motions(best), key=price)
