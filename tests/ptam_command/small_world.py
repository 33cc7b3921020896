"""A world that is quick to draw: boards with a random texture before a wall, and a camera that passes by.

Pictures are 320 x 240.  A board is a rectangle of a plane z = depth; textures are smooth noise, so that
corners stay where they are.  The truth is exact.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

SIZE = 320, 240
FOCAL = 260.0
CALIB = f"{FOCAL} {FOCAL} 159.5 119.5 320 240\n"
BOARDS = (
    (4.5, (-9.0, 9.0), (-9.0, 9.0)),
    (3.2, (-1.6, -0.4), (-1.1, 0.3)),
    (2.8, (0.5, 2.0), (-0.4, 0.9)),
    (2.3, (-0.5, 0.3), (0.1, 1.0)),
    (3.6, (1.2, 2.6), (-1.5, -0.6)),
)
"""Depth, and from where to where in x and y; the wall first."""
STEP = 0.04


def place(k: int) -> np.ndarray:
    """Where the camera is at picture k; it does not turn."""
    return np.array([STEP * k, 0.05 * np.sin(0.2 * k), 0.01 * k])


def _texture(seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).uniform(0, 255, (256, 256)).astype(np.float32)
    smooth = cv2.GaussianBlur(np.tile(noise, (3, 3)), (0, 0), 1.2)[256:512, 256:512]
    smooth = (smooth - smooth.mean()) / smooth.std()
    return np.clip(128 + 50 * smooth, 0, 255)


TEXTURES = [_texture(seed) for seed in range(len(BOARDS))]


def picture(k: int) -> np.ndarray:
    """Grey picture k, (240, 320)."""
    v, u = np.indices(SIZE[::-1]).astype(np.float32)
    x, y = (u - 159.5) / FOCAL, (v - 119.5) / FOCAL
    C = place(k)
    image, nearest = np.zeros(SIZE[::-1], np.float32), np.full(SIZE[::-1], np.inf, np.float32)
    for texture, (depth, (left, right), (low, high)) in zip(TEXTURES, BOARDS, strict=True):
        z = depth - C[2]
        X, Y = C[0] + z * x, C[1] + z * y
        inside = (left <= X) & (right > X) & (low <= Y) & (high > Y)
        seen = inside & (nearest > z)
        scale = 0.4 * FOCAL / depth  # 2.5 pixels a texel
        at = (scale * X % 256).astype(np.float32), (scale * Y % 256).astype(np.float32)
        shown = cv2.remap(texture, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        image[seen], nearest[seen] = shown[seen], z
    return np.rint(image).astype(np.uint8)


def write(folder: Path, count: int, *, truth: bool = True, camera: bool = True) -> Path:
    """Write ``count`` pictures in the plain layout."""
    (folder / "images").mkdir(parents=True)
    for k in range(count):
        cv2.imwrite(str(folder / "images" / f"{k:06d}.png"), picture(k))
    (folder / "times.txt").write_text("".join(f"{0.1 * k!r}\n" for k in range(count)))
    if camera:
        (folder / "calib.txt").write_text(CALIB)
    if truth:
        rows = [f"{0.1 * k!r} {' '.join(repr(float(v)) for v in place(k))} 0 0 0 1\n" for k in range(count)]
        (folder / "groundtruth_tum.txt").write_text("".join(rows))
    return folder
