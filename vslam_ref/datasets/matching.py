"""Corresponding pixels of several pictures, as an input: what a detector and a matcher deliver.

OpenCV's SIFT finds places and describes them; they are compared here, all with all.  Two rules keep most
wrong pairs out: the best partner must be clearly better than the second (ratio test), and it must hold both
ways (cross-check).  Wrong ones remain; what uses this input must expect them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray

RATIO = 0.75
"""Largest ratio of the distances to the best and to the second partner."""


class Features(NamedTuple):
    """Places (P, 2) in a picture, pixels; descriptors (D, 128); the place (D,) that each describes.

    A place with several dominant directions has several descriptors.
    """

    uv: Array
    descriptors: NDArray[np.float32]
    place: IntArray


class Tracks(NamedTuple):
    """Pixels (N, V, 2) of N points in V pictures, zero where not seen, and where they are seen (N, V)."""

    uv: Array
    mask: NDArray[np.bool_]


def detect(image: NDArray[np.uint8]) -> Features:
    """SIFT places and descriptors of a grey picture; pixel (0, 0) is the centre of the top-left pixel.

    Raises
    ------
    ValueError
        If the picture is not (height, width) of bytes.
    """
    import cv2

    if image.ndim != 2 or image.dtype != np.uint8:
        raise ValueError(f"picture is {image.dtype} of shape {image.shape}: need uint8 of (height, width)")
    # without the precise doubling of the picture all places are off by a quarter of a pixel
    keypoints, descriptors = cv2.SIFT.create(enable_precise_upscale=True).detectAndCompute(image, None)
    if not keypoints:
        return Features(np.zeros((0, 2)), np.zeros((0, 128), np.float32), np.zeros(0, np.int64))
    points = np.array([k.pt for k in keypoints], dtype=np.float64)
    uv, place = np.unique(points, axis=0, return_inverse=True)
    return Features(uv, np.asarray(descriptors, dtype=np.float32), place.reshape(-1).astype(np.int64))


def match(a: Features, b: Features, ratio: float = RATIO) -> IntArray:
    """Pairs (M, 2) of places of two pictures, sorted.

    Parameters
    ----------
    a, b : Features
    ratio : float
        In (0, 1]; a pair counts if its distance is less than this share of the next best *place*'s, both
        ways, and if both are each other's best.

    Raises
    ------
    ValueError
        If ``ratio`` lies outside.
    """
    if not 0 < ratio <= 1:
        raise ValueError(f"ratio={ratio}: must lie in (0, 1]")
    if len(a.descriptors) < 2 or len(b.descriptors) < 2:
        return np.zeros((0, 2), np.int64)
    x, y = a.descriptors.astype(np.float64), b.descriptors.astype(np.float64)
    # whole numbers below 256: the squares are exact
    square = (x**2).sum(1)[:, None] + (y**2).sum(1)[None] - 2.0 * x @ y.T
    there, clear_there = _best(square, b.place, ratio)
    back, clear_back = _best(square.T, a.place, ratio)
    mutual = (back[there] == np.arange(len(x))) & clear_there & clear_back[there]
    i = np.flatnonzero(mutual)
    pairs = np.stack([a.place[i], b.place[there[i]]], 1)
    return np.unique(pairs, axis=0)


def _best(square: Array, place: IntArray, ratio: float) -> tuple[IntArray, NDArray[np.bool_]]:
    """Nearest column of each row, and whether every other place is clearly farther."""
    best = np.argmin(square, axis=1)
    at = np.arange(len(square))
    nearest = square[at, best]
    others = np.where(place[None] == place[best][:, None], np.inf, square).min(axis=1)
    return best.astype(np.int64), nearest < ratio**2 * others


def tracks(features: Sequence[Features], pairs: Mapping[tuple[int, int], IntArray]) -> Tracks:
    """Join pairs of places that share one: a point in several pictures.

    Parameters
    ----------
    features : sequence of V Features
    pairs : mapping of (i, j) to ndarray (M, 2)
        Matches of pictures i and j, as from :func:`match`.

    Returns
    -------
    Tracks
        Of two pictures and more.  A chain that comes to two places of one picture is wrong somewhere, and
        is left out as a whole.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first = np.concatenate([[0], np.cumsum([len(f.uv) for f in features])]).astype(np.int64)
    links = [first[[i, j]] + found for (i, j), found in pairs.items()]
    a, b = np.concatenate([np.zeros((0, 2), np.int64), *links]).T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(first[-1], first[-1]))
    _, group = connected_components(graph, directed=False)  # numbered by their first places
    picture = np.repeat(np.arange(len(features)), np.diff(first))
    uv = np.concatenate([f.uv for f in features]) if len(features) else np.zeros((0, 2))
    _, row, size = np.unique(group, return_inverse=True, return_counts=True)
    row = row.reshape(-1)
    counts = np.zeros((len(size), len(features)), dtype=np.int64)
    np.add.at(counts, (row, picture), 1)
    keep = (size >= 2) & (counts.max(axis=1, initial=0) == 1)
    all_uv = np.zeros((len(size), len(features), 2))
    all_uv[row, picture] = uv
    return Tracks(np.where(counts[keep][..., None] > 0, all_uv[keep], 0.0), counts[keep] > 0)
