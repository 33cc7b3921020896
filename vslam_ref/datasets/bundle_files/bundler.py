"""Bundler's ``bundle.out``, version 0.3 (Snavely, Seitz and Szeliski, 2006): read.

Below the comment ``# Bundle file v0.3`` a row of numbers, line ends mean nothing::

    cameras points
    f k1 k2   R row by row (9)   t (3)           one camera each
    x y z   red green blue   n   n times: camera key u v      one point each

Cameras look along -z with y up, and the origin of the pixels is the image's centre; see
:mod:`~vslam_ref.datasets.bundle_files.opengl_cameras`.  The key is the number of the feature in its image; it
is passed over.

A camera with f = 0 is one that Bundler could not place.  It is left out, and so is what it saw;
``view_ids`` keeps the numbers of those that stay, and ``notes`` names the others.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.loading import (
    FARTHEST,
    counted,
    first_of_each,
    load,
    require_room,
    rotations,
    told_again,
)
from vslam_ref.datasets.bundle_files.opengl_cameras import DOWN, free, scene
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.numbers import Numbers, read_numbers
from vslam_ref.datasets.text import FormatError, read_lines
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations
from vslam_ref.geometry.cameras import Radtan

HEADER = b"# Bundle file v0.3"
PER_CAMERA, PER_POINT, PER_SIGHT = 15, 7, 4


def read_bundler(
    path: Path | str, list_file: Path | str | None = None, *, max_bytes: int | None = None
) -> BundleFile:
    """Read a reconstruction.

    Parameters
    ----------
    path : Path or str
    list_file : Path or str, optional
        Bundler's list of images, for the names: one image a line, its name the first word.
    max_bytes : int, optional
        Limit of the unpacked size; see :func:`.loading.load`.

    Returns
    -------
    BundleFile
        With the camera model ``Radtan``, p1, p2, k3 and the centre zero, and the points' colours.

    Raises
    ------
    FormatError
        Where a file is not as the module says.
    """
    path = Path(path)
    data = load(path, max_bytes)
    end = data.find(b"\n") if b"\n" in data else len(data)
    line = data[:end]
    if line.strip() != HEADER:
        shown = line[:40].decode("ascii", "backslashreplace")
        raise FormatError(path, 1, f"{shown!r}; expected {HEADER.decode()!r}")
    numbers = read_numbers(path, data[end:])
    cameras, points = _counts(numbers, data)
    start = 2 + PER_CAMERA * cameras
    counted_at, lengths = _lists(numbers, start, points)
    numbers.require_below(FARTHEST)
    at = counted_at[:, None] - 6 + np.arange(6)
    numbers.whole(at[:, 3:], "colour", 256)
    colours = numbers.values[at[:, 3:]].astype(np.uint8)
    table = 2 + np.arange(PER_CAMERA * cameras).reshape(cameras, PER_CAMERA)
    numbers.require(numbers.values[table[:, 0]] >= 0, table[:, 0], "focal length", "0 (not placed) or more")
    kept = np.flatnonzero(numbers.values[table[:, 0]] > 0)
    if not len(kept):
        raise numbers.error(2, f"none of the {cameras} cameras has a focal length; expected at least one")
    rows = numbers.values[table[kept]]
    R = rotations(
        path, rows[:, 3:12].reshape(-1, 3, 3), lambda k: numbers.line(int(table[kept[k], 3])), "camera"
    )
    begin = scene(R, rows[:, 12:], rows[:, :3], numbers.values[at[:, :3]])
    seen, lost, again = _observations(numbers, counted_at, lengths, kept, cameras)
    names = () if list_file is None else _names(Path(list_file), cameras)
    return BundleFile(
        BundleProblem(Radtan, begin, seen, free=free(begin)),
        "bundler",
        view_names=tuple(names[k] for k in kept) if names else (),
        view_ids=kept,
        colours=colours,
        notes=(*_notes(cameras, kept, lost), *again),
    )


def _counts(numbers: Numbers, data: bytes) -> tuple[int, int]:
    """Cameras and points, few enough for the file."""
    if len(numbers.values) < 2:
        raise numbers.error(0, "no counts; expected the numbers of cameras and points")
    cameras, points = (int(n) for n in numbers.whole([0, 1], "a count", 2**53, right="a whole number"))
    if cameras == 0:
        raise numbers.error(0, "0 cameras; expected at least one")
    needed = 2 * (2 + PER_CAMERA * cameras + PER_POINT * points) - 1
    require_room(numbers.path, numbers.line(0), f"{cameras} cameras and {points} points", needed, len(data))
    if len(numbers.values) < 2 + PER_CAMERA * cameras:
        what = f"the file ends after {len(numbers.values)} numbers; expected {cameras} cameras of 15"
        raise numbers.error(len(numbers.values), what)
    return cameras, points


def _lists(numbers: Numbers, start: int, points: int) -> tuple[IntArray, IntArray]:
    """Where the length of each point's list of sights stands, and that length, shapes (N,)."""
    at, total = start, len(numbers.values)
    places, lengths = np.zeros(points, np.int64), np.zeros(points, np.int64)
    for k in range(points):
        end = at + PER_POINT
        if end <= total:
            length = numbers.values[end - 1]
            if not (length >= 0 and length == np.floor(length)):
                right = "expected a whole number, 0 or more"
                raise numbers.error(end - 1, f"point {k} is seen {length:g} times; {right}")
            end += PER_SIGHT * int(length)
        if end > total:
            what = f"the file ends inside point {k} of {points}; expected 7 numbers and its list of sights"
            raise numbers.error(total, what)
        places[k], lengths[k] = at + 6, int(length)
        at = end
    if at < total:
        raise numbers.error(at, f"numbers go on after the last of {points} points; expected the end")
    return places, lengths


def _observations(
    numbers: Numbers, counted_at: IntArray, lengths: IntArray, kept: IntArray, cameras: int
) -> tuple[Observations, int, tuple[str, ...]]:
    """Sights of the cameras that are kept, how many were of others, and what is told of repeated ones."""
    point = np.repeat(np.arange(len(lengths)), lengths)
    before = np.cumsum(lengths) - lengths
    at = counted_at[point] + 1 + PER_SIGHT * (np.arange(len(point)) - before[point])
    camera = numbers.whole(at, "camera of a sight", cameras)
    numbers.whole(at + 1, "key of a sight", 2**53, right="a whole number, 0 or more")
    first = first_of_each(camera, point)
    place = np.full(cameras, -1, dtype=np.int64)
    place[kept] = np.arange(len(kept))
    placed: NDArray[np.bool_] = place[camera] >= 0
    stays, placed_again = placed & first, placed & ~first
    at, camera, point = at[stays], camera[stays], point[stays]
    uv: Array = np.stack([numbers.values[at + 2], numbers.values[at + 3]], -1)
    seen = Observations(place[camera], point, uv * DOWN)
    return seen, int((~placed).sum()), told_again(placed_again)


def _names(path: Path, cameras: int) -> list[str]:
    """First word of each line."""
    lines = list(read_lines(path))
    if len(lines) != cameras:
        what = f"{len(lines)} images; expected {cameras}, one for each camera"
        raise FormatError(path, lines[-1][0] if lines else None, what)
    return [re.split(r"\s", text, maxsplit=1)[0] for _, text in lines]


def _notes(cameras: int, kept: IntArray, lost: int) -> tuple[str, ...]:
    gone = np.setdiff1d(np.arange(cameras), kept)
    if not len(gone):
        return ()
    shown = ", ".join(map(str, gone[:10].tolist())) + (", …" if len(gone) > 10 else "")
    return (f"{counted(len(gone), 'camera')} without a focal length left out, with {lost} sights: {shown}",)
