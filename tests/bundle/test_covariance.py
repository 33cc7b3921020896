"""Covariances against the dense inverse, against repetition, and what the gauge changes in them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats

from vslam_ref.estimation.bundle import Freedom, Observations, Options, bundle_adjust
from vslam_ref.estimation.bundle.covariance import covariance
from vslam_ref.estimation.bundle.gauge import fix_gauge, gauge_directions
from vslam_ref.geometry import camera_pose, se3

from .conftest import dense_system, hold, make

TIGHT = Options(cost=1e-14, gradient=1e-13)
SETTINGS = {
    "pinhole": {},
    "covariances": {"with_cov": True},
    "own lenses": {"sets": 4, "intrinsics": ("f",)},
    "shared lens": {"intrinsics": ("f", "k1")},
}


def rows_of(problem: object, views: list[int], points: list[int]) -> list[int]:
    V, q, L = problem.sizes[0], problem.free.intrinsics.shape[1], len(problem.scene.intrinsics)  # type: ignore[attr-defined]
    columns = [6 * i + a for i in views for a in range(6)]
    return columns + [6 * V + q * L + 3 * j + a for j in points for a in range(3)]


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("gauge", ["fixed", "free"])
def test_equals_the_dense_inverse(name: str, gauge: str, rng: np.random.Generator) -> None:
    """Pseudo-inverse of the whole normal matrix, with columns of what is held zero: cond times eps."""
    problem, _ = make(rng, "radtan", points=14, **SETTINGS[name])
    if gauge == "fixed":
        problem = fix_gauge(problem)
    result = bundle_adjust(problem, options=TIGHT)
    system = dense_system(result.problem)
    # a cut-off between the seven zeros and the smallest of the rest
    want = np.linalg.pinv(system["J"], rcond=1e-11)
    want = 0.49 * want @ want.T
    found = covariance(result, [2, 3], [5, 0], gauge=gauge, sigma=0.7)  # type: ignore[arg-type]
    rows = rows_of(problem, [2, 3], [5, 0])
    assert found.matrix is not None, found.reason
    assert found.view is not None
    assert found.point is not None
    expected = want[np.ix_(rows, rows)]
    assert np.abs(found.matrix - expected).max() < 1e-6 * np.abs(expected).max()
    assert np.abs(found.view[1] - found.matrix[6:12, 6:12]).max() == 0.0
    assert np.abs(found.point[1] - found.matrix[15:, 15:]).max() == 0.0


def test_sigma_is_estimated_from_the_residuals(rng: np.random.Generator) -> None:
    """Chi-squared with 2n - parameters + 7: a band with a false-alarm rate of 1e-4."""
    problem, _ = make(rng, views=6, points=60, noise=0.5)
    result = bundle_adjust(problem, options=TIGHT)
    dof = 2 * 360 - 36 - 180 + 7
    low, high = np.sqrt(stats.chi2.ppf([5e-5, 1 - 5e-5], dof) / dof)
    for gauge in ("free", "fixed"):
        used = result if gauge == "free" else bundle_adjust(fix_gauge(problem), options=TIGHT)
        found = covariance(used, [1], gauge=gauge)  # type: ignore[arg-type]
        assert low * 0.5 < found.sigma < high * 0.5
        assert found.sigma == pytest.approx(np.sqrt(2 * used.cost / dof), rel=1e-12)


def test_repetition_scatters_as_predicted(rng: np.random.Generator) -> None:
    """120 draws of the noise at one scene: the Mahalanobis lengths are chi-squared; false alarms 1e-4.

    Noise of 0.05 pixels keeps what is not linear below a hundredth of a standard deviation.
    """
    problem, truth = make(rng, views=4, points=12, noise=0.0)
    problem = fix_gauge(hold(problem.at(truth), [], truth))
    seen = problem.seen
    sigma, total, draws = 0.05, 0.0, 120
    exact = bundle_adjust(problem, options=TIGHT)
    found = covariance(exact, [1, 3], [4, 7], sigma=sigma)
    assert found.matrix is not None
    live = np.diag(found.matrix) > 0  # one coordinate holds the scale
    inverse = np.linalg.inv(found.matrix[np.ix_(live, live)])
    for _ in range(draws):
        uv = seen.uv + sigma * rng.standard_normal(seen.uv.shape)
        noisy = dataclasses.replace(problem, seen=dataclasses.replace(seen, uv=uv))
        scene = bundle_adjust(noisy, options=Options(cost=1e-10)).problem.scene
        moved = se3.log(scene.T_cam_world[[1, 3]] @ se3.inverse(truth.T_cam_world[[1, 3]])).ravel()
        error = np.concatenate([moved, (scene.X_world - truth.X_world)[[4, 7]].ravel()])[live]
        total += float(error @ inverse @ error)
    low, high = stats.chi2.ppf([5e-5, 1 - 5e-5], draws * int(live.sum()))
    assert low < total < high


def test_gauge_directions_change_no_image(rng: np.random.Generator) -> None:
    """J g = 0 for all seven, and they are independent; any other direction is seen."""
    problem, _ = make(rng, views=4, points=10)
    system = dense_system(problem)
    views, points = gauge_directions(problem.scene)
    lens = np.zeros((system["q"] * system["lenses"], 7))
    G = np.concatenate([views.reshape(-1, 7), lens, points.reshape(-1, 7)])
    J = system["J"]
    assert np.abs(J @ G).max() < 1e-12 * np.abs(J).max() * np.abs(G).max()
    assert np.linalg.matrix_rank(G) == 7
    values = np.linalg.svd(J, compute_uv=False)
    assert np.count_nonzero(values < 1e-10 * values[0]) == 7


def test_invariants_are_as_sure_in_every_gauge(rng: np.random.Generator) -> None:
    """Ratio of two distances of points: the same variance from either covariance; a coordinate is not."""
    problem, _ = make(rng, views=4, points=12)
    free = bundle_adjust(problem, options=TIGHT)
    fixed = dataclasses.replace(free, problem=fix_gauge(free.problem))
    X = free.problem.scene.X_world
    chosen = [0, 1, 2]

    def gradient(step: float = 1e-6) -> np.ndarray:
        def ratio(x: np.ndarray) -> float:
            a, b, c = x.reshape(3, 3)
            return float(np.linalg.norm(a - b) / np.linalg.norm(a - c))

        x = X[chosen].ravel()
        return np.array([(ratio(x + h) - ratio(x - h)) / (2 * step) for h in step * np.eye(9)])

    g = gradient()
    a = covariance(free, points=chosen, gauge="free", sigma=1.0).matrix
    b = covariance(fixed, points=chosen, sigma=1.0).matrix
    assert a is not None
    assert b is not None
    assert g @ a @ g == pytest.approx(g @ b @ g, rel=1e-6)
    assert np.trace(a) < 0.8 * np.trace(b)  # the free gauge has the least trace of all


def test_fix_gauge_holds_seven_coordinates(rng: np.random.Generator) -> None:
    problem, _ = make(rng, views=5)
    held = fix_gauge(problem, view=2)
    assert (~held.free.pose).sum() == 7
    assert not held.free.pose[2].any()
    other = int(np.flatnonzero((~held.free.pose).sum(1) == 1)[0])
    centres = camera_pose.centre_from_pose(problem.scene.T_cam_world)
    assert other == np.argmax(np.linalg.norm(centres - centres[2], axis=1))
    values = np.linalg.svd(dense_system(held)["J"], compute_uv=False)
    assert np.count_nonzero(values < 1e-10 * values[0]) == 7  # the seven empty columns, and no more
    with pytest.raises(ValueError, match="view 9"):
        fix_gauge(problem, view=9)


def test_what_has_no_covariance_says_why(rng: np.random.Generator) -> None:
    problem, truth = make(rng, views=4, points=12)
    result = bundle_adjust(problem, options=TIGHT)
    assert "gauge is free" in covariance(result, [1], sigma=1.0).reason
    held = hold(problem, [0], truth)
    with pytest.raises(ValueError, match="holds a view"):
        covariance(bundle_adjust(held), [1], gauge="free")
    with pytest.raises(ValueError, match="point 12"):
        covariance(result, points=[12], gauge="free")
    once = (problem.seen.point != 5) | (problem.seen.view == 1)
    weak = dataclasses.replace(hold(problem, [0, 3], truth), seen=problem.seen.only(once))
    told = covariance(bundle_adjust(weak), [1], [5], sigma=1.0)
    assert told.matrix is None
    assert "point 5" in told.reason
    few = Observations(problem.seen.view[:3], problem.seen.point[:3], problem.seen.uv[:3])
    assert "noise is unknown" in covariance(bundle_adjust(dataclasses.replace(held, seen=few)), [1]).reason


def test_held_coordinates_have_no_variance(rng: np.random.Generator) -> None:
    problem, truth = make(rng, views=4, points=12)
    problem = hold(problem, [0, 3], truth)
    free = Freedom(problem.free.pose, np.arange(12) != 5, problem.free.intrinsics)
    found = covariance(bundle_adjust(dataclasses.replace(problem, free=free)), [0, 1], [5, 6], sigma=1.0)
    assert found.view is not None
    assert found.point is not None
    assert not found.view[0].any()
    assert not found.point[0].any()
    assert (np.linalg.eigvalsh(found.view[1]) > 0).all()
    assert (np.linalg.eigvalsh(found.point[1]) > 0).all()
