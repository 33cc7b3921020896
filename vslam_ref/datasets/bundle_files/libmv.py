"""libmv's dump of a bundle adjustment, as Blender's tracker makes it: binary, 4 bytes a number.

::

    'v' or 'V'          little or big endian
    'P' or 'N'          markers in pixels, or normalised
    8 floats            f cx cy k1 k2 k3 p1 p2, one camera for all images
    int, then cameras   image number (int), R column by column (9 floats), t (3 floats)
    int, then points    track number (int), X (3 floats)
    int, then markers   image number, track number (ints), x y (floats)

X_cam = R X + t with z ahead, so no axis is turned.  libmv distorts a normalised position (x, y) with q =
x^2 + y^2 to

    x (1 + k1 q + k2 q^2 + k3 q^3) + 2 p1 x y + p2 (q + 2 x^2)
    y (1 + k1 q + k2 q^2 + k3 q^3) + 2 p2 x y + p1 (q + 2 y^2)

Our ``Radtan`` is G xn + q p + 2 (p . xn) xn with p = (p2, p1).  Its first row is G x + q p2 + 2 (p2 x + p1
y) x = G x + p2 (q + 2 x^2) + 2 p1 x y, and its second likewise: p1 and p2 are the same, no swap and no sign.

Image and track numbers are arbitrary; here views and points are counted from 0 in the file's order, and
``view_ids`` and ``point_ids`` keep the numbers.  Markers of an image or a track that is not in the file are
left out, as libmv's own adjuster does, and counted in ``notes``.  The pixel's origin is that of the centre
(cx, cy) in the same file; it is left as it is.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.loading import (
    FARTHEST,
    first_of_each,
    load,
    require_room,
    rotations,
    told_again,
)
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations, Scene
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Radtan

ORDERS = {b"v": "<", b"V": ">"}
SPACES = {b"P": "pixels", b"N": "normalised"}
INTRINSICS = ("f", "cx", "cy", "k1", "k2", "k3", "p1", "p2")
UNIT = [1.0] + 7 * [0.0]
PARTS: dict[str, tuple[tuple[str, str, tuple[int, ...]], ...]] = {
    "camera": (("id", "i4", ()), ("R", "f4", (3, 3)), ("t", "f4", (3,))),
    "point": (("id", "i4", ()), ("X", "f4", (3,))),
    "marker": (("view", "i4", ()), ("point", "i4", ()), ("uv", "f4", (2,))),
}


def read_libmv(path: Path | str, *, max_bytes: int | None = None) -> BundleFile:
    """Read a libmv problem; its intrinsics are fixed by default.

    Parameters
    ----------
    path : Path or str
    max_bytes : int, optional
        Limit of the size; see :func:`.loading.load`.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    path = Path(path)
    data = load(path, max_bytes)
    order, space = ORDERS.get(data[:1]), SPACES.get(data[1:2])
    if order is None or space is None:
        raise FormatError(path, None, f"begins with {data[:2]!r}; expected 'v' or 'V', then 'P' or 'N'")
    params, notes = _intrinsics(path, data, order, space)
    at = 2 + 4 * len(INTRINSICS)
    cameras, at = _part(path, data, at, order, "camera")
    if not len(cameras):
        raise FormatError(path, None, "0 cameras; expected at least one")
    points, at = _part(path, data, at, order, "point")
    markers, at = _part(path, data, at, order, "marker")
    if at != len(data):
        what = f"{len(data) - at} bytes after the last marker; expected the end of the file at byte {at}"
        raise FormatError(path, None, what)
    seen, dropped, again = _observations(path, cameras["id"], points["id"], markers)
    if dropped:
        notes.append(f"{dropped} markers of images or tracks that are not in the file were left out")
    R = rotations(path, np.swapaxes(cameras["R"], 1, 2).astype(np.float64), lambda _: None, "camera")
    scene = Scene(se3.from_rt(R, cameras["t"].astype(np.float64)), points["X"], params[None])
    return BundleFile(
        BundleProblem(Radtan, scene, seen),
        "libmv",
        view_ids=cameras["id"].astype(np.int64),
        point_ids=points["id"].astype(np.int64),
        notes=(*notes, *again),
    )


def _intrinsics(path: Path, data: bytes, order: str, space: str) -> tuple[Array, list[str]]:
    """Parameters (9,) in our order, and what there is to say about them."""
    require_room(path, None, "the intrinsics", 2 + 4 * len(INTRINSICS), len(data))
    stored = np.frombuffer(data, f"{order}f4", len(INTRINSICS), 2)
    _require_numbers(path, stored, "intrinsics")
    given = stored.astype(np.float64)
    notes = []
    if space == "normalised" and given.tolist() != UNIT:
        notes = [
            "markers are normalised: f = 1 and all other intrinsics 0, whatever the file says of its images"
        ]
        given = np.array(UNIT)
    if not given[0] > 0:
        raise FormatError(path, None, f"focal length is {given[0]:g}; expected more than 0 pixels")
    named = dict(zip(INTRINSICS, given.tolist(), strict=True))
    named["fx"] = named["fy"] = named["f"]
    return np.array([named[name] for name in Radtan.names()]), notes


def _part(path: Path, data: bytes, at: int, order: str, name: str) -> tuple[NDArray[Any], int]:
    """Read a counted list at byte ``at``, and the byte behind it."""
    require_room(path, None, f"the number of {name}s", at + 4, len(data))
    count = int(np.frombuffer(data, f"{order}i4", 1, at)[0])
    if count < 0:
        raise FormatError(path, None, f"{count} {name}s (byte {at}); expected 0 or more")
    kind = np.dtype([(field, order + code, shape) for field, code, shape in PARTS[name]])
    end = at + 4 + count * kind.itemsize
    require_room(path, None, f"{count} {name}s (byte {at})", end, len(data))
    rows = np.frombuffer(data, kind, count, at + 4)
    for field, code, shape in PARTS[name]:
        if code == "f4":
            _require_numbers(path, rows[field].reshape(count, math.prod(shape)), f"{field} of {name}")
        elif field == "id":
            _require_distinct(path, rows[field], name)
    return rows, end


def _require_numbers(path: Path, values: NDArray[Any], name: str) -> None:
    with np.errstate(invalid="ignore"):  # a signalling NaN
        bad = np.argwhere(~(np.abs(values) < FARTHEST))
    if len(bad):
        place = f"{name} {bad[0][0]}" if values.ndim > 1 else name
        shown = values[tuple(bad[0])].item()
        raise FormatError(path, None, f"{place} has the number {shown:g}; expected finite ones below 1e15")


def _require_distinct(path: Path, ids: NDArray[Any], name: str) -> None:
    _, first = np.unique(ids, return_index=True)
    if len(first) < len(ids):
        k = int(np.setdiff1d(np.arange(len(ids)), first)[0])
        what = {"camera": "image", "point": "track"}[name]
        raise FormatError(path, None, f"{name} {k} has {what} number {ids[k]} again; expected it once")


def _observations(
    path: Path, images: NDArray[Any], tracks: NDArray[Any], markers: NDArray[Any]
) -> tuple[Observations, int, tuple[str, ...]]:
    """Markers with views and points from 0, how many belong to none, and what is told of repeated ones."""
    view, point = _places(images, markers["view"]), _places(tracks, markers["point"])
    keep = np.flatnonzero((view >= 0) & (point >= 0))
    view, point = view[keep], point[keep]
    first = first_of_each(view, point)
    seen = Observations(view[first], point[first], markers["uv"][keep[first]])
    return seen, len(markers) - len(keep), told_again(~first, "an image")


def _places(ids: NDArray[Any], wanted: NDArray[Any]) -> IntArray:
    """Places of numbers among ``ids``, -1 for one that is not there."""
    place = {number: k for k, number in enumerate(ids.tolist())}
    return np.array([place.get(number, -1) for number in wanted.tolist()], dtype=np.int64)
