"""Points from the cameras, and each camera from the points that the others made."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.least_squares import Options, minimise
from vslam_ref.estimation.resection import Resection, refine_pose, refine_pose_robust
from vslam_ref.estimation.robust import mad_scale, tuned
from vslam_ref.estimation.triangulation import Triangulation, triangulate
from vslam_ref.experiments.multiview.scene import MultiviewConfig, World, moved
from vslam_ref.geometry import camera_pose, se3, so3
from vslam_ref.geometry.cameras import Camera, Pinhole, WorldProjectionJacobians
from vslam_ref.geometry.multiview import (
    Views,
    epipolar_distance,
    essential_from_motion,
    fundamental_from_essential,
    relative_motion,
    sampson_distance,
)


class Flipped(Pinhole):
    """A pinhole whose Jacobian in the pose has the wrong sign: what must not work."""

    def pixel_from_world_with_jacobians(
        self, T_cam_world: object, X_world: object
    ) -> WorldProjectionJacobians:
        """The right pixels and the wrong slope."""
        at = super().pixel_from_world_with_jacobians(T_cam_world, X_world)  # type: ignore[arg-type]
        return at._replace(J_pose=-at.J_pose)


class Error(NamedTuple):
    """How far a resected camera is from the true one: degrees, metres, pixels, and the steps it took."""

    turn: float
    shift: float
    rmse_px: float
    iterations: int


class Resected(NamedTuple):
    """One camera that was left out and found again.

    Attributes
    ----------
    view, points : int
    held_out_px : float
        Median distance, in its picture, of the points that the *other* cameras made; its true pose.
    inliers : float
        Share of points that the robust loss keeps.
    start, robust, plain, flipped : Error
        The perturbed start; Huber then Tukey; least squares on the same pixels; the robust one with the
        sign of its Jacobian turned.  ``rmse_px`` of all is over the robust one's inliers.
    """

    view: int
    points: int
    held_out_px: float
    inliers: float
    start: Error
    robust: Error
    plain: Error
    flipped: Error


class Reconstruction(NamedTuple):
    """Everything that is judged and drawn.

    Attributes
    ----------
    config : MultiviewConfig
    world : World
        Its pixels moved by ``shift_px``.
    shift_px, shift_sd_px : ndarray, shape (2,)
        What the pairs' epipolar distances say of the principal point: (du, dv) to add to all pixels.  Zero
        where they say too little.
    points : Triangulation
    consistent : ndarray of bool, shape (N,)
        Tracks whose pairs agree within ``gate_px``.
    pair_px, pair_px_as_filed : dict
        Median distances to epipolar lines; with pixels moved, and without.
    resected, as_filed : tuple of Resected
        Every picture with enough points; with pixels moved, and without.
    """

    config: MultiviewConfig
    world: World
    shift_px: Array
    shift_sd_px: Array
    points: Triangulation
    consistent: BoolArray
    pair_px: dict[str, float]
    pair_px_as_filed: dict[str, float]
    resected: tuple[Resected, ...]
    as_filed: tuple[Resected, ...]


def study_world(config: MultiviewConfig, filed: World) -> Reconstruction:
    """Triangulate all tracks, measure all pairs, leave out and resect every camera."""
    shift, sd = principal_offset(filed)
    shift = shift if sd.max() <= config.shift_known_px else np.zeros(2)
    world = moved(filed, shift)
    points = triangulate(world.views, world.uv, world.mask)
    consistent = pairwise_distance(world.views, world.uv, world.mask) <= config.gate_px
    resected = _leave_each_out(config, world)
    return Reconstruction(
        config,
        world,
        shift,
        sd,
        points,
        consistent,
        pair_medians(world),
        pair_medians(filed),
        resected,
        _leave_each_out(config, filed) if shift.any() else resected,
    )


def principal_offset(world: World) -> tuple[Array, Array]:
    """Offset (du, dv) of all pixels with the smallest Sampson distances, and its standard deviations.

    Two numbers, from all pairs with at least 30 matches.  Cameras that all hang the same way say little: the
    offset is then nearly a turn of each.  Tukey's loss, its scale from the distances themselves.
    """
    pairs = [(fundamental(world.views, i, j), a, b) for (i, j), (a, b) in world.pairs.items() if len(a) >= 30]
    if not pairs:
        return np.zeros(2), np.full(2, np.inf)

    def distances(shift: Array) -> Array:
        return np.concatenate([sampson_distance(F, a + shift, b + shift) for F, a, b in pairs])

    x, sigma = np.zeros(2), 1.0
    for _ in range(3):
        sigma = max(mad_scale(distances(x)).sigma, 1e-3)
        found = minimise(distances, x, loss=tuned("tukey").scaled(sigma))
        x = found.x
    spread = found.covariance(sigma).matrix
    return x, np.full(2, np.inf) if spread is None else np.sqrt(np.diag(spread))


def _leave_each_out(config: MultiviewConfig, world: World) -> tuple[Resected, ...]:
    seeds = np.random.SeedSequence(config.seed).spawn(len(world.views))
    views = range(0, len(world.views), config.every)
    tried = [resect_left_out(config, world, v, np.random.default_rng(seeds[v])) for v in views]
    return tuple(r for r in tried if r is not None)


def fundamental(views: Views, i: int, j: int) -> Array:
    """F of two of the views, x_j^T F x_i = 0."""
    K = [camera.matrix for camera in views.each]
    return fundamental_from_essential(
        essential_from_motion(relative_motion(views.T_cam_world[i], views.T_cam_world[j])), K[i], K[j]
    )


def pair_medians(world: World) -> dict[str, float]:
    """Median distance, pixels, to the epipolar line, for each pair with at least 30 matches."""
    return {
        f"{i + 1}-{j + 1}": float(np.median(np.abs(epipolar_distance(fundamental(world.views, i, j), a, b))))
        for (i, j), (a, b) in world.pairs.items()
        if len(a) >= 30
    }


def pairwise_distance(views: Views, uv: Array, mask: BoolArray) -> Array:
    """Largest Sampson distance (N,) between two views of each track; two views at one place say nothing."""
    worst = np.zeros(len(uv))
    p = views.centres
    for i, j in combinations(range(len(views)), 2):
        both = np.flatnonzero(mask[:, i] & mask[:, j])
        if len(both) and np.linalg.norm(p[i] - p[j]) > 1e-9:
            d = np.abs(sampson_distance(fundamental(views, i, j), uv[both, i], uv[both, j]))
            worst[both] = np.maximum(worst[both], d)
    return worst


def points_of_the_others(config: MultiviewConfig, world: World, v: int) -> tuple[Array, Array]:
    """Points (n, 3) made without view v, and their pixels (n, 2) in it."""
    others = world.mask.copy()
    others[:, v] = False
    use = world.mask[:, v] & (others.sum(axis=1) >= 2)
    use &= pairwise_distance(world.views, world.uv, others) <= config.gate_px
    made = triangulate(world.views, world.uv[use], others[use])
    return made.X_world[made.ok], world.uv[use][made.ok, v]


def resect_left_out(
    config: MultiviewConfig, world: World, v: int, rng: np.random.Generator
) -> Resected | None:
    """Find view v again from a perturbed start; None if too few points are seen in it."""
    X, uv = points_of_the_others(config, world, v)
    camera, T = world.views.each[v], world.views.T_cam_world[v]
    if len(X) < config.least_points:
        return None
    there = camera.pixel_from_world(T, X)
    held_out = float(np.median(np.where(there.valid, np.linalg.norm(there.uv - uv, axis=1), np.inf)))
    turn, shift = _direction(rng), _direction(rng)
    xi = np.concatenate([config.start_shift * shift, np.radians(config.start_turn) * turn])
    start = se3.perturb(T, xi)
    spoilt = exchange(uv, config.wrong, rng)
    robust = refine_pose_robust(camera, X, spoilt, start)
    kept = robust.inliers
    found = [
        robust,
        refine_pose(camera, X, spoilt, start),
        refine_pose_robust(_flipped(camera), X, spoilt, start),
    ]
    errors = [_error(f, T, kept) for f in found]
    begin = _error(refine_pose(camera, X, spoilt, start, options=Options(max_iterations=0)), T, kept)
    return Resected(v, len(X), held_out, float(kept.mean()), begin, errors[0], errors[1], errors[2])


def exchange(uv: Array, share: float, rng: np.random.Generator) -> Array:
    """Give a share of the points each other's pixels."""
    chosen = rng.permutation(len(uv))[: round(share * len(uv))]
    wrong = uv.copy()
    wrong[chosen] = uv[np.roll(chosen, 1)]
    return wrong


def _flipped(camera: Camera) -> Flipped:
    return Flipped(camera.fx, camera.fy, camera.cx, camera.cy)


def _direction(rng: np.random.Generator) -> Array:
    d = rng.standard_normal(3)
    unit: Array = d / np.linalg.norm(d)
    return unit


def _error(found: Resection, T: Array, kept: NDArray[np.bool_]) -> Error:
    turn = so3.log(se3.rotation(found.T_cam_world) @ se3.rotation(T).T)
    shift = camera_pose.centre_from_pose(found.T_cam_world) - camera_pose.centre_from_pose(T)
    rmse = float(np.sqrt(np.mean(found.errors_px[kept] ** 2))) if kept.any() else np.inf
    return Error(
        float(np.degrees(np.linalg.norm(turn))), float(np.linalg.norm(shift)), rmse, found.iterations
    )
