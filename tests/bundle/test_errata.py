"""Printed objectives of bundle adjustment (A1.4, A2.9) against what must be meant."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

from vslam_ref.estimation.bundle import Options, Robust, bundle_adjust
from vslam_ref.estimation.robust import Tukey
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole, projection

from .conftest import make


def test_a1_4_as_printed_is_not_a_norm(rng: np.random.Generator) -> None:
    """e^T Sigma^-1 e quadruples when e doubles, and breaks the triangle inequality."""
    A = rng.standard_normal((2, 2))
    information = np.linalg.inv(A @ A.T + np.eye(2))
    e = rng.standard_normal(2)

    def printed(x: np.ndarray) -> float:
        return float(x @ information @ x)

    assert printed(2 * e) == pytest.approx(4 * printed(e))
    assert printed(e + e) > printed(e) + printed(e)
    root = np.sqrt(printed(e)) + np.sqrt(printed(e))
    assert np.sqrt(printed(e + e)) <= root * (1 + 1e-12)  # the root is a norm


def test_a1_4_is_the_likelihood_with_the_square_and_not_with_the_norm(rng: np.random.Generator) -> None:
    """One point measured three times: squares end at the likelihood's maximum, norms elsewhere."""
    roots = np.eye(2) + 0.6 * rng.uniform(-1, 1, (3, 2, 2))
    cov = roots @ np.swapaxes(roots, 1, 2)
    information = np.linalg.inv(cov)
    x = np.array([[0.0, 0.0], [1.0, 0.2], [4.0, 3.0]])

    def squares(m: np.ndarray) -> np.ndarray:
        return np.einsum("ni,nij,nj->n", x - m, information, x - m)

    def log_likelihood(m: np.ndarray) -> float:
        pairs = zip(x, cov, strict=True)
        return float(sum(multivariate_normal.logpdf(a, m, c) for a, c in pairs))

    weighted_mean = np.linalg.solve(information.sum(0), np.einsum("nij,nj->i", information, x))
    a, b = rng.standard_normal((2, 2))
    # half the sum of squares is minus the logarithm of the likelihood, but for a constant
    assert 0.5 * (squares(a) - squares(b)).sum() == pytest.approx(log_likelihood(b) - log_likelihood(a))
    norms = minimize(lambda m: np.sqrt(squares(m)).sum(), weighted_mean, method="Nelder-Mead").x
    assert np.linalg.norm(norms - weighted_mean) > 0.3
    assert log_likelihood(norms) < log_likelihood(weighted_mean) - 0.05


def test_a1_4_as_computed_is_half_the_sum_of_squares(rng: np.random.Generator) -> None:
    """The solver's cost against an explicit sum over observations, at points that are neither a minimum."""
    problem, _ = make(rng, with_cov=True)
    scene, seen = problem.scene, problem.seen
    assert seen.cov_uv is not None
    total = 0.0
    for o in range(len(seen)):
        camera = Pinhole.from_params(scene.intrinsics[0])
        e = (
            camera.pixel_from_world(scene.T_cam_world[seen.view[o]], scene.X_world[seen.point[o]]).uv
            - seen.uv[o]
        )
        total += float(e @ np.linalg.inv(seen.cov_uv[o]) @ e)
    cost = bundle_adjust(problem, options=Options(max_iterations=0)).initial_cost
    assert cost == pytest.approx(0.5 * total, rel=1e-12)


def test_a1_4_needs_the_measurement_and_not_its_mean(rng: np.random.Generator) -> None:
    """With the mean in the measurement's place, as the text has it, the truth costs nothing, noise or not."""
    problem, truth = make(rng, noise=1.0)
    seen = problem.seen
    mean = projection.pixel_from_world(
        truth.intrinsics[0], truth.T_cam_world[seen.view], truth.X_world[seen.point], lens=Pinhole.lens
    ).uv
    at_truth = problem.at(truth)
    none = Options(max_iterations=0)
    measured = bundle_adjust(at_truth, options=none).initial_cost
    means = bundle_adjust(
        dataclasses.replace(at_truth, seen=dataclasses.replace(seen, uv=mean)), options=none
    ).initial_cost
    assert means < 1e-15
    # 2 n squares of unit variance: n +- 5 sqrt(n), a false alarm in a million
    assert measured == pytest.approx(len(seen), abs=5 * np.sqrt(len(seen)))


def test_a2_9_needs_both_indices(rng: np.random.Generator) -> None:
    """e_j without i is one error for a point: then the sum over keyframes cannot see what a keyframe does."""
    problem, _ = make(rng, views=3, points=8, perturb=0.01)
    loss, seen = Tukey(20.0), problem.seen

    def errors(T_cam_world: np.ndarray) -> np.ndarray:
        scene = problem.scene
        at = projection.pixel_from_world(
            scene.intrinsics[0], T_cam_world[seen.view], scene.X_world[seen.point], lens=Pinhole.lens
        )
        return np.linalg.norm(at.uv - seen.uv, axis=1)

    def right(T_cam_world: np.ndarray) -> float:
        return float(loss.cost(errors(T_cam_world)).sum())

    def printed(T_cam_world: np.ndarray) -> float:
        e = errors(T_cam_world)
        of_point = np.array([e[(seen.point == j) & (seen.view == 0)][0] for j in range(8)])
        return float(sum(loss.cost(of_point[seen.point[seen.view == i]]).sum() for i in range(3)))

    T = problem.scene.T_cam_world
    moved = T.copy()
    moved[2] = se3.perturb(T[2], [0.01, 0, 0, 0, 0.005, 0])
    assert right(moved) != pytest.approx(right(T), rel=1e-3)
    assert printed(moved) == printed(T)
    computed = bundle_adjust(problem, Robust(loss, 1.0), Options(max_iterations=0)).initial_cost
    assert computed == pytest.approx(right(T), rel=1e-12)
    assert computed != pytest.approx(printed(T), rel=1e-3)
