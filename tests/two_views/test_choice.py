"""The whole way: the right motion, or a reason.  A wrong motion without a reason is what must not be."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.estimation.relative_pose import estimate_motion, refine_motion
from vslam_ref.estimation.robust import tuned
from vslam_ref.geometry import se3
from vslam_ref.geometry.multiview import essential_from_motion, two_views
from vslam_ref.geometry.multiview.two_views import Degeneracy, apart

SIGMA = 1 / 500


@pytest.mark.parametrize("kind", ["space", "plane"])
def test_no_motion_is_wrong_without_a_reason(pair, kind: str) -> None:
    accepted = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        s = pair(rng, 150, kind, sigma_px=1.0, wrong=0.3)
        found = estimate_motion(s.a, s.b, rng, sigma=SIGMA)
        accepted += not found.reason
        # a wrong answer of a plane or a mirrored one is tens of degrees off; a pixel of noise up to seven
        assert found.reason or apart(found.T_b_a, s.T_b_a) < np.radians(8)
    if kind == "space":
        assert accepted >= 4


def test_the_rivals_of_a_plane_are_told_with_their_costs(pair) -> None:
    refused = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        s = pair(rng, 100, "plane", sigma_px=0.5)
        found = estimate_motion(s.a, s.b, rng, sigma=SIGMA)
        assert found.choice is not None
        assert found.verdict is not None
        assert found.verdict.degeneracy is Degeneracy.PLANE
        costs = [cost for _, cost in found.choice.rivals]
        assert costs == sorted(costs)
        assert found.choice.cost <= costs[0]
        close = costs[0] < 1.5 * found.choice.cost + 0.01
        assert bool(found.reason) == close
        refused += close
        if close:
            assert "do not tell them apart" in found.reason
    assert refused >= 2  # the test sees both outcomes


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [("space", Degeneracy.NONE), ("plane", Degeneracy.PLANE), ("turn", Degeneracy.PURE_ROTATION)],
)
def test_each_case_has_its_name(pair, kind: str, wanted: Degeneracy) -> None:
    for seed in range(3):
        rng = np.random.default_rng(seed)
        s = pair(rng, 100, kind, sigma_px=0.5)
        found = estimate_motion(s.a, s.b, rng, sigma=SIGMA / 2)
        assert found.verdict is not None
        assert found.verdict.degeneracy is wanted
        if kind == "turn":
            assert "pure rotation" in found.reason
            np.testing.assert_allclose(
                found.verdict.R_b_a, s.T_b_a[:3, :3], atol=2e-3
            )  # 1 px / 500 / sqrt(100) x 8


def test_a_camera_that_stands_still_and_too_few_pairs_have_names(pair) -> None:
    rng = np.random.default_rng(0)
    x = rng.uniform(-0.5, 0.5, (60, 2))
    still = estimate_motion(x, x + rng.normal(0, SIGMA, x.shape), rng, sigma=SIGMA)
    assert "no parallax" in still.reason
    few = estimate_motion(x[:4], x[:4], rng, sigma=SIGMA)
    assert few.reason == "4 pairs: need at least 5"
    verdict = two_views.degeneracy(x[:4], x[:4], np.eye(3), np.eye(3), sigma=SIGMA)
    assert verdict.degeneracy is Degeneracy.TOO_FEW


def test_far_points_do_not_let_a_wrong_motion_win(pair) -> None:
    """With most points at infinity, half of them behind by noise, counting them would lose."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        s = pair(rng, 200, "far", sigma_px=0.5)
        motions = two_views.essential_motions(essential_from_motion(s.T_b_a))
        found = two_views.choose(motions, list("1234"), s.a, s.b, sigma=SIGMA / 2)
        assert apart(found.T_b_a, s.T_b_a) < 1e-9
        assert found.reason == ""
        assert found.front.mean() < 0.9  # though many are not in front


@pytest.mark.parametrize("loss", [None, "huber", "tukey"])
def test_the_refined_motion_beats_its_start_and_its_covariance_is_right(pair, loss: str | None) -> None:
    """Errors over 20 runs in units of the stated covariance: chi-square of five numbers each."""
    total, wrong = 0.0, 0.1 if loss == "tukey" else 0.0
    rng = np.random.default_rng(1)
    for _ in range(20):
        s = pair(rng, 80, sigma_px=0.5, wrong=wrong)
        start = two_views.perturb(s.T_b_a, rng.normal(0, 0.002, 5))
        found = refine_motion(s.a, s.b, start, sigma=SIGMA / 2, loss=None if loss is None else tuned(loss))
        assert found.reason == ""
        assert found.cov_motion is not None
        delta = difference(found.T_b_a, s.T_b_a)
        total += delta @ np.linalg.solve(found.cov_motion, delta)
    # 100 degrees of freedom: 4 standard deviations of sqrt(200); the robust losses lose 5 % of efficiency,
    # and a fixed final weight is a little too sure (some 10 %)
    assert 100 - 4 * 14.1 < total < (100 + 4 * 14.1) * (1.0 if loss is None else 1.2)


def difference(T: np.ndarray, S: np.ndarray) -> np.ndarray:
    """The five numbers that lead from S to T, to first order."""
    J = np.array([(two_views.perturb(S, 1e-6 * e) - S)[:3].ravel() / 1e-6 for e in np.eye(5)]).T
    return np.linalg.lstsq(J, (T - S)[:3].ravel(), rcond=None)[0]


def test_the_refinement_names_what_is_missing(pair) -> None:
    s = pair(np.random.default_rng(3), 4)
    few = refine_motion(s.a, s.b, s.T_b_a, sigma=SIGMA)
    assert few.reason == "4 pairs: a relative pose needs at least 5"
    assert not few.converged
    with pytest.raises(ValueError, match="no translation"):
        refine_motion(s.a, s.b, np.eye(4), sigma=SIGMA)
    with pytest.raises(ValueError, match="sigma"):
        refine_motion(s.a, s.b, s.T_b_a, sigma=-1.0)
    with pytest.raises(ValueError, match="finite"):
        refine_motion(np.full((6, 2), np.nan), np.zeros((6, 2)), s.T_b_a, sigma=1.0)


def test_choose_refuses_nonsense_and_counts_a_valley_once(pair) -> None:
    s = pair(np.random.default_rng(4), 30)
    near = two_views.perturb(s.T_b_a, [0.001, 0, 0, 0, 0])
    found = two_views.choose([s.T_b_a, near], ["one", "its neighbour"], s.a, s.b, sigma=SIGMA)
    assert found.rivals == ()
    with pytest.raises(ValueError, match="names"):
        two_views.choose([s.T_b_a], [], s.a, s.b, sigma=SIGMA)
    with pytest.raises(ValueError, match="at least 1"):
        two_views.choose(np.zeros((0, 4, 4)), [], s.a, s.b, sigma=SIGMA)
    assert apart(se3.identity(), s.T_b_a) > 0
