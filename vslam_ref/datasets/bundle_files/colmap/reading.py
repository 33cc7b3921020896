"""Reader of COLMAP's models, binary or text: the parts of the three files, made a problem."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.bundle_files.colmap.binary import FILES as BINARY_FILES
from vslam_ref.datasets.bundle_files.colmap.binary import binary_parts
from vslam_ref.datasets.bundle_files.colmap.lenses import Lenses, lenses_of
from vslam_ref.datasets.bundle_files.colmap.models import HALF, MODELS
from vslam_ref.datasets.bundle_files.colmap.parts import NO_POINT, Parts
from vslam_ref.datasets.bundle_files.colmap.rigs import chosen_poses, frame_poses
from vslam_ref.datasets.bundle_files.colmap.text import FILES as TEXT_FILES
from vslam_ref.datasets.bundle_files.colmap.text import text_parts
from vslam_ref.datasets.bundle_files.colmap.tracks import MOST_ODD, places, told_of_tracks
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
    tracks = told_of_tracks(parts)
    lenses = lenses_of(parts)
    seen, told = _observations(parts)
    by_frame, rig_notes = frame_poses(parts)
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
        notes=(*notes, *told, *tracks, *_unused(parts, lenses), *rig_notes, *stale),
    )


def _parts(folder: Path, max_bytes: int | None) -> tuple[Parts, tuple[str, ...]]:
    """The files of the form that is there, and what is told."""
    has_binary, has_text = (
        [(folder / name).exists() for name in files] for files in (BINARY_FILES, TEXT_FILES)
    )
    if all(has_binary):
        both = "the folder has the model twice: the binary files are read, as COLMAP does, not the text"
        return binary_parts(folder, max_bytes), (both,) if all(has_text) else ()
    if sum(has_binary) > sum(has_text):
        return binary_parts(folder, max_bytes), ()
    return text_parts(folder, max_bytes), ()


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


def _observations(parts: Parts) -> tuple[Observations, tuple[str, ...]]:
    """Features with a point, the first of each image and point, and what is told of the others."""
    images = list(parts.images.values())
    lengths = [len(image.point) for image in images]
    named = np.concatenate([image.point for image in images])
    view = np.repeat(np.arange(len(images)), lengths)
    point, known = places(parts.points.ids, named)
    bad = np.flatnonzero(~known & (named != NO_POINT))
    if len(bad) > MOST_ODD * np.count_nonzero(named != NO_POINT):
        image = images[view[bad[0]]]
        k = int(bad[0] - np.sum(lengths[: view[bad[0]]], dtype=np.int64))
        right = f"expected {NO_POINT} or one of {parts.path('points3D').name}"
        what = f"POINT3D_ID of feature {k} is {image.point[k]}; {right}"
        raise image.place.error(parts.path("images"), what, below=1)
    uv = np.concatenate([image.uv for image in images])[known] - HALF
    view, point = view[known], point[known]
    first = first_of_each(view, point)
    unmatched = int((named == NO_POINT).sum())
    told = (f"{counted(unmatched, 'feature')} without a point left out",) if unmatched else ()
    again = told_again(~first, "an image")
    points = parts.path("points3D").name
    gone = (
        (f"{counted(len(bad), 'feature')} of a point that {points} does not have left out",)
        if len(bad)
        else ()
    )
    return Observations(view[first], point[first], uv[first]), (*told, *gone, *again)
