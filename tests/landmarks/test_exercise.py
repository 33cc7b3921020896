"""Exercise 20.1: a corner's covariance, the gate and the claim, each with the usual mistakes."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

EXERCISE = "20_corner_gate"

CENTRE = np.array([[1.0, 0.2], [3.1, 2.0]])
ANGLE = np.array([0.1, 1.5])
VAR_OFFSET, VAR_ANGLE = np.array([4e-6, 9e-6]), np.array([1e-4, 2e-4])


def test_the_corner_lies_on_both_lines(answer: ModuleType) -> None:
    xy, _ = answer.corner(CENTRE.copy(), ANGLE.copy(), VAR_OFFSET.copy(), VAR_ANGLE.copy())
    for c, a in zip(CENTRE, ANGLE, strict=True):
        off = np.array([-np.sin(a), np.cos(a)]) @ (np.asarray(xy) - c)
        assert abs(off) < 1e-12, f"the corner lies {off:.3g} m beside a line"


def drawn(n: int = 20_000) -> np.ndarray:
    """Corners of lines drawn with the declared errors: the covariance by brute force."""
    rng = np.random.default_rng(1)
    angle = ANGLE + np.sqrt(VAR_ANGLE) * rng.standard_normal((n, 2))
    offset = np.sqrt(VAR_OFFSET) * rng.standard_normal((n, 2))
    normal = np.stack([-np.sin(angle), np.cos(angle)], axis=-1)
    return np.linalg.solve(normal, ((normal * CENTRE).sum(-1) + offset)[..., None])[..., 0]


def test_the_covariance_is_that_of_many_draws(answer: ModuleType) -> None:
    _, cov = answer.corner(CENTRE.copy(), ANGLE.copy(), VAR_OFFSET.copy(), VAR_ANGLE.copy())
    cov, true = np.asarray(cov), np.cov(drawn().T)
    assert cov.shape == (2, 2)
    np.testing.assert_allclose(cov, cov.T, err_msg="a covariance is symmetric")
    no_lever = answer.corner(CENTRE.copy(), ANGLE.copy(), VAR_OFFSET.copy(), np.zeros(2))[1]
    if np.allclose(cov, no_lever):
        pytest.fail(
            "the errors of the directions are missing: they act with the distance from the line's middle"
        )
    if np.trace(cov) < 0.5 * np.trace(true):
        pytest.fail("far too certain: the lever is the distance from the CENTROID to the corner, squared")
    # 20000 draws know a variance to 1 %; four of these, and 1 % for what is not linear
    scale = np.sqrt(np.outer(np.diag(true), np.diag(true)))
    np.testing.assert_allclose(cov / scale, true / scale, atol=0.05, err_msg="against 20000 drawn corners")


def test_parallel_lines_know_their_crossing_badly(answer: ModuleType) -> None:
    """Two lines at a small angle: the corner is uncertain along them, and certain across."""
    _, cov = answer.corner(np.zeros((2, 2)), np.array([0.0, 0.1]), np.full(2, 1e-6), np.zeros(2))
    # (x, y) with y = o1 and 0.1 x ~ o1 - o2: var x = 2e-6 / sin(0.1)^2 about, var y = 1e-6
    assert cov[0][0] == pytest.approx(1e-6 * (1 + np.cos(0.1) ** 2) / np.sin(0.1) ** 2, rel=1e-9)
    assert cov[1][1] == pytest.approx(1e-6, rel=1e-9)


def blocks() -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(2)
    A = rng.standard_normal((5, 5))
    P, J = A @ A.T, rng.standard_normal((2, 5))
    return J[:, :3], J[:, 3:], P[:3, :3], P[3:, 3:], P[:3, 3:], np.array([[0.3, 0.1], [0.1, 0.2]])


def test_the_innovation_s_covariance_counts_everything_once(answer: ModuleType) -> None:
    J_p, J_l, P_pp, P_ll, P_pl, cov_z = blocks()
    J, P = np.hstack([J_p, J_l]), np.block([[P_pp, P_pl], [P_pl.T, P_ll]])
    expected = J @ P @ J.T + cov_z
    found = np.asarray(answer.innovation_cov(*(b.copy() for b in blocks())))
    once = J_p @ P_pl @ J_l.T
    if np.allclose(found, expected - once - once.T):
        pytest.fail("pose and landmark are correlated: the cross covariance is missing, twice")
    if np.allclose(found, expected - once) or np.allclose(found, expected - once.T):
        pytest.fail("the cross term enters with its transpose, too")
    if np.allclose(found, expected - cov_z):
        pytest.fail("the measurement's own covariance is missing")
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_landmark_that_is_known_relative_to_the_robot_has_a_narrow_gate(answer: ModuleType) -> None:
    """Both lost together by a metre, but seen a moment ago: only the cross terms know that."""
    J_p, J_l = np.array([[-1.0, 0, 0], [0, -1.0, 0]]), np.eye(2)
    P = np.eye(2)
    S = answer.innovation_cov(
        J_p, J_l, np.diag([1, 1, 0.0]), P + 1e-4 * P, np.vstack([P, [[0, 0]]]), 1e-4 * P
    )
    np.testing.assert_allclose(S, 2e-4 * np.eye(2), atol=1e-12)


S2 = np.array([[0.04, 0.0], [0.0, 0.0001]])


@pytest.mark.parametrize(
    ("innovations", "alike", "expected", "told"),
    [
        ([[0.3, 0.0], [0.0, 0.05]], [True, True], 0, "the nearer one in metres lies five sigma off"),
        ([[0.9, 0.0]], [True], -1, "4.5 sigma: outside of the gate"),
        ([[0.58, 0.0]], [True], 0, "2.9 sigma: inside, as d^2 = 8.4 < 9.21"),
        ([[0.62, 0.0]], [True], -1, "3.1 sigma: outside, as d^2 = 9.6 > 9.21; is d compared, and not d^2?"),
        ([[0.3, 0.0], [0.0, 0.005]], [True, True], -2, "two in the gate: nobody knows which, so neither"),
        ([[0.3, 0.0], [0.0, 0.005]], [True, False], 0, "the second one looks otherwise: it is no rival"),
        ([[0.3, 0.0], [0.0, 0.005]], [False, False], -1, "none looks like this corner"),
        ([[0.3, 0.0], [0.3, 0.0], [0.3, 0.0]], [True] * 3, -2, "three in the gate"),
    ],
)
def test_whose_corner_it_is(
    answer: ModuleType, innovations: list[list[float]], alike: list[bool], expected: int, told: str
) -> None:
    v = np.array(innovations)
    found = answer.claim(v, np.broadcast_to(S2, (len(v), 2, 2)).copy(), np.array(alike))
    assert found == expected, told


def test_an_empty_map_has_no_landmark(answer: ModuleType) -> None:
    assert answer.claim(np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0, dtype=bool)) == -1


def test_correlated_errors_turn_the_gate(answer: ModuleType) -> None:
    S = np.array([[[1.0, 0.95], [0.95, 1.0]]])
    v = np.array([[2.0, 2.0]])
    assert answer.claim(v, S, np.array([True])) == 0, "along the ellipse's long axis: inside"
    assert answer.claim(v * [1, -1], S, np.array([True])) == -1, "across it: far outside, S is not diagonal"
