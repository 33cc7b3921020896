"""Numbers of loop closing, and why each has its value."""

from __future__ import annotations

from dataclasses import dataclass

from vslam_ref.support.config import assume, refuse_small

COUNTS = (
    "consistent", "draws", "least_matches", "least_inliers", "least_points", "group", "theta_min", "steps",
)  # fmt: skip
"""Fewer than one of these is none at all."""


@dataclass(frozen=True)
class LoopSettings:
    """When a loop is believed, and how it is closed; every field has its own unit, beside it."""

    close: bool = assume(True, "", "look for loops after each keyframe, and close them")
    consistent: int = assume(3, "keyframes", "in a row that propose one place; ORB-SLAM's")
    apart: int = assume(10, "keyframes", "after a loop before the next one; ORB-SLAM's")
    ratio: float = assume(0.75, "", "of the best to the second distance; ORB-SLAM's")
    bits: int = assume(50, "bits", "largest Hamming distance where the place is not known; ORB-SLAM's")
    guided_bits: int = assume(100, "bits", "largest where it is; ORB-SLAM's")
    least_matches: int = assume(
        20, "points", "of both keyframes before a similarity is looked for; ORB-SLAM's"
    )
    draws: int = assume(300, "samples", "of three points; ORB-SLAM's")
    guided_radius: float = assume(7.5, "px of the octave", "around the place of a point; ORB-SLAM's")
    least_inliers: int = assume(20, "points", "that agree on the similarity; ORB-SLAM's")
    wide_radius: float = assume(10.0, "px of the octave", "around the points of the whole place; ORB-SLAM's")
    least_points: int = assume(40, "points", "of the whole place found again; ORB-SLAM's")
    turn: float = assume(
        30.0, "degrees", "that drift may have turned the path; more: a look-alike; not in ORB-SLAM"
    )
    group: int = assume(
        15, "points", "shared by neighbours, which are no candidates, and move as one; ORB-SLAM's"
    )
    fuse_radius: float = assume(4.0, "px of the octave", "where points of both visits become one; ORB-SLAM's")
    theta_min: int = assume(100, "points", "shared by the pairs of the essential graph; ORB-SLAM's")
    steps: int = assume(20, "", "of the pose graph; ORB-SLAM's")
    last_steps: int = assume(20, "", "of the adjustment of everything afterwards; 0 leaves it out")

    def __post_init__(self) -> None:
        """Refuse numbers that mean nothing."""
        refuse_small(self, COUNTS)
        if self.ratio > 1:
            raise ValueError(f"ratio={self.ratio:g}: need a share up to 1")
