"""Every number of the system, and why it has its value."""

from __future__ import annotations

from dataclasses import dataclass, field

from vslam_ref.support.config import assume, refuse_small
from vslam_ref.systems.visual_map import Looks
from vslam_ref.systems.visual_map.refine_camera import CameraSettings


@dataclass(frozen=True)
class FeatureSettings:
    """Corners and patches; every field has its own unit, beside it."""

    levels: int = assume(4, "", "PTAM's pyramid: 640 x 480 to 80 x 60")
    arc: int = assume(10, "pixels of 16", "PTAM's FAST-10")
    threshold: int = assume(
        10, "grey levels", "of all levels but the finest; PTAM's program has 15, 15, 10, to balance them"
    )
    threshold_finest: int = assume(10, "grey levels", "PTAM's")
    least_eigenvalue: float = assume(
        10.0,
        "grey levels^2 / px^2",
        "PTAM's 70 halves to 35 in this unit and depends on exposure; 20 halved keeps twice the corners",
    )
    limit: float = assume(0.5, "share of the template's variation", "an absolute limit depends on contrast")
    absolute: float = assume(0.0, "grey levels^2", "0: the relative limit; PTAM has an absolute one")
    measure: str = assume("zmssd", "", "PTAM's; zncc is the other")
    first_refine: bool = assume(True, "", "points lie beside corners: corners alone find fewer")
    warp: bool = assume(True, "", "PTAM's; without, a patch is compared as it was first seen")

    @property
    def looks(self) -> Looks:
        """How patches are compared."""
        return Looks(self.limit, self.measure, self.absolute, self.first_refine, self.warp)


@dataclass(frozen=True)
class StartSettings:
    """From two pictures to a map; every field has its own unit, beside it."""

    trails: int = assume(800, "points", "PTAM starts with 1000 corners")
    least_trails: int = assume(80, "points", "fewer: the trails begin anew")
    search_radius: float = assume(
        6.0, "px", "from picture to picture, around where it was going; twice as far while that is unknown"
    )
    found_again: float = assume(
        0.5, "share", "fewer found: the picture turned, and the small images may know how"
    )
    least_motion: float = assume(8.0, "px", "median length of the trails before a start is tried")
    least_pictures: int = assume(
        6, "pictures", "a rolling shutter makes parallax out of a quick turn; the true one grows with time"
    )
    parallax: float = assume(0.7, "degrees", "median; forward motion never reaches 1.5")
    wide_parallax: float = assume(1.0, "degrees", "of the points that make the map")
    wide_points: int = assume(45, "points", "with that parallax at least")
    cost: float = assume(0.25, "px^2 per pair", "Sampson distance squared, of inliers and outliers alike")
    keep: float = assume(
        0.6, "share", "of the trails that must survive following from the first picture again"
    )
    patience: int = assume(60, "pictures", "the trails begin anew after so many")


@dataclass(frozen=True)
class TrackerSettings:
    """Two passes, quality, and what is done when lost; every field has its own unit, beside it."""

    coarse_points: int = assume(60, "points", "PTAM's 50 to 60, of the two coarsest levels")
    coarse_least: int = assume(15, "points", "fewer found: the next guess is tried")
    coarse_agree: float = assume(0.4, "share", "of the coarse points found: the guess was good")
    fine_points: int = assume(
        1000,
        "points",
        "PTAM's, at most: all that are in sight where those are fewer, as mostly",
    )
    radius: tuple[float, ...] = assume(
        (10.0, 20.0, 40.0), "px", "constant velocity; small image; small image, wide"
    )
    small_image: bool = assume(True, "", "the two guesses by small images; PTAM of 2007 has none")
    decay: float = assume(
        1.0, "share", "of the velocity that is left after a picture; PTAM's 0.9 lags behind"
    )
    newest: float = assume(1.0, "share", "of the newest motion in the velocity; PTAM's 0.5 lags behind")
    fine_radius: float = assume(5.0, "px", "after the coarse pass")
    steps: int = assume(10, "", "PTAM's reweighted steps")
    loss: str = assume("tukey", "", "PTAM's; l2 and huber for comparison")
    least_sigma: float = assume(0.4, "px of the level", "PTAM's floor of the scale")
    good: float = assume(0.3, "share", "of the points tried that were found; PTAM's")
    lost: float = assume(0.13, "share", "of the coarse levels; PTAM's")
    least_inliers: int = assume(20, "points", "fewer: lost")
    worst_sigma: float = assume(4.0, "px of the level", "more: lost")
    follow: bool = assume(True, "", "lost: follow the last inliers patch by patch, then three points")
    relocalise: bool = assume(True, "", "still lost: the same from the keyframes most alike")
    recover_inliers: int = assume(30, "points", "of a recovered pose; fewer may be chance")
    similar: int = assume(5, "keyframes", "tried when lost, the most alike small images")


@dataclass(frozen=True)
class KeyframeSettings:
    """When a picture becomes a keyframe; every field has its own unit, beside it."""

    least_inliers: int = assume(50, "points", "trap: a starved map must be fed")
    worst_sigma: float = assume(1.5, "px of the level", "a pose that is not good enough spoils the map")
    good_only: bool = assume(False, "", "PTAM's rule; it starves the map where it is needed most")
    gap: int = assume(4, "pictures", "since the last; PTAM's 20 starve on quick turns")
    starving: int = assume(120, "points", "fewer inliers: the map is about to end, and the next gap counts")
    gap_starving: int = assume(2, "pictures", "since the last, when the map is about to end")
    fewer: float = assume(0.8, "share", "of the best inliers since the last keyframe, at some distance")
    much_fewer: float = assume(0.65, "share", "at any distance")
    distance: float = assume(0.03, "of the median depth", "from the nearest keyframe, with fewer inliers")
    far: float = assume(0.12, "of the median depth", "from the nearest keyframe, whatever the inliers")


@dataclass(frozen=True)
class MapperSettings:
    """What happens to a keyframe; every field has its own unit, beside it."""

    look_radius: float = assume(4.0, "px", "looking again with a known pose")
    epipolar: float = assume(2.0, "px of the level", "corners so near to the curve are compared")
    back: float = assume(
        1.5,
        "px of the level",
        "the way back must end there; a wrong match on the line fits two views exactly",
    )
    search_back: bool = assume(True, "", "as above")
    spacing: float = assume(10.0, "px of the level", "from points that are measured already")
    parallax: float = assume(1.0, "degrees", "of new points; forward motion needs it so small")
    partners: int = assume(2, "keyframes", "nearest views for the epipolar search")
    new_points: int = assume(400, "points per level", "candidates, strongest first")
    near: float = assume(0.15, "of the median depth", "nearest depth that is searched")
    neighbours: int = assume(6, "keyframes", "in which new points are looked for")
    local: int = assume(4, "keyframes", "adjusted beside the newest; PTAM's")
    local_steps: int = assume(15, "", "of a local adjustment")
    global_every: int = assume(5, "keyframes", "an adjustment of everything")
    global_steps: int = assume(10, "", "of a global adjustment while pictures come")
    lag: int = assume(
        3, "pictures", "beside the tracker: it waits for a keyframe that was handed over so long ago"
    )
    queue: int = assume(
        1, "keyframes", "beside the tracker, that wait at most: a second would find what the first finds"
    )
    tries: int = assume(8, "looks", "after which a point must have been found often enough")
    found: float = assume(0.25, "share", "fewer: the point dies")


AT_LEAST_ONE = {
    *("features.levels", "start.trails", "tracker.coarse_points", "tracker.fine_points", "tracker.steps"),
    *("mapper.partners", "mapper.new_points", "mapper.global_every", "mapper.tries", "mapper.queue"),
}
"""Settings of which a run needs one; of the others none may be negative."""


@dataclass(frozen=True)
class Settings:
    """PTAM as it runs."""

    seed: int = assume(0, "", "of the one generator")
    features: FeatureSettings = field(default_factory=FeatureSettings)
    start: StartSettings = field(default_factory=StartSettings)
    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    keyframe: KeyframeSettings = field(default_factory=KeyframeSettings)
    mapper: MapperSettings = field(default_factory=MapperSettings)
    camera: CameraSettings = field(default_factory=CameraSettings)
    last_steps: int = assume(40, "", "of the adjustment of everything at the end")

    def __post_init__(self) -> None:
        """Refuse numbers that mean nothing."""
        refuse_small(self, AT_LEAST_ONE)
