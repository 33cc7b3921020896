"""Chapter 08: corners, levels, patches."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.conformance.adapters.table import Answers
from vslam_ref.features.corners import shi_tomasi
from vslam_ref.features.fast import corner_score, segment_test
from vslam_ref.features.levels import finest_from_level, halve, level_from_finest
from vslam_ref.features.patch_search import zmssd, zncc
from vslam_ref.features.templates import sampling, warp

Array = NDArray[Any]


def _bytes(image: Array) -> NDArray[np.uint8]:
    return np.asarray(image).astype(np.uint8)


def _warp(image: Array, uv: Array, M: Array) -> Array:
    found = warp(_bytes(image), uv[None], M[None])
    if not found.inside[0]:
        raise ValueError("the patch leaves the image")
    patch: Array = found.patch[0]
    return patch


TABLE: Answers = {
    "features.segment_test": lambda image, threshold, arc: segment_test(_bytes(image), threshold, arc),
    "features.corner_score": lambda image, arc: int(corner_score(_bytes(image), [[3, 3]], arc)[0]),
    "features.halve": lambda image: halve(_bytes(image)),
    "features.finest_from_level": lambda uv, level: finest_from_level(uv, level),
    "features.level_from_finest": lambda uv, level: level_from_finest(uv, level),
    "features.zmssd": lambda a, b: float(zmssd(a.ravel(), b.ravel())),
    "features.zncc": lambda a, b: float(zncc(a.ravel(), b.ravel())),
    "features.shi_tomasi": lambda image: float(shi_tomasi(_bytes(image), [[4, 4]])[0]),
    "features.warp": _warp,
    "features.sampling": lambda A, target_level, source_level: sampling(A, target_level, source_level),
}
