"""A third picture tells the two answers of a plane apart, and refuses what does not fit it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import least_squares

from vslam_ref.estimation import three_views
from vslam_ref.estimation.third_picture import ask_third, refine_three
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview import two_views
from vslam_ref.geometry.multiview.two_views import apart
from vslam_ref.geometry.multiview.two_views.consensus import ONE_EQUATION

SIGMA = 1 / 500


class Triple(NamedTuple):
    T_b_a: np.ndarray
    T_m_a: np.ndarray
    a: np.ndarray
    m: np.ndarray
    b: np.ndarray


def triple(
    rng: np.random.Generator, points: int = 200, kind: str = "plane", *, px: float = 0.5, bend: float = 0.25
) -> Triple:
    """Three pictures, four base lines away; ``bend`` is how far m lies off the straight way."""
    t = rng.normal(size=3)
    t /= np.linalg.norm(t)
    off = np.cross(t, rng.normal(size=3))
    off /= np.linalg.norm(off)
    turn = rng.normal(0, 0.08, 3) if bend else np.zeros(3)
    T_b = se3.exp([*t, *turn])
    T_m = se3.exp([*(0.5 * t + bend * off), *(0.5 * turn)])
    X = rng.uniform(-1, 1, (points, 3)) * [2.0, 1.5, 1.5] + [0, 0, 5.0]
    if kind == "plane":
        X[:, 2] = 5.0 + rng.uniform(0.1, 0.4) * X[:, 0] + rng.uniform(-0.4, 0.4) * X[:, 1]
    if kind == "far":
        X *= rng.choice([1.0, 1000.0], (points, 1))
    seen = (p[:, :2] / p[:, 2:] for p in (X, se3.act(T_m, X), se3.act(T_b, X)))
    a, m, b = (x + rng.normal(0, px / 500, x.shape) for x in seen)
    return Triple(T_b, T_m, a, m, b)


def both_answers(s: Triple) -> np.ndarray:
    return two_views.homography_motions(two_views.fit_homography(s.a, s.b), s.a).T_b_a


def told_apart_by_two(s: Triple, answers: np.ndarray) -> bool:
    """Whether the pair alone decides."""
    squared = two_views.cheirality(answers, s.a, s.b, SIGMA).squared
    costs = two_views.truncated_cost(squared, ONE_EQUATION)
    return bool(costs.max() >= 1.5 * costs.min() + 0.01)


def test_a_third_picture_chooses_where_two_do_not_tell() -> None:
    """And the last picture once more, which is no third one, does not."""
    open_, decided = 0, 0
    for seed in range(16):
        s = triple(np.random.default_rng(seed), px=0.3)
        answers = both_answers(s)
        if told_apart_by_two(s, answers):
            continue
        open_ += 1
        found = ask_third(answers, s.a, s.m, s.b, sigma=SIGMA)
        assert found.views is not None
        if not found.reason:
            decided += 1
            # 0.3 of 500 pixels in 200 points with some ten degrees of parallax: a direction to a hundredth;
            # the wrong answer of a plane is several tenths off
            assert apart(found.views.T_b_a, s.T_b_a) < 0.05
            assert apart(found.views.T_m_a, s.T_m_a) < 0.1
            assert found.inliers.mean() > 0.9
        repeated = ask_third(answers, s.a, s.b, s.b, sigma=SIGMA, share=1.0)
        assert "not told apart" in repeated.reason
    assert open_ >= 8
    assert decided >= 0.7 * open_


def test_a_straight_way_without_a_turn_tells_nothing_and_says_so() -> None:
    refused = 0
    for seed in range(6):
        s = triple(np.random.default_rng(seed), bend=0.0)
        answers = both_answers(s)
        if not two_views.homography_motions(two_views.fit_homography(s.a, s.b), s.a).possible.all():
            continue
        found = ask_third(answers, s.a, s.m, s.b, sigma=SIGMA)
        assert "not told apart" in found.reason
        refused += 1
    assert refused >= 2


def test_the_distance_is_that_of_the_nearest_three_positions_that_fit() -> None:
    """SciPy moves each point freely in space; to first order in the noise that is the same minimum."""
    s = triple(np.random.default_rng(1), 30, "space", px=0.3)
    found = refine_three(s.T_b_a, s.a, s.m, s.b, sigma=SIGMA)

    def errors(p: np.ndarray, j: int) -> np.ndarray:
        ray = np.array([p[0], p[1], 1.0])
        views = ((s.a, np.eye(4)), (s.m, found.T_m_a), (s.b, found.T_b_a))
        y = [T[:3, :3] @ ray + p[2] * T[:3, 3] for _, T in views]
        return np.concatenate([v[:2] / v[2] - x[j] for v, (x, _) in zip(y, views, strict=True)]) / SIGMA

    for j in range(30):
        best = least_squares(errors, [*s.a[j], found.inverse_depth[j]], args=(j,), xtol=1e-14, ftol=1e-14)
        # relative error of a first-order distance: the noise, 0.3 pixels, over the 100 pixels in which
        # directions change, some times the parallax's inverse (5)
        assert found.squared[j] == pytest.approx(2 * best.cost, rel=0.02, abs=1e-4)


def test_squared_distances_are_chi_square_of_three_equations_a_point() -> None:
    """3 N - 11 degrees of freedom; a band of four standard deviations, both sides."""
    total, freedom = 0.0, 0
    for seed in range(5):
        s = triple(np.random.default_rng(seed), 300, "space", px=1.0)
        total += refine_three(s.T_b_a, s.a, s.m, s.b, sigma=SIGMA).squared.sum()
        freedom += 3 * 300 - 11
    assert abs(total - freedom) < 4 * np.sqrt(2 * freedom)


def test_what_moved_on_its_own_between_is_refused() -> None:
    """Fits the pair perfectly well; the picture between saw it elsewhere."""
    s = triple(np.random.default_rng(3), 200, "space")
    still = ask_third(s.T_b_a[None], s.a, s.m, s.b, sigma=SIGMA)
    moved = s.m + np.random.default_rng(0).normal(0, 2 * SIGMA, s.m.shape)
    found = ask_third(s.T_b_a[None], s.a, moved, s.b, sigma=SIGMA)
    assert still.reason == ""
    assert "a picture between does not agree" in found.reason
    assert found.added > 1.5 * found.pair_cost + 0.01


def test_the_rows_of_a_rolling_shutter_are_refused() -> None:
    """A camera that turns while it reads its rows: up to 5 pixels at the borders of one picture."""
    s = triple(np.random.default_rng(5), 200, "space")
    bent = s.m + np.column_stack([0.01 * s.m[:, 1] ** 2 / 0.3**2, np.zeros(200)])
    found = ask_third(s.T_b_a[None], s.a, bent, s.b, sigma=SIGMA)
    assert "a picture between does not agree" in found.reason


def test_far_points_stay_in_front_and_do_no_harm() -> None:
    s = triple(np.random.default_rng(4), 200, "far")
    found = ask_third(s.T_b_a[None], s.a, s.m, s.b, sigma=SIGMA)
    assert found.reason == ""
    assert found.views is not None
    assert (found.views.inverse_depth >= 0.0).all()
    assert (found.views.inverse_depth == 0.0).sum() > 20  # half of the far ones would lie behind
    assert found.inliers.mean() > 0.85
    assert apart(found.views.T_b_a, s.T_b_a) < 0.05


@pytest.mark.parametrize(("w", "error", "wanted"), [(0.0, -1.0, 1.0), (0.0, 1.0, 0.0), (2.0, 1.0, -1.0)])
def test_from_infinity_a_point_comes_nearer_and_goes_no_farther(
    w: float, error: float, wanted: float
) -> None:
    """One point whose error grows by one for each unit of inverse depth: Newton's step is minus the error."""
    along = np.array([[1.0, 0.0, 0.0, 0.0]])
    now = three_views._Linear(error * along, np.zeros((1, 4, 11)), along, np.ones(1))
    step = three_views._step(now, np.ones(1), np.array([w]), 1e-3)
    assert step.inverse_depth[0] == pytest.approx(wanted, abs=1e-12)


def test_wrong_matches_in_any_picture_change_little() -> None:
    s = triple(np.random.default_rng(6), 200, "space")
    rng = np.random.default_rng(0)
    s.m[:30] = rng.uniform(-0.4, 0.4, (30, 2))
    s.b[30:60] = rng.uniform(-0.4, 0.4, (30, 2))
    found = ask_third(s.T_b_a[None], s.a, s.m, s.b, sigma=SIGMA)
    assert found.views is not None
    assert apart(found.views.T_b_a, s.T_b_a) < 0.05
    assert found.inliers[60:].mean() > 0.9
    assert found.inliers[:60].sum() <= 4


@pytest.mark.parametrize("depth", [5e-4, 1e-6, 1e-12, -1.0])
def test_a_point_at_a_camera_counts_as_behind_it(depth: float) -> None:
    """Its position is beyond all numbers: it must cost much, and stop nothing."""
    T_m = se3.exp([0.1, 0.0, -1.0, 0.0, 0.0, 0.0])
    a = np.array([[0.1, 0.2], [0.3, -0.1]])
    w = np.array([1.0 - depth, 0.2])  # depth in m, of one in a
    at = three_views.ThreeViews(se3.exp([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), T_m, w, np.zeros(2))
    now = three_views._linearised(at, a, a, a, SIGMA)
    assert now.squared[0] == three_views.BEHIND
    assert now.squared[1] < three_views.BEHIND
    assert all(np.isfinite(part).all() for part in now)


def test_too_few_points_and_bad_numbers_are_told() -> None:
    s = triple(np.random.default_rng(0), 5)
    found = ask_third(s.T_b_a[None], s.a, s.m, s.b, sigma=SIGMA)
    assert found.reason == "5 points are seen in all three pictures, 1 answers: need 6, and 1"
    assert found.views is None
    with pytest.raises(ValueError, match="answers"):
        ask_third(np.full((1, 4, 4), np.nan), s.a, s.m, s.b, sigma=SIGMA)
    with pytest.raises(ValueError, match="sigma"):
        ask_third(s.T_b_a[None], s.a, s.m, s.b, sigma=0.0)
