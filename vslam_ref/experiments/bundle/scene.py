"""Scenes of the studies of bundle adjustment; they stand in :mod:`vslam_ref.worlds.bundles`."""

from vslam_ref.worlds.bundles import (
    INTRINSICS,
    Bundle,
    displacement,
    make_bundle,
    moved_start,
    moved_world,
    nearest_of_family,
    scene_error,
)

__all__ = [
    "INTRINSICS",
    "Bundle",
    "displacement",
    "make_bundle",
    "moved_start",
    "moved_world",
    "nearest_of_family",
    "scene_error",
]
