"""Choosing and withdrawing, without a filter: corners handed in by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.grids import LogOddsGrid, Scan
from vslam_ref.grids.landmarks import LandmarkConfig, LandmarkMap, ScanCorners

POSE = np.array([0.0, 0.0, 0.0])
L_SHAPE = [(20, c) for c in range(20, 50)] + [(r, 20) for r in range(20, 50)]


def corners_at(*places: tuple[float, float], convex: bool = True) -> ScanCorners:
    """Corners with arms to the right and upwards, as the L's."""
    n = len(places)
    return ScanCorners(
        np.array(places), np.tile(1e-4 * np.eye(2), (n, 1, 1)), np.full(n, np.pi / 4), np.full(n, np.pi / 2),
        np.full(n, convex), np.tile([np.pi / 2, 0.0], (n, 1)),
    )  # fmt: skip


def show(
    marks: LandmarkMap,
    grid: LogOddsGrid,
    corners: ScanCorners,
    places: np.ndarray,
    times: int,
    first: int = 0,
) -> int:
    """Show the same corners in some scans; how many landmarks came of it."""
    before = len(marks.landmarks)
    for scan in range(first, first + times):
        have = np.concatenate([places, np.zeros((len(marks.active) - len(places), 2))])
        marks.choose(scan, POSE, corners, np.ones(len(corners), dtype=bool), have, grid)
    return len(marks.landmarks) - before


def test_a_corner_of_s_seen_five_times_becomes_a_landmark(make_grid: Callable[..., LogOddsGrid]) -> None:
    grid, none = make_grid(L_SHAPE), np.zeros((0, 2))
    assert show(LandmarkMap(), grid, corners_at((2.06, 2.04)), none, 4) == 0
    assert show(LandmarkMap(), grid, corners_at((2.06, 2.04)), none, 5) == 1


def test_only_static_corners_are_chosen(make_grid: Callable[..., LogOddsGrid]) -> None:
    none = np.zeros((0, 2))
    free = make_grid([])
    assert show(LandmarkMap(), free, corners_at((2.05, 2.05)), none, 9) == 0
    one_arm = make_grid(L_SHAPE[:30])
    assert show(LandmarkMap(), one_arm, corners_at((2.05, 2.05)), none, 9) == 0
    undecided = make_grid(L_SHAPE, value=1.0)
    assert show(LandmarkMap(), undecided, corners_at((2.05, 2.05)), none, 9) == 0
    anywhere = LandmarkMap(LandmarkConfig(static_only=False))
    assert show(anywhere, free, corners_at((2.05, 2.05)), none, 5) == 1


def test_no_second_look_alike_is_set_near_a_landmark(make_grid: Callable[..., LogOddsGrid]) -> None:
    """0.5 m beside one that looks the same: none; 0.7 m away, or of the other kind: yes."""
    free, config = make_grid([]), LandmarkConfig(static_only=False)
    for place, convex, expected in (((2.5, 2.0), True, 0), ((2.7, 2.0), True, 1), ((2.5, 2.0), False, 1)):
        marks = LandmarkMap(config)
        assert show(marks, free, corners_at((2.0, 2.0)), np.zeros((0, 2)), 5) == 1
        second = corners_at(place, convex=convex)
        assert show(marks, free, second, np.array([[2.0, 2.0]]), 5, first=10) == expected


def test_what_is_not_seen_again_is_forgotten(make_grid: Callable[..., LogOddsGrid]) -> None:
    marks, free = LandmarkMap(LandmarkConfig(static_only=False)), make_grid([])
    assert show(marks, free, corners_at((2.0, 2.0)), np.zeros((0, 2)), 4) == 0
    assert show(marks, free, corners_at((2.0, 2.0)), np.zeros((0, 2)), 4, first=20) == 0, (
        "the count began anew"
    )


BEAMS = np.deg2rad(np.arange(-20.0, 110.0, 0.5))


@pytest.mark.parametrize(
    ("static_only", "held", "needed"),
    [
        (True, True, 3),  # S still holds it: three scans in a row
        (True, False, 1),  # S does not, either: one scan through it is enough
        (False, False, 3),  # S is not asked
    ],
)
def test_when_a_landmark_is_withdrawn(
    make_grid: Callable[..., LogOddsGrid], static_only: bool, held: bool, needed: int
) -> None:
    place, grid, free = np.array([[2.05, 2.05]]), make_grid(L_SHAPE), make_grid([])
    marks = LandmarkMap(LandmarkConfig(static_only=static_only))
    show(marks, grid, corners_at((2.05, 2.05)), np.zeros((0, 2)), 5)
    assert len(marks.active) == 1
    far, near = np.full(len(BEAMS), 9.0), np.full(len(BEAMS), 1.0)
    now = grid if held else free
    assert marks.check(5, POSE, place, Scan(BEAMS, near, 10.0, 0.0), now) == [], (
        "somebody in front is no evidence"
    )
    for k in range(needed):
        assert len(marks.active) == 1
        gone = marks.check(6 + k, POSE, place, Scan(BEAMS, far, 10.0, 0.0), now)
    assert [m.id for m in gone] == [0]
    assert gone[0].withdrawn == 5 + needed
    assert gone[0].why == ("seen through" if needed == 3 else "no longer static in S")
    assert marks.active == []


def test_a_reading_in_front_starts_the_count_anew(make_grid: Callable[..., LogOddsGrid]) -> None:
    place, grid = np.array([[2.05, 2.05]]), make_grid(L_SHAPE)
    marks = LandmarkMap()
    show(marks, grid, corners_at((2.05, 2.05)), np.zeros((0, 2)), 5)
    for k, r in enumerate((9.0, 9.0, 1.0, 9.0, 9.0)):
        assert marks.check(6 + k, POSE, place, Scan(BEAMS, np.full(len(BEAMS), r), 10.0, 0.0), grid) == []
