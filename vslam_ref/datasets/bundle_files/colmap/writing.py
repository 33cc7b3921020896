"""Writer of COLMAP's text model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.colmap.models import HALF, params_to_colmap
from vslam_ref.datasets.bundle_files.colmap.reading import FILES
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.geometry import quaternion
from vslam_ref.geometry.cameras import projection
from vslam_ref.support.files import new_folder

GREY = (128, 128, 128)


def write_colmap(folder: Path | str, file: BundleFile) -> None:
    """Write a text model, every number in full.

    Numbers of views and points are the file's own, and so are names and models where they still fit;
    otherwise views are called ``view000000`` and so on, and a set of intrinsics gets the smallest model
    that says it all.  The size of images that is not known is the smallest that holds all observations.
    Points without a colour are grey.  ERROR is the mean distance of a point from its observations, in
    pixels, or -1 without any.

    Parameters
    ----------
    folder : Path or str
        Made if it is not there.  One that is there may hold a text model, which is replaced, and nothing
        else.
    file : BundleFile

    Raises
    ------
    ValueError
        On what COLMAP cannot say (covariances, a name with blanks or a name that comes twice, negative
        numbers), or a folder with other files.
    """
    folder = Path(folder)
    _require_free(folder)
    content = dict(zip(FILES, (_cameras(file), _images(file), _points(file)), strict=True))
    folder.parent.mkdir(parents=True, exist_ok=True)
    with new_folder(folder) as beside:
        for name, text in content.items():
            (beside / name).write_text(text, encoding="utf-8")


def _require_free(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder} is a file: a COLMAP model is a folder")
    others = sorted({path.name for path in folder.iterdir()} - set(FILES)) if folder.is_dir() else []
    if others:
        what = f"{folder} holds {others[0]} and is not a text model alone"
        raise ValueError(f"{what}: name a new folder (COLMAP would mix old files with new)")


def _cameras(file: BundleFile) -> str:
    if file.problem.seen.cov_uv is not None:
        raise ValueError("observations with covariances: COLMAP has no place for them")
    lines = ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"]
    models = file.camera_models or ("",) * len(file.problem.scene.intrinsics)
    for k, params in enumerate(file.problem.scene.intrinsics):
        name, values = params_to_colmap(file.problem.model, params, models[k])
        width, height = _size(file, k)
        lines.append(f"{k + 1} {name} {width} {height} {' '.join(map(repr, values))}")
    return "\n".join(lines) + "\n"


def _size(file: BundleFile, lens: int) -> tuple[int, int]:
    """Width and height of the images of a set of intrinsics."""
    if file.image_sizes is not None:
        width, height = file.image_sizes[lens].tolist()
        return width, height
    seen = file.problem.seen
    uv = seen.uv[file.problem.lens_of_view[seen.view] == lens]
    width, height = np.maximum(np.ceil(uv.max(0, initial=0.0) + HALF), 1).astype(int).tolist()
    return width, height


def _images(file: BundleFile) -> str:
    problem = file.problem
    views = problem.sizes[0]
    names = file.view_names or tuple(f"view{k:06d}" for k in range(views))
    for name in names:
        if not name or name.split() != [name]:
            raise ValueError(f"image name {name!r}: COLMAP's names have no blanks")
    if len(set(names)) < len(names):
        raise ValueError("an image name comes twice: COLMAP needs different ones")
    if len(file.view_ids) and file.view_ids.min() < 0:
        raise ValueError(f"view number {file.view_ids.min()}: COLMAP's are 0 or more")
    T = problem.scene.T_cam_world
    poses = np.column_stack([quaternion.from_matrix(T[:, :3, :3]), T[:, :3, 3]]).tolist()
    order, start = _by_view(problem)
    uv, ids = (problem.seen.uv[order] + HALF).tolist(), file.point_ids[problem.seen.point[order]].tolist()
    lines = ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME", "# POINTS2D[] as (X, Y, POINT3D_ID)"]
    for k in range(views):
        pose = " ".join(map(repr, poses[k]))
        lines.append(f"{file.view_ids[k]} {pose} {problem.lens_of_view[k] + 1} {names[k]}")
        lines.append(" ".join(f"{uv[i][0]!r} {uv[i][1]!r} {ids[i]}" for i in range(start[k], start[k + 1])))
    return "\n".join(lines) + "\n"


def _points(file: BundleFile) -> str:
    problem = file.problem
    points = problem.sizes[1]
    if points and file.point_ids.min() < 0:
        raise ValueError(f"point number {file.point_ids.min()}: COLMAP's are 0 or more")
    order, start = _by_view(problem)
    feature = np.empty(len(order), dtype=np.int64)
    feature[order] = np.arange(len(order)) - start[problem.seen.view[order]]
    by_point = np.argsort(problem.seen.point, kind="stable")
    ends = np.searchsorted(problem.seen.point[by_point], np.arange(points + 1))
    pairs = np.stack([file.view_ids[problem.seen.view], feature], -1)[by_point].tolist()
    colours = (np.tile(GREY, (points, 1)) if file.colours is None else file.colours).tolist()
    rows = zip(problem.scene.X_world.tolist(), colours, mean_errors(problem).tolist(), strict=True)
    lines = ["# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)"]
    for k, (X, colour, error) in enumerate(rows):
        track = " ".join(f"{image} {at}" for image, at in pairs[ends[k] : ends[k + 1]])
        head = f"{file.point_ids[k]} {' '.join(map(repr, X))} {' '.join(map(str, colour))} {error!r}"
        lines.append(f"{head} {track}".rstrip())
    return "\n".join(lines) + "\n"


def _by_view(problem: BundleProblem) -> tuple[IntArray, IntArray]:
    """Order of the observations by view, and where each view begins in it, shape (V + 1,)."""
    order = np.argsort(problem.seen.view, kind="stable")
    start = np.searchsorted(problem.seen.view[order], np.arange(problem.sizes[0] + 1))
    return order, start


def mean_errors(problem: BundleProblem) -> Array:
    """Mean distance of each point's projections from where it was seen, pixels, shape (N,); -1 if nowhere."""
    seen, scene = problem.seen, problem.scene
    at = projection.pixel_from_world(
        scene.intrinsics[problem.lens_of_view[seen.view]],
        scene.T_cam_world[seen.view],
        scene.X_world[seen.point],
        lens=problem.model.lens,
    )
    distance = np.where(at.valid, np.hypot(*(at.uv - seen.uv).T), 0.0)
    points = problem.sizes[1]
    total = np.bincount(seen.point, distance, points)
    count = np.bincount(seen.point, at.valid, points)
    return np.where(count > 0, total / np.maximum(count, 1), -1.0)
