"""BAL, "bundle adjustment in the large" (Agarwal, Snavely, Seitz and Szeliski, 2010): read and written.

A text of numbers, plain, ``.gz`` or ``.bz2``; line ends mean nothing::

    cameras points observations
    camera point u v                    one observation each, numbers from 0
    r1 r2 r3 t1 t2 t3 f k1 k2           one camera each: rotation vector, translation, lens
    x y z                               one point each

The camera looks along -z with y up, and the origin of the pixels is the principal point; see
:mod:`~vslam_ref.datasets.bundle_files.opengl_cameras`.  Each camera has a set of intrinsics of its own, of
which f, k1 and k2 may move.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.bundle_files.loading import (
    FARTHEST,
    first_of_each,
    load,
    require_room,
    told_again,
)
from vslam_ref.datasets.bundle_files.opengl_cameras import DOWN, FLIP, free, scene
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.numbers import Numbers, read_numbers
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.bundle.families import Families
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations
from vslam_ref.geometry import so3
from vslam_ref.geometry.cameras import Pinhole, Radtan
from vslam_ref.support.files import write_bytes

COUNTS = ("cameras", "points", "observations")
CAMERA = ("r1", "r2", "r3", "t1", "t2", "t3", "f", "k1", "k2")
UNSAID = ("cx", "cy", "p1", "p2", "k3")
"""Intrinsics that the format has no place for."""
LARGEST_ANGLE = 1e6
"""Radians.  Of a longer rotation vector, sine and cosine would lose more than six digits."""


def read_bal(path: Path | str, *, max_bytes: int | None = None) -> BundleFile:
    """Read a BAL problem.

    Parameters
    ----------
    path : Path or str
    max_bytes : int, optional
        Limit of the unpacked size; see :func:`.loading.load`.

    Returns
    -------
    BundleFile
        With the camera model ``Radtan``, p1, p2, k3 and the centre zero.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    path = Path(path)
    data = load(path, max_bytes)
    views, points, seen = _counts(path, data)
    numbers = read_numbers(path, data)
    counts = f"3 counts, {seen} observations of 4, {views} cameras of 9, {points} points of 3"
    numbers.require_count(3 + 4 * seen + 9 * views + 3 * points, counts)
    at = 3 + 4 * np.arange(seen)
    view = numbers.whole(at, "camera of an observation", views)
    point = numbers.whole(at + 1, "point of an observation", points)
    first = first_of_each(view, point)
    numbers.require_below(FARTHEST)
    uv = np.stack([numbers.values[at + 2], numbers.values[at + 3]], -1)
    cameras = _cameras(numbers, 3 + 4 * seen, views)
    X_world = numbers.values[3 + 4 * seen + 9 * views :].reshape(points, 3)
    start = scene(so3.exp(cameras[:, :3]), cameras[:, 3:6], cameras[:, 6:], X_world)
    sights = Observations(view, point, uv * DOWN).only(first)
    return BundleFile(BundleProblem(Radtan, start, sights, free=free(start)), "bal", notes=told_again(~first))


def _counts(path: Path, data: bytes) -> tuple[int, int, int]:
    """Read the first three numbers, small enough for the file."""
    found = re.match(rb"\s*(\d{1,18})\s+(\d{1,18})\s+(\d{1,18})(?=\s|$)", data)
    if not found:
        line = data[: len(data) - len(data.lstrip())].count(b"\n") + 1
        shown = data.split(None, 3)[:3]
        words = " ".join(word[:20].decode("ascii", "backslashreplace") for word in shown)
        raise FormatError(path, line, f"{words!r}; expected three counts: {', '.join(COUNTS)}")
    line = data.count(b"\n", 0, found.start(1)) + 1
    views, points, seen = (int(word) for word in found.groups())
    if views == 0:
        raise FormatError(path, line, "0 cameras; expected at least one")
    if seen > views * points:
        what = f"{seen} observations of {points} points by {views} cameras; expected at most one each"
        raise FormatError(path, line, what)
    counts = f"{views} cameras, {points} points, {seen} observations"
    # a number and the blank after it are two bytes at least
    require_room(path, line, counts, 2 * (3 + 9 * views + 3 * points + 4 * seen) - 1, len(data))
    return views, points, seen


def _cameras(numbers: Numbers, start: int, views: int) -> Array:
    """Cameras (V, 9), with angles that mean something and a focal length."""
    at = start + np.arange(9 * views).reshape(views, 9)
    cameras = numbers.values[at]
    numbers.require(np.abs(cameras[:, :3]) < LARGEST_ANGLE, at[:, :3], "rotation vector", "radians below 1e6")
    numbers.require(cameras[:, 6] > 0, at[:, 6], "focal length", "more than 0 pixels")
    return np.asarray(cameras)


def write_bal(path: Path | str, file: BundleFile) -> None:
    """Write a BAL problem, every number in full; packed if the name ends in ``.gz`` or ``.bz2``.

    Read again, it has the same observations, points, translations and lenses to the last bit (but the sign of
    a zero), and rotations within a few eps.  Intrinsics that views share are repeated for each.  What may
    move is not written: the format has no place for it.

    Parameters
    ----------
    path : Path or str
        Where to write; an existing file is replaced only when all is written.
    file : BundleFile
        Its model is ``Radtan`` or ``Pinhole``.

    Raises
    ------
    ValueError
        On what BAL cannot say: another model, fx other than fy, a centre other than (0, 0), p1, p2 or k3,
        covariances.
    """
    problem = file.problem
    lenses = _lenses(problem)
    T = problem.scene.T_cam_world
    cameras = np.column_stack([so3.log(FLIP @ T[:, :3, :3]), T[:, :3, 3] @ FLIP, lenses])
    views, points, seen = problem.sizes
    lines = [f"{views} {points} {seen}"]
    seen_by, point, (u, v) = problem.seen.view, problem.seen.point, (problem.seen.uv * DOWN).T
    rows = zip(seen_by.tolist(), point.tolist(), u.tolist(), v.tolist(), strict=True)
    lines += [f"{i} {j} {u!r} {v!r}" for i, j, u, v in rows]
    lines += map(repr, cameras.ravel().tolist())
    lines += map(repr, problem.scene.X_world.ravel().tolist())
    write_bytes(Path(path), ("\n".join(lines) + "\n").encode())


def require_bal(problem: BundleProblem) -> None:
    """Refuse what BAL cannot say, before any work: the lenses as they are, and what of them may move.

    Raises
    ------
    ValueError
        As :func:`write_bal`.
    """
    _lenses(problem)
    names = problem.model.names() if not isinstance(problem.model, Families) else ()
    moves = dict(zip(names, problem.free.intrinsics, strict=True))
    for name in (name for name in UNSAID if name in moves and moves[name].any()):
        raise ValueError(f"{name} may move: BAL cannot say it, it must stay 0")
    if (moves["fx"] != moves["fy"]).any():
        raise ValueError("fx and fy may move apart: BAL has one focal length, f")


def _lenses(problem: BundleProblem) -> Array:
    """f, k1, k2 of each view, shape (V, 3)."""
    model = problem.model
    if isinstance(model, Families) or model not in (Pinhole, Radtan):
        called = model.__name__ if not isinstance(model, Families) else "of several lens families"
        raise ValueError(f"model {called}: BAL has f, k1, k2 only (Radtan or Pinhole)")
    if problem.seen.cov_uv is not None:
        raise ValueError("observations with covariances: BAL has no place for them")
    columns = problem.scene.intrinsics[problem.lens_of_view].T
    params = dict(zip(model.names(), columns, strict=True))
    params["fy - fx"] = params.pop("fy") - params["fx"]
    for name in ("fy - fx", *UNSAID):
        bad = np.flatnonzero(params.get(name, np.zeros(0)))
        if len(bad):
            raise ValueError(
                f"{name} of view {bad[0]} is {params[name][bad[0]]:g}: BAL cannot say it, it must be 0"
            )
    zero = np.zeros(len(problem.lens_of_view))
    return np.stack([params["fx"], params.get("k1", zero), params.get("k2", zero)], -1)
