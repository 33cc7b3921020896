"""Small scenes: cameras on an arc, points in a box, all in front of the cameras and inside the lens."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from vslam_ref.estimation.bundle import BundleProblem, Freedom, Observations, Scene, freedom
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, projection

SENSOR = {"fx": 480.0, "fy": 500.0, "cx": 315.0, "cy": 245.0}
CAMERAS: dict[str, Camera] = {
    "pinhole": Pinhole(**SENSOR),
    "radtan": Radtan(**SENSOR, k1=-0.2, k2=0.05, p1=2e-3, p2=-3e-3, k3=0.01),
    "fov": Fov(**SENSOR, omega=0.9),
    "fisheye": Fisheye(**SENSOR, k1=-0.02, k2=0.01, k3=-0.003, k4=0.001),
}


def poses(views: int) -> np.ndarray:
    """Cameras on an arc of radius 6 around the origin, looking inwards, each a little tilted."""
    angles = np.linspace(-0.5, 0.5, views)
    turn = np.stack([0.05 * np.sin(5 * angles), -angles, 0.1 * np.cos(3 * angles)], -1)
    xi = np.concatenate([np.zeros((views, 3)), turn], -1)
    return se3.perturb(se3.exp(xi), [0.05, -0.02, 6.0, 0.0, 0.0, 0.0])


def scene_and_links(
    rng: np.random.Generator, camera: Camera, views: int, points: int, sets: int, seen_by: int | None
) -> tuple[Scene, np.ndarray, np.ndarray]:
    X = rng.uniform(-1.5, 1.5, (points, 3))
    spread = 1.0 + 0.02 * rng.standard_normal((sets, len(camera.params)))
    scene = Scene(poses(views), X, np.tile(camera.params, (sets, 1)) * (spread if sets > 1 else 1.0))
    if seen_by is None:
        view, point = (a.ravel() for a in np.meshgrid(np.arange(views), np.arange(points), indexing="ij"))
    else:
        first = rng.integers(0, views - seen_by + 1, points)
        point = np.repeat(np.arange(points), seen_by)
        view = (first[:, None] + np.arange(seen_by)).ravel()
    order = rng.permutation(len(view))
    return scene, view[order], point[order]


def make(
    rng: np.random.Generator,
    model: str = "pinhole",
    *,
    views: int = 4,
    points: int = 12,
    sets: int = 1,
    seen_by: int | None = None,
    noise: float = 0.5,
    with_cov: bool = False,
    intrinsics: tuple[str, ...] = (),
    perturb: float = 0.02,
) -> tuple[BundleProblem, Scene]:
    """A problem that starts away from the truth, and the true scene."""
    camera = CAMERAS[model]
    truth, view, point = scene_and_links(rng, camera, views, points, sets, seen_by)
    lens = np.arange(views) % sets
    at = projection.pixel_from_world(
        truth.intrinsics[lens[view]], truth.T_cam_world[view], truth.X_world[point], lens=camera.lens
    )
    assert at.valid.all()
    cov, error = None, noise * rng.standard_normal(at.uv.shape)
    if with_cov:
        root = noise * (np.eye(2) + 0.5 * rng.uniform(-1, 1, (len(view), 2, 2)))
        cov = root @ np.swapaxes(root, 1, 2)
        error = np.einsum("nab,nb->na", root, rng.standard_normal(at.uv.shape))
    start = Scene(
        se3.perturb(truth.T_cam_world, perturb * rng.standard_normal((views, 6))),
        truth.X_world + perturb * rng.standard_normal(truth.X_world.shape),
        truth.intrinsics * (1.0 + (0.01 if intrinsics else 0.0) * (truth.intrinsics > 1)),
    )
    seen = Observations(view, point, at.uv + error, cov)
    free = freedom(type(camera), start, intrinsics=intrinsics)
    return BundleProblem(type(camera), start, seen, lens, free), truth


def hold(problem: BundleProblem, views: list[int], truth: Scene) -> BundleProblem:
    """The same problem with some views held at their true poses."""
    T = problem.scene.T_cam_world.copy()
    T[views] = truth.T_cam_world[views]
    problem = problem.at(dataclasses.replace(problem.scene, T_cam_world=T))
    pose = problem.free.pose.copy()
    pose[views] = False
    free = Freedom(pose, problem.free.point, problem.free.intrinsics)
    return dataclasses.replace(problem, free=free)


def dense_system(problem: BundleProblem, weights: np.ndarray | None = None) -> dict[str, Any]:
    """All rows of the Jacobian, dense, by the cameras' own functions: columns views, lenses, points."""
    V, N, n = problem.sizes
    q, L = problem.free.intrinsics.shape[1], len(problem.scene.intrinsics)
    J = np.zeros((2 * n, 6 * V + q * L + 3 * N))
    r = np.zeros(2 * n)
    for o in range(n):
        i, j = problem.seen.view[o], problem.seen.point[o]
        at = problem.lens_of_view[i]
        seen = projection.pixel_from_world_with_jacobians(
            problem.scene.intrinsics[at],
            problem.scene.T_cam_world[i],
            problem.scene.X_world[j],
            lens=problem.model.lens,
        )
        U = np.eye(2)
        if problem.seen.cov_uv is not None:
            U = np.linalg.cholesky(np.linalg.inv(problem.seen.cov_uv[o])).T
        if weights is not None:
            U = U * np.sqrt(weights[o])
        row = slice(2 * o, 2 * o + 2)
        J[row, 6 * i : 6 * i + 6] = U @ seen.J_pose * problem.free.pose[i]
        J[row, 6 * V + q * at : 6 * V + q * at + q] = U @ seen.J_intrinsics @ problem.free.intrinsics
        a = 6 * V + q * L + 3 * j
        J[row, a : a + 3] = U @ seen.J_point * problem.free.point[j]
        r[row] = U @ (seen.uv - problem.seen.uv[o])
    return {"J": J, "r": r, "views": V, "q": q, "lenses": L, "points": N}


@pytest.fixture
def rng() -> np.random.Generator:
    """Fresh, seeded numbers for each test."""
    return np.random.default_rng(20)
