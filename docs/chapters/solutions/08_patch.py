"""Exercise 8.1: find a patch again."""

import numpy as np

CIRCLE = [(0, 3), (1, 3), (2, 2), (3, 1), (3, 0), (3, -1), (2, -2), (1, -3)]
CIRCLE += [(-x, -y) for x, y in CIRCLE]


def on_level_zero(uv: np.ndarray, level: int) -> np.ndarray:
    """Scale by 2^l, and add the half pixels of all levels: 1/2 + 1 + 2 + ... = (2^l - 1)/2."""
    return 2.0**level * np.asarray(uv) + (2.0**level - 1) / 2


def is_corner(image: np.ndarray, x: int, y: int, threshold: int, arc: int) -> bool:
    """Walk around the circle from each of its pixels; whole numbers first, since bytes wrap around."""
    centre = int(image[y, x])
    differences = [int(image[y + dy, x + dx]) - centre for dx, dy in CIRCLE]
    for k in range(16):
        part = [differences[(k + j) % 16] for j in range(arc)]
        if min(part) > threshold or max(part) < -threshold:
            return True
    return False


def zmssd(sum_a: float, sum_b: float, sum_aa: float, sum_bb: float, sum_ab: float, n: int) -> float:
    """Sum of squares of A - B, less the square of its sum over n."""
    return sum_aa + sum_bb - 2 * sum_ab - (sum_a - sum_b) ** 2 / n


def refine(image: np.ndarray, T: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
    """The Jacobian is the template's: made once, outside the loop."""
    T, image, u, b = np.asarray(T, float), np.asarray(image, float), np.array(u, float), 0.0
    gx, gy = (T[1:-1, 2:] - T[1:-1, :-2]) / 2, (T[2:, 1:-1] - T[:-2, 1:-1]) / 2
    J = np.stack([gx.ravel(), gy.ravel(), np.ones(36)], 1)
    inverse = np.linalg.inv(J.T @ J)
    dx, dy = (d.ravel() for d in np.meshgrid(np.arange(-3, 3), np.arange(-3, 3)))
    for _ in range(20):
        x, y = u[0] + dx, u[1] + dy
        j, i = np.floor(x).astype(int), np.floor(y).astype(int)
        fx, fy = x - j, y - i
        top = (1 - fx) * image[i, j] + fx * image[i, j + 1]
        bottom = (1 - fx) * image[i + 1, j] + fx * image[i + 1, j + 1]
        r = T[1:-1, 1:-1].ravel() + b - ((1 - fy) * top + fy * bottom)
        step = -inverse @ J.T @ r
        u, b = u - step[:2], b + step[2]  # the template would move by the step: the place moves the other way
        if np.hypot(step[0], step[1]) < 0.01:
            break
    return u, float(b)
