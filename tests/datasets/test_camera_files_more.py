"""camodocal's cameras, KITTI's raw calibration, ROS' ost.txt, and chains of two cameras."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from camera_samples import OST, RAW

from vslam_ref.datasets.sequences import read_camera
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry.cameras import Fisheye, Pinhole, Radtan, Rational

SIZE = (752, 480)
SENSOR = (458.5, 457.25, 367.25, 248.5)
PINHOLE = """%YAML:1.0
---
model_type: PINHOLE
camera_name: camera
image_width: 752
image_height: 480
distortion_parameters:
   k1: -0.28
   k2: 0.07
   p1: 0.0002
   p2: 1.76e-05
projection_parameters:
   fx: 458.5
   fy: 457.25
   cx: 367.25
   cy: 248.5
"""
FISHEYE = """%YAML:1.0
---
model_type: KANNALA_BRANDT
camera_name: cam0
image_width: 752
image_height: 480
projection_parameters:
   k2: -0.01
   k3: 0.02
   k4: -0.03
   k5: 0.004
   mu: 458.5
   mv: 457.25
   u0: 367.25
   v0: 248.5
"""
MEI = PINHOLE.replace("PINHOLE", "MEI").replace("distortion_p", "mirror_parameters:\n   xi: 0\ndistortion_p")
MEI = MEI.replace("fx:", "gamma1:").replace("fy:", "gamma2:").replace("cx:", "u0:").replace("cy:", "v0:")
CHAIN = "".join(
    f"""cam{k}:
  camera_model: pinhole
  intrinsics: [458.5, 457.25, 367.25, 248.5]
  distortion_model: none
  resolution: [752, 480]
"""
    for k in range(2)
)


def read(tmp_path: Path, text: str, size: tuple[int, int] = SIZE):  # type: ignore[no-untyped-def]
    path = tmp_path / "camera.file"
    path.write_text(text, encoding="utf-8")
    return read_camera(path, size)


def test_camodocals_pinhole_has_opencvs_lens(tmp_path: Path) -> None:
    assert read(tmp_path, PINHOLE).camera == Radtan(*SENSOR, -0.28, 0.07, 0.0002, 1.76e-05)
    assert read(tmp_path, MEI).camera == Radtan(*SENSOR, -0.28, 0.07, 0.0002, 1.76e-05)


def test_camodocals_fisheye_is_opencvs(tmp_path: Path) -> None:
    """R(theta) = theta + k2 theta^3 + k3 theta^5 + k4 theta^7 + k5 theta^9, typed in here."""
    camera = read(tmp_path, FISHEYE).camera
    assert isinstance(camera, Fisheye)
    X = np.array([0.7, -0.4, 0.9])
    theta = np.arctan2(np.hypot(X[0], X[1]), X[2])
    r = theta - 0.01 * theta**3 + 0.02 * theta**5 - 0.03 * theta**7 + 0.004 * theta**9
    ideal = r * X[:2] / np.hypot(X[0], X[1])
    assert np.abs(camera.project(X).uv - (ideal * SENSOR[:2] + SENSOR[2:])).max() < 1e-11
    K = np.array([[SENSOR[0], 0, SENSOR[2]], [0, SENSOR[1], SENSOR[3]], [0, 0, 1]])
    theirs = cv2.fisheye.projectPoints(
        X.reshape(1, 1, 3), np.zeros(3), np.zeros(3), K, np.array([-0.01, 0.02, -0.03, 0.004])
    )[0]
    assert np.abs(camera.project(X).uv - theirs.ravel()).max() < 1e-9


def test_kittis_raw_camera_is_that_of_the_pictures(tmp_path: Path) -> None:
    taken, rectified = read(tmp_path, RAW, (1392, 512)), read(tmp_path, RAW, (1242, 375))
    assert taken.camera == Radtan(984.25, 980.75, 690, 233.25, -0.37, 0.2, 0.002, 0.001, -0.07)
    assert rectified.camera == Pinhole(721.5, 721.5, 609.5, 172.75)
    assert "camera 00 of 2 is read" in rectified.notes[0]
    assert read(tmp_path, RAW.replace("S_01: 1392 512\n", ""), (1242, 375)).notes == ()


def test_kittis_own_file_is_read() -> None:
    data = Path(os.environ.get("VSLAM_REF_DATA", "/nowhere").split(os.pathsep)[0])
    path = data / "camera_models" / "kitti_calib_cam_to_cam.txt"
    if not path.is_file():
        pytest.skip("the data set camera_models is not here")
    assert read_camera(path, (1242, 375)).camera == Pinhole(721.5377, 721.5377, 609.5593, 172.854)
    assert read_camera(path, (1392, 512)).camera.params[4] == -0.3728755


def test_ost_is_read(tmp_path: Path) -> None:
    assert read(tmp_path, OST).camera == Radtan(*SENSOR, -0.28, 0.07, 0.0002, 0.00002, 0.015)
    eight = OST.replace("0.015\n", "0.015 0.1 0.2 0.3\n")
    assert isinstance(read(tmp_path, eight).camera, Rational)


def test_of_a_chain_the_first_is_read_and_told(tmp_path: Path) -> None:
    assert "cam0 of 2 cameras is read" in read(tmp_path, CHAIN).notes[0]
    one = CHAIN[: CHAIN.index("cam1")]
    assert read(tmp_path, one).notes == ()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PINHOLE.replace("PINHOLE", "SCARAMUZZA"), "nearest supported model is fisheye"),
        (MEI.replace("xi: 0", "xi: 0.9"), "nearest supported model is fisheye"),
        (PINHOLE.replace("PINHOLE", "PINHALE"), "expected PINHOLE, KANNALA_BRANDT"),
        (FISHEYE.replace("   mv: 457.25\n", ""), "has no mv"),
        (PINHOLE.replace("458.5", "-458.5"), "f"),
        (RAW.replace("K_00: 984.25 0", "K_00: 984.25 1"), "expected that"),
        (RAW.replace("D_00: -0.37", "D_00:"), "4 numbers; expected 5"),
        (RAW.replace("T_00: 0 0 0", "K_00: 1 0 0 0 1 0 0 0 1"), "K_00 again"),
        (RAW.replace("S_rect_00: 1242 375\n", ""), "no line S_rect_00"),
        (RAW.replace("S_00: 1392", "S_00: 1392.5"), "whole numbers"),
        (OST.replace(" 0.015\n", "\n"), "ost.yaml"),
        (OST.replace("458.5 0.000000", "458.5 0.100000"), "expected that"),
        (OST.replace("width\n752", "width\n752.5"), "whole number"),
        (OST + "width\n3\n", "width again"),
        (OST.replace("camera matrix", "camera"), "no part 'camera matrix'"),
        (OST.replace("0.0002", "zero"), "expected a number"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FormatError, match=message) as raised:
        read(tmp_path, text, (1392, 512) if text.startswith("calib_time") else SIZE)
    assert "\n" not in str(raised.value)
