"""Corners of scans and of maps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vslam_ref.geometry import se2, so2
from vslam_ref.grids import LogOddsGrid
from vslam_ref.grids.landmarks import CornerConfig, cross, map_corners, scan_corners, static_along_arms
from vslam_ref.grids.landmarks.lines import fit_lines
from vslam_ref.worlds.floor_plan import cast

EPS = float(np.finfo(float).eps)
BEAMS = np.deg2rad(np.arange(-135.0, 135.25, 0.5))
ROOM = np.array([[0.0, 0.0, 5.0, 0.0], [5.0, 0.0, 5.0, 4.0], [5.0, 4.0, 0.0, 4.0], [0.0, 4.0, 0.0, 0.0]])
CUPBOARD = np.array([[3.0, 2.5, 3.5, 2.5], [3.5, 2.5, 3.5, 3.0], [3.5, 3.0, 3.0, 3.0], [3.0, 3.0, 3.0, 2.5]])
POSE = np.array([1.2, 1.1, 0.4])


def scan(discs: object = ()) -> np.ndarray:
    return cast(POSE[:2], POSE[2] + BEAMS, np.concatenate([ROOM, CUPBOARD]), discs).range


@given(st.integers(0, 2**32 - 1))
def test_the_crossing_solves_both_lines(seed: int) -> None:
    """numpy's solver on the two normal equations; the error is that of the solver, eps x condition x size."""
    rng = np.random.default_rng(seed)
    centre, angle, offset = rng.uniform(-3, 3, (2, 2)), rng.uniform(-np.pi, np.pi, 2), rng.uniform(-1, 1, 2)
    n = np.stack([-np.sin(angle), np.cos(angle)], 1)
    expected = np.linalg.solve(n, (n * centre).sum(1) + offset)
    bound = 32 * EPS * np.linalg.cond(n) ** 2 * (1 + np.abs(expected).max() + 8)
    np.testing.assert_allclose(cross(centre, angle, offset), expected, rtol=0, atol=bound)


def test_a_line_fit_has_the_declared_variances() -> None:
    """Noise along the normal: offset and angle are unbiased, uncorrelated, with the declared variances.

    4000 draws: a variance is known to sqrt(2/4000) = 2.2 %, four of these allowed.
    """
    rng = np.random.default_rng(1)
    s, sigma, phi = np.linspace(-0.4, 0.7, 23), 0.01, 0.8
    t, n = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    found = []
    for _ in range(4000):
        points = s[:, None] * t + sigma * rng.standard_normal(23)[:, None] * n
        line = fit_lines(points, np.arange(23), [(0, 23)], sigma)
        found.append([line.centre[0] @ n, so2.wrap(line.angle[0] - phi)])
    z = np.array(found) / np.sqrt([line.var_offset[0], line.var_angle[0]])
    assert np.abs(z.mean(axis=0)).max() < 4 / np.sqrt(4000)
    np.testing.assert_allclose((z**2).mean(axis=0), 1.0, atol=4 * np.sqrt(2 / 4000))
    assert abs((z[:, 0] * z[:, 1]).mean()) < 4 / np.sqrt(4000)
    np.testing.assert_allclose(line.var_angle[0], sigma**2 / ((s - s.mean()) ** 2).sum(), rtol=0.01)


def test_an_exact_scan_gives_the_room_s_corners() -> None:
    """Without noise the corners are the room's to rounding, of the right kind, looking the right way."""
    found = scan_corners(BEAMS, scan())
    world = se2.act(POSE, found.xy)
    bisector = so2.wrap(POSE[2] + found.bisector)
    expected = {  # corner: (convex, bisector)
        (5.0, 0.0): (False, 3 * np.pi / 4), (0.0, 4.0): (False, -np.pi / 4), (3.0, 2.5): (True, np.pi / 4),
    }  # fmt: skip
    seen = {tuple(np.round(w, 6).tolist()): i for i, w in enumerate(world)}
    assert set(expected) <= set(seen) | {(0.0, -0.0)}
    for place, (convex, direction) in expected.items():
        i = seen[place]
        assert found.convex[i] == convex
        assert abs(so2.wrap(bisector[i] - direction)) < 1e-9
        assert found.opening[i] == pytest.approx(np.pi / 2, abs=1e-9)
        np.testing.assert_allclose(
            np.sort(np.abs(so2.wrap(found.arms[i] - found.bisector[i]))), np.pi / 4, atol=1e-9
        )


def test_corners_have_the_declared_covariance() -> None:
    """Squared Mahalanobis errors over 400 noisy scans: their mean is 2, chi^2 with 2 x 400 degrees.

    Without the floor; the room's walls are straight.  Noise along the beam is sin(incidence) as large
    across the wall, so that the declared sigma is an upper bound: the mean may fall to half of 2, not rise
    above the band.
    """
    config, rng, truth = (
        CornerConfig(floor=0.0),
        np.random.default_rng(3),
        se2.act(se2.inverse(POSE), [[5.0, 0.0]])[0],
    )
    exact, d2 = scan(), []
    for _ in range(400):
        found = scan_corners(BEAMS, exact + 0.015 * rng.standard_normal(len(BEAMS)), config)
        i = int(np.argmin(np.hypot(*(found.xy - truth).T)))
        e = found.xy[i] - truth
        if np.hypot(*e) < 0.1:
            d2.append(e @ np.linalg.solve(found.cov[i], e))
    assert len(d2) > 380
    assert 0.5 < np.mean(d2) / 2 < 1 + 4 * np.sqrt(1 / 400)


def test_legs_make_no_corners() -> None:
    rng = np.random.default_rng(4)
    places = rng.uniform([0.5, 0.5], [4.5, 3.5], (60, 2))
    places = places[np.hypot(*(places - POSE[:2]).T) > 0.6][:25]
    discs = np.column_stack([places, np.full(len(places), 0.07)])
    found = scan_corners(BEAMS, scan(discs) + 0.015 * rng.standard_normal(len(BEAMS)))
    world = se2.act(POSE, found.xy)
    real = np.concatenate([ROOM[:, :2], CUPBOARD[:, :2]])
    off = np.hypot(*(world[:, None] - real).transpose(2, 0, 1)).min(axis=1)
    assert (off < 0.1).all(), f"corners {off} m away from every real one"


def test_readings_that_say_nothing_are_left_out() -> None:
    r = scan()
    r[::40], r[3::55], r[5], r[6] = np.nan, np.inf, -1.0, 0.0
    found = scan_corners(BEAMS, r)
    assert any(np.hypot(*(se2.act(POSE, c) - [5.0, 0.0])) < 1e-6 for c in found.xy)
    assert len(scan_corners(BEAMS, np.full(len(BEAMS), np.nan))) == 0
    assert len(scan_corners([], [])) == 0


@pytest.mark.parametrize(
    ("angles", "ranges"), [([0.0, 0.1], [1.0]), ([0.0, np.nan], [1.0, 1.0]), ([[0.0]], [[1.0]])]
)
def test_scans_that_do_not_fit_together_are_refused(angles: object, ranges: object) -> None:
    with pytest.raises(ValueError, match="need one range per beam"):
        scan_corners(angles, ranges)  # type: ignore[arg-type]


L_SHAPE = [(20, c) for c in range(20, 50)] + [(r, 20) for r in range(20, 50)]


def test_the_map_s_corner_is_where_the_walls_middle_lines_meet(make_grid: Callable[..., LogOddsGrid]) -> None:
    """Walls on row 20 and column 20 meet at the middle of cell (20, 20); half a cell is the bound."""
    corners = map_corners(make_grid(L_SHAPE))
    assert len(corners.xy) == 1, "one corner; the ends of the two walls are none"
    np.testing.assert_allclose(corners.xy[0], [2.05, 2.05], atol=0.05)


def test_the_map_s_corner_does_not_care_which_way_it_looks(make_grid: Callable[..., LogOddsGrid]) -> None:
    for turn in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        cells = [(32 + turn[0] * k, 32) for k in range(25)] + [(32, 32 + turn[1] * k) for k in range(25)]
        corners = map_corners(make_grid(cells))
        assert len(corners.xy) == 1
        np.testing.assert_allclose(corners.xy[0], [3.25, 3.25], atol=0.05)


def test_a_straight_wall_and_a_leg_are_no_corners(make_grid: Callable[..., LogOddsGrid]) -> None:
    assert len(map_corners(make_grid([(30, c) for c in range(5, 60)])).xy) == 0
    assert len(map_corners(make_grid([])).xy) == 0
    assert len(map_corners(make_grid([(30, 30)])).xy) == 0


def test_undecided_walls_make_no_corner(make_grid: Callable[..., LogOddsGrid]) -> None:
    """P = 0.8 everywhere on the walls: A determines at 0.9."""
    assert len(map_corners(make_grid(L_SHAPE, value=np.log(4.0))).xy) == 0


def test_arms_are_static_where_s_says_so(make_grid: Callable[..., LogOddsGrid]) -> None:
    grid = make_grid(L_SHAPE)
    right, up = 0.0, np.pi / 2
    share = static_along_arms(
        grid, [[2.05, 2.05]] * 3 + [[4.0, 4.0]], [[right, up], [right, -up], [np.pi, up], [0, 1]]
    )
    np.testing.assert_allclose(share, [1.0, 0.0, 0.0, 0.0], atol=0.25)
    assert share[0] == 1.0
    assert len(static_along_arms(grid, np.zeros((0, 2)), np.zeros((0, 2)))) == 0


def test_a_half_sure_corner_is_weaker_than_a_sure_one(make_grid: Callable[..., LogOddsGrid]) -> None:
    """Weights grow with P: the same L at 0.93 and at 0.993; and a strong L without a decided cell is none."""
    from vslam_ref.grids.landmarks import MapCornerConfig

    weak, strong = (map_corners(make_grid(L_SHAPE, value=v)).strength[0] for v in (2.6, 5.0))
    assert 0.8 * strong < weak < 0.95 * strong
    strict = MapCornerConfig(decided=0.95)
    assert len(map_corners(make_grid(L_SHAPE, value=2.6), strict).xy) == 0
    assert len(map_corners(make_grid(L_SHAPE, value=5.0), strict).xy) == 1
