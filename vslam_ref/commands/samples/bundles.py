"""Bundle adjustment problems with their true scenes: a BAL file, and a COLMAP model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.commands.samples import Made
from vslam_ref.datasets.bundle_files import BundleFile, write_bal, write_colmap
from vslam_ref.estimation.bundle import BundleProblem, Observations, Scene
from vslam_ref.geometry.cameras import Radtan, projection
from vslam_ref.worlds.bundles import make_bundle, moved_start

SIGMA_PX = 0.5
SEEN = 0.7
"""Share of the points that a view sees."""
TURN, MOVE = 0.01, 0.05
"""Standard deviations of the start: radians of a view, metres of views and points, per coordinate."""

BAL = f"""\
Cameras on an arc around a box of points, each with its own focal length and radial distortion (f, k1, k2).

format: BAL, "bundle adjustment in the large": cameras, points and observations as numbers, one text
        problem.txt   the start: views turned by about {TURN} rad, views and points moved by about
                      {MOVE} m, focal lengths 2 % off, no distortion; pixels with noise of {SIGMA_PX} px
true:   truth.txt     the same with the true scene and exact pixels
        truth.json    sigma, and the cost that adjusted noise leaves (mean and standard deviation)"""

COLMAP = f"""\
Cameras on an arc around a box of points, all with one OPENCV camera (fx, fy, cx, cy, k1, k2, p1, p2).

format: COLMAP's text model: cameras.txt, images.txt, points3D.txt
        model/   the start: views turned by about {TURN} rad, views and points moved by about
                 {MOVE} m; pixels with noise of {SIGMA_PX} px
true:   truth/   the same with the true scene and exact pixels
        truth.json   sigma, and the cost that adjusted noise leaves (mean and standard deviation)"""


def make_bal(folder: Path, rng: np.random.Generator) -> Made:
    """Write a BAL problem of 12 views, each with a lens of its own."""
    true = np.zeros((12, 9))
    true[:, 0] = true[:, 1] = rng.uniform(480.0, 520.0, 12)
    true[:, 4:6] = rng.uniform([-0.12, 0.01], [-0.08, 0.03], (12, 2))
    start = true.copy()
    start[:, :2] *= 0.98
    start[:, 4:] = 0.0
    truth, problem = _problems(true, start, 200, rng)
    for name, one in (("truth", truth), ("problem", problem)):
        write_bal(folder / f"{name}.txt", BundleFile(one))
    command = "vslam-ref ba samples/bal/problem.txt"
    return Made(
        BAL, (f"{command} --ply scene.ply", f"{command} --loss tukey --scale 1.5"), _known(problem, 3 * 12)
    )


def make_colmap(folder: Path, rng: np.random.Generator) -> Made:
    """Write a COLMAP model of 10 views with one camera."""
    lens = np.array([[505.0, 500.0, 322.3, 238.6, -0.08, 0.02, 1e-3, -5e-4, 0.0]])
    truth, problem = _problems(np.repeat(lens, 10, axis=0), lens, 150, rng, shared=True)
    sizes = np.array([[640, 480]])
    for name, one in (("truth", truth), ("model", problem)):
        write_colmap(folder / name, BundleFile(one, image_sizes=sizes, camera_models=("OPENCV",)))
    return Made(COLMAP, ("vslam-ref ba samples/colmap/model --out adjusted",), _known(problem, 0))


def _problems(
    true: Array, start: Array, points: int, rng: np.random.Generator, *, shared: bool = False
) -> tuple[BundleProblem, BundleProblem]:
    """True problem with exact pixels, and the start with noisy ones; lenses (V, 9) true, and of the start."""
    views = len(true)
    scene = make_bundle(np.linspace(-0.6, 0.6, views), points, rng).truth
    view, point = np.nonzero(rng.uniform(size=(views, points)) < SEEN)
    uv = projection.pixel_from_world(
        true[view], scene.T_cam_world[view], scene.X_world[point], lens=Radtan.lens
    ).uv
    exact = Scene(scene.T_cam_world, scene.X_world, true[:1] if shared else true)
    moved = moved_start(scene, TURN, MOVE, rng)
    noisy = uv + SIGMA_PX * rng.standard_normal(uv.shape)
    return (
        BundleProblem(Radtan, exact, Observations(view, point, uv)),
        BundleProblem(
            Radtan, Scene(moved.T_cam_world, moved.X_world, start), Observations(view, point, noisy)
        ),
    )


def _known(problem: BundleProblem, lens_unknowns: int) -> dict[str, Any]:
    """Counts, and the law of the adjusted cost: sigma^2 / 2 times chi-square with the redundancy."""
    views, points, seen = problem.sizes
    redundancy = 2 * seen - (6 * views + 3 * points - 7 + lens_unknowns)  # 7: the gauge is free
    return {
        "cameras": views,
        "points": points,
        "observations": seen,
        "sigma_px": SIGMA_PX,
        "redundancy": redundancy,
        "final_cost_mean": SIGMA_PX**2 / 2 * redundancy,
        "final_cost_sd": SIGMA_PX**2 / 2 * float(np.sqrt(2 * redundancy)),
    }
