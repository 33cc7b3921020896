"""A simulated robot among landmarks, written in MRCLAM format: reader and runner without any real data."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from vslam_ref.filters import observation, vehicle
from vslam_ref.systems.slam_log import Calibration

LANDMARKS = np.array([[0.5, 4.2], [-3.8, 0.4], [0.3, -4.0], [4.1, 0.2], [2.9, 3.1], [-2.7, -3.0]])
CALIBRATION = Calibration(
    sigma_distance=0.02, sigma_turn=0.02, sigma_drift=0.02, sigma_range=0.05, sigma_bearing=0.02
)


class World(NamedTuple):
    """Times (T,), true poses (T, 3) and the folder a log of it lies in."""

    folder: Path
    times: np.ndarray
    poses: np.ndarray


def drive(seconds: float, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An eight, one loop left, one right; controls (T, 2) hold from each time on."""
    times = np.arange(0, seconds, dt)
    controls = np.column_stack([np.full(len(times), 0.5), np.where(np.sin(times / 8) >= 0, 0.3, -0.3)])
    poses = np.zeros((len(times), 3))
    poses[0] = [0.3, -0.2, 0.4]
    for k in range(len(times) - 1):
        poses[k + 1] = vehicle.propagate(poses[k], controls[k] * dt)
    return times, controls, poses


def write_world(
    folder: Path, noise: Calibration | None, rng: np.random.Generator, seconds: float = 60.0
) -> World:
    """Write one robot's log; with ``noise`` exactly the noises that calibration describes."""
    folder.mkdir(parents=True, exist_ok=True)
    dt = 0.05
    times, controls, poses = drive(seconds, dt)
    logged = controls.copy()
    if noise is not None:
        inc = np.abs(controls * dt)
        sd = np.sqrt(
            np.column_stack(
                [
                    noise.sigma_distance**2 * inc[:, 0],
                    noise.sigma_turn**2 * inc[:, 1] + noise.sigma_drift**2 * inc[:, 0],
                ]
            )
        )
        logged += sd / dt * rng.standard_normal(sd.shape)
    rows = []
    for k in range(0, len(times), 10):
        z = observation.vehicle_from_world(poses[k], LANDMARKS)
        r, b = np.hypot(*z.T), np.arctan2(z[:, 1], z[:, 0])
        for j in np.flatnonzero((np.abs(b) < 1.0) & (r < 6.0)):
            e = (
                rng.standard_normal(2) * [noise.sigma_range, noise.sigma_bearing]
                if noise is not None
                else (0, 0)
            )
            rows.append(f"{1000 + times[k]:.6f} {60 + j} {r[j] + e[0]:.12f} {b[j] + e[1]:.12f}")
    lines = {
        "Barcodes.dat": [f"{s} {s}" for s in range(1, 6)]
        + [f"{6 + j} {60 + j}" for j in range(len(LANDMARKS))],
        "Robot1_Odometry.dat": [
            f"{1000 + t:.6f} {v:.12f} {w:.12f}" for t, (v, w) in zip(times, logged, strict=True)
        ],
        "Robot1_Measurement.dat": rows,
        "Robot1_Groundtruth.dat": [
            f"{1000 + t:.6f} {x:.9f} {y:.9f} {a:.9f}" for t, (x, y, a) in zip(times, poses, strict=True)
        ],
        "Landmark_Groundtruth.dat": [f"{6 + j} {x} {y} 0 0" for j, (x, y) in enumerate(LANDMARKS)],
    }
    for name, content in lines.items():
        (folder / name).write_text("# simulated\n" + "\n".join(content) + "\n")
    return World(folder, times, poses)


@pytest.fixture
def make_world(tmp_path: Path) -> Callable[..., World]:
    """Return a writer of worlds; call it with a name, a noise (or None) and a seed."""

    def make(name: str, noise: Calibration | None, seed: int = 0, seconds: float = 60.0) -> World:
        return write_world(tmp_path / name, noise, np.random.default_rng(seed), seconds)

    return make


@pytest.fixture
def calibration() -> Calibration:
    """Noises of the simulated world."""
    return CALIBRATION
