"""Pictures of a checkerboard, taken by two cameras that are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.commands.samples import Made
from vslam_ref.datasets.calibration_files import CameraFile, write_opencv
from vslam_ref.datasets.pictures import write_png
from vslam_ref.estimation.calibration import Board
from vslam_ref.geometry.cameras import Camera, Fov, Radtan
from vslam_ref.worlds import board_pictures

BOARD = Board(9, 6, 0.025)
SIZE = (400, 300)
PICTURES = 10
CAMERAS: dict[str, Camera] = {
    "radtan": Radtan(350.0, 352.0, 201.5, 148.2, -0.2, 0.05, 1e-3, -5e-4, 0.0),
    "fov": Fov(300.0, 301.0, 198.0, 151.0, 0.9),
}

README = f"""\
{PICTURES} pictures by each of two cameras of a board with {BOARD.columns}x{BOARD.rows} inner corners and
squares of {BOARD.square} m.

format: radtan/*.png, fov/*.png, grey, {SIZE[0]} x {SIZE[1]} pixels
true:   radtan/camera.yaml and fov/camera.yaml, the cameras that drew them (OpenCV's YAML)
        truth.json  their parameters, and T_cam_board of every picture, metres"""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Write pictures and cameras."""
    known: dict[str, Any] = {"board": "9x6", "square_m": BOARD.square}
    for model, camera in CAMERAS.items():
        pictures = board_pictures.take(BOARD, camera, SIZE, PICTURES, rng, tilt=(0.3, 0.7), fill=(0.5, 0.85))
        (folder / model).mkdir()
        for k, image in enumerate(pictures.images):
            write_png(folder / model / f"board{k:02d}.png", image)
        write_opencv(folder / model / "camera.yaml", CameraFile(camera, SIZE))
        parameters = dict(zip(camera.names(), camera.params.tolist(), strict=True))
        known[model] = {"parameters": parameters, "T_cam_board": pictures.T_cam_board.tolist()}
    commands = [
        f"vslam-ref calibrate samples/boards/{m} --board 9x6 --square 0.025 --model {m}" for m in CAMERAS
    ]
    return Made(README, (f"{commands[0]} --out camera.yaml", commands[1]), known)
