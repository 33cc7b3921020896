"""Landmarks composed from pose and r_i: book, fast form, and moments by quadrature.

The oracle of the moments is Gauss-Hermite quadrature of p + R(theta) r over the five-dimensional Gaussian,
the heading's axis first: 30 nodes there (the error of e^{2 i theta} at a variance below 1 is under
2^60 30!/60! = 4e-32), and 3 nodes in the other axes, in which mean and covariance are of degree 2.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from vslam_ref.filters.carleman_ekf import ReducedCarlemanEkf, book, carleman_ekf
from vslam_ref.filters.carleman_ekf.composition import compose_first_order, compose_gaussian
from vslam_ref.filters.carleman_ekf.reduced import READOUTS
from vslam_ref.filters.vehicle import Increment

EQUAL = 2e-11
"""As in ``test_reduction_theorem``."""
QUADRATURE = 1e-12
"""2430 terms of at most 100 m^2 with weights that sum to 1: 100 * eps * sqrt(2430) = 1e-12."""


def random_case(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(5, 5)) * np.array([0.5, 0.4, 0.3, 0.4, 0.5])[:, None]
    return rng.uniform(-3, 3, 3), A @ A.T / 5, rng.uniform(-4, 4, 2)


def quadrature(pose: np.ndarray, P: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = [2, 0, 1, 3, 4]  # the heading depends on the first axis only
    L = np.linalg.cholesky(P[np.ix_(order, order)])
    rules = [np.polynomial.hermite_e.hermegauss(n) for n in (30, 3, 3, 3, 3)]
    nodes = np.array(list(product(*[x for x, _ in rules])))
    weights = np.array([np.prod(w) for w in product(*[w / w.sum() for _, w in rules])])
    theta, x, y, r1, r2 = (nodes @ L.T + np.array([pose[2], *pose[:2], *r])).T
    places = np.stack(
        [x + np.cos(theta) * r1 - np.sin(theta) * r2, y + np.sin(theta) * r1 + np.cos(theta) * r2]
    )
    mean = places @ weights
    d = places - mean[:, None]
    return mean, (d * weights) @ d.T


@pytest.mark.parametrize("seed", range(6))
def test_the_exact_moments_are_those_of_quadrature(seed: int) -> None:
    case = random_case(seed)
    for found, expected in zip(compose_gaussian(*case), quadrature(*case), strict=True):
        assert np.abs(found - expected).max() < QUADRATURE


@pytest.mark.parametrize("seed", range(6))
def test_first_order_misses_by_the_next_order(seed: int) -> None:
    """Ten times less noise: the mean's error falls tenfold, the covariance's a hundredfold.

    A wrong first-order covariance would fall tenfold only.  The order after the next is relatively 1e-3 of
    its variances (below 1, lengths below 10 m), so within 0.1 of the power.
    """
    pose, P, r = random_case(seed)
    errors = []
    for scale in (1e-3, 1e-4):
        first, exact = compose_first_order(pose, scale * P, r), quadrature(pose, scale * P, r)
        errors.append([np.abs(a - b).max() for a, b in zip(first, exact, strict=True)])
    powers = np.log10(np.array(errors[0]) / np.array(errors[1]))
    assert powers == pytest.approx([1.0, 2.0], abs=0.1)


def test_without_noise_both_moments_are_the_point() -> None:
    pose, P, r = random_case(0)
    (a, cov_a), (b, cov_b) = (f(pose, 0 * P, r) for f in (compose_first_order, compose_gaussian))
    assert np.abs(a - b).max() < 1e-14 * 10  # one rounding of numbers below 10 m, a few times
    assert not cov_a.any()
    assert np.abs(cov_b).max() < 1e-14 * 100  # m^2


@pytest.mark.parametrize("form", ["reduced", "reduced-map"])
def test_the_filter_composes_what_the_book_composes(drive: Any, form: str) -> None:
    slam: Any = carleman_ekf(drive.mean, drive.cov, form, capacity=2)
    drive.feed(slam)
    slam.predict(drive.steps[0].increment)  # increments that wait are in the map too
    found = slam.landmarks(readout="composed")
    for b in range(slam.runs):
        belief = book.start_reduced(drive.mean[b], drive.cov)
        for step in drive.steps:
            belief = book.predict_reduced(belief, *(part[b] for part in step.increment))
            cov_z = np.broadcast_to(drive.cov_z, (len(step.ids), 2, 2))
            belief = book.see(belief, step.ids.tolist(), step.z[b], cov_z, False)
        belief = book.predict_reduced(belief, *(part[b] for part in drive.steps[0].increment))
        for at, i in enumerate(found.ids.tolist()):
            mean, cov = book.composed(belief, i)
            assert np.abs(found.mean[b, at] - mean).max() < EQUAL
            assert np.abs(found.cov[b, at] - cov).max() < EQUAL


@pytest.mark.parametrize("readout", ["composed", "lifted"])
def test_only_the_composed_map_predicts_what_the_filter_predicts(drive: Any, readout: str) -> None:
    """R^T (landmark - p) is the filter's own predicted sighting; the lifted map's is another one."""
    slam = ReducedCarlemanEkf(drive.mean, drive.cov, with_map=True)
    drive.feed(slam)
    found, (x, y, theta) = slam.landmarks(readout=readout), slam.pose().mean.T[:, :, None]
    d = found.mean - np.concatenate([x, y], 1)[:, None]
    s, c = np.sin(theta), np.cos(theta)
    predicted = np.stack([c * d[..., 0] + s * d[..., 1], c * d[..., 1] - s * d[..., 0]], -1)
    seen = slam.innovation(found.ids, np.zeros_like(predicted), drive.cov_z)
    assert seen is not None
    off = np.abs(predicted + seen.innovation.reshape(predicted.shape)).max()
    assert off < EQUAL if readout == "composed" else off > 1e-3


def test_all_readouts_meet_when_the_noise_goes_away() -> None:
    """The three maps differ by second moments: a tenth of the noise, a hundredth of the difference.

    The errors of the sightings shrink with their standard deviations, so the next order is relatively
    1e-3 (standard deviations in metres and radians) times lengths of 10 m: far from the first order's 10.
    """
    cov, cov_u, cov_z = np.diag([0.2, 0.1, 0.03]), np.diag([0.02, 0.01]), np.diag([0.02, 0.01])
    draws, gaps = np.random.default_rng(4).normal(size=(12, 2)), []
    for sigma in (1e-3, 1e-4):
        slam = ReducedCarlemanEkf(np.array([2.0, 1.0, 0.6]), sigma**2 * cov, with_map=True)
        ahead = np.array([6.0, 3.0])
        for draw in draws:  # straight on, 0.3 m a step, landmark to the left
            slam.update([0], (ahead + 0.1 * sigma * draw)[None, None], sigma**2 * cov_z)
            slam.predict(Increment(np.array([0.3]), np.array([0.0]), sigma**2 * cov_u[None]))
            ahead = ahead - [0.3, 0.0]
        lifted, first, exact = (slam.landmarks(readout=name).mean for name in READOUTS)
        gaps.append([np.abs(lifted - first).max(), np.abs(exact - first).max()])
    assert np.array(gaps[0]) / np.array(gaps[1]) == pytest.approx([100.0, 100.0], rel=0.1)


def test_an_empty_map_is_composed_of_nothing(drive: Any) -> None:
    for name in ("composed", "composed_gaussian"):
        found = ReducedCarlemanEkf(drive.mean, drive.cov).landmarks(readout=name)
        assert found.mean.shape == (2, 0, 2)
        assert found.cov.shape == (2, 0, 2, 2)


def test_another_readout_is_refused(drive: Any) -> None:
    with pytest.raises(ValueError, match="readout='exact': must be one of lifted, composed"):
        ReducedCarlemanEkf(drive.mean, drive.cov).landmarks(readout="exact")
