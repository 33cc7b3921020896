"""The tracks of a COLMAP model's points, which say once more what the images say: compared, not used.

::

    images    feature 7 of image 5 has POINT3D_ID 100
    points    TRACK of point 100 has (5, 7)

COLMAP reads files in which the two differ.  A few such points are told, and the images are believed; more
than one in twenty, and the files are of two models.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import BoolArray, IntArray
from vslam_ref.datasets.bundle_files.colmap.parts import NO_POINT, Parts
from vslam_ref.datasets.bundle_files.loading import counted
from vslam_ref.datasets.text import FormatError

MOST_ODD = 0.05
"""Share of the points that may be odd."""


def places(known: IntArray, wanted: IntArray) -> tuple[IntArray, BoolArray]:
    """Where each wanted number (m,) stands among known ones (n,), and whether it does (m,); no unit.

    Examples
    --------
    >>> places(np.array([7, 3]), np.array([3, 4]))
    (array([1, 0]), array([ True, False]))
    """
    if not len(known):
        return np.zeros(len(wanted), dtype=np.int64), np.zeros(len(wanted), dtype=np.bool_)
    order = np.argsort(known, kind="stable")
    at = order[np.minimum(np.searchsorted(known[order], wanted), len(known) - 1)]
    return at, np.asarray(known[at] == wanted)


def told_of_tracks(parts: Parts) -> tuple[str, ...]:
    """What is told where tracks and images differ.

    Raises
    ------
    FormatError
        At the first point that differs, if more than ``MOST_ODD`` of them do.
    """
    points, images = parts.points, parts.path("images").name
    named = np.concatenate([image.point for image in parts.images.values()])
    image_of = np.repeat(np.arange(len(parts.images)), [len(image.point) for image in parts.images.values()])
    wrong = _wrong_entries(parts, named)
    at, known = places(points.ids, named)
    by_images, by_track = (
        _images_of_each(len(points.ids), *pair)
        for pair in ((at[known], image_of[known]), (points.track_point, points.track[:, 0]))
    )
    bare = np.bincount(points.track_point, minlength=len(points.ids)) == 0
    odd = (by_images != by_track) & ~bare
    odd[points.track_point[wrong]] = True
    if odd.sum() > MOST_ODD * len(points.ids):
        k = int(np.argmax(odd))
        raise _error(parts, k, named, wrong, int(by_track[k]), int(by_images[k]))
    empty = int((bare & (by_images > 0)).sum())
    told = []
    if odd.any():
        told.append(
            f"{counted(int(odd.sum()), 'point')} whose TRACK differs from {images}: {images} is believed"
        )
    if empty:
        told.append(f"{counted(empty, 'point')} without a TRACK: what sees them is taken from {images}")
    return tuple(told)


def _wrong_entries(parts: Parts, named: IntArray) -> BoolArray:
    """Which entries (m,) of the tracks name no feature of this point."""
    points = parts.points
    image, known = places(np.array(list(parts.images), dtype=np.int64), points.track[:, 0])
    there = _named_by(parts, image, named)
    return np.asarray(~known | (there != points.ids[points.track_point]))


def _named_by(parts: Parts, image: IntArray, named: IntArray) -> IntArray:
    """POINT3D_ID (m,) of the features that the tracks name; below ``NO_POINT`` where there is none."""
    lengths = np.array([len(one.point) for one in parts.images.values()], dtype=np.int64)
    start, feature = np.concatenate([[0], np.cumsum(lengths)])[image], parts.points.track[:, 1]
    there = np.full(len(feature), NO_POINT - 1)
    inside = feature < lengths[image]
    there[inside] = named[(start + feature)[inside]]
    return there


def _images_of_each(points: int, point: IntArray, image: IntArray) -> IntArray:
    """Number of different images of each point (N,): a second sight in an image is told elsewhere."""
    pairs = np.unique(np.stack([point, image], -1), axis=0)
    return np.bincount(pairs[:, 0], minlength=points)


def _error(
    parts: Parts, k: int, named: IntArray, wrong: BoolArray, by_track: int, by_images: int
) -> FormatError:
    """What is wrong with the track of point k."""
    points, images = parts.points, parts.path("images").name
    mine = np.flatnonzero(wrong & (points.track_point == k))
    what = f"TRACK of point {points.ids[k]} has {by_track} images, {images} {by_images}; expected the same"
    if len(mine):
        key, feature = points.track[mine[0]].tolist()
        if key not in parts.images:
            what = f"TRACK names image {key}; expected one of {images}"
        else:
            found = parts.images[key].point
            point = found[feature] if feature < len(found) else "none"
            has = f"which has point {point}; expected {points.ids[k]}"
            what = f"TRACK names feature {feature} of image {key}, {has}"
    return points.place(k).error(parts.path("points3D"), what)
