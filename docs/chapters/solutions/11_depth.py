"""Exercise 11.1: depth, and what it is worth."""

import numpy as np


def depths(ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray, t_b_a: np.ndarray) -> np.ndarray:
    """Least squares of q b - p R a = t: two unknowns, three rows."""
    M = np.stack([-R_b_a @ ray_a, ray_b], 1)
    return np.linalg.solve(M.T @ M, M.T @ t_b_a)


def parallax(ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray) -> float:
    """Angle between the rays; by the sine and the cosine, since the arc cosine loses small angles."""
    in_b = R_b_a @ ray_a
    return float(np.arctan2(np.linalg.norm(np.cross(in_b, ray_b)), in_b @ ray_b))


def depth_sigma(
    ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray, t_b_a: np.ndarray, eps: float
) -> float:
    """The other ray's error slides the point along this one; of this one's own error cos(alpha) is left."""
    p, q = depths(ray_a, ray_b, R_b_a, t_b_a)
    alpha = parallax(ray_a, ray_b, R_b_a)
    return float(eps * np.hypot(q, p * np.cos(alpha)) / np.sin(alpha))


def worth_a_point(
    ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray, t_b_a: np.ndarray, eps: float
) -> bool:
    """Parallel rays first: nothing else can be computed for them."""
    if np.sin(parallax(ray_a, ray_b, R_b_a)) < 1e-6:
        return False
    p, q = depths(ray_a, ray_b, R_b_a, t_b_a)
    gap = np.linalg.norm(p * R_b_a @ ray_a + t_b_a - q * ray_b)
    near = gap <= 3 * eps * np.hypot(p, q)
    return bool(p > 0 and q > 0 and near and depth_sigma(ray_a, ray_b, R_b_a, t_b_a, eps) <= p / 5)
