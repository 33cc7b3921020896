"""A picture made ready: its ORB features, with the grey level at each."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.features.orb import extract
from vslam_ref.systems.orbslam.feature_map import DescribedPicture
from vslam_ref.systems.orbslam.settings import FeatureSettings


def describe_picture(number: int, grey: ArrayLike, settings: FeatureSettings) -> DescribedPicture:
    """Find the features of a picture (H, W), grey levels of 8 bits; their places are in pixels."""
    features = extract(grey, settings.orb)
    image = np.asarray(grey)
    x, y = np.rint(features.uv).astype(np.int64).T
    height, width = image.shape
    return DescribedPicture(number, features, image[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)])
