"""A drive among landmarks, and a dense textbook EKF-SLAM: the oracle of this chapter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

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


class Textbook:
    """EKF-SLAM with full F, G, H and K for one run; Jacobians by complex step, so none is typed twice.

    Methods are small so that a test can replace one by a known mistake.
    """

    def __init__(self, mean: np.ndarray, cov: np.ndarray) -> None:
        self.x, self.P, self.ids = mean.copy(), cov.copy(), []  # type: ignore[var-annotated]

    @staticmethod
    def jacobian(f: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
        return np.stack([f(at + 1e-100j * e).imag / 1e-100 for e in np.eye(len(at))], 1)

    @staticmethod
    def move(x: np.ndarray, u: np.ndarray) -> np.ndarray:
        return np.stack([x[0] + u[0] * np.cos(x[2]), x[1] + u[0] * np.sin(x[2]), x[2] + u[1]])

    @staticmethod
    def see(x: np.ndarray, at: int) -> np.ndarray:
        dx, dy, c, s = x[at] - x[0], x[at + 1] - x[1], np.cos(x[2]), np.sin(x[2])
        return np.stack([c * dx + s * dy, c * dy - s * dx])

    @staticmethod
    def place(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        c, s = np.cos(x[2]), np.sin(x[2])
        return np.stack([x[0] + c * z[0] - s * z[1], x[1] + s * z[0] + c * z[1]])

    def motion_jacobians(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        F = self.jacobian(lambda p: self.move(p, u), self.x[:3])
        return F, self.jacobian(lambda v: self.move(self.x[:3], v), u)

    def motion_covariance(self, F: np.ndarray, P: np.ndarray) -> np.ndarray:
        return F @ P @ F.T

    def predict(self, u: np.ndarray, cov_u: np.ndarray) -> None:
        J, G3 = self.motion_jacobians(u)
        F, G = np.eye(len(self.x)), np.zeros((len(self.x), 2))
        F[:3, :3], G[:3] = J, G3
        self.x[:3] = self.move(self.x[:3], u)
        self.P = self.motion_covariance(F, self.P) + G @ cov_u @ G.T

    def update(self, ids: list[int], z: np.ndarray, cov_z: np.ndarray) -> None:
        known = [j for j, i in enumerate(ids) if i in self.ids]
        if known:
            at = [3 + 2 * self.ids.index(ids[j]) for j in known]
            H = np.vstack([self.jacobian(lambda x, a=a: self.see(x, a), self.x) for a in at])
            S = H @ self.P @ H.T + np.kron(np.eye(len(known)), cov_z)
            K = self.P @ H.T @ np.linalg.inv(S)
            self.x = self.x + K @ (z[known] - np.array([self.see(self.x, a) for a in at])).ravel()
            self.P = (np.eye(len(self.x)) - K @ H) @ self.P
        for j, i in enumerate(ids):
            if i not in self.ids:
                self.augment(i, z[j], cov_z)

    def augment(self, i: int, z: np.ndarray, cov_z: np.ndarray) -> None:
        G = np.zeros((2, len(self.x)))
        G[:, :3] = self.jacobian(lambda p: self.place(p, z), self.x[:3])
        Gz = self.jacobian(lambda m: self.place(self.x[:3], m), z)
        self.x = np.concatenate([self.x, self.place(self.x[:3], z)])
        self.P = np.block([[self.P, self.P @ G.T], [G @ self.P, G @ self.P @ G.T + Gz @ cov_z @ Gz.T]])
        self.ids.append(i)


@pytest.fixture(scope="session")
def new_drive() -> Callable[..., Drive]:
    return make_drive


@pytest.fixture(scope="session")
def textbook() -> type[Textbook]:
    return Textbook


@pytest.fixture(scope="session")
def relative_difference() -> Callable[..., float]:
    """Largest difference of one EkfSlam run to oracle (x, P, ids), relative to the largest entry."""

    def difference(slam: Any, x: np.ndarray, P: np.ndarray, ids: list[int], run: int = 0) -> float:
        mean, cov = slam.blocks.full()
        assert slam.blocks.ids.tolist() == ids
        d = mean[run] - x
        d[2] = np.angle(np.exp(1j * d[2]))
        return float(max(np.abs(d).max() / np.abs(x).max(), np.abs(cov[run] - P).max() / np.abs(P).max()))

    return difference
