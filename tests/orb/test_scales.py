"""Octaves: grey levels lie where the geometry says, and OpenCV's resampling is the same."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features.orb import OrbSettings
from vslam_ref.features.orb.scales import finest_from_octave, octave_images, shrink

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


@pytest.mark.parametrize("scale", [1.2, 1.5, 2.0])
def test_a_slope_keeps_its_place(scale: float) -> None:
    """Each octave of 5 x + 4 y has that grey level at its pixels' places in the first.

    A rounding is off by half a level at most, once in each octave, and weights by 2^-12.  Half a pixel that
    is forgotten, 0.1 pixels in each direction and octave at scale 1.2, is 0.9 levels.
    """
    x, y = np.meshgrid(np.arange(30), np.arange(25))
    images = octave_images((5 * x + 4 * y).astype(np.uint8), 5, scale)
    assert len(images) == 5
    for k, octave in enumerate(images):
        v, u = np.indices(octave.shape)
        at = finest_from_octave(np.stack([u, v], -1).astype(float), k, scale)
        error = octave - (5 * at[..., 0] + 4 * at[..., 1])
        assert np.abs(error).max() <= 0.51 * k


def test_opencvs_resampling_at_whole_sizes(wall: Bytes) -> None:
    """180 = 216 / 1.2: the same places; OpenCV's weights have 11 bits too, but it may round twice."""
    theirs = cv2.resize(wall, (180, 180), interpolation=cv2.INTER_LINEAR)
    assert np.abs(shrink(wall, 1.2).astype(int) - theirs).max() <= 1


@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (2, 2), (7, 3)])
def test_small_pictures_end_early(shape: tuple[int, int]) -> None:
    images = octave_images(np.full(shape, 9, np.uint8), 20, 1.2)
    assert all(min(i.shape) >= 1 and (i == 9).all() for i in images)
    assert images[0].shape == shape
    assert min(images[-1].shape) / 1.2 < 1


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"features": -1}, "features is -1"),
        ({"octaves": 0}, "octaves is 0"),
        ({"scale": 1.0}, "scale is 1.0"),
        ({"scale": 2.5}, "scale is 2.5"),
        ({"low_threshold": 21}, "low_threshold is 21 and threshold 20"),
        ({"threshold": 255}, "threshold 255"),
        ({"cell": 0}, "cell is 0"),
    ],
)
def test_bad_settings_are_refused(change: dict[str, float], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        OrbSettings(**change)  # type: ignore[arg-type]
