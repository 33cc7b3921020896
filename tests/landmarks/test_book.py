"""The fast modules give the numbers of the book: full matrices and loops, no code shared.

Tolerances: both invert matrices of at most 11 x 11 with condition numbers of at most 1e5; times eps, that is
1e-11 of numbers up to 10, and 1e-9 is asked.
"""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry import so2
from vslam_ref.grids import Lattice, LogOddsGrid
from vslam_ref.grids.landmarks import (
    CornerConfig,
    MatchConfig,
    ScanCorners,
    book,
    distance_field,
    map_corners,
    match_scan,
    scan_corners,
    static_along_arms,
)
from vslam_ref.grids.landmarks.landmark_map import Landmark
from vslam_ref.grids.landmarks.lines import straight_runs
from vslam_ref.grids.landmarks.pose_update import pose_measurement, pose_update
from vslam_ref.systems.grid_slam import GridSlam

CLOSE = {"rtol": 1e-9, "atol": 1e-9}


def l_shaped_scan(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Angles and noisy ranges of two walls that meet 2 to 4 m ahead, under 60 to 120 degrees."""
    beams, turn = np.deg2rad(np.arange(-40.0, 41.0)), rng.uniform(-0.3, 0.3)
    half, depth = rng.uniform(0.55, 1.0), rng.uniform(2.0, 4.0)
    exact = depth * np.sin(half) / np.sin(half + np.abs(beams - turn))
    return beams, exact + rng.normal(0.0, 0.01, len(beams))


@pytest.mark.parametrize("seed", range(10))
def test_corners_of_a_scan_are_the_books(seed: int) -> None:
    angles, ranges = l_shaped_scan(np.random.default_rng(seed))
    c = CornerConfig(bend=0.08)
    found = scan_corners(angles, ranges, c)
    points = ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    runs = [
        points[a + 1 : b - 1] for a, b in straight_runs(points, c)
    ]  # the point at a bend belongs to neither
    assert len(found) == 1
    assert len(runs) == 2
    expected = book.corner((runs[0], runs[1]), c.sigma, c.floor)
    np.testing.assert_allclose(found.xy[0], expected.xy, **CLOSE)
    np.testing.assert_allclose(found.cov[0], expected.cov, rtol=1e-9, atol=1e-15)


def rooms(seed: int) -> LogOddsGrid:
    """Walls around a room with a corner that juts in, unsure here and there; free floor, unknown outside."""
    rng = np.random.default_rng(seed)
    L = np.zeros((40, 44))
    L[8:31, 9:35] = -4.0
    for wall in (np.s_[8, 9:35], np.s_[30, 9:35], np.s_[8:31, 9], np.s_[8:31, 34]):
        L[wall] = rng.uniform(3.0, 6.0, L[wall].shape)
    row, column = rng.integers(14, 24), rng.integers(16, 27)
    L[8:row, column], L[row, column:35] = 5.0, 5.0
    return LogOddsGrid(Lattice(0.1, (0, 0), L.shape), L)


@pytest.mark.parametrize("seed", range(2))
def test_corners_of_s_are_the_books(seed: int) -> None:
    grid = rooms(seed)
    found = map_corners(grid)
    assert len(found.xy) >= 4
    for xy, strength in zip(found.xy[:3], found.strength[:3], strict=True):
        places = []
        column, row = np.floor(xy / 0.1).astype(int)
        for i in range(row - 2, row + 3):  # the peak lies within some cells of the point that it stands for
            for j in range(column - 2, column + 3):
                places.append(book.corner_of_map(grid.probability, i, j))
        at, best = max(places, key=lambda place: place[1])
        assert best == pytest.approx(strength, rel=1e-9)
        np.testing.assert_allclose(xy, 0.1 * (at + 0.5), **CLOSE)


@pytest.mark.parametrize("seed", range(10))
def test_a_corner_is_static_where_the_book_says_so(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = rooms(seed)
    xy, arms = rng.uniform(1.2, 3.0, (20, 2)), rng.uniform(-np.pi, np.pi, (20, 2))
    xy[:4] = np.array([[0.95, 0.85], [3.45, 0.85], [3.45, 3.05], [0.95, 3.05]]) + rng.normal(0, 0.02, (4, 2))
    arms[:4] = np.deg2rad([[0, 90], [90, 180], [180, 270], [270, 0]])
    expected = [
        min(book.static_share(grid.probability, 0.1, p, arm) for arm in pair)
        for p, pair in zip(xy, arms, strict=True)
    ]
    found = static_along_arms(grid, xy, arms)
    assert found.tolist() == pytest.approx(expected)
    assert found.min() < 0.5 < found.max()


def state(seed: int) -> tuple[GridSlam, np.ndarray, np.ndarray, list[book.Corner]]:
    """A loop whose filter holds a pose and four landmarks, all of it correlated; the same as x and P."""
    rng = np.random.default_rng(seed)
    slam = GridSlam(rng.uniform([-1, -1, -3], [1, 1, 3]), start_sigma=(0.3, 0.1))
    z = np.array([[2.0, 0.5], [2.3, 0.9], [1.0, -1.5], [-1.0, 1.0]]) + rng.normal(0, 0.1, (4, 2))
    slam.filter.update(np.arange(4), z[None], 0.02**2 * np.eye(2))
    slam.filter.update(np.arange(3), z[None, :3] + rng.normal(0, 0.02, (1, 3, 2)), 0.05**2 * np.eye(2))
    marks = []
    for k in range(4):
        bisector, opening, convex = float(so2.wrap(slam.T_world_robot[2] + 0.3)), 1.6, k < 3
        slam.landmarks.landmarks.append(Landmark(k, bisector, opening, convex, np.zeros(2), born=0))
        marks.append(book.Corner(np.zeros(2), np.zeros((2, 2)), bisector, opening, convex))
    x, P = (a[0].copy() for a in slam.filter.blocks.full())
    return slam, x, P, marks


def shown(x: np.ndarray, rng: np.random.Generator) -> tuple[ScanCorners, list[book.Corner]]:
    """Six corners near landmarks, some far off or of another kind."""
    corners = []
    for k in (0, 1, 1, 2, 3, 3):
        h, _ = book.observe(x, k)
        spread = rng.choice([0.02, 0.1, 0.5])
        corner = h + rng.normal(0, spread, 2)
        kind = bool(k < 3) if rng.random() < 0.8 else bool(k >= 3)
        corners.append(book.Corner(corner, np.diag(rng.uniform(1e-4, 1e-3, 2)), 0.3, 1.6, kind))
    arrays = (np.array([getattr(z, name) for z in corners]) for name in book.Corner._fields)
    return ScanCorners(*arrays, np.zeros((6, 2))), corners


def localised(seed: int) -> tuple[list[int], list[int], float]:
    """Associations of the loop and of the book, and how far their states and covariances are apart."""
    slam, x, P, marks = state(seed)
    corners, of_the_book = shown(x, np.random.default_rng(100 + seed))
    which = book.associate(x, P, of_the_book, marks)
    x, P = book.localise(x, P, of_the_book, which)
    found = slam._use(corners).tolist()
    x_found, P_found = (a[0] for a in slam.filter.blocks.full())
    return found, which, float(max(np.abs(x_found - x).max(), np.abs(P_found - P).max()))


def test_association_and_update_are_the_books() -> None:
    seen = set()
    for seed in range(30):
        found, which, off = localised(seed)
        assert found == which
        assert off < 1e-9
        seen |= set(found)
    assert seen == {book.NONE, book.AMBIGUOUS, 0, 1, 2, 3}


@pytest.mark.parametrize("part", ["heading", "landmark", "innovation"])
def test_a_flipped_sign_in_the_book_shows(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison has teeth: turned Jacobians, or predicted - measured, give other states."""
    observe, update = book.observe, book.update

    def turned(x: np.ndarray, j: int) -> tuple[np.ndarray, np.ndarray]:
        h, H = observe(x, j)
        H[:, 2 if part == "heading" else slice(3, None)] *= -1
        return h, H

    if part == "innovation":
        monkeypatch.setattr(book, "update", lambda x, P, H, v, cov: update(x, P, H, -v, cov))
    else:
        monkeypatch.setattr(book, "observe", turned)
    found, which, off = localised(3)
    assert found != which or off > 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_a_match_and_what_the_filter_makes_of_it_are_the_books(seed: int) -> None:
    """From the prediction, without the search of a box: the same steps of Gauss and Newton."""
    rng = np.random.default_rng(seed)
    grid = rooms(seed)
    slam, x, P, _ = state(seed)
    points = np.array(
        [[1.1, -0.5], [1.15, 0.3], [1.12, 0.8], [0.4, 1.02], [-0.3, 1.0], [-0.9, 1.05], [0.8, 1.0]]
    )
    points = np.concatenate([points, points + rng.normal(0, 0.02, points.shape)])
    predicted = np.array([2.3, 2.03, 0.0]) + rng.normal(0, 0.01, 3)
    cov = np.diag([0.05, 0.05, 0.03]) ** 2
    config = MatchConfig(steps=0, least_points=3)
    found = match_scan(distance_field(grid), points, predicted, cov, config)
    floor = book.Floor(grid.probability > 0.9, 0.1, 0.5)
    p, A = book.match(predicted, cov, points, floor, config.sigma, config.cut)
    assert found.reason == "converged"
    assert found.iterations > 1
    np.testing.assert_allclose(found.T_world_laser, p, **CLOSE)
    np.testing.assert_allclose(found.information, A, **CLOSE)

    x[:3] += rng.normal(0, 0.01, 3) - x[:3] + predicted  # the filter stands where the prediction does
    slam.filter.blocks.x_p[0] = x[:3]
    x_book, P_book = book.use_match(x, P, p, A)
    pose_update(slam.filter.blocks, *pose_measurement(p, A, x[:3], P[:3, :3]))
    x_found, P_found = (a[0] for a in slam.filter.blocks.full())
    np.testing.assert_allclose(x_found, x_book, **CLOSE)
    np.testing.assert_allclose(P_found, P_book, **CLOSE)
    wrong, _ = book.use_match(x, P, 2 * x[:3] - p, A)
    assert np.abs(wrong - x_found).max() > 1e-3, "a match turned about the prediction is another one"
