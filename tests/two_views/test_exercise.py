"""Exercise 9.1: the nearest essential matrix, four motions, the cost of a pair, a motion from bad pairs."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.multiview import essential_from_motion

EXERCISE = "09_motion"


def lifted(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)


def test_the_nearest_essential_matrix_has_two_equal_singular_values(answer: ModuleType) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        M = rng.normal(size=(3, 3))
        E = np.asarray(answer.nearest_essential(M))
        s = np.linalg.svd(E, compute_uv=False)
        if s[2] < 1e-12 and abs(s[0] - s[1]) > 1e-6:
            pytest.fail(f"singular values {s.round(3).tolist()}: rank two, but the first two must be equal")
        np.testing.assert_allclose(s, [1, 1, 0], atol=1e-13)
        assert np.sum(E * M) > 0  # near M, not its negative, nor its transpose
        np.testing.assert_allclose(answer.nearest_essential(3 * E), E, atol=1e-13)


def test_four_different_motions_none_of_them_a_mirror(answer: ModuleType, pair) -> None:
    for seed in range(6):
        s = pair(np.random.default_rng(seed), 5)
        E = (-1) ** seed * essential_from_motion(s.T_b_a)
        found = answer.motions(E)
        assert len(found) == 4
        for R, t in found:
            if np.linalg.det(R) < 0:
                pytest.fail("a rotation has the determinant -1: it is a mirror; E and -E are the same matrix")
            np.testing.assert_allclose(np.asarray(R) @ np.asarray(R).T, np.eye(3), atol=1e-13)
            back = essential_from_motion(se3.from_rt(R, t))
            assert min(np.abs(back - E).max(), np.abs(back + E).max()) < 1e-13
        errors = [np.abs(se3.from_rt(R, t) - s.T_b_a).max() for R, t in found]
        assert min(errors) < 1e-13
        assert sum(e < 1e-6 for e in errors) == 1


def test_a_pair_in_front_costs_its_sampson_distance(answer: ModuleType) -> None:
    """A step to the right: lines are rows, and both pictures share a vertical error."""
    R, t = np.eye(3), np.array([-1.0, 0, 0])
    x_a, x_b = np.array([0.1, 0.2, 1.0]), np.array([0.0, 0.26, 1.0])
    assert answer.cost(R, t, x_a, x_b) == pytest.approx(0.06**2 / 2, rel=1e-12)


def test_a_pair_behind_costs_its_distance_from_infinity(answer: ModuleType) -> None:
    R, t = np.eye(3), np.array([-1.0, 0, 0])
    x_a, x_b = np.array([0.0, 0.2, 1.0]), np.array([0.3, 0.2, 1.0])  # moves to the right: behind
    found = answer.cost(R, t, x_a, x_b)
    if found < 1e-12:
        pytest.fail(
            "the pair lies on its line, but its rays meet behind: the mirrored motion must cost something"
        )
    assert found == pytest.approx(0.3**2 / 2, rel=1e-12)
    turned = so3.exp([0.0, 0.3, 0.1])  # a map that is not the identity: J counts
    x = turned @ x_a
    y = np.append(x[:2] / x[2] + [0.02, 0.0], 1.0)
    h = 1e-6
    image = [(turned @ (x_a + h * e))[:2] / (turned @ (x_a + h * e))[2] for e in np.eye(3)[:2]]
    J = (np.array(image).T - (x[:2] / x[2])[:, None]) / h
    e = np.array([-0.02, 0.0])
    wanted = e @ np.linalg.solve(np.eye(2) + J @ J.T, e)
    side = next(u for u in (t, -t) if is_behind(turned, u, x_a, y))
    # the slope by a difference of 1e-6: six digits
    assert answer.cost(turned, side, x_a, y) == pytest.approx(wanted, rel=1e-4)


def is_behind(R: np.ndarray, t: np.ndarray, x_a: np.ndarray, x_b: np.ndarray) -> bool:
    depths = np.linalg.lstsq(np.column_stack([R @ x_a, -x_b]), -t, rcond=None)[0]
    return bool((depths < 0).any())


def test_far_points_cost_their_noise(answer: ModuleType) -> None:
    rng = np.random.default_rng(1)
    x = rng.uniform(-0.5, 0.5, (300, 2))
    a, b = (lifted(x + rng.normal(0, 1e-3, x.shape)) for _ in "ab")
    costs = [answer.cost(np.eye(3), np.array([-1.0, 0, 0]), p, q) / 1e-6 for p, q in zip(a, b, strict=True)]
    # a mean of chi-square with one or two degrees of freedom, 300 pairs: 1.5, and 4 x 0.11
    assert 1.0 < np.mean(costs) < 2.0


def test_the_motion_is_found_though_a_fifth_of_the_pairs_is_wrong(answer: ModuleType, pair) -> None:
    for seed in range(3):
        s = pair(np.random.default_rng(seed), 60, sigma_px=0.1, wrong=0.2)
        R, t = answer.find_motion(lifted(s.a), lifted(s.b), 0.2 / 500, np.random.default_rng(seed))
        turn = np.linalg.norm(so3.log(np.asarray(R) @ s.T_b_a[:3, :3].T))
        direction = np.arccos(np.clip(np.asarray(t) @ s.T_b_a[:3, 3], -1, 1))
        if direction > np.pi / 2:
            pytest.fail("the direction is mirrored: which of the four motions has the points in front?")
        # eight-point on 48 pairs with 0.1 px of noise at 500 px: 2e-4 times a condition of some 100
        assert np.degrees([turn, direction]).max() < 5
