"""The recorded corners of OpenCV's pictures, and a start that is wrong on purpose."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.estimation.calibration import Board, BoardView, Start
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Radtan

SIZE = (640, 480)


class Recorded(NamedTuple):
    """Corners that OpenCV found, and the camera that OpenCV's calibration made of them."""

    views: list[BoardView]
    camera: Radtan
    rms_px: float
    T_cam_board: np.ndarray


def _read(side: str) -> Recorded:
    folder = catalogue.find("opencv_reference")
    if folder is None:
        pytest.skip("opencv_reference is not in VSLAM_REF_DATA")
    data = np.load(folder / "chessboard_corners_calib.npz", allow_pickle=False)
    names = sorted(n for n in data.files if n.startswith(side) and n.removeprefix(side).isdigit())
    K, board = data[f"{side}_K"], Board(9, 6)
    camera = Radtan(K[0, 0], K[1, 1], K[0, 2], K[1, 2], *data[f"{side}_dist"])
    T = se3.from_rt(so3.exp(data[f"{side}_rvecs"]), data[f"{side}_tvecs"])
    return Recorded([BoardView(board.points, data[n]) for n in names], camera, float(data[f"{side}_rms"]), T)


@pytest.fixture(scope="session")
def recorded() -> Callable[[str], Recorded]:
    known: dict[str, Any] = {}

    def read(side: str) -> Recorded:
        if side not in known:
            known[side] = _read(side)
        return known[side]

    return read


@pytest.fixture
def perturbed() -> Callable[[Recorded], Start]:
    """f 10 % too long and unequal, centre off by (20, -15) px, no distortion; poses off by 0.3 squares and 3
    deg.
    """

    def start(recorded: Recorded) -> Start:
        rng = np.random.default_rng(7)
        right = recorded.camera
        camera = Radtan(
            1.1 * right.fx, 1.08 * right.fy, right.cx + 20, right.cy - 15, k1=0.0, k2=0.0, p1=0.0, p2=0.0
        )
        xi = np.concatenate([0.3 * rng.normal(size=(13, 3)), np.radians(3) * rng.normal(size=(13, 3))], 1)
        return Start(camera, se3.perturb(recorded.T_cam_board, xi), float("nan"))

    return start
