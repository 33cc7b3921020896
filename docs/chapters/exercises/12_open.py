"""Exercise 12.1: what a map leaves open.

Poses ``T_a_b (4, 4)`` map points of frame b to frame a; ``kf`` is a keyframe, ``cam`` the camera of a
picture, ``world`` the frame of the map.
"""

import numpy as np


def latencies(work: np.ndarray, period: float) -> np.ndarray:
    """Time (n,) from the arrival of each picture to the end of its work, which takes ``work (n,)``.

    Pictures arrive every ``period`` and are worked on one after the other, in their order.  The first
    arrives at an idle machine.
    """
    raise NotImplementedError


def own_unit(T_kf_world: np.ndarray, X_world: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Keyframes (K, 4, 4) and points (N, 3) of the same map in its own frame and unit.

    The first keyframe has the identity for its pose, and the median depth of all points in it is 1.  No
    point moves in any keyframe's picture.
    """
    raise NotImplementedError


def final_path(
    T_cam_world: np.ndarray, kf: np.ndarray, T_kf_then: np.ndarray, T_kf_now: np.ndarray
) -> np.ndarray:
    """Poses (n, 4, 4) of pictures at the end.

    Picture i had the pose ``T_cam_world[i]`` when keyframe ``kf[i]`` had ``T_kf_then[i]``, shape (n, 4, 4).
    Now the keyframes have ``T_kf_now (K, 4, 4)``, and each picture has kept its place beside its own.
    """
    raise NotImplementedError


def scale_drift(centres: np.ndarray, true: np.ndarray) -> float:
    """Scale of the last third of a path (n, 3) over that of the first third.

    The scale of a part is the s of the similarity s R x + t that brings it to the truth (n, 3) with the least
    sum of squares.  A third has n // 3 pictures.  Below 1: the map has grown.
    """
    raise NotImplementedError
