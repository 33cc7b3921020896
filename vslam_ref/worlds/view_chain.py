"""A bundle adjustment problem of any size: a chain of views as from a car on a winding road."""

from __future__ import annotations

import numpy as np

from vslam_ref.estimation.bundle import BundleProblem, Observations, Scene, freedom
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Radtan, projection

POINTS_PER_VIEW = 220
LEAST_PARALLAX = np.radians(1.5)
"""Points whose outer rays meet at less are left out: noise sends them behind a camera, where solvers differ
in what they count."""
MEAN_TRACK = 4.1
"""Views that see a point, on average; at least two."""


def chain(views: int, seed: int = 0) -> BundleProblem:
    """Views a metre apart along a winding road, points ahead of them; each view has its own f, k1, k2.

    Half a pixel of noise; the start is off by 3 mrad and 3 cm, the points by 8 cm, focal lengths by 1 %.
    """
    rng = np.random.default_rng(seed)
    yaw = 0.25 * np.sin(np.arange(views) / 9.0)
    phi = np.stack([0.02 * np.cos(np.arange(views)), yaw, 0.01 * np.sin(np.arange(views))], -1)
    R_world_cam = so3.exp(phi)
    centres = np.cumsum(R_world_cam[:, :, 2], axis=0)
    T = se3.inverse(se3.from_rt(R_world_cam, centres))
    lenses = np.zeros((views, 9))
    lenses[:, 0] = lenses[:, 1] = rng.normal(500.0, 20.0, views)
    lenses[:, 4], lenses[:, 5] = rng.normal(-1e-2, 3e-3, views), rng.normal(0.0, 1e-3, views)
    points = POINTS_PER_VIEW * views
    length = np.minimum(1 + rng.geometric(1.0 / (MEAN_TRACK - 1.0), points), views)
    first = rng.integers(0, views - length + 1)
    view = np.concatenate([np.arange(a, a + n) for a, n in zip(first, length, strict=True)])
    point = np.repeat(np.arange(points), length)
    # a point is placed in sight of its last view: the others are behind that one and see it farther away
    depth = rng.uniform(3.0, 25.0, points)
    ray = np.stack([rng.uniform(-0.55, 0.55, points), rng.uniform(-0.4, 0.4, points), np.ones(points)], -1)
    X = se3.act(se3.inverse(T)[first + length - 1], depth[:, None] * ray)
    rays = X[:, None] - centres[np.stack([first, first + length - 1], -1)]
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    keep = np.einsum("ni,ni->n", rays[:, 0], rays[:, 1]) < np.cos(LEAST_PARALLAX)
    of_kept = keep[point]
    view, point, X = view[of_kept], (np.cumsum(keep) - 1)[point[of_kept]], X[keep]
    uv, valid = projection.pixel_from_world(lenses[view], T[view], X[point], lens=Radtan.lens)
    uv = uv + 0.5 * rng.standard_normal(uv.shape)
    off = lenses + rng.standard_normal((views, 9)) * [0, 0, 0, 0, 2e-3, 1e-3, 0, 0, 0]
    off[:, :2] += 5.0 * rng.standard_normal((views, 1))
    xi = rng.standard_normal((views, 6)) * np.repeat([0.03, 3e-3], 3)
    start = Scene(se3.perturb(T, xi), X + 0.08 * rng.standard_normal(X.shape), off)
    seen = Observations(view[valid], point[valid], uv[valid])
    return BundleProblem(Radtan, start, seen, free=freedom(Radtan, start, intrinsics=("f", "k1", "k2")))
