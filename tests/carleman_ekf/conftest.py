"""A short drive among a few landmarks, the same for every form of the filter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from vslam_ref.filters import observation, vehicle
from vslam_ref.geometry import se2, so2
from vslam_ref.worlds import vehicle_field


class Step(NamedTuple):
    increment: vehicle.Increment
    ids: np.ndarray
    z: np.ndarray


class Drive(NamedTuple):
    mean: np.ndarray  # (B, 3)
    cov: np.ndarray  # (3, 3)
    cov_z: np.ndarray  # (2, 2)
    landmarks: np.ndarray  # (n, 2)
    steps: list[Step]

    def feed(self, slam: Any) -> list[Any]:
        """Run a filter through the drive; the innovations of all updates that had any."""
        seen = []
        for step in self.steps:
            slam.predict(step.increment)
            if len(step.ids):
                seen.append(slam.update(step.ids, step.z, self.cov_z))
        return [s for s in seen if s is not None]

    def every_landmark(self) -> tuple[np.ndarray, np.ndarray]:
        """Ids and a zero measurement of each landmark in every run: its innovation is minus r_i."""
        ids = np.unique(np.concatenate([s.ids for s in self.steps]))
        return ids, np.zeros((len(self.mean), len(ids), 2))


def make_drive(
    seed: int = 0, batch: int = 2, steps: int = 60, landmarks: int = 6, sigma: float = 0.04
) -> Drive:
    """A winding drive with correlated, large noise; landmarks enter one after the other."""
    rng = np.random.default_rng(seed)
    cov = np.array([[0.3, 0.05, 0.02], [0.05, 0.2, -0.03], [0.02, -0.03, 0.03]])
    cov_z = np.array([[0.02, 0.004], [0.004, 0.01]])
    cov_u = sigma**2 * np.array([[1.0, 0.3], [0.3, 0.8]])
    world = rng.uniform(-4, 10, (landmarks, 2))
    truth = np.array([0.5, -1.0, 0.7])
    mean = truth + rng.multivariate_normal(np.zeros(3), cov, batch)
    out = []
    for k in range(steps):
        u = np.array([0.4, 0.15 * np.sin(0.1 * k) + 0.03])
        truth = vehicle.propagate(truth, u)
        noisy = u + rng.multivariate_normal(np.zeros(2), cov_u, batch)
        ids, z = np.array([], dtype=int), np.zeros((batch, 0, 2))
        if k % 4 == 3:
            r = observation.vehicle_from_world(truth, world)
            ids = np.flatnonzero(np.hypot(*r.T) < 7.0)
            z = r[ids] + rng.multivariate_normal(np.zeros(2), cov_z, (batch, len(ids)))
        out.append(Step(vehicle.Increment(noisy[:, 0], noisy[:, 1], np.tile(cov_u, (batch, 1, 1))), ids, z))
    return Drive(mean, cov, cov_z, world, out)


@pytest.fixture(scope="session")
def drive() -> Drive:
    made = make_drive()
    first = [set(s.ids) for s in made.steps if len(s.ids)]
    assert set().union(*first) - first[0], "some landmarks must come late"
    return made


@pytest.fixture(scope="session")
def new_drive() -> Callable[..., Drive]:
    return make_drive


@pytest.fixture(scope="session")
def largest_difference() -> Callable[[Any, Any], float]:
    """Largest difference of two filters' poses and covariances, headings modulo a turn."""

    def largest(a: Any, b: Any) -> float:
        p, q = a.pose(), b.pose()
        d = p.mean - q.mean
        d[:, 2] = so2.wrap(d[:, 2])
        return float(max(np.abs(d).max(), np.abs(p.cov - q.cov).max()))

    return largest


def monomials(u: np.ndarray) -> np.ndarray:
    """u1, u2, u3, u2u2, u2u3, u3u3, u1u2, u1u3 of (ds, dalpha) (..., 2)."""
    u1, u2, u3 = u[..., 0], np.sin(u[..., 1]), np.cos(u[..., 1])
    return np.stack([u1, u2, u3, u2 * u2, u2 * u3, u3 * u3, u1 * u2, u1 * u3], -1)


def control_first_order(ds: float, dalpha: float, cov: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the monomials by a numeric Jacobian (sixth order: exact to 1e-13)."""
    at, h = np.array([ds, dalpha]), 5e-3
    J = np.zeros((8, 2))
    for j in range(2):
        e = np.eye(2)[j] * h
        D = [(monomials(at + e / k) - monomials(at - e / k)) * k / (2 * h) for k in (1, 2, 4)]
        once = [(4 * D[1] - D[0]) / 3, (4 * D[2] - D[1]) / 3]
        J[:, j] = (16 * once[1] - once[0]) / 15
    return monomials(at), J @ cov @ J.T


def control_quadrature(ds: float, dalpha: float, cov: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the monomials for Gaussian (ds, dalpha), by 24 x 24 Gauss-Hermite nodes."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(24)
    a, b = np.meshgrid(nodes, nodes, indexing="ij")
    p = np.outer(weights, weights).ravel() / (2 * np.pi)
    values, vectors = np.linalg.eigh(cov)
    root = vectors * np.sqrt(np.maximum(values, 0))
    v = monomials(np.array([ds, dalpha]) + np.stack([a.ravel(), b.ravel()], -1) @ root.T)
    mean = p @ v
    return mean, (p[:, None] * (v - mean)).T @ (v - mean)


class LiteralFilter:
    """The reduced filter, 5 + 2 n states, for one run, in textbook matrices and nothing clever.

    States x, y, s, c, w, then r_i per landmark.  ``keep_w=False`` holds w at 1: 4 + 2 n states.
    """

    def __init__(
        self, mean: np.ndarray, cov: np.ndarray, control: Callable[..., Any], keep_w: bool = True
    ) -> None:
        self.x, self.P, self.control, self.keep_w = mean.copy(), cov.copy(), control, keep_w
        self.ids: list[int] = []
        self.new_landmark_scale: Callable[[], float] = lambda: self.x[4]

    def move(self, v: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Bilinear in (1, v) and x."""
        u1, u2, u3, u22, _, u33, u12, u13 = v
        out = x.copy()
        out[:2] += u1 * x[[3, 2]]
        out[2:4] = x[2] * u3 + x[3] * u2, x[3] * u3 - x[2] * u2
        out[4] = (u22 + u33) * x[4] if self.keep_w else x[4]
        out[5::2] = x[5::2] * u3 + x[6::2] * u2 - u13 * x[4]
        out[6::2] = x[6::2] * u3 - x[5::2] * u2 + u12 * x[4]
        return out

    def predict(self, ds: float, dalpha: float, cov: np.ndarray) -> None:
        v, C = self.control(ds, dalpha, cov)
        F = np.stack([self.move(v, e) for e in np.eye(len(self.x))], 1)
        nothing = self.move(np.zeros(8), self.x)
        J = np.stack([self.move(e, self.x) - nothing for e in np.eye(8)], 1)
        self.x, self.P = F @ self.x, F @ self.P @ F.T + J @ C @ J.T

    def update(self, ids: Any, z: np.ndarray, cov_z: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        known = [j for j, i in enumerate(ids) if i in self.ids]
        seen = None
        if known:
            H = np.zeros((2 * len(known), len(self.x)))
            for row, j in enumerate(known):
                at = 5 + 2 * self.ids.index(ids[j])
                H[2 * row, at] = H[2 * row + 1, at + 1] = 1.0
            S = H @ self.P @ H.T + np.kron(np.eye(len(known)), cov_z)
            K = self.P @ H.T @ np.linalg.inv(S)
            innovation = z[known].ravel() - H @ self.x
            self.x, self.P = self.x + K @ innovation, (np.eye(len(self.x)) - K @ H) @ self.P
            seen = innovation, S
        for j, i in enumerate(ids):
            if i not in self.ids:
                w = self.new_landmark_scale()
                G = np.vstack([np.eye(len(self.x)), np.zeros((2, len(self.x)))])
                G[-2:, 4] = z[j]
                self.P = G @ self.P @ G.T
                self.P[-2:, -2:] += w**2 * cov_z
                self.x = np.concatenate([self.x, w * z[j]])
                self.ids.append(i)
        return seen


def reduction_of_vehicle() -> np.ndarray:
    """T for the vehicle states: (x, y, s, c, w) from z_R, shape (5, 11)."""
    T = np.zeros((5, 11))
    T[range(4), range(4)] = 1.0
    T[4, 4] = T[4, 5] = 1.0
    return T


@pytest.fixture(scope="session")
def literal() -> Callable[..., LiteralFilter]:
    """Build the literal filter: from a lifted start (11,), (11, 11) and a kind of control moments."""
    kinds = {"first_order": control_first_order, "gaussian": control_quadrature}

    def build(z: np.ndarray, P: np.ndarray, control: Any, keep_w: bool = True) -> LiteralFilter:
        T = reduction_of_vehicle()
        return LiteralFilter(T @ z, T @ P @ T.T, kinds.get(control, control), keep_w)

    return build


class Field(NamedTuple):
    """The standard field of seed B for a few runs: what a filter is fed, and the truth."""

    truth: np.ndarray  # (T + 1, 3)
    increments: list[vehicle.Increment]
    sightings: dict[int, tuple[np.ndarray, np.ndarray]]  # step -> ids, z
    cov_z: np.ndarray
    start: np.ndarray  # (B, 3), standard normal

    def run(self, make: Callable[[np.ndarray, np.ndarray], Any], P0: tuple[float, ...], look: Any) -> None:
        """Build a filter from a drawn start and its P0; call ``look(slam, step, what)`` after everything."""
        slam = make(self.truth[0] + self.start * np.sqrt(P0), np.diag(P0))
        for k in range(len(self.truth)):
            if k:
                slam.predict(self.increments[k - 1])
                look(slam, k, "predicted")
            if k in self.sightings:
                ids, z = self.sightings[k]
                slam.update(ids, z, self.cov_z)
                look(slam, k, "updated")


@pytest.fixture(scope="session")
def field() -> Callable[..., Field]:
    """Build the standard field for a number of laps and runs, turned as a whole about the origin."""

    def build(laps: int, runs: int, turn: float = 0.0) -> Field:
        config = vehicle_field.VehicleFieldConfig(laps=laps)
        world = vehicle_field.make_field(config, np.random.default_rng(0))
        noise = vehicle_field.draw_noise(world, [np.random.default_rng(i) for i in range(runs)])
        u = world.controls + noise.controls * np.array([config.sigma_v, config.sigma_phi])
        steps = [
            vehicle.ackermann_increment(u[:, k], config.cov_u, config.wheelbase, config.dt)
            for k in range(config.steps)
        ]
        seen = {
            s.step: (s.ids, s.z + config.sigma_z * e)
            for s, e in zip(world.sightings, noise.sightings, strict=True)
        }
        truth = se2.compose([0.0, 0.0, turn], world.T_world_vehicle)
        start = np.concatenate([so2.rotate(turn, noise.start[:, :2]), noise.start[:, 2:]], 1)
        return Field(truth, steps, seen, config.cov_z, start)

    return build
