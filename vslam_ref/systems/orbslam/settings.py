"""Every number of the system, and why it has its value."""

from __future__ import annotations

from dataclasses import dataclass, field

from vslam_ref.features.orb import OrbSettings
from vslam_ref.support.config import assume, refuse_small
from vslam_ref.systems.orbslam.loop_settings import LoopSettings
from vslam_ref.systems.visual_map.refine_camera import CameraSettings


@dataclass(frozen=True)
class FeatureSettings:
    """ORB features and how they are compared; every field has its own unit, beside it."""

    features: int = assume(1200, "features", "of a picture, over all octaves; half as many track worse")
    octaves: int = assume(8, "", "ORB-SLAM's")
    scale: float = assume(1.2, "", "from octave to octave; ORB-SLAM's")
    threshold: int = assume(20, "grey levels", "FAST's; ORB-SLAM's")
    low_threshold: int = assume(7, "grey levels", "in cells without a corner at the higher one; ORB-SLAM's")
    spread: bool = assume(True, "", "by a quadtree; without, the strongest corners lie all in one place")
    far: int = assume(100, "bits", "largest Hamming distance where the place is known; ORB-SLAM's")
    near: int = assume(50, "bits", "largest where it is not; ORB-SLAM's")

    @property
    def orb(self) -> OrbSettings:
        """The same as the extractor wants it."""
        return OrbSettings(
            features=self.features,
            octaves=self.octaves,
            scale=self.scale,
            threshold=self.threshold,
            low_threshold=self.low_threshold,
            spread=self.spread,
        )


@dataclass(frozen=True)
class StartSettings:
    """From two pictures to a map; every field has its own unit, beside it."""

    least_matches: int = assume(100, "matches", "fewer: the first picture is another one; ORB-SLAM's")
    octaves: int = assume(3, "", "finest ones, that are matched: what coarser ones show lies too loosely")
    window: float = assume(0.15, "of the width", "half side of the window around the last match")
    ratio: float = assume(0.9, "", "of the best to the second distance; ORB-SLAM's")
    least_motion: float = assume(8.0, "px", "median length of the matches before a start is tried")
    least_pictures: int = assume(
        4, "pictures", "a rolling shutter makes parallax out of a quick turn; the true one grows with time"
    )
    parallax: float = assume(0.5, "degrees", "median; points from half of it on make the map")
    wide_parallax: float = assume(1.0, "degrees", "of the points that fix the scale")
    wide_points: int = assume(
        50, "points", "with that parallax; a median of 1.5 degrees is not reached by forward motion"
    )
    cost: float = assume(0.5, "px^2 per pair", "Sampson distance squared, of inliers and outliers alike")
    agree: float = assume(
        2.5, "", "an equation of the picture between may cost so much more: corners lie on whole pixels"
    )
    patience: int = assume(60, "pictures", "then the newest is the first one")


@dataclass(frozen=True)
class TrackerSettings:
    """Two passes, and what is done when lost; every field has its own unit, beside it."""

    radius: float = assume(12.0, "px of the octave", "around where the motion puts the last points")
    fine_radius: float = assume(5.0, "px of the octave", "around where the first pose puts the map")
    ratio: float = assume(0.8, "", "of the best to the second distance on its octave; ORB-SLAM's")
    local_map: str = assume("whole", "", "what the second pass looks for: whole, or covisible keyframes'")
    local_keyframes: int = assume(80, "keyframes", "of a covisible local map; ORB-SLAM's")
    first_least: int = assume(20, "points", "with weight after the first pass; ORB-SLAM's")
    steps: int = assume(10, "", "reweighted steps of a pose")
    least_sigma: float = assume(0.5, "px of the octave", "floor of the scale of the errors")
    least_inliers: int = assume(30, "points", "fewer: lost; ORB-SLAM's")
    worst_sigma: float = assume(4.0, "px of the octave", "more: lost")
    good_inliers: int = assume(50, "points", "fewer: poor")
    found_again: int = assume(50, "points", "of a pose that relocalisation found; ORB-SLAM's")
    relocalise: bool = assume(True, "", "lost: match with the keyframes that look alike")
    similar: int = assume(5, "keyframes", "tried when lost")


@dataclass(frozen=True)
class KeyframeSettings:
    """When a picture becomes a keyframe; every field has its own unit, beside it."""

    fewer: float = assume(
        0.9, "share", "of the most points since the last keyframe; at 0.8 rendered paths are worse by half"
    )
    gap: int = assume(1, "pictures", "since the last, at least")
    most: int = assume(5, "pictures", "since the last, if the camera has moved")
    distance: float = assume(0.02, "of the median depth", "that counts as moved")
    least_inliers: int = assume(40, "points", "a pose from fewer spoils the map")


@dataclass(frozen=True)
class MapperSettings:
    """What happens to a keyframe; every field has its own unit, beside it."""

    neighbours: int = assume(10, "keyframes", "with which new points are made; of twenty in ORB-SLAM")
    second: int = assume(5, "keyframes", "neighbours of each neighbour, for fusing; ORB-SLAM's")
    base: float = assume(0.01, "of the median depth", "least base line of a new point; ORB-SLAM's")
    epipolar: float = assume(1.96, "px of the octave", "from the epipolar curve; 95 %")
    parallax: float = assume(1.0, "degrees", "of new points; ORB-SLAM's 1.15")
    worst: float = assume(2.0, "px of the octave", "root mean square distance of a new point")
    fuse: bool = assume(True, "", "points of neighbours are looked for in the keyframe, and back")
    fuse_radius: float = assume(3.0, "px of the octave", "ORB-SLAM's")
    young: int = assume(3, "keyframes", "during which a point is on probation; ORB-SLAM's")
    found: float = assume(0.25, "share", "of the looks, or a young point dies; ORB-SLAM's")
    least_seen: int = assume(3, "keyframes", "that see a young point after two more, or it dies; ORB-SLAM's")
    local: int = assume(12, "keyframes", "adjusted with the newest among them")
    local_steps: int = assume(10, "", "of a local adjustment; 0 leaves it out")
    redundant: float = assume(0.9, "share", "of a keyframe's points that others see as well; ORB-SLAM's")
    others: int = assume(3, "keyframes", "that must see these; ORB-SLAM's")


AT_LEAST_ONE = {"features.octaves", "tracker.steps", "mapper.neighbours", "keyframe.gap"}
"""Settings of which a run needs one; of the others none may be negative."""


@dataclass(frozen=True)
class Settings:
    """ORB-SLAM as it runs."""

    seed: int = assume(0, "", "of the one generator")
    features: FeatureSettings = field(default_factory=FeatureSettings)
    start: StartSettings = field(default_factory=StartSettings)
    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    keyframe: KeyframeSettings = field(default_factory=KeyframeSettings)
    mapper: MapperSettings = field(default_factory=MapperSettings)
    loops: LoopSettings = field(default_factory=LoopSettings)
    camera: CameraSettings = field(default_factory=CameraSettings)
    last_steps: int = assume(40, "", "of the adjustment of everything at the end")

    def __post_init__(self) -> None:
        """Refuse numbers that mean nothing."""
        refuse_small(self, AT_LEAST_ONE)
        if self.tracker.local_map not in LOCAL_MAPS:
            raise ValueError(f"tracker.local_map={self.tracker.local_map!r}: need {' or '.join(LOCAL_MAPS)}")
        try:
            _ = self.features.orb
        except ValueError as error:
            raise ValueError(f"features: {error}") from error


LOCAL_MAPS = ("whole", "covisible")
