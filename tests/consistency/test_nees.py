"""The normalised squares against SciPy's solve, against distributions, and against their own mistakes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from vslam_ref.geometry import se2
from vslam_ref.metrics import consistency as cs

BATCHES = st.sampled_from([(), (1,), (3, 1, 2), (5,)])
FALSE_ALARM = 1e-4
"""Chance that one two-sided statistical check below fails for correct code; seeds are fixed all the same."""


def spd(rng, d, batch=(), spread=2.0):
    """Covariances with standard deviations spread over 10^+-spread."""
    A = rng.standard_normal((*batch, d, d + 2))
    scale = 10.0 ** rng.uniform(-spread, spread, (*batch, d))
    return scale[..., :, None] * (A @ np.swapaxes(A, -1, -2)) * scale[..., None, :]


def draw(rng, cov, n):
    """``n`` errors with exactly this covariance."""
    L = np.linalg.cholesky(cov)
    return rng.standard_normal((n, len(cov))) @ L.T


@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 8), batch=BATCHES)
@settings(max_examples=60, deadline=None)
def test_equals_a_direct_solve(seed, d, batch):
    rng = np.random.default_rng(seed)
    P, e = spd(rng, d, batch), rng.standard_normal((*batch, d))
    sd = np.sqrt(np.einsum("...ii->...i", P))
    C, y = P / (sd[..., :, None] * sd[..., None, :]), e / sd
    found = cs.nees(e, P)
    # forward error of a backward stable solve, times 10 for the constants of both sides
    bound = 10 * d * np.finfo(float).eps * np.linalg.cond(C)
    expected = np.einsum("...i,...i->...", y, np.linalg.solve(C, y[..., None])[..., 0])
    assert found.value.shape == found.dof.shape == batch
    assert np.all(np.abs(found.value - expected) <= bound * expected)
    assert np.all(found.dof == d)
    assert found.invalid_count == 0
    assert np.all(found.outside == 0)


@given(seed=st.integers(0, 2**32 - 1), d=st.integers(1, 5))
@settings(max_examples=30, deadline=None)
def test_does_not_depend_on_the_coordinates(seed, d):
    rng = np.random.default_rng(seed)
    P, e = spd(rng, d, spread=0), rng.standard_normal(d)
    A = np.linalg.qr(rng.standard_normal((d, d)))[0] * 10.0 ** rng.uniform(-1, 1)
    bound = 100 * d * np.finfo(float).eps * np.linalg.cond(P)
    assert cs.nees(A @ e, A @ P @ A.T).value == pytest.approx(cs.nees(e, P).value, rel=bound)


def test_broadcasts_error_and_covariance():
    P = np.diag([4.0, 9.0])
    assert cs.nees(np.ones((7, 3, 2)), P).value == pytest.approx(np.full((7, 3), 1 / 4 + 1 / 9), rel=1e-15)
    assert cs.nees([2.0, 3.0], np.stack([P, 4 * P])).value == pytest.approx([2.0, 0.5], rel=1e-15)


def test_honest_errors_are_chi_squared_and_flipped_signs_are_not():
    rng = np.random.default_rng(3)
    P = np.array([[1.0, 0.6, -0.02], [0.6, 2.0, 0.05], [-0.02, 0.05, 0.01]])
    e = draw(rng, P, 4000)
    q = cs.nees(e, P).value
    assert stats.kstest(q, stats.chi2(3).cdf).pvalue > FALSE_ALARM
    wrong = P.copy()
    wrong[0, 1] = wrong[1, 0] = -P[0, 1]
    assert stats.kstest(cs.nees(e, wrong).value, stats.chi2(3).cdf).pvalue < 1e-12
    assert stats.kstest(cs.nees(e, np.linalg.inv(P)).value, stats.chi2(3).cdf).pvalue < 1e-12


@pytest.mark.parametrize(
    ("name", "P"),
    [
        ("negative variance", np.diag([1.0, -1.0, 1.0])),
        ("zero variance", np.diag([1.0, 0.0, 1.0])),
        ("indefinite", np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]])),
        ("just indefinite", np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.1], [0.0, 1.1, 1.0]])),
        ("singular", np.ones((3, 3))),
        ("singular in the last pivot", np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, 1.0]])),
        ("not symmetric", np.array([[1.0, 0.3, 0.0], [-0.3, 1.0, 0.0], [0.0, 0.0, 1.0]])),
        ("not finite", np.diag([1.0, np.inf, 1.0])),
        ("not a number", np.diag([1.0, np.nan, 1.0])),
    ],
)
def test_a_covariance_without_a_value_is_counted_and_never_a_number(name, P):
    found = cs.nees(np.ones((2, 3)), np.stack([np.eye(3), P]))
    assert found.invalid.tolist() == [False, True], name
    assert found.invalid_count == 1
    assert found.value[0] == 3.0
    assert np.isnan(found.value[1])
    assert np.isnan(found.outside[1])


def test_an_error_that_is_not_finite_is_counted():
    assert cs.nees([[np.nan, 0.0], [np.inf, 0.0], [1.0, 0.0]], np.eye(2)).invalid.tolist() == [
        True,
        True,
        False,
    ]


def test_input_is_not_changed():
    e, P = np.ones((4, 3)), np.tile(2 * np.eye(3) + 1, (4, 1, 1))
    before = P.copy()
    cs.nees(e, P)
    cs.nees_singular(e, P)
    assert np.array_equal(P, before)
    assert np.array_equal(e, np.ones((4, 3)))


@pytest.mark.parametrize(
    ("e", "P"), [((3,), (2, 2)), ((), (1, 1)), ((2,), (2,)), ((2,), (2, 3)), ((0,), (0, 0))]
)
def test_shapes_that_do_not_fit_are_named(e, P):
    with pytest.raises(ValueError, match=r"need an error .* got"):
        cs.nees(np.zeros(e), np.zeros(P))


@pytest.mark.parametrize("side", [1, -1])
def test_the_heading_wraps_at_pi(side):
    truth, mean = [0.0, 0.0, side * (np.pi - 0.01)], [0.0, 0.0, -side * (np.pi - 0.01)]
    # 2 * (pi - 0.01) turns to -0.02: one rounding of pi, relative to 0.02
    assert cs.pose_error(truth, mean)[2] == pytest.approx(-side * 0.02, rel=1e-13)
    cov = np.diag([1.0, 1.0, 1e-4])
    assert cs.nees_pose(truth, mean, cov).value == pytest.approx(4.0, rel=1e-12)
    assert cs.nees_se2(truth, mean, cov).value == pytest.approx(4.0, rel=1e-12)
    assert cs.nees(np.subtract(truth, mean), cov).value > 1e5  # what forgetting to wrap would give


@given(seed=st.integers(0, 2**32 - 1), batch=BATCHES)
@settings(max_examples=40, deadline=None)
def test_the_se2_nees_is_the_same_in_body_and_in_world_axes(seed, batch):
    """xi_world = Ad xi_body; the covariance maps to world axes by [[1,0,y],[0,1,-x],[0,0,1]]."""
    rng = np.random.default_rng(seed)
    mean = rng.uniform(-3, 3, (*batch, 3))
    truth = se2.compose(mean, se2.exp(0.5 * rng.standard_normal((*batch, 3))))
    P = spd(rng, 3, batch, spread=0)
    J = np.broadcast_to(np.eye(3), (*batch, 3, 3)).copy()
    J[..., 0, 2], J[..., 1, 2] = mean[..., 1], -mean[..., 0]
    world = cs.nees(se2.log(se2.compose(truth, se2.inverse(mean))), J @ P @ np.swapaxes(J, -1, -2)).value
    body = cs.nees_se2(truth, mean, P).value
    bound = 1000 * np.finfo(float).eps * np.max(np.linalg.cond(P)) * (1 + np.max(np.abs(mean))) ** 2
    assert np.allclose(world, body, rtol=bound, atol=0)


def test_the_se2_nees_differs_from_the_pose_nees_by_order_phi():
    rng = np.random.default_rng(5)
    mean = np.array([2.0, -1.0, 2.5])
    P = spd(rng, 3, spread=0)
    shift = rng.standard_normal(3)
    gap = []
    for h in (1e-2, 5e-3, 2.5e-3):
        truth = mean + h * shift
        gap.append(abs(cs.nees_se2(truth, mean, P).value / cs.nees_pose(truth, mean, P).value - 1))
    ratios = np.divide(gap[:-1], gap[1:])
    assert np.all(np.abs(ratios - 2) < 0.1), "halving the error halves the relative gap"


def test_the_se2_nees_fails_with_the_rotation_transposed():
    mean, truth = np.array([0.0, 0.0, 0.7]), np.array([0.1, 0.0, 0.7])
    P = np.diag([1.0, 0.01, 0.01])  # long along the world's x
    assert cs.nees_se2(truth, mean, P).value == pytest.approx(0.01, rel=1e-12)
    c, s = np.cos(0.7), np.sin(0.7)
    J = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])  # the untransposed rotation
    assert cs.nees(se2.log(se2.between(mean, truth)), J @ P @ J.T).value > 0.1


def test_nis_of_honest_innovations_is_chi_squared():
    rng = np.random.default_rng(8)
    S = spd(rng, 6, spread=1)
    found = cs.nis(draw(rng, S, 4000), S)
    assert stats.kstest(found.value, stats.chi2(6).cdf).pvalue > FALSE_ALARM
    assert np.all(found.dof == 6)


class TestSingular:
    def test_equals_nees_for_a_regular_covariance(self):
        rng = np.random.default_rng(1)
        P, e = spd(rng, 4, (20,), spread=1), rng.standard_normal((20, 4))
        found = cs.nees_singular(e, P)
        assert found.value == pytest.approx(cs.nees(e, P).value, rel=1e-9)
        assert np.all(found.dof == 4)
        assert np.all(found.outside == 0)

    @pytest.mark.parametrize("rank", [1, 2, 3])
    def test_is_chi_squared_with_rank_degrees_of_freedom(self, rank):
        rng = np.random.default_rng(rank)
        A = rng.standard_normal((4, rank)) * np.array([[3.0], [0.5], [0.02], [0.1]])
        e = rng.standard_normal((3000, rank)) @ A.T
        found = cs.nees_singular(e, A @ A.T)
        assert np.all(found.dof == rank)
        assert np.all(found.outside < 1e-12)
        assert stats.kstest(found.value, stats.chi2(rank).cdf).pvalue > FALSE_ALARM

    def test_jacobian_lift_has_three_freedoms_and_the_same_nees(self):
        """(x, y, sin, cos): for an error tangent to the circle the value is that of (x, y, theta)."""
        rng = np.random.default_rng(2)
        theta = rng.uniform(-3, 3, 50)
        P = spd(rng, 3, (50,), spread=0)
        J = np.zeros((50, 4, 3))
        J[:, 0, 0] = J[:, 1, 1] = 1
        J[:, 2, 2], J[:, 3, 2] = np.cos(theta), -np.sin(theta)
        e = rng.standard_normal((50, 3))
        lifted = cs.nees_singular(np.einsum("bij,bj->bi", J, e), J @ P @ np.swapaxes(J, -1, -2))
        assert np.all(lifted.dof == 3)
        assert lifted.value == pytest.approx(cs.nees(e, P).value, rel=1e-9)

    def test_error_off_the_circle_is_told(self):
        theta, turn = 0.8, 0.3
        P = np.diag([1.0, 1.0, 0.04])
        J = np.array([[1, 0, 0], [0, 1, 0], [0, 0, np.cos(theta)], [0, 0, -np.sin(theta)]])
        mean = np.array([0, 0, np.sin(theta), np.cos(theta)])
        e = cs.heading_vector_error([0.0, 0.0, theta + turn], mean)
        # the part along the radius is cos(turn) - 1 in the heading vector
        assert e[2:] @ mean[2:] == pytest.approx(np.cos(turn) - 1, rel=1e-12)
        found = cs.nees_singular(e, J @ P @ J.T)
        assert found.dof == 3
        assert found.outside > 0.1

    def test_a_coordinate_known_exactly_admits_no_error(self):
        P = np.diag([1.0, 0.0])
        assert cs.nees_singular([2.0, 0.0], P).outside == 0.0
        assert cs.nees_singular([2.0, 0.0], P).value == pytest.approx(4.0)
        assert cs.nees_singular([2.0, 0.1], P).outside == np.inf

    def test_rounding_of_many_steps_does_not_add_a_freedom(self):
        """A null direction rotated through 10^4 products keeps an eigenvalue of rounding size."""
        rng = np.random.default_rng(4)
        steps = 10_000
        A = rng.standard_normal((4, 3))
        P = A @ A.T
        for _ in range(steps):
            Q = np.linalg.qr(rng.standard_normal((4, 4)))[0]
            P = Q @ P @ Q.T
        assert cs.nees_singular(np.zeros(4), P, steps=steps).dof == 3

    def test_a_negative_eigenvalue_is_counted(self):
        found = cs.nees_singular(np.ones(2), np.array([[1.0, 1.1], [1.1, 1.0]]))
        assert found.invalid_count == 1
        assert np.isnan(found.value)

    def test_steps_must_be_positive(self):
        with pytest.raises(ValueError, match="steps must be at least 1"):
            cs.nees_singular(np.zeros(2), np.eye(2), steps=0)
