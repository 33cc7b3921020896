"""From a picture to its features."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb.candidates import BORDER, Candidates, candidates
from vslam_ref.features.orb.description import describe, smooth
from vslam_ref.features.orb.direction import moments, towards
from vslam_ref.features.orb.scales import finest_from_octave, octave_images
from vslam_ref.features.orb.settings import OrbSettings
from vslam_ref.features.orb.spread import spread


class OrbFeatures(NamedTuple):
    """Features of a picture, octave by octave and in row order.

    Attributes
    ----------
    uv : ndarray, shape (n, 2)
        Pixels of the picture itself; (0, 0) is the centre of the top-left pixel.
    octave : ndarray of int64, shape (n,)
        Where it was found; a pixel there is scale^octave pixels wide.
    angle : ndarray, shape (n,)
        Radians, from x towards y, -pi to pi.
    response : ndarray, shape (n,)
        FAST's score, grey levels.
    descriptor : ndarray of uint8, shape (n, 32)
    """

    uv: Array
    octave: IntArray
    angle: Array
    response: Array
    descriptor: Bytes


DEFAULTS = OrbSettings()


def extract(image: ArrayLike, settings: OrbSettings = DEFAULTS) -> OrbFeatures:
    """Find and describe ORB features.

    Implements :eq:`eq-orb-share`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
    settings : OrbSettings

    Returns
    -------
    OrbFeatures
        None at all in a picture that is flat, or has fewer than 39 pixels to a side.

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits.

    Examples
    --------
    >>> image = np.zeros((80, 80), np.uint8)
    >>> image[40, 40] = 200
    >>> extract(image, OrbSettings(octaves=1)).uv
    array([[40., 40.]])
    """
    images = octave_images(image, settings.octaves, settings.scale)
    wanted = shares(settings)
    found = [_of_octave(images[k], k, wanted[k], settings) for k in range(len(images))]
    return OrbFeatures(*(np.concatenate(part) for part in zip(*found, strict=True)))


def shares(settings: OrbSettings) -> list[int]:
    """How many features each octave may have: in proportion to its picture's side, together all of them.

    Implements :eq:`eq-orb-share`.

    Examples
    --------
    >>> shares(OrbSettings(features=100, octaves=3))
    [40, 33, 27]
    """
    side = settings.scale ** -np.arange(settings.octaves)
    until = np.rint(settings.features * np.cumsum(side) / side.sum()).astype(int)  # eq-orb-share
    return np.diff(until, prepend=0).tolist()  # type: ignore[no-any-return]


def located(image: Bytes, wanted: int, settings: OrbSettings) -> Candidates:
    """Corners of one octave's picture (H, W) that become features, with their scores: about ``wanted``."""
    if min(image.shape) <= 2 * BORDER:
        return Candidates(np.zeros((0, 2), np.int32), np.zeros(0, np.int64))
    xy, score = candidates(image, settings.threshold, settings.low_threshold, settings.cell)
    if settings.spread:
        keep = spread(xy, score, image.shape, wanted)
    else:
        keep = np.sort(np.argsort(-score, kind="stable")[:wanted])
    return Candidates(xy[keep], score[keep])


def _of_octave(image: Bytes, octave: int, wanted: int, settings: OrbSettings) -> OrbFeatures:
    """Features of one octave's picture."""
    xy, score = located(image, wanted, settings)
    moment = moments(image, xy)
    bits = describe(smooth(image), xy, towards(moment)) if len(xy) else np.zeros((0, 32), np.uint8)
    return OrbFeatures(
        uv=finest_from_octave(xy, octave, settings.scale),
        octave=np.full(len(xy), octave),
        angle=np.arctan2(moment[:, 1], moment[:, 0]),  # eq-orb-angle
        response=score.astype(np.float64),
        descriptor=bits,
    )
