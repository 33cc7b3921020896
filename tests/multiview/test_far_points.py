"""Poses from points of which a few are very far away: mountains, stars, a wrong track."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from vslam_ref.estimation.resection import Resection, refine_pose, resect
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.geometry.multiview import best_of_three, dlt, nearness, p3p, planar_dlt, resect_linear

LENS = Pinhole(500.0, 520.0, 320.0, 240.0)
SIGMA = 0.5


def view(
    count: int, far: int, factor: float, rng: np.random.Generator, flat: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pose, world points and pixels without noise; the first ``far`` points ``factor`` times as far.

    They are moved along their rays; the points of a plane along the plane, away from its middle.
    """
    uv = rng.uniform([20, 20], [620, 460], (count, 2))
    X_cam = LENS.unproject(uv).bearing
    X_cam *= rng.uniform(4, 8, (count, 1)) / X_cam[:, 2:]
    if flat:  # a floor: what is far on it lies towards the horizon
        X_cam = np.column_stack([rng.uniform(-1, 1, count), np.full(count, 1.2), rng.uniform(3, 6, count)])
    X_cam[:far] *= [factor, 1.0, factor] if flat else factor
    T = se3.from_rt(so3.exp(rng.normal(0, 0.5, 3)), rng.normal(0, 1, 3))
    return T, se3.act(se3.inverse(T), X_cam), LENS.project(X_cam).uv


def squares(found: Resection) -> float:
    return float(np.sum(found.errors_px**2))


@pytest.mark.parametrize(
    ("count", "far", "factor"),
    [(4, 1, 1e4), (5, 1, 1e6), (6, 1, 30), (6, 1, 1e3), (6, 2, 1e4), (6, 3, 1e4), (8, 1, 1e6), (10, 2, 1e4),
     (12, 8, 1e4), (20, 1, 1e9), (30, 18, 1e3)],
)  # fmt: skip
def test_the_pose_is_found_as_from_the_true_one(count: int, far: int, factor: float) -> None:
    """The oracle is the search that begins at the truth: every trial ends in a pose as good as that."""
    rng = np.random.default_rng([count, far, int(factor)])
    for _ in range(15):
        T, X, uv = view(count, far, factor, rng)
        uv = uv + rng.normal(0, SIGMA, uv.shape)
        found, best = resect(LENS, X, uv, sigma_px=SIGMA), refine_pose(LENS, X, uv, T, sigma_px=SIGMA)
        assert found.reason == ""
        # four points leave two degrees of freedom: their squares may be next to nothing, in units of sigma^2
        assert squares(found) <= 1.1 * squares(best) + 1e-3 * SIGMA**2


@pytest.mark.parametrize("factor", [1e2, 1e4, 1e6])
def test_the_linear_equations_know_the_rotation_and_the_place(factor: float) -> None:
    """Without noise both are right, to the rounding of the far points."""
    rng = np.random.default_rng(int(factor))
    worst = 0.0
    for _ in range(20):
        T, X, uv = view(12, 2, factor, rng)
        found = resect_linear(LENS.unproject(uv).bearing, X)
        assert found.method == "dlt"
        worst = max(worst, float(np.abs(found.T_cam_world - T).max()))
    # the far points' coordinates are rounded at eps times their distance, 1e7 eps at most; condition 1e4
    assert worst < 1e-16 * 8 * factor * 1e4 + 1e-10


def test_a_small_noise_stays_small_in_the_place() -> None:
    """What used to fail: the turn's error times the far distance went into the translation.

    With a tenth of a pixel the linear rotation is off by some 1e-3 rad.  Unweighted, a point at 6e5 m then
    asks for hundreds of metres; weighted, the place is as good as from the near points alone.
    """
    rng = np.random.default_rng(4)
    off = []
    for _ in range(20):
        T, X, uv = view(20, 1, 1e5, rng)
        b = LENS.unproject(uv + rng.normal(0, 0.1, uv.shape)).bearing
        with_far, without = dlt(b, X), dlt(b[1:], X[1:])
        assert with_far.ok
        assert without.ok
        off.append([np.linalg.norm(found.T_cam_world[:3, 3] - T[:3, 3]) for found in (with_far, without)])
    mean = np.mean(off, axis=0)
    assert mean[0] < 1.5 * mean[1]


def test_far_points_of_a_plane_are_points_of_the_plane() -> None:
    rng = np.random.default_rng(5)
    for factor in (1e2, 1e4):
        for _ in range(10):
            T, X, uv = view(9, 2, factor, rng, flat=True)
            found = resect_linear(LENS.unproject(uv).bearing, X)
            assert found.method == "planar"
            assert found.ok
            assert np.abs(found.T_cam_world - T).max() < 1e-7  # as above
            noisy = uv + rng.normal(0, SIGMA, uv.shape)
            refined = resect(LENS, X, noisy, sigma_px=SIGMA)
            assert refined.reason == ""
            best = refine_pose(LENS, X, noisy, T, sigma_px=SIGMA)
            assert squares(refined) <= 1.05 * squares(best)


def test_near_points_of_a_plane_with_one_far_point_beside_it() -> None:
    """Neither method applies: the plane leaves the far point out, twelve numbers are not determined."""
    rng = np.random.default_rng(6)
    for _ in range(10):
        T, X, uv = view(8, 0, 1.0, rng, flat=True)
        X[0] = se3.act(se3.inverse(T), [200.0, -900.0, 4000.0])
        uv[0] = LENS.project(se3.act(T, X[0])).uv
        found = resect(LENS, X, uv)
        assert found.reason == ""
        assert found.rmse_px < 1e-6


def test_weights_are_one_without_far_points() -> None:
    """So nothing changes for them, not even the rounding."""
    rng = np.random.default_rng(7)
    for count in (0, 1, 2, 3, 6, 50, 1000):
        assert (nearness(rng.uniform(-1, 1, (count, 3))) == 1.0).all()
    assert (nearness(np.zeros((5, 3))) == 1.0).all()  # one place
    assert (nearness(1e6 * rng.uniform(-1, 1, (30, 3)) + 1e8) == 1.0).all()  # neither unit nor origin matter


@pytest.mark.parametrize(("count", "far"), [(6, 1), (6, 3), (9, 6), (600, 300)])
def test_weights_of_far_points_are_ratios_of_distances(count: int, far: int) -> None:
    rng = np.random.default_rng(8)
    X = rng.uniform(-1, 1, (count, 3))
    X[:far] = 1e5 * (X[:far] / np.linalg.norm(X[:far], axis=1, keepdims=True))
    weight = nearness(X)
    assert (weight[far:] == 1.0).all()
    # from any point of the box the far ones are 1e5 away, and its third has a radius between 0.1 and 2 sqrt 3
    assert (weight[:far] > 0.09e-5).all()
    assert (weight[:far] < 3.5e-5).all()
    assert np.ptp(weight[:far]) < 1e-4 * weight[0]
    np.testing.assert_allclose(nearness(1e-3 * X + [5.0, 0, 0]), weight, rtol=1e-9)


def test_the_rotation_is_as_good_as_from_the_near_points() -> None:
    """Or better, as far points are the best compass; unweighted equations serve them and nothing else."""
    rng = np.random.default_rng(9)
    for method, flat in ((dlt, False), (planar_dlt, True)):
        turns = []
        for _ in range(40):
            T, X, uv = view(20, 2, 1e6, rng, flat)
            b = LENS.unproject(uv + rng.normal(0, SIGMA, uv.shape)).bearing
            found = [method(b, X), method(b[2:], X[2:])]
            turns.append([np.linalg.norm(so3.log(se3.rotation(f.T_cam_world) @ T[:3, :3].T)) for f in found])
        with_far, without = np.sqrt(np.mean(np.square(turns), axis=0))
        assert with_far < 1.2 * without, (method.__name__, with_far, without)


def test_the_best_of_three_is_the_best_by_angle() -> None:
    """Pixels are the oracle: of the poses of all triples it is among the best, far point or not."""
    rng = np.random.default_rng(10)
    ratio = []
    for _ in range(30):
        _, X, uv = view(7, 1, 1e6, rng)
        uv = uv + rng.normal(0, SIGMA, uv.shape)
        b = LENS.unproject(uv).bearing
        triples = np.array(list(combinations(range(7), 3)))
        found = p3p(b[triples], X[triples])
        off = []
        for T in [best_of_three(b, X).T_cam_world, *found.T_cam_world[found.valid]]:
            at = LENS.pixel_from_world(T, X)
            off.append(np.inf if not at.valid.all() else float(np.linalg.norm(at.uv - uv)))
        ratio.append(off[0] / min(off[1:]))
    # an angle and a pixel differ by cos^2 at most, 0.6 in the corner of this picture
    assert max(ratio) < 1 / 0.6


def test_too_few_points_for_the_best_of_three() -> None:
    X = np.array([[0, 0, 4], [1, 0, 5], [0, 2, 6.0]])
    b = X / np.linalg.norm(X, axis=1, keepdims=True)
    assert best_of_three(b, X).reason == "too few points"
    assert planar_dlt(b, X).reason == "too few points"
