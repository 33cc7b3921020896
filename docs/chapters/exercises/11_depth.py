"""Exercise 11.1: depth, and what it is worth.

A point of camera a's frame is R_b_a @ X + t_b_a in the frame of b.  ``ray_a`` and ``ray_b`` are unit vectors
(3,), each in the frame of its own camera.
"""

import numpy as np


def depths(ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray, t_b_a: np.ndarray) -> np.ndarray:
    """Distances (2,) along both rays of the places where they come closest to one another.

    Negative where that is behind the camera.  The rays are not parallel.
    """
    raise NotImplementedError


def depth_sigma(
    ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray, t_b_a: np.ndarray, eps: float
) -> float:
    """Standard deviation of the first of the two distances, to first order.

    Each ray errs within the plane of both, independently, with the standard deviation ``eps``, radians.
    """
    raise NotImplementedError


def worth_a_point(
    ray_a: np.ndarray, ray_b: np.ndarray, R_b_a: np.ndarray, t_b_a: np.ndarray, eps: float
) -> bool:
    """Whether the two rays should become a point of the map.

    The point lies before both cameras; the sigma of its distance from a is at most a fifth of that distance;
    and the rays pass each other within three sigma: the gap between them is at most 3 ``eps`` times the
    root of the sum of both squared distances.  Parallel rays (parallax below 1e-6 radians) are refused.
    """
    raise NotImplementedError
