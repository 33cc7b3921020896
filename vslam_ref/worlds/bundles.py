"""Scenes for bundle adjustment: cameras on an arc around a box, or along a wall; errors free of the gauge.

Lengths are in metres, angles in radians, image positions in pixels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.bundle import BundleProblem, Observations, Scene
from vslam_ref.estimation.bundle.gauge import gauge_directions
from vslam_ref.geometry import alignment, camera_pose, se3, so3
from vslam_ref.geometry.cameras import Pinhole, projection

INTRINSICS = (500.0, 500.0, 320.0, 240.0)
"""fx, fy, cx, cy of every camera, pixels."""
RADIUS, BOX = 6.0, 1.5
"""Metres from the cameras to the middle of the points, and half the width of the box they lie in."""


class Bundle(NamedTuple):
    """A true scene, and who sees what where, without errors: ``view (n,)``, ``point (n,)``, ``uv (n, 2)``."""

    truth: Scene
    view: IntArray
    point: IntArray
    uv: Array

    def problem(self, uv: Array, start: Scene) -> BundleProblem:
        """Adjustment of measured pixels (n, 2) from a start."""
        return BundleProblem(Pinhole, start, Observations(self.view, self.point, uv))


def arc(angles: Array) -> Array:
    """Poses (V, 4, 4) on an arc, by their angles (V,) in radians, looking at the origin; the arc is wavy.

    The y axis of the world points down, as that of a camera does.
    """
    height = 0.8 * np.cos(9.0 * angles)
    centres = np.stack([RADIUS * np.sin(angles), height, -RADIUS * np.cos(angles)], axis=-1)
    z = -centres / np.linalg.norm(centres, axis=1, keepdims=True)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    R_cam_world = np.stack([x, np.cross(z, x), z], axis=1)
    return se3.from_rt(R_cam_world, -np.einsum("vij,vj->vi", R_cam_world, centres))


def make_bundle(angles: Array, points: int, rng: np.random.Generator) -> Bundle:
    """Views at ``angles (V,)`` of the arc, all of which see all points; these are uniform in the box."""
    X = rng.uniform(-BOX, BOX, (points, 3))
    T, K = arc(angles), np.array([INTRINSICS])
    view, point = (i.ravel() for i in np.divmod(np.arange(len(T) * points), points))
    uv = projection.pixel_from_world(K[0], T[view], X[point], lens=Pinhole.lens).uv
    return Bundle(Scene(T, X, K), view, point, uv)


def walk(views: int, seed: int, points_per_view: int = 12, reach: float = 2.0) -> BundleProblem:
    """A camera that walks along a wall in steps of half a metre; its pictures have lost their order.

    Parameters
    ----------
    views : int
        Number V of pictures.
    seed : int
        Of order and points, together with ``views``.
    points_per_view : int
        Points on the wall for each picture.
    reach : float
        A point is seen from places at most this far along the wall, metres.

    Returns
    -------
    BundleProblem
        The true scene, and pixels without errors.
    """
    rng = np.random.default_rng([seed, views])
    place = rng.permutation(views)
    T = se3.from_rt(np.eye(3), np.stack([-0.5 * place, np.zeros(views), np.zeros(views)], -1))
    X = rng.uniform([-1.0, -1.0, 3.5], [0.5 * views + 0.5, 1.0, 4.5], (points_per_view * views, 3))
    view, point = np.nonzero(np.abs(0.5 * place[:, None] - X[None, :, 0]) < reach)
    uv = projection.pixel_from_world(np.array(INTRINSICS), T[view], X[point], lens=Pinhole.lens).uv
    return BundleProblem(Pinhole, Scene(T, X, np.array([INTRINSICS])), Observations(view, point, uv))


def moved_start(truth: Scene, turn: float, move: float, rng: np.random.Generator) -> Scene:
    """Scene with every view turned (radians) and moved, and every point moved (metres, per coordinate)."""
    views, points = len(truth.T_cam_world), len(truth.X_world)
    xi = np.concatenate([move * rng.standard_normal((views, 3)), turn * rng.standard_normal((views, 3))], -1)
    X = truth.X_world + move * rng.standard_normal((points, 3))
    return Scene(se3.perturb(truth.T_cam_world, xi), X, truth.intrinsics)


class SceneError(NamedTuple):
    """Root mean squares after the similarity that fits the camera centres best: metres, radians, metres."""

    centre: float
    turn: float
    point: float


def scene_error(found: Scene, truth: Scene, judged: NDArray[np.bool_]) -> SceneError:
    """Errors of a scene, its points judged where the mask (N,) says so."""
    centres, true_centres = (camera_pose.centre_from_pose(s.T_cam_world) for s in (found, truth))
    fit = alignment.align(centres, true_centres, with_scale=True)
    R, s, t = fit.R_target_source, fit.scale, fit.t_target_source
    turns = np.linalg.norm(
        so3.log(found.T_cam_world[:, :3, :3] @ R.T @ np.swapaxes(truth.T_cam_world[:, :3, :3], 1, 2)), axis=1
    )
    apart = s * centres @ R.T + t - true_centres
    off = (s * found.X_world @ R.T + t - truth.X_world)[judged]
    return SceneError(*(float(np.sqrt(np.mean(np.sum(e**2, -1)))) for e in (apart, turns[:, None], off)))


def displacement(found: Scene, truth: Scene) -> tuple[Array, Array]:
    """From the truth to a scene: left tangent vectors of the views (V, 6), and of the points (N, 3)."""
    xi = se3.log(se3.compose(found.T_cam_world, se3.inverse(truth.T_cam_world)))
    return xi, found.X_world - truth.X_world


def nearest_of_family(found: Scene, truth: Scene) -> tuple[Array, Array]:
    """Displacement of the one scene, of all that look the same as ``found``, that is nearest to the truth.

    Nearest in the tangent coordinates of all views and points.  To first order this takes the part of the
    displacement away that lies along the seven directions of the gauge; five rounds leave nothing visible.
    """
    for _ in range(5):
        views, points = displacement(found, truth)
        G = np.concatenate([part.reshape(-1, 7) for part in gauge_directions(found)])
        d = np.concatenate([views.ravel(), points.ravel()])
        step = -np.linalg.lstsq(G, d, rcond=None)[0]
        found = moved_world(found, step)
    return displacement(found, truth)


def moved_world(scene: Scene, step: Array) -> Scene:
    """The scene after its world was moved by Exp(step[:6]) and scaled by exp(step[6]), ``step (7,)``."""
    motion, s = se3.exp(step[:6]), float(np.exp(step[6]))
    T = se3.compose(scene.T_cam_world, se3.inverse(motion))
    T = se3.from_rt(T[:, :3, :3], s * T[:, :3, 3])
    return Scene(T, s * se3.act(motion, scene.X_world), scene.intrinsics)
