"""A drive among landmarks, and the book's EKF-SLAM in whole matrices to feed with it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from vslam_ref.filters import book
from vslam_ref.filters.vehicle import Increment


class Step(NamedTuple):
    increment: Increment
    ids: np.ndarray
    z: np.ndarray


class Drive(NamedTuple):
    mean: np.ndarray  # (B, 3)
    cov: np.ndarray  # (3, 3)
    cov_z: np.ndarray  # (2, 2)
    truth: np.ndarray  # (T + 1, 3)
    landmarks: np.ndarray
    steps: list[Step]

    def feed(self, slam: Any) -> list[Any]:
        """Run a filter through the drive and collect what its updates return."""
        out = []
        for step in self.steps:
            slam.predict(step.increment)
            if len(step.ids):
                out.append(slam.update(step.ids, step.z, self.cov_z))
        return out


def make_drive(seed: int = 3, batch: int = 1, steps: int = 300, landmarks: int = 8, every: int = 5) -> Drive:
    """A circle of 6 m radius with correlated noises; turns cross +-pi several times."""
    rng = np.random.default_rng(seed)
    cov = np.array([[0.2, 0.03, 0.01], [0.03, 0.1, -0.01], [0.01, -0.01, 0.01]])
    cov_z = np.array([[0.02, 0.004], [0.004, 0.01]])
    cov_u = 1e-3 * np.array([[1.0, 0.3], [0.3, 0.5]])
    world = rng.uniform(-9, 9, (landmarks, 2))
    truth = [np.array([0.0, -6.0, 0.1])]
    mean = truth[0] + rng.multivariate_normal(np.zeros(3), cov, batch)
    out = []
    for k in range(steps):
        u = np.array([0.3, 0.05])
        x, y, theta = truth[-1]
        truth.append(np.array([x + u[0] * np.cos(theta), y + u[0] * np.sin(theta), theta + u[1]]))
        noisy = u + rng.multivariate_normal(np.zeros(2), cov_u, batch)
        ids, z = np.array([], dtype=int), np.zeros((batch, 0, 2))
        if k % every == every - 1:
            zc = (world - truth[-1][:2]) @ np.array([1, 1j]) * np.exp(-1j * truth[-1][2])
            ids = rng.permutation(np.flatnonzero(np.abs(zc) < 8))
            z = np.stack([zc.real, zc.imag], -1)[ids] + rng.multivariate_normal(
                [0, 0], cov_z, (batch, len(ids))
            )
        out.append(Step(Increment(noisy[:, 0], noisy[:, 1], np.tile(cov_u, (batch, 1, 1))), ids, z))
    return Drive(mean, cov, cov_z, np.array(truth), world, out)


class BookFilter:
    """``filters/book.py``, or a version of it with a mistake, fed with run ``b`` of a drive."""

    def __init__(self, mean: np.ndarray, cov: np.ndarray, module: Any = book) -> None:
        self.book, self.belief = module, module.Belief(mean.copy(), cov.copy())

    def predict(self, increment: Increment, b: int = 0) -> None:
        self.belief = self.book.predict(self.belief, *(part[b] for part in increment))

    def update(self, ids: Any, z: np.ndarray, cov_z: np.ndarray) -> None:
        cov_z = np.broadcast_to(cov_z, (len(ids), 2, 2))
        self.belief = self.book.see(self.belief, np.asarray(ids).tolist(), z, cov_z)

    def feed(self, drive: Drive, b: int = 0) -> BookFilter:
        for step in drive.steps:
            self.predict(step.increment, b)
            self.update(step.ids, step.z[b], drive.cov_z)
        return self


@pytest.fixture(scope="session")
def new_drive() -> Callable[..., Drive]:
    return make_drive


@pytest.fixture(scope="session")
def book_filter() -> type[BookFilter]:
    return BookFilter


@pytest.fixture(scope="session")
def relative_difference() -> Callable[..., float]:
    """Largest difference of one EkfSlam run to (X, P, ids), relative to the largest entry."""

    def difference(slam: Any, x: np.ndarray, P: np.ndarray, ids: Any, run: int = 0) -> float:
        mean, cov = slam.blocks.full()
        assert slam.blocks.ids.tolist() == list(ids)
        d = mean[run] - x
        d[2] = np.angle(np.exp(1j * d[2]))
        return float(max(np.abs(d).max() / np.abs(x).max(), np.abs(cov[run] - P).max() / np.abs(P).max()))

    return difference
