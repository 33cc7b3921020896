"""Every equation, figure, table and named system of the two seed documents, in their order.

A is the report on visual SLAM, B the paper on IEKF-SLAM. ``items`` are the names under which code may
cite a part of the row; ``chapter`` is the chapter that explains it; ``erratum`` marks a slip in print.
"""

from __future__ import annotations

from typing import NamedTuple


class Row(NamedTuple):
    """One row of the equation index."""

    items: tuple[str, ...]
    about: str
    chapter: int
    erratum: bool = False


def _numbered(prefix: str, first: int, last: int) -> tuple[str, ...]:
    return tuple(f"{prefix}{number}" for number in range(first, last + 1))


ROWS = (
    Row(("A1.1",), "world point in a camera's frame", 2),
    Row(("A1.2", "A1.3"), "pinhole projection", 3),
    Row(("A1.4",), "bundle adjustment's objective", 6, erratum=True),
    Row(("A fig 1.1",), "several views of one scene", 1),
    Row(("A§1.3.2",), "three families of methods: filter, keyframes, direct", 23, erratum=True),
    Row(("A§1.3.3",), "five claims that compare the families", 23),
    Row(("A2.1",), "point in the keyframe's frame", 2, erratum=True),
    Row(("A2.2", "A2.3", "A2.4"), "the FOV (arctangent) camera", 3),
    Row(("A2.5",), "motion by the exponential map", 2, erratum=True),
    Row(("A fig 2.1",), "scale space, FAST-10, patch search", 8),
    Row(("A2.6", "A2.7"), "pose from matches, robustly", 10),
    Row(("A2.8",), "Tukey's function", 4, erratum=True),
    Row(("A§2.2.1",), "two passes, 50 then 1000 points; a frame that is rejected", 10),
    Row(("A§2.2.2",), "the map's start from two frames", 9, erratum=True),
    Row(("A§2.2.2.1",), "keyframes and new points", 11),
    Row(("A2.9",), "global and local bundle adjustment", 6, erratum=True),
    Row(("A fig 2.2",), "PTAM's two pipelines", 12),
    Row(("A fig 2.3",), "a plane found, a model drawn on it", 18),
    Row(("A§2.3",), "frame rate of PTAM", 12),
    Row(("A§3.1",), "ORB, vocabulary, covisibility and loop closing", 14),
    Row(("A fig 3.1",), "ORB-SLAM's three pipelines and its graphs", 14, erratum=True),
    Row(("A§3",), "furniture placed in a room", 18),
    Row(("A§4.1",), "occupancy by static and by moving things", 19, erratum=True),
    Row(("A§4.2",), "recursion of the static map", 19, erratum=True),
    Row(("A§4.3",), "recursion of the dynamic map", 19, erratum=True),
    Row(("A§4.4",), "landmark map and localisation in it", 20),
    Row(_numbered("B", 1, 4), "state, map, pose, the rear-axle car", 15),
    Row(_numbered("B", 5, 9), "lifted pose and its transition", 16, erratum=True),
    Row(("B10", "B11"), "covariance of the lifted pose and the controls' noise", 16, erratum=True),
    Row(_numbered("B", 12, 15), "second-order Carleman lift", 16),
    Row(("B16", "B17"), "prediction of the lifted vehicle", 16, erratum=True),
    Row(("B18", "B19"), "prediction of a lifted feature", 16, erratum=True),
    Row(("B20", "B21"), "observation of a landmark", 15, erratum=True),
    Row(("B22",), "observation, linear in the lifted state", 16, erratum=True),
    Row(("B23", "B24", "B25"), "a new landmark", 15),
    Row(("B26",), "a new landmark, lifted", 16, erratum=True),
    Row(("B27", "B28"), "covariance after a new landmark", 16),
    Row(("B§3", "B fig 1"), "AR by mapping and tracking in parallel", 18),
    Row(("B fig 2",), "NEES of the EKF", 17, erratum=True),
    Row(("B fig 3",), "NEES of the IEKF", 17, erratum=True),
    Row(("B fig 4",), "mean error of both", 17, erratum=True),
    Row(("B29",), "registration error", 18, erratum=True),
    Row(("B fig 5", "B fig 6"), "the Hall: registration error over time", 18),
    Row(("B table 1",), "time per frame, stage by stage", 18),
    Row(("B§1",), "filters said to leave inconsistency unsolved: PF, UKF, AEKF", 17),
)
