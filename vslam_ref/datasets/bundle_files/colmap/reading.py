"""Reader of COLMAP's models, binary or text: the parts of the three files, made a problem."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.datasets.bundle_files.colmap.binary import FILES as BINARY_FILES
from vslam_ref.datasets.bundle_files.colmap.binary import read_binary_parts
from vslam_ref.datasets.bundle_files.colmap.lenses import Lenses, read_lenses
from vslam_ref.datasets.bundle_files.colmap.models import HALF, MODELS
from vslam_ref.datasets.bundle_files.colmap.parts import NO_POINT, Parts
from vslam_ref.datasets.bundle_files.colmap.rigs import chosen_poses, read_poses
from vslam_ref.datasets.bundle_files.colmap.text import FILES as TEXT_FILES
from vslam_ref.datasets.bundle_files.colmap.text import read_text_parts
from vslam_ref.datasets.bundle_files.loading import UNIT_TOLERANCE, counted, first_of_each, told_again
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations, Scene
from vslam_ref.geometry import quaternion, se3


def read_colmap(folder: Path | str, *, max_bytes: int | None = None) -> BundleFile:
    """Read a model; its intrinsics are fixed by default.

    Parameters
    ----------
    folder : Path or str
        With ``cameras``, ``images`` and ``points3D``, all with ``.bin`` or all with ``.txt``.  Where it has
        both forms, the binary one is read, as COLMAP does.  ``rigs`` and ``frames`` of the same form are read
        for their poses.
    max_bytes : int, optional
        Limit of each file's size; see :func:`.loading.load`.

    Raises
    ------
    FormatError
        Where a file is not as the package says, or the files disagree.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise FormatError(
            folder, None, f"no such folder; expected one with {', '.join(TEXT_FILES)} (or .bin)"
        )
    parts, notes = _parts(folder, max_bytes)
    if not parts.images:
        raise FormatError(parts.path("images"), None, "no image; expected at least one")
    _require_tracks(parts)
    lenses = read_lenses(parts)
    seen, told = _observations(parts)
    by_frame, rig_notes = read_poses(parts)
    T_cam_world, stale = chosen_poses(parts, _own_poses(parts), by_frame)
    images, points = list(parts.images.values()), parts.points
    problem = BundleProblem(
        lenses.model, Scene(T_cam_world, points.X, lenses.intrinsics), seen, lenses.of_image
    )
    return BundleFile(
        problem,
        "colmap",
        view_names=tuple(image.name for image in images),
        view_ids=np.array(list(parts.images), dtype=np.int64),
        point_ids=points.ids,
        colours=points.colours,
        image_sizes=lenses.sizes,
        camera_models=lenses.names,
        notes=(*notes, *told, *_unused(parts, lenses), *rig_notes, *stale),
    )


def _parts(folder: Path, max_bytes: int | None) -> tuple[Parts, tuple[str, ...]]:
    """The files of the form that is there, and what is told."""
    has_binary, has_text = (
        [(folder / name).exists() for name in files] for files in (BINARY_FILES, TEXT_FILES)
    )
    if all(has_binary):
        both = "the folder has the model twice: the binary files are read, as COLMAP does, not the text"
        return read_binary_parts(folder, max_bytes), (both,) if all(has_text) else ()
    if sum(has_binary) > sum(has_text):
        return read_binary_parts(folder, max_bytes), ()
    return read_text_parts(folder, max_bytes), ()


def _unused(parts: Parts, lenses: Lenses) -> tuple[str, ...]:
    """What is told of the cameras that no image has."""
    unused = [camera for key, camera in parts.cameras.items() if key not in lenses.keys]
    if not unused:
        return ()
    foreign = sorted({camera.model for camera in unused if camera.model not in MODELS})
    models = f" (of {', '.join(foreign)}, not known here)" if foreign else ""
    return (f"{counted(len(unused), 'camera')} without an image left out{models}",)


def _own_poses(parts: Parts) -> Array:
    """Poses (V, 4, 4) as the images' file has them."""
    values = np.array([image.pose for image in parts.images.values()])
    with np.errstate(over="ignore"):
        length = np.linalg.norm(values[:, :4], axis=1)
    bad = np.flatnonzero(~(np.abs(length - 1.0) <= UNIT_TOLERANCE))
    if len(bad):
        place = list(parts.images.values())[bad[0]].place
        what = f"quaternion of length {length[bad[0]]:.6g}; expected 1 within {UNIT_TOLERANCE:g}"
        raise place.error(parts.path("images"), what)
    R = quaternion.matrix(quaternion.normalise(values[:, :4]))
    return np.asarray(se3.from_rt(R, values[:, 4:]))


def _places(known: IntArray, wanted: IntArray) -> tuple[IntArray, BoolArray]:
    """Where each wanted number stands among known ones, and whether it does."""
    if not len(known):
        return np.zeros(len(wanted), dtype=np.int64), np.zeros(len(wanted), dtype=np.bool_)
    order = np.argsort(known, kind="stable")
    at = order[np.minimum(np.searchsorted(known[order], wanted), len(known) - 1)]
    return at, np.asarray(known[at] == wanted)


def _require_tracks(parts: Parts) -> None:
    """Every track must name features that name this point: the two files say the same twice."""
    points, path = parts.points, parts.path("points3D")
    images = list(parts.images.values())
    image, known = _places(np.array(list(parts.images), dtype=np.int64), points.track[:, 0])
    if not known.all():
        k = int(np.argmin(known))
        what = f"TRACK names image {points.track[k, 0]}; expected one of {parts.path('images').name}"
        raise points.place(int(points.track_point[k])).error(path, what)
    lengths = np.array([len(one.point) for one in images], dtype=np.int64)
    named = np.concatenate([one.point for one in images])
    feature = points.track[:, 1]
    inside = feature < lengths[image]
    start = np.concatenate([[0], np.cumsum(lengths)])[image]
    there = np.full(len(feature), NO_POINT - 1)
    there[inside] = named[(start + feature)[inside]]
    wrong = np.flatnonzero(there != points.ids[points.track_point])
    if len(wrong):
        k = int(wrong[0])
        point = there[k] if inside[k] else "none"
        what = f"TRACK names feature {feature[k]} of image {points.track[k, 0]}, which has point {point}"
        at = int(points.track_point[k])
        raise points.place(at).error(path, f"{what}; expected {points.ids[at]}")
    _require_lengths(parts, named)


def _require_lengths(parts: Parts, named: IntArray) -> None:
    """Every point's track must be as long as the number of features that name it."""
    points = parts.points
    at, known = _places(points.ids, named)
    by_images = np.bincount(at[known], minlength=len(points.ids))
    by_track = np.bincount(points.track_point, minlength=len(points.ids))
    bad = np.flatnonzero(by_images != by_track)
    if len(bad):
        k = int(bad[0])
        has = f"TRACK of point {points.ids[k]} has {by_track[k]} features"
        what = f"{has}, {parts.path('images').name} {by_images[k]}; expected the same"
        raise points.place(k).error(parts.path("points3D"), what)


def _observations(parts: Parts) -> tuple[Observations, tuple[str, ...]]:
    """Features with a point, the first of each image and point, and what is told of the others."""
    images = list(parts.images.values())
    lengths = [len(image.point) for image in images]
    named = np.concatenate([image.point for image in images])
    view = np.repeat(np.arange(len(images)), lengths)
    point, known = _places(parts.points.ids, named)
    bad = np.flatnonzero(~known & (named != NO_POINT))
    if len(bad):
        image = images[view[bad[0]]]
        k = int(bad[0] - np.sum(lengths[: view[bad[0]]], dtype=np.int64))
        right = f"expected {NO_POINT} or one of {parts.path('points3D').name}"
        what = f"POINT3D_ID of feature {k} is {image.point[k]}; {right}"
        raise image.place.error(parts.path("images"), what, below=1)
    uv = np.concatenate([image.uv for image in images])[known] - HALF
    view, point = view[known], point[known]
    first = first_of_each(view, point)
    unmatched = int((~known).sum())
    told = (f"{counted(unmatched, 'feature')} without a point left out",) if unmatched else ()
    again = told_again(~first, "an image")
    return Observations(view[first], point[first], uv[first]), (*told, *again)
