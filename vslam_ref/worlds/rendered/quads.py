"""The solid things of a scene: flat rectangles, alone or as the faces of boxes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import so3

TOP, BRIGHT, DIM = 1.0, 0.82, 0.66
"""Light on faces that look up, along x, and along y: shares of the texture's grey values."""


class Quads(NamedTuple):
    """Textured parallelograms ``corner + s side[0] + t side[1]``, 0 <= s, t <= 1, seen from both sides.

    Attributes
    ----------
    corner : ndarray, shape (Q, 3)
        Metres, in the world.
    side : ndarray, shape (Q, 2, 3)
        Metres; the texture's columns run along the first side, its rows along the second.
    texture : ndarray of int, shape (Q,)
        Number of the texture.
    light : ndarray, shape (Q,)
        Share of the texture's grey values that is seen.
    """

    corner: Array
    side: Array
    texture: IntArray
    light: Array


class Built(NamedTuple):
    """A scene's things.

    Attributes
    ----------
    quads : Quads
    images : list of ndarray of uint8, shapes (H, W)
        Their textures, grey values.
    landmarks : ndarray, shape (L, 3)
        Points that stand out, metres, in the world.
    """

    quads: Quads
    images: list[NDArray[np.uint8]]
    landmarks: Array = np.zeros((0, 3))


def quad(corner: ArrayLike, across: ArrayLike, down: ArrayLike, texture: int, light: float = 1.0) -> Quads:
    """One parallelogram: ``corner (3,)``, sides ``across (3,)`` and ``down (3,)`` of its texture, metres."""
    sides = np.stack([np.asarray(across, np.float64), np.asarray(down, np.float64)])
    return Quads(np.asarray([corner], np.float64), sides[None], np.array([texture]), np.array([light]))


def joined(parts: Sequence[Quads]) -> Quads:
    """All parts as one."""
    return Quads(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def taken(quads: Quads, rows: IntArray) -> Quads:
    """Some of the quads, in metres as all are, by their rows (n,)."""
    return Quads(quads.corner[rows], quads.side[rows], quads.texture[rows], quads.light[rows])


def box(
    middle: ArrayLike, size: ArrayLike, yaw: float, textures: Sequence[int], bottom: float = 0.0
) -> Quads:
    """A box that stands on something: its top and its four walls.

    Parameters
    ----------
    middle : array_like, shape (2,)
        Where its middle stands, metres.
    size : array_like, shape (3,)
        Along its own x, y and z, metres.
    yaw : float
        Turn about z, radians.
    textures : sequence of int
        Of the top, of the walls at -y and +y, and of those at -x and +x.
    bottom : float
        Height of what it stands on, metres.
    """
    R = so3.exp([0.0, 0.0, yaw])
    width, depth, height = np.asarray(size, np.float64)
    x, y, z = width * R[:, 0], depth * R[:, 1], np.array([0.0, 0.0, height])
    base = np.array([*np.asarray(middle, np.float64), bottom]) - x / 2 - y / 2
    top, front, side = textures
    turned = abs(np.cos(yaw))
    along_y, along_x = DIM + (BRIGHT - DIM) * (1 - turned), BRIGHT - (BRIGHT - DIM) * (1 - turned)
    faces = [
        quad(base + y + z, x, -y, top, TOP),
        quad(base + z, x, -z, front, along_y),
        quad(base + x + y + z, -x, -z, front, along_y),
        quad(base + y + z, -y, -z, side, along_x),
        quad(base + x + z, y, -z, side, along_x),
    ]
    return joined(faces)
