"""Image features in plain loops: one pixel, one patch, one comparison, one step, as chapter 08 reads them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.features.levels import Bytes

CIRCLE = [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
CIRCLE += [(-x, -y) for x, y in CIRCLE]


def halve(image: Bytes) -> Bytes:
    """Mean of each block of four pixels, rounded half up."""
    height, width = image.shape[0] // 2, image.shape[1] // 2
    half = np.zeros((height, width), np.uint8)
    for y in range(height):
        for x in range(width):
            block = image[2 * y : 2 * y + 2, 2 * x : 2 * x + 2]
            half[y, x] = (int(block.sum()) + 2) // 4  # eq-pyramid
    return half


def is_corner(image: Bytes, x: int, y: int, threshold: int, arc: int) -> bool:
    """Whether ``arc`` pixels in a row of the circle are all brighter, or all darker, than the centre."""
    centre = int(image[y, x])
    around = [int(image[y + dy, x + dx]) - centre for dx, dy in CIRCLE]
    for start in range(16):
        differences = [around[(start + k) % 16] for k in range(arc)]
        if min(differences) > threshold or max(differences) < -threshold:  # eq-segment-test
            return True
    return False


def corner_score(image: Bytes, x: int, y: int, arc: int) -> int:
    """Largest threshold at which the pixel is a corner, -1 without one."""
    score = -1
    while score < 254 and is_corner(image, x, y, score + 1, arc):  # eq-corner-score
        score += 1
    return score


def shi_tomasi(image: Bytes, x: int, y: int) -> float:
    """Smaller eigenvalue of the mean of g g^T over 7 x 7 pixels."""
    grey = image.astype(float)
    tensor = np.zeros((2, 2))
    for j in range(y - 3, y + 4):
        for i in range(x - 3, x + 4):
            g = np.array([grey[j, i + 1] - grey[j, i - 1], grey[j + 1, i] - grey[j - 1, i]]) / 2
            tensor += np.outer(g, g) / 49  # eq-structure-tensor
    return float(np.linalg.eigvalsh(tensor)[0])  # eq-shi-tomasi


def between(image: Bytes, x: float, y: float) -> float:
    """Grey level between four pixels."""
    j, i = min(int(x), image.shape[1] - 2), min(int(y), image.shape[0] - 2)
    fx, fy = x - j, y - i
    four = image[i : i + 2, j : j + 2].astype(float)
    return float(np.array([1 - fy, fy]) @ four @ np.array([1 - fx, fx]))  # eq-bilinear


def warped_patch(image: Bytes, u: Array, M: Array) -> Bytes:
    """Patch of 8 x 8 pixels around the pixel u (2,), each pixel of it M (2, 2) pixels wide in the image."""
    patch = np.zeros((8, 8), np.uint8)
    for i in range(8):
        for j in range(8):
            x, y = u + M @ np.array([j - 4.0, i - 4.0])  # eq-warp
            patch[i, j] = int(between(image, x, y) + 0.5)
    return patch


def zmssd(A: Bytes, B: Bytes) -> float:
    """Squared differences of two patches, each without its mean."""
    difference = (A - A.mean()) - (B - B.mean())
    return float(np.sum(difference**2))  # eq-zmssd


def best_corner(image: Bytes, corners: list[tuple[int, int]], T: Bytes, u: Array, radius: float) -> int:
    """Number of the corner within the radius of u (2,), pixels, that looks most like T; -1 without one."""
    best, least = -1, np.inf
    for number, (x, y) in enumerate(corners):
        patch = image[y - 4 : y + 4, x - 4 : x + 4] if min(x, y) >= 4 else image[:0]
        if patch.shape == (8, 8) and np.hypot(x - u[0], y - u[1]) <= radius:
            cost = zmssd(T, patch)  # eq-zmssd
            best, least = (number, cost) if cost < least else (best, least)
    return best


class Step(NamedTuple):
    """Pixel u (2,) where the patch lies after a step, and its offset of brightness b, grey levels."""

    u: Array
    b: float


def refine_step(image: Bytes, T: Bytes, u: Array, b: float) -> Step:
    """One inverse compositional step from pixel u (2,) and offset b, grey levels: three unknowns."""
    H, gradient = np.zeros((3, 3)), np.zeros(3)
    for i in range(1, 7):
        for j in range(1, 7):
            gx, gy = float(T[i, j + 1]) - float(T[i, j - 1]), float(T[i + 1, j]) - float(T[i - 1, j])
            J = np.array([gx / 2, gy / 2, 1.0])
            r = float(T[i, j]) + b - between(image, u[0] + j - 4, u[1] + i - 4)  # eq-refine-residual
            H += np.outer(J, J)  # eq-refine-normal
            gradient += J * r
    delta = -np.linalg.solve(H, gradient)
    return Step(u - delta[:2], b + delta[2])  # eq-inverse-compositional
