"""A short film of a desk, its camera, and where the camera was."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.commands.samples import Made
from vslam_ref.datasets import trajectories
from vslam_ref.datasets.pictures import write_png
from vslam_ref.datasets.sequences import write_plain_camera
from vslam_ref.datasets.video import avi
from vslam_ref.support.files import write_text
from vslam_ref.worlds import rendered

SIZE = (320, 240)
PICTURES = 75
"""Two and a half seconds: a quarter of a metre along the desk."""

README = f"""\
A camera in a hand moves over a desk with books, papers, a keyboard and boxes: {PICTURES} pictures at 30 Hz,
rendered with exact poses.

format: images/*.png, grey, {SIZE[0]} x {SIZE[1]} pixels; times.txt, seconds; calib.txt, a line
        'fx fy cx cy width height'; film.avi, the same pictures as JPEGs in one file, a little changed
true:   groundtruth_tum.txt, poses of the camera in the world, lines 'time tx ty tz qx qy qz qw', metres; the
        camera looks along its z, x is right and y down"""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Render the pictures and write them beside what is true."""
    seed = int(rng.integers(2**31))
    camera = rendered.pinhole("desk", SIZE)
    scene = rendered.scene("desk", seed, camera=camera, size=SIZE, frames=PICTURES)
    (folder / "images").mkdir()
    with avi(folder / "film.avi") as film:
        for k in range(PICTURES):
            grey = scene.frame(k)
            write_png(folder / "images" / f"{k:06d}.png", grey)
            film(np.repeat(grey[..., None], 3, axis=-1))
    write_plain_camera(folder / "calib.txt", camera, SIZE)
    write_text(folder / "times.txt", "".join(f"{t!r}\n" for t in scene.times.tolist()))
    truth = scene.trajectory()
    trajectories.write(folder / "groundtruth_tum.txt", truth, "tum")
    length = float(np.linalg.norm(np.diff(truth.t_world_body, axis=0), axis=1).sum())
    say = "from vslam_ref.datasets.sequences import open_sequence; print(len(open_sequence('samples/video')))"
    known = {
        "scene": "desk",
        "scene_seed": seed,
        "pictures": PICTURES,
        "camera": camera.params.tolist(),
        "path_m": length,
    }
    return Made(README, (f'python -c "{say}"',), known)
