"""Which part makes the difference: features of one library, described by the other (``precision.py --parts``)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vslam_ref.features.orb import OrbFeatures, OrbSettings, extract
from vslam_ref.features.orb.description import describe, smooth
from vslam_ref.features.orb.direction import moments, towards
from vslam_ref.features.orb.extraction import DEFAULTS
from vslam_ref.features.orb.scales import octave_images

Bytes = NDArray[np.uint8]
FEATURES = 1000


def without_spread(image: Bytes) -> OrbFeatures:
    return extract(image, OrbSettings(features=FEATURES, spread=False))


def described_by_us(found: OrbFeatures, image: Bytes) -> OrbFeatures:
    """Features found elsewhere, on the nearest pixels of our octaves."""
    images = octave_images(image, 8, DEFAULTS.scale)
    bits, angle, kept = (
        np.zeros((len(found.uv), 32), np.uint8),
        np.zeros(len(found.uv)),
        np.zeros(len(found.uv), bool),
    )
    for k, octave in enumerate(images):
        scale = DEFAULTS.scale**k
        xy = np.rint((found.uv + 0.5) / scale - 0.5).astype(np.int32)
        inside = ((xy >= 19) & (xy < np.array(octave.shape[::-1]) - 19)).all(1) & (found.octave == k)
        moment = moments(octave, xy[inside])
        bits[inside] = describe(smooth(octave), xy[inside], towards(moment))
        angle[inside], kept[inside] = np.arctan2(moment[:, 1], moment[:, 0]), True
    return OrbFeatures(*(part[kept] for part in found._replace(angle=angle, descriptor=bits)))


def opencv_found(image: Bytes) -> OrbFeatures:
    import precision

    return described_by_us(precision.opencv(image), image)


def described_by_opencv(found: OrbFeatures, image: Bytes) -> OrbFeatures:
    """Our features as OpenCV's keypoints: it takes position, octave and angle as they are."""
    scale = DEFAULTS.scale**found.octave
    uv = found.uv - (scale[:, None] - 1) / 2
    keys = [
        cv2.KeyPoint(float(x), float(y), 31.0 * s, float(np.degrees(a)) % 360.0, float(r), int(o))
        for (x, y), s, a, r, o in zip(uv, scale, found.angle, found.response, found.octave, strict=True)
    ]
    orb = cv2.ORB_create(FEATURES)
    keys, bits = orb.compute(image, keys)
    octave = np.array([k.octave for k in keys])
    at = np.array([k.pt for k in keys]) + (1.2 ** octave[:, None] - 1) / 2
    return OrbFeatures(
        at, octave, np.radians([k.angle for k in keys]), np.array([k.response for k in keys]), bits
    )


def ours_by_opencv(image: Bytes) -> OrbFeatures:
    return described_by_opencv(extract(image, OrbSettings(features=FEATURES)), image)


def no_spread_by_opencv(image: Bytes) -> OrbFeatures:
    return described_by_opencv(without_spread(image), image)


METHODS = {
    "no spread": without_spread,
    "OpenCV's, our bits": opencv_found,
    "ours, its bits": ours_by_opencv,
    "no spread, its bits": no_spread_by_opencv,
}
