"""Exercise 12.1: what a map leaves open."""

import numpy as np


def latencies(work: np.ndarray, period: float) -> np.ndarray:
    """What is left of the last one's time when the next arrives, if anything, comes on top."""
    latency, before = np.zeros(len(work)), 0.0
    for k, own in enumerate(work):
        before = own + max(0.0, before - period)
        latency[k] = before
    return latency


def own_unit(T_kf_world: np.ndarray, X_world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first keyframe's frame for the world's, then all lengths over the median depth."""
    first = T_kf_world[0]
    X = X_world @ first[:3, :3].T + first[:3, 3]
    T = T_kf_world @ np.linalg.inv(first)
    depth = np.median(X[:, 2])
    T[:, :3, 3] /= depth
    return T, X / depth


def final_path(
    T_cam_world: np.ndarray, kf: np.ndarray, T_kf_then: np.ndarray, T_kf_now: np.ndarray
) -> np.ndarray:
    """T_cam_kf as it was, and the keyframe as it is: neighbours cancel."""
    return T_cam_world @ np.linalg.inv(T_kf_then) @ T_kf_now[kf]


def scale(source: np.ndarray, target: np.ndarray) -> float:
    """Umeyama's: the turn first, then how far the turned source reaches along the target."""
    a, b = source - source.mean(0), target - target.mean(0)
    U, d, Vt = np.linalg.svd(b.T @ a)
    d[2] *= np.linalg.det(U) * np.linalg.det(Vt)
    return float(d.sum() / np.sum(a**2))


def scale_drift(centres: np.ndarray, true: np.ndarray) -> float:
    """Each third alone."""
    n = len(centres) // 3
    return scale(centres[-n:], true[-n:]) / scale(centres[:n], true[:n])
