"""What is drawn into the world: a grid on a plane, and a house that stands on it.

All coordinates are of the plane's frame: z = 0 is the plane, z points away from it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera

CELLS = 8
"""Of the grid, in each direction."""
PIECES = 5
"""Of a cell's side: a lens bends lines."""
WIDTH, DEPTH, WALL, ROOF = 1.3, 1.0, 0.8, 1.35
"""Of the house, cells; the last two are heights above the plane."""
BEYOND = 1.5
"""Times the field of the picture: farther out, no lens is asked."""


class Face(NamedTuple):
    """A flat side of a solid: its corners (n, 3), its normal outwards (3,), and how bright it is."""

    corners: Array
    normal: Array
    light: float


def grid(cell: float) -> Array:
    """Lines of a grid around the plane's origin, cut into pieces: their ends, (n, 2, 3)."""
    reach = CELLS // 2
    along = np.linspace(-reach, reach, CELLS * PIECES + 1) * cell
    across = np.arange(-reach, reach + 1) * cell
    a, b = np.meshgrid(along, across)
    x_lines = np.stack([a, b, np.zeros_like(a)], -1)
    both = np.concatenate([x_lines, x_lines[..., [1, 0, 2]]])
    return np.stack([both[:, :-1], both[:, 1:]], 2).reshape(-1, 2, 3)


def house(cell: float) -> tuple[Face, ...]:
    """A convex house around the plane's origin: four walls, two of them gables, and two sides of a roof."""
    w, d, h, top = (v * cell for v in (WIDTH / 2, DEPTH / 2, WALL, ROOF))
    low = np.array([[-w, -d, 0], [w, -d, 0], [w, d, 0], [-w, d, 0]])
    high = low + [0, 0, h]
    left, right = np.array([-w, 0, top]), np.array([w, 0, top])
    sides = (
        ([low[0], low[1], high[1], high[0]], 0.85),
        ([low[2], low[3], high[3], high[2]], 0.6),
        ([low[1], low[2], high[2], right, high[1]], 0.7),
        ([low[3], low[0], high[0], left, high[3]], 0.75),
        ([high[0], high[1], right, left], 1.0),
        ([high[2], high[3], left, right], 0.8),
    )
    return tuple(_face(np.array(corners), light) for corners, light in sides)


def _face(corners: Array, light: float) -> Face:
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    return Face(corners, normal / np.linalg.norm(normal), light)


def faces_towards(faces: tuple[Face, ...], eye: Array) -> list[Face]:
    """Those whose outside the eye (3,) sees; of a convex solid, none hides another."""
    return [face for face in faces if face.normal @ (eye - face.corners[0]) > 0]


class SolidView(NamedTuple):
    """A camera (its picture's size is (width, height)) at a pose ``T_cam_plane`` (4, 4)."""

    camera: Camera
    size: tuple[int, int]
    T_cam_plane: Array

    @property
    def eye(self) -> Array:
        """The camera's centre in the plane's frame, (3,)."""
        return np.asarray(se3.inverse(self.T_cam_plane)[:3, 3])

    def pixels(self, X: Array) -> tuple[Array, BoolArray]:
        """Pixels (..., 2) of points (..., 3) of the plane's frame, and which are in or near the picture."""
        X_cam = se3.act(self.T_cam_plane, X)
        width, height = self.size
        corners = np.array([[0, 0], [width, 0], [0, height], [width, height]], dtype=np.float64)
        border = self.camera.unproject(corners)
        inside = X_cam[..., 2] > 0
        if border.valid.all():
            reach = BEYOND * np.abs(border.xn).max()
            inside &= (np.abs(X_cam[..., :2]) <= reach * X_cam[..., 2:]).all(-1)
        shown = self.camera.project(np.where(inside[..., None], X_cam, [0.0, 0.0, 1.0]))
        return shown.uv, inside & shown.valid
