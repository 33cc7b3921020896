"""Writer of COLMAP's models: what is written, as rows; the two forms are made of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.colmap import binary, text
from vslam_ref.datasets.bundle_files.colmap.binary_writing import packed
from vslam_ref.datasets.bundle_files.colmap.models import HALF, params_to_colmap
from vslam_ref.datasets.bundle_files.colmap.rows import CameraRow, ImageRow, PointRow
from vslam_ref.datasets.bundle_files.colmap.text_writing import printed, require_printable
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.estimation.bundle.families import model_of_set, parts_of
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.geometry import quaternion
from vslam_ref.geometry.cameras import projection
from vslam_ref.support.files import new_folder, write_together

GREY = (128, 128, 128)
LARGEST_NUMBER = 2**32 - 2
"""IMAGE_ID has 32 bits, and COLMAP keeps the largest for none."""


def write_colmap(folder: Path | str, file: BundleFile, *, binary: bool = False) -> None:
    """Write a model, every number in full.

    Numbers of views and points are the file's own, and so are names and models where they still fit;
    otherwise views are called ``view000000`` and so on, and a set of intrinsics gets the smallest model
    that says it all.  The size of images that is not known is the smallest that holds all observations.
    Points without a colour are grey.  ERROR is the mean distance of a point from its observations, in
    pixels, or -1 without any.

    Parameters
    ----------
    folder : Path or str
        Made if it is not there.  One that is there may be empty, or hold a model of the same form, which is
        replaced, and nothing else.
    file : BundleFile
    binary : bool
        ``.bin`` files instead of ``.txt``.

    Raises
    ------
    ValueError
        On what COLMAP cannot say (covariances, a name that comes twice, numbers that do not fit), or a
        folder with other files.
    """
    folder = Path(folder)
    require_colmap(folder, file, binary=binary)
    make = packed if binary else printed
    content = make(list(_cameras(file)), list(_images(file)), list(_points(file)))
    if folder.is_dir():
        write_together(folder, content)
        return
    folder.parent.mkdir(parents=True, exist_ok=True)
    with new_folder(folder) as beside:
        for name, data in content.items():
            (beside / name).write_bytes(data)


def require_colmap(folder: Path, file: BundleFile, *, binary: bool = False) -> None:
    """Refuse what COLMAP cannot say, and a folder that is not free, before any work.

    Raises
    ------
    ValueError
        As :func:`write_colmap`.
    """
    require_free(folder, binary=binary)
    if file.problem.seen.cov_uv is not None:
        raise ValueError("observations with covariances: COLMAP has no place for them")
    names = view_names(file)
    if not binary:
        require_printable(names)
    if any("\0" in name for name in names):
        raise ValueError("an image name has a zero byte: COLMAP ends names with one")
    if len(set(names)) < len(names):
        again = next(name for k, name in enumerate(names) if name in names[:k])
        raise ValueError(f"an image name comes twice: {again[:60]!r}; COLMAP needs different ones")
    for what, ids, most in (("view", file.view_ids, LARGEST_NUMBER), ("point", file.point_ids, 2**63 - 1)):
        if len(ids) and not (ids.min() >= 0 and ids.max() <= most):
            wrong = ids.min() if ids.min() < 0 else ids.max()
            raise ValueError(f"{what} number {wrong}: COLMAP's are from 0 to {most}")


def require_free(folder: Path, *, binary: bool = False) -> None:
    """Refuse a folder that holds anything but a model of the form that is to be written.

    Raises
    ------
    ValueError
        With the name of what is there.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder} is a file: a COLMAP model is a folder")
    mine = _names(binary)
    others = sorted({path.name for path in folder.iterdir()} - set(mine)) if folder.is_dir() else []
    if others:
        kind = "binary" if binary else "text"
        what = f"{folder} holds {others[0]} and is not empty, nor a {kind} model alone"
        raise ValueError(f"{what}: name a new folder (COLMAP would mix old files with new)")


def _names(is_binary: bool) -> tuple[str, ...]:
    return binary.FILES if is_binary else text.FILES


def view_names(file: BundleFile) -> tuple[str, ...]:
    """Names of the images, made up where the file has none."""
    return file.view_names or tuple(f"view{k:06d}" for k in range(file.problem.sizes[0]))


def _cameras(file: BundleFile) -> Iterator[CameraRow]:
    problem = file.problem
    sets = problem.scene.intrinsics
    preferred = file.camera_models or ("",) * len(sets)
    for k in range(len(sets)):
        model, own = model_of_set(problem.model, k)
        name, values = params_to_colmap(model, sets[k, own], preferred[k])
        yield CameraRow(k + 1, name, _size(file, k), values)


def _size(file: BundleFile, lens: int) -> tuple[int, int]:
    """Width and height of the images of a set of intrinsics."""
    if file.image_sizes is not None:
        width, height = file.image_sizes[lens].tolist()
        return width, height
    seen = file.problem.seen
    uv = seen.uv[file.problem.lens_of_view[seen.view] == lens]
    width, height = np.maximum(np.ceil(uv.max(0, initial=0.0) + HALF), 1).astype(int).tolist()
    return width, height


class _ByView(NamedTuple):
    """Order of the observations by view, and where each view begins in it, shape (V + 1,)."""

    order: IntArray
    start: IntArray

    @classmethod
    def of(cls, problem: BundleProblem) -> _ByView:
        order = np.argsort(problem.seen.view, kind="stable")
        return cls(order, np.searchsorted(problem.seen.view[order], np.arange(problem.sizes[0] + 1)))


def _images(file: BundleFile) -> Iterator[ImageRow]:
    problem = file.problem
    T = problem.scene.T_cam_world
    poses = np.column_stack([quaternion.from_matrix(T[:, :3, :3]), T[:, :3, 3]]).tolist()
    order, start = _ByView.of(problem)
    uv, ids = problem.seen.uv[order] + HALF, file.point_ids[problem.seen.point[order]]
    for k, name in enumerate(view_names(file)):
        mine = slice(start[k], start[k + 1])
        yield ImageRow(
            int(file.view_ids[k]), poses[k], int(problem.lens_of_view[k]) + 1, name, uv[mine], ids[mine]
        )


def _points(file: BundleFile) -> Iterator[PointRow]:
    problem = file.problem
    points = problem.sizes[1]
    order, start = _ByView.of(problem)
    feature = np.empty(len(order), dtype=np.int64)
    feature[order] = np.arange(len(order)) - start[problem.seen.view[order]]
    by_point = np.argsort(problem.seen.point, kind="stable")
    ends = np.searchsorted(problem.seen.point[by_point], np.arange(points + 1))
    pairs = np.stack([file.view_ids[problem.seen.view], feature], -1)[by_point]
    colours = (np.tile(GREY, (points, 1)) if file.colours is None else file.colours).tolist()
    rows = zip(problem.scene.X_world.tolist(), colours, mean_errors(problem).tolist(), strict=True)
    for k, (X, colour, error) in enumerate(rows):
        yield PointRow(int(file.point_ids[k]), X, colour, error, pairs[ends[k] : ends[k + 1]])


def mean_errors(problem: BundleProblem) -> Array:
    """Mean distance of each point's projections from where it was seen, pixels, shape (N,); -1 if nowhere."""
    seen, scene = problem.seen, problem.scene
    lens, distance, valid = problem.lens_of_view[seen.view], np.zeros(len(seen)), np.zeros(len(seen))
    for part in parts_of(problem.model, lens):
        rows, own = part.rows, scene.intrinsics[:, part.columns]
        at = projection.pixel_from_world(
            own[lens[rows]],
            scene.T_cam_world[seen.view[rows]],
            scene.X_world[seen.point[rows]],
            lens=part.model.lens,
        )
        distance[rows] = np.where(at.valid, np.hypot(*(at.uv - seen.uv[rows]).T), 0.0)
        valid[rows] = at.valid
    points = problem.sizes[1]
    total, count = np.bincount(seen.point, distance, points), np.bincount(seen.point, valid, points)
    return np.where(count > 0, total / np.maximum(count, 1), -1.0)
