"""PLY, for looking at: points in their colours, and cameras as small pyramids.

Points come first, ``vertex`` elements with x y z and red green blue.  A camera is five vertices, its centre
and the corners of its image at some depth, and eight ``edge`` elements that join them.  Viewers that know
no edges show the five as points.  Coordinates are the world's, in doubles.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.estimation.bundle.families import sensors
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.geometry import se3
from vslam_ref.support.files import write_bytes

VERTEX = np.dtype([("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("red", "u1"), ("green", "u1"), ("blue", "u1")])
EDGE = np.dtype([("vertex1", "<i4"), ("vertex2", "<i4")])
NAMES = {"<f8": "double", "|u1": "uchar", "<i4": "int"}
POINT_COLOUR, CAMERA_COLOUR = (200, 200, 200), (213, 94, 0)
"""Light grey; vermilion, which differs from the other colours for colour-blind readers too."""
PYRAMID = np.array([(0, 1), (0, 2), (0, 3), (0, 4), (1, 2), (2, 3), (3, 4), (4, 1)])
DEPTH_SHARE = 0.02
"""Depth of the pyramids as a share of the typical distance from a camera to the middle of the points."""


def write_ply(path: Path | str, file: BundleFile, *, depth: float | None = None, ascii: bool = False) -> None:
    """Write points and cameras.

    Parameters
    ----------
    path : Path or str
        An existing file is replaced only when all is written.
    file : BundleFile
        Points without a colour are light grey.
    depth : float, optional
        Of the cameras' pyramids, in the world's unit; 0 leaves the cameras out.  By default a share of the
        distance to the points.
    ascii : bool
        Text with every digit, instead of little-endian binary.

    Raises
    ------
    ValueError
        On a depth that is negative or not finite.
    """
    if depth is None:
        depth = _typical_depth(file.problem)
    if not 0 <= depth < np.inf:
        raise ValueError(f"depth={depth}: must be 0 or more, and finite")
    vertices, edges = _points(file), np.zeros(0, EDGE)
    if depth > 0:
        cameras, edges = _cameras(file, depth, len(vertices))
        vertices = np.concatenate([vertices, cameras])
    write_bytes(Path(path), _header(ascii, vertices, edges) + _body(ascii, vertices) + _body(ascii, edges))


def _header(ascii: bool, vertices: NDArray[np.void], edges: NDArray[np.void]) -> bytes:
    lines = ["ply", f"format {'ascii' if ascii else 'binary_little_endian'} 1.0", "comment vslam_ref"]
    for name, rows in (("vertex", vertices), ("edge", edges)):
        if name == "vertex" or len(rows):
            lines.append(f"element {name} {len(rows)}")
            kinds = [(field, rows.dtype[field]) for field in rows.dtype.names or ()]
            lines += [f"property {NAMES[kind.str]} {field}" for field, kind in kinds]
    return "\n".join([*lines, "end_header", ""]).encode()


def _body(ascii: bool, rows: NDArray[np.void]) -> bytes:
    if not ascii:
        return rows.tobytes()
    return "".join(" ".join(map(repr, row)) + "\n" for row in rows.tolist()).encode()


def _vertices(X: Array, colours: NDArray[Any]) -> NDArray[np.void]:
    rows = np.zeros(len(X), VERTEX)
    for k, axis in enumerate("xyz"):
        rows[axis] = X[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        rows[name] = colours[:, k]
    return rows


def _points(file: BundleFile) -> NDArray[np.void]:
    X = file.problem.scene.X_world
    colours = np.tile(POINT_COLOUR, (len(X), 1)) if file.colours is None else file.colours
    return _vertices(X, colours)


def _cameras(file: BundleFile, depth: float, first: int) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """Five vertices and eight edges a camera; ``first`` is the number of its first vertex."""
    T_world_cam = se3.inverse(file.problem.scene.T_cam_world)
    corners = depth * _corners(file)[file.problem.lens_of_view]
    local = np.concatenate([np.zeros((len(corners), 1, 3)), corners], 1)
    world = np.einsum("vij,vkj->vki", T_world_cam[:, :3, :3], local) + T_world_cam[:, None, :3, 3]
    vertices = _vertices(world.reshape(-1, 3), np.tile(CAMERA_COLOUR, (5 * len(world), 1)))
    pairs: IntArray = (first + 5 * np.arange(len(world))[:, None, None] + PYRAMID).reshape(-1, 2)
    edges = np.zeros(len(pairs), EDGE)
    edges["vertex1"], edges["vertex2"] = pairs.T
    return vertices, edges


def _corners(file: BundleFile) -> Array:
    """Corners of the image on the plane z = 1, going round, shape (L, 4, 3); distortion is left out."""
    problem = file.problem
    sensor = sensors(problem.model, problem.scene.intrinsics)
    focal, centre = sensor[:, None, :2], sensor[:, None, 2:]
    if file.image_sizes is not None:
        low, high = np.full((len(focal), 2), -0.5), file.image_sizes - 0.5
    else:  # what was seen
        lens = problem.lens_of_view[problem.seen.view]
        low, high = np.full((len(focal), 2), np.inf), np.full((len(focal), 2), -np.inf)
        np.minimum.at(low, lens, problem.seen.uv)
        np.maximum.at(high, lens, problem.seen.uv)
        empty = ~np.isfinite(low)
        low[empty], high[empty] = (centre - focal / 2)[:, 0][empty], (centre + focal / 2)[:, 0][empty]
    uv = np.stack(
        [low, np.stack([high[:, 0], low[:, 1]], -1), high, np.stack([low[:, 0], high[:, 1]], -1)], 1
    )
    return np.concatenate([(uv - centre) / focal, np.ones((*uv.shape[:2], 1))], -1)


def _typical_depth(problem: BundleProblem) -> float:
    T_world_cam = se3.inverse(problem.scene.T_cam_world)
    if not len(problem.scene.X_world) or not len(T_world_cam):
        return 1.0
    middle = np.median(problem.scene.X_world, axis=0)
    distance = float(np.median(np.linalg.norm(T_world_cam[:, :3, 3] - middle, axis=1)))
    return DEPTH_SHARE * distance if distance > 0 else 1.0
