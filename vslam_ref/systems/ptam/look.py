"""A picture made ready: pyramid, corners of every level, small image."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.features import corner_score, detect, is_peak, pyramid, shi_tomasi, small_image
from vslam_ref.features.corners import HALF
from vslam_ref.features.fast import Pixels
from vslam_ref.features.small_images import LEAST_SIDE
from vslam_ref.systems.ptam.settings import FeatureSettings
from vslam_ref.systems.visual_map import PreparedPicture


def prepare(number: int, grey: ArrayLike, settings: FeatureSettings) -> PreparedPicture:
    """Make a picture (H, W), grey levels of 8 bits, ready; its corners are in pixels of their level."""
    levels = pyramid(grey, settings.levels)
    limit = [settings.threshold_finest] + [settings.threshold] * (settings.levels - 1)
    corners = tuple(detect(image, t, settings.arc) for image, t in zip(levels, limit, strict=True))
    coarse = max(k for k, image in enumerate(levels) if k == 0 or min(image.shape) >= LEAST_SIDE)
    return PreparedPicture(number, levels, corners, small_image(levels[coarse], coarse))


def peaks(picture: PreparedPicture, level: int, settings: FeatureSettings) -> Pixels:
    """Pixels (n, 2) of a level's corners that are stronger than their neighbours."""
    return picture.corners[level].xy[stand_out(picture, level, settings)]


def stand_out(picture: PreparedPicture, level: int, settings: FeatureSettings) -> BoolArray:
    """Which of a level's corners (n,) are stronger than their neighbours, in pixels of the level."""
    corners = picture.corners[level]
    return is_peak(corners, corner_score(picture.levels[level], corners.xy, settings.arc))


def strong_corners(
    picture: PreparedPicture, level: int, settings: FeatureSettings, peak: BoolArray | None = None
) -> IntArray:
    """Indices (n,) of a level's corners that are peaks and strong, strongest first; pixels of the level.

    ``peak`` is the answer of :func:`stand_out`, where it is known already.
    """
    image, corners = picture.levels[level], picture.corners[level]
    peak = stand_out(picture, level, settings) if peak is None else peak
    height, width = image.shape
    reach = HALF + 2
    inner = (corners.xy >= reach).all(1) & (corners.xy < (width - reach, height - reach)).all(1)
    number = np.flatnonzero(peak & inner)
    strength: Array = shi_tomasi(image, corners.xy[number])
    order = np.argsort(-strength, kind="stable")
    strong: IntArray = number[order[strength[order] >= settings.least_eigenvalue]]
    return strong


def spread(xy: Pixels, shape: tuple[int, ...], count: int) -> IntArray:
    """Rows of at most ``count`` points, strongest first, so that all parts of a picture have their share."""
    side = max(int(np.ceil(np.sqrt(shape[0] * shape[1] / max(count, 1) * 3.0))), 8)
    cell = xy[:, 1] // side * (shape[1] // side + 1) + xy[:, 0] // side
    order = np.argsort(cell, kind="stable")
    start = np.concatenate([[True], np.diff(cell[order]) != 0]) if len(order) else np.zeros(0, bool)
    first = np.maximum.accumulate(np.where(start, np.arange(len(order)), 0)) if len(order) else order
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order)) - first
    chosen: IntArray = np.sort(np.argsort(rank, kind="stable")[:count])
    return chosen
