"""From trails to a first map, or the reason why not yet."""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import IntArray
from vslam_ref.features import level_sigma
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.ptam.mapper.mapper import adjust_all
from vslam_ref.systems.ptam.mapper.new_points import new_points
from vslam_ref.systems.ptam.settings import Settings, StartSettings
from vslam_ref.systems.ptam.trails import Trails, again_in, from_the_first
from vslam_ref.systems.visual_map import VisualMap
from vslam_ref.systems.visual_map.starting import Between, Pair, judge_start, unit_depth
from vslam_ref.systems.visual_map.telling import Attempt

__all__ = ["Attempt", "attempt", "first_map"]


def attempt(camera: Camera, trails: Trails, s: StartSettings, rng: np.random.Generator) -> Attempt | str:
    """Try to start from the ends of trails and a picture between; a sentence if there is nothing to try."""
    again = from_the_first(trails)
    ok = np.isfinite(again[:, 0])
    if ok.sum() < max(s.least_trails, 8):
        return f"{ok.sum()} of {len(ok)} corners are still found: need {s.least_trails}"
    level, row = trails.level[ok], np.flatnonzero(ok)
    pair = Pair(trails.first[ok], again[ok], level, level_sigma(level), row)
    between = _shown_between(trails, row) if len(trails.pictures) > 2 else None
    return judge_start(camera, pair, between, s, rng)


def _shown_between(trails: Trails, row: IntArray) -> Between:
    """Trails (n,) in the picture that is to be asked."""
    number = _between(trails)
    share = float(trails.moved[number] / max(trails.moved[-1], 1e-9))
    return Between(trails.pictures[number].number, again_in(trails, number)[row], share)


def _between(trails: Trails) -> int:
    """Return which of the pictures lies half way, by how far the points had moved."""
    moved = trails.moved
    return 1 + int(np.argmin(np.abs(moved[1:-1] - 0.5 * moved[-1])))


def first_map(camera: Camera, trails: Trails, found: Attempt, settings: Settings) -> VisualMap:
    """Make a map of two keyframes from a start; the median depth in the first is 1, in its own unit.

    Implements A§2.2.2.
    """
    first, last = trails.pictures[0], trails.pictures[-1]
    scale = 1.0 / float(np.median(found.X_a[found.good, 2]))
    T_b_a = se3.from_rt(se3.rotation(found.T_b_a), scale * se3.translation(found.T_b_a))
    height, width = first.levels[0].shape
    visual_map = VisualMap(camera, (height, width), len(first.levels))
    visual_map.add_keyframe(se3.identity(), first)
    visual_map.add_keyframe(T_b_a, last)
    g = found.good
    numbers = visual_map.add_points(scale * found.X_a[g], 0, found.level[g], found.uv_a[g])
    visual_map.observe(1, numbers, found.level[g], found.uv_b[g])
    adjust_all(visual_map, settings, settings.mapper.global_steps)
    new_points(visual_map, 1, last, settings.mapper, settings.features)
    adjust_all(visual_map, settings, settings.mapper.global_steps)
    unit_depth(visual_map)
    return visual_map
