"""The likelihood field, the match, and what it tells a filter that holds landmarks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from vslam_ref.filters.block_covariance import Blocks
from vslam_ref.geometry import se2, so2
from vslam_ref.grids import Lattice, LogOddsGrid
from vslam_ref.grids.landmarks import DistanceField, MatchConfig, distance_field, match_scan, sample, thin
from vslam_ref.grids.landmarks.pose_update import pose_measurement, pose_update
from vslam_ref.worlds.floor_plan import cast

EPS = float(np.finfo(float).eps)
BEAMS = np.deg2rad(np.arange(-135.0, 135.0, 1.0))


def test_distances_are_those_to_the_nearest_static_cell(make_grid: Callable[..., LogOddsGrid]) -> None:
    rng = np.random.default_rng(1)
    cells = [tuple(c) for c in rng.integers(0, 64, (40, 2)).tolist()]
    field = distance_field(make_grid(cells), most=1.5)
    middles = 0.1 * (np.array(cells)[:, ::-1] + 0.5)
    for row, column in rng.integers(0, 64, (50, 2)):
        here = 0.1 * (np.array([column, row]) + 0.5)
        expected = min(np.hypot(*(middles - here).T).min(), 1.5)
        assert field.distance[row, column] == pytest.approx(expected, abs=1e-12)


def test_samples_are_the_bilinear_interpolation() -> None:
    """SciPy's spline of order 1; a few eps, as both are sums of four products."""
    rng = np.random.default_rng(2)
    field = DistanceField((-1.0, 2.0), 0.2, rng.uniform(0, 1, (17, 23)), 1.0)
    points = rng.uniform([-0.9, 2.1], [3.4, 5.2], (200, 2))
    at = (points - field.origin_xy) / 0.2 - 0.5
    np.testing.assert_allclose(
        sample(points, field), map_coordinates(field.distance, at[:, ::-1].T, order=1), atol=16 * EPS * 20
    )
    assert sample([[-9.0, 0.0], [3.6, 3.0]], field).tolist() == [1.0, 1.0], "outside nothing is near"


def test_a_map_without_anything_static_is_far_from_everything(make_grid: Callable[..., LogOddsGrid]) -> None:
    assert (distance_field(make_grid([]), 0.7).distance == 0.7).all()
    with pytest.raises(ValueError, match="most"):
        distance_field(make_grid([]), 0.0)


def room(make_grid: Callable[..., LogOddsGrid], open_ends: bool = False) -> tuple[DistanceField, np.ndarray]:
    """A room of 5 m by 3 m, walls on middle lines; or two long walls only.  Field and segments."""
    walls = [(10, c) for c in range(5, 56)] + [(40, c) for c in range(5, 56)]
    segments = [[0.55, 1.05, 5.55, 1.05], [0.55, 4.05, 5.55, 4.05]]
    if not open_ends:
        walls += [(r, c) for r in range(10, 41) for c in (5, 55)]
        segments += [[0.55, 1.05, 0.55, 4.05], [5.55, 1.05, 5.55, 4.05]]
    return distance_field(make_grid(walls)), np.array(segments)


def points_from(pose: np.ndarray, segments: np.ndarray) -> np.ndarray:
    r = cast(pose[:2], pose[2] + BEAMS, segments, []).range
    near = np.isfinite(r)
    return r[near, None] * np.stack([np.cos(BEAMS[near]), np.sin(BEAMS[near])], 1)


COV = np.diag([0.1, 0.1, 0.05]) ** 2


@pytest.mark.parametrize("off", [[0.12, -0.09, 0.05], [-0.18, 0.15, -0.09], [0.0, 0.0, 0.0]])
def test_a_match_finds_the_pose(make_grid: Callable[..., LogOddsGrid], off: list[float]) -> None:
    """Walls on the cells' middle lines: the field is exact there, the optimum the truth but for the prior."""
    field, segments = room(make_grid)
    pose = np.array([2.31, 2.47, 0.7])
    found = match_scan(field, thin(points_from(pose, segments), 0.1), pose + off, COV)
    assert found.reason == "converged"
    assert found.inliers > 50
    # the prior pulls by a share of the offset, and thinned means lie a little inside of corners
    np.testing.assert_allclose(found.T_world_laser[:2], pose[:2], atol=0.005)
    assert abs(so2.wrap(found.T_world_laser[2] - pose[2])) < 0.003


def test_a_third_of_the_beams_on_people_does_not_matter(make_grid: Callable[..., LogOddsGrid]) -> None:
    field, segments = room(make_grid)
    rng, pose = np.random.default_rng(5), np.array([2.31, 2.47, 0.7])
    points = points_from(pose, segments)
    bad = rng.uniform(size=len(points)) < 0.33
    points[bad] *= rng.uniform(0.2, 0.8, bad.sum())[:, None]
    found = match_scan(field, thin(points, 0.1), pose + [0.08, -0.05, 0.03], COV)
    np.testing.assert_allclose(found.T_world_laser[:2], pose[:2], atol=0.01)


def test_people_beside_a_wall_pull_only_without_the_cut(make_grid: Callable[..., LogOddsGrid]) -> None:
    """Half of the points of one wall lie 0.2 m before it, as of people who lean there.

    With a cut at a cell they count for nothing: the pose is right to 1 cm.  Without one the wall's points are
    0.1 m off in the mean, and least squares move the robot by some of that.
    """
    field, segments = room(make_grid)
    pose = np.array([2.31, 2.47, 0.0])
    points = points_from(pose, segments)
    at_wall = np.flatnonzero(points[:, 1] > 1.5)  # the wall y = 4.05
    points[at_wall[::2], 1] -= 0.2
    kept = match_scan(field, points, pose, COV)
    assert abs(kept.T_world_laser[1] - pose[1]) < 0.01
    plain = match_scan(field, points, pose, COV, MatchConfig(cut=np.inf, search_cut=np.inf))
    assert plain.reason == "converged"
    assert plain.T_world_laser[1] - pose[1] > 0.03


def test_a_narrow_search_loses_what_a_wide_one_finds(make_grid: Callable[..., LogOddsGrid]) -> None:
    """From 0.2 m and 0.1 rad off, between the box's poses: a cut of 2 cm feels no wall there."""
    field, segments = room(make_grid)
    pose, rng = np.array([2.31, 2.47, 0.7]), np.random.default_rng(3)
    points = thin(points_from(pose, segments), 0.1)
    lost = {0.3: 0, 0.02: 0}
    for off in rng.uniform(-1, 1, (20, 3)) * [0.2, 0.2, 0.1]:
        for cut in lost:
            found = match_scan(field, points, pose + off, COV, MatchConfig(search_cut=cut))
            lost[cut] += bool(np.abs(found.T_world_laser[:2] - pose[:2]).max() > 0.02)
    assert lost[0.3] == 0
    assert lost[0.02] >= 3


def test_a_corridor_tells_nothing_of_the_way_along_it(make_grid: Callable[..., LogOddsGrid]) -> None:
    """Two long walls: information across and in heading; along, none, and the prediction stays."""
    field, segments = room(make_grid, open_ends=True)
    pose = np.array([3.03, 2.47, 0.0])
    points = points_from(pose, segments)
    # ends of the walls would fix the way along: keep what lies well inside of them
    points = points[np.abs(points[:, 0]) < 1.5]
    found = match_scan(field, points, pose + [0.1, 0.06, 0.03], COV)
    H, _, _ = pose_measurement(found.T_world_laser, found.information, pose + [0.1, 0.06, 0.03], COV)
    assert found.information[0, 0] < 1e-6 * found.information[1, 1]
    assert len(H) == 2, "two known directions of three"
    assert found.T_world_laser[0] == pytest.approx(pose[0] + 0.1, abs=1e-3)
    assert found.T_world_laser[1] == pytest.approx(pose[1], abs=0.005)


def test_without_a_map_nothing_moves(make_grid: Callable[..., LogOddsGrid]) -> None:
    field = distance_field(make_grid([]))
    found = match_scan(field, np.ones((50, 2)), [1.0, 2.0, 3.0], COV)
    assert found.reason == "too few points on the map"
    np.testing.assert_array_equal(found.T_world_laser, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found.information, 0.0)
    assert match_scan(field, np.zeros((0, 2)), [1.0, 2.0, 3.0], COV).reason == "too few points on the map"


def test_predictions_that_mean_nothing_are_refused(make_grid: Callable[..., LogOddsGrid]) -> None:
    field = distance_field(make_grid([]))
    with pytest.raises(ValueError, match="prediction"):
        match_scan(field, np.ones((5, 2)), [np.nan, 0, 0], COV)
    with pytest.raises(ValueError, match="sigma > 0"):
        MatchConfig(sigma=0.0)
    for name in ("cut", "search_cut"):
        with pytest.raises(ValueError, match=name):
            MatchConfig(**{name: 0.0})


def filter_with_landmarks(rng: np.random.Generator) -> Blocks:
    """One run, two landmarks, a random positive definite covariance."""
    A = rng.standard_normal((7, 7))
    P, x = A @ A.T / 50 + 1e-3 * np.eye(7), rng.standard_normal(7)
    b = Blocks(x[None, :3], P[None, :3, :3], landmark_states=2, capacity=2)
    b.append(np.array([4, 9]), x[None, 3:], np.zeros((1, 4, 3)), np.zeros((1, 2, 2, 2)))
    b.P_pm[:], b.P_mm[:] = P[:3, 3:], P[3:, 3:]
    return b


@pytest.mark.parametrize("rank", [3, 2])
def test_the_update_is_the_information_filter_s(rank: int) -> None:
    """Gaussians: P+^-1 = P^-1 + E^T A E, and the mean minimises the sum; landmarks move along.

    Inverses of 7 x 7 matrices: the tolerance is 1000 eps times their condition.
    """
    rng = np.random.default_rng(8)
    b = filter_with_landmarks(rng)
    x, P = (a[0] for a in b.full())
    J = rng.standard_normal((rank, 3))
    A, best = J.T @ J * 40, x[:3] + [0.03, -0.02, 0.01]
    E = np.eye(3, 7)
    P_new = np.linalg.inv(np.linalg.inv(P) + E.T @ A @ E)
    x_new = x + P_new @ E.T @ A @ (best - x[:3])
    # the match hands over its most probable pose, prediction included
    posterior = np.linalg.solve(np.linalg.inv(P[:3, :3]) + A, np.linalg.solve(P[:3, :3], x[:3]) + A @ best)
    pose_update(b, *pose_measurement(posterior, A, x[:3], P[:3, :3]))
    tolerance = 1000 * EPS * np.linalg.cond(P)
    found_x, found_P = (a[0] for a in b.full())
    np.testing.assert_allclose(found_x, x_new, atol=tolerance)
    np.testing.assert_allclose(found_P, P_new, atol=tolerance)
    np.testing.assert_allclose(found_x[:3], posterior, atol=tolerance)


def test_a_match_that_knows_nothing_changes_nothing() -> None:
    b = filter_with_landmarks(np.random.default_rng(9))
    before = [a.copy() for a in b.full()]
    pose_update(b, *pose_measurement(b.x_p[0].copy(), np.zeros((3, 3)), b.x_p[0].copy(), b.P_pp[0].copy()))
    for a, c in zip(before, b.full(), strict=True):
        np.testing.assert_array_equal(a, c)


def test_thinning_keeps_one_point_a_cell() -> None:
    rng = np.random.default_rng(10)
    p = rng.uniform(-2, 2, (500, 2))
    t = thin(p, 0.5)
    assert len(t) == len({tuple(c) for c in np.floor(p / 0.5).astype(int).tolist()})
    np.testing.assert_allclose(np.sort(np.floor(t / 0.5), axis=0)[[0, -1]], [[-4, -4], [3, 3]])
    lattice = Lattice(0.5).grown([-2, -2], [2, 2])
    assert lattice.inside(lattice.cells_from_world(t)).all()
    assert se2.act([0, 0, 0], t).shape == t.shape


def test_a_match_is_the_minimum_of_its_objective(make_grid: Callable[..., LogOddsGrid]) -> None:
    """SciPy's simplex from the match finds nothing lower; a strong prior far off draws the match to itself.

    Distances have kinks, so that neither is exact: 1 mm and 1 mrad.
    """
    from scipy.optimize import minimize

    from vslam_ref.grids.landmarks.matching import Objective

    field, segments = room(make_grid)
    pose = np.array([2.31, 2.47, 0.7])
    points = thin(points_from(pose, segments), 0.1)
    pulled = []
    for sigma in (0.1, 0.01, 0.003):
        cov = np.diag([sigma, sigma, sigma / 2]) ** 2
        predicted = pose + [0.06, 0.0, 0.0]
        found = match_scan(field, points, predicted, cov)
        o = Objective(field, points, predicted, np.linalg.inv(cov), MatchConfig().sigma, MatchConfig().cut)
        least = minimize(lambda p, o=o: float(o.cost(p)[0]), found.T_world_laser, method="Nelder-Mead")
        np.testing.assert_allclose(found.T_world_laser, least.x, atol=1e-3)
        pulled.append(found.T_world_laser[0] - pose[0])
    assert pulled[0] < 0.005
    assert pulled[0] < pulled[1] < pulled[2]
    assert pulled[2] > 0.02, "a prediction that is sure of itself must count"
