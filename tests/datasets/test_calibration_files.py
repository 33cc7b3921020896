"""Calibration files: each dialect read into one convention, written, damaged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.calibration_files import (
    CameraFile,
    pixels_from_relative,
    read_euroc,
    read_kalibr,
    read_opencv,
    read_ptam,
    read_tum_mono,
    write_opencv,
)
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, Rational

OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.35e+02, 0., 3.42e+02, 0., 5.36e+02, 2.35e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.66e-01, -3.8e-02, 1.78e-03, -2.8e-04, 2.38e-01 ]
"""
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [461.6, 460.3, 363.0, 248.1]
  distortion_model: radtan
  distortion_coeffs: [-0.27, 0.06, 0.0008, 0.0003]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: pinhole
  intrinsics: [460.0, 459.0, 370.0, 250.0]
  distortion_model: equidistant
  distortion_coeffs: [-0.01, 0.02, -0.01, 0.002]
  resolution: [752, 480]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
"""
EUROC = """%YAML:1.0
# a comment
sensor_type: camera
comment: cam0
T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, 0.1,
         1.0, 0.0, 0.0, 0.2,
         0.0, 0.0, 1.0, 0.3,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] # fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.7e-05]
"""
PTAM = "Tracker.Rotation=1 // another variable\nCamera.Parameters=[ 0.7 0.93 0.5 0.52 0.93 ]\n"
TUM = "0.349153 0.436593 0.493140 0.499021 0.933271\n1280 1024\n0.4 0.53 0.5 0.5 0\n640 480\n"
SENSOR = (535.5, 536.25, 342.125, 235.1)
Reader = Callable[[Path], object]
READERS: dict[str, tuple[str, Reader]] = {
    "opencv": (OPENCV, read_opencv),
    "kalibr": (KALIBR, read_kalibr),
    "euroc": (EUROC, read_euroc),
    "ptam": (PTAM, lambda path: read_ptam(path, (640, 480))),
    "tum": (TUM, read_tum_mono),
}


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "camera.file"
    path.write_text(text, encoding="utf-8")
    return path


# --- OpenCV --------------------------------------------------------------------------------------


@pytest.mark.parametrize("header", ["%YAML:1.0\n---\n", "%YAML 1.2\n---\n", "%YAML:1.0\n", "---\n", ""])
def test_opencv_headers_of_all_versions(tmp_path: Path, header: str) -> None:
    found = read_opencv(written(tmp_path, header + OPENCV.split("---\n")[1]))
    assert found.camera == Radtan(535.0, 536.0, 342.0, 235.0, -0.266, -0.038, 1.78e-3, -2.8e-4, 0.238)
    assert found.size == (640, 480)


@pytest.mark.parametrize(
    "camera",
    [
        Pinhole(*SENSOR),
        Fov(*SENSOR, 0.1 + 0.2),
        Radtan(*SENSOR, -1 / 3, 1e-300, 1.78e-3, -2.8e-4, 0.238),
        Rational(*SENSOR, 1, 2, 3e-4, 4e-5, 5, 6, 7, np.pi),
        Fisheye(*SENSOR, -0.01, 0.02, -0.01, 0.002),
    ],
)
def test_writing_and_reading_gives_the_same_bits(tmp_path: Path, camera: Camera) -> None:
    path = tmp_path / "camera.yaml"
    std = tuple(0.1 * k for k in range(len(camera.params)))
    file = CameraFile(camera, (640, 480), name='left "one": #1', std=std)
    write_opencv(path, file)
    assert read_opencv(path) == file
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert np.array_equal(storage.getNode("camera_matrix").mat(), camera.matrix)
    if len(camera.params) > 4:
        assert np.array_equal(storage.getNode("distortion_coefficients").mat().ravel(), camera.params[4:])
    assert int(storage.getNode("image_width").real()) == 640
    storage.release()
    assert [p.name for p in tmp_path.iterdir()] == ["camera.yaml"]


@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_what_this_opencv_writes_is_read(tmp_path: Path, count: int) -> None:
    path = tmp_path / "camera.yml"
    k = np.zeros((1, count))
    k[0, : min(count, 8)] = np.arange(1, min(count, 8) + 1) / 100
    K = np.array([[500.25, 0, 320.5], [0, 501.5, 240.125], [0, 0, 1]])
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in (("cameraMatrix", K), ("distCoeffs", k), ("image_width", 640), ("image_height", 480)):
        storage.write(name, value)
    storage.release()
    found = read_opencv(path)
    assert np.array_equal(found.camera.matrix, K)
    kept = found.camera.params[4:]
    assert np.array_equal(kept[: min(count, 8)], k[0, : min(count, 8)])
    assert not kept[count:].any()


def test_ros_and_named_models(tmp_path: Path) -> None:
    ros = OPENCV.replace("!!opencv-matrix", "") + "distortion_model: plumb_bob\ncamera_name: head\n"
    found = read_opencv(written(tmp_path, ros))
    assert type(found.camera) is Radtan
    assert found.name == "head"
    four = OPENCV.replace("rows: 5", "rows: 4").replace(", 2.38e-01", "")
    assert type(read_opencv(written(tmp_path, four)).camera) is Radtan
    assert type(read_opencv(written(tmp_path, four + "fisheye_model: 1\n")).camera) is Fisheye
    assert type(read_opencv(written(tmp_path, four), model="fisheye").camera) is Fisheye
    assert type(read_opencv(written(tmp_path, four + "distortion_model: equidistant\n")).camera) is Fisheye
    with pytest.raises(ValueError, match="must be one of pinhole"):
        read_opencv(written(tmp_path, four), model="magic")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("   rows: 3", "   rows: 2", r":9: camera_matrix has 9 numbers; expected 2 x 3"),
        ("   rows: 3\n   cols: 3", "   rows: 1\n   cols: 9", r"camera_matrix is 1 x 9; expected 3 x 3"),
        ("camera_matrix", "matrix_of_camera", r"has no camera_matrix or cameraMatrix"),
        ("5.35e+02, 0.,", "5.35e+02, 1.,", "other numbers than fx, fy, cx, cy"),
        ("5.35e+02", ".Nan", r":9: camera_matrix\[0\]|data\[0\] is '.Nan'; expected a number"),
        ("5.35e+02", "1e999", "expected a finite number"),
        ("5.35e+02", "-5", "focal lengths must be more than 0"),
        ("rows: 5", "rows: five", ":11: rows is 'five'; expected a number"),
        ("image_width: 640", "image_width: 640.5", ":3: image_width is '640.5'; expected a whole number"),
        ("image_width: 640", "image_width: 0", "at least 1"),
        ("image_height: 480", "image_width: 480", ":4: image_width again; expected it once"),
        ("   data: [ 5.35e+02", "   data: [ [5.35e+02]", r"is a list; expected one word"),
        ("[ -2.66e-01", "[ -2.66e-01, 0.1", "distortion_coefficients has 6 numbers; expected 5 x 1"),
        ("   rows: 5", "   rows: 5\n  bad", "expected YAML"),
        ("---\n", "---\nstandard_deviations: 3\n", ":3: standard_deviations"),
        ("---\n", "---\nstandard_deviations: { rows: 1, cols: 1, data: [1.] }\n", "expected 9 numbers"),
        ("---\n", "---\ncamera_model: magic\n", ":3: camera_model is 'magic'; expected one of pinhole"),
        ("---\n", "---\ncamera_model: fisheye\n", "5 coefficients for fisheye; expected 4"),
    ],
)
def test_damaged_opencv(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in OPENCV
    path = written(tmp_path, OPENCV.replace(old, new, 1))
    with pytest.raises(FormatError, match=message) as told:
        read_opencv(path)
    assert "\n" not in str(told.value)
    assert str(path) in str(told.value)


# --- Kalibr --------------------------------------------------------------------------------------


def test_kalibr(tmp_path: Path) -> None:
    cam0, cam1 = read_kalibr(written(tmp_path, KALIBR))
    assert cam0.camera == Radtan(461.6, 460.3, 363.0, 248.1, -0.27, 0.06, 8e-4, 3e-4)
    assert cam1.camera == Fisheye(460.0, 459.0, 370.0, 250.0, -0.01, 0.02, -0.01, 0.002)
    assert cam0.size == cam1.size == (752, 480)
    assert cam0.T_cam_rig is not None
    assert cam1.T_cam_rig is not None
    assert np.array_equal(cam0.T_cam_rig, np.eye(4))
    assert cam1.T_cam_rig[:3, 3].tolist() == [-0.11, 0.0, 0.0]


def test_kalibr_chain_and_imu(tmp_path: Path) -> None:
    """T_cam1_rig = T_cn_cnm1 T_cam0_rig, whatever T_cam_imu of cam0 is."""
    rows = ("[0.0, -1.0, 0.0, 1.0]", "[1.0, 0.0, 0.0, 2.0]", "[0.0, 0.0, 1.0, 3.0]", "[0, 0, 0, 1]")
    imu = "  T_cam_imu:\n" + "".join(f"  - {row}\n" for row in rows)
    cam0, cam1 = read_kalibr(written(tmp_path, KALIBR.replace("  rostopic", imu + "  rostopic")))
    assert cam0.T_cam_rig is not None
    assert cam1.T_cam_rig is not None
    assert cam1.T_cam_rig[:3, 3].tolist() == [1.0 - 0.11, 2.0, 3.0]
    assert np.array_equal(cam1.T_cam_rig[:3, :3], cam0.T_cam_rig[:3, :3])


def test_kalibr_other_lenses(tmp_path: Path) -> None:
    one = KALIBR.split("cam1:")[0]
    fov = one.replace("radtan", "fov").replace("[-0.27, 0.06, 0.0008, 0.0003]", "[0.92]")
    assert read_kalibr(written(tmp_path, fov))[0].camera == Fov(461.6, 460.3, 363.0, 248.1, 0.92)
    none = one.replace("radtan", "none")
    assert read_kalibr(written(tmp_path, none))[0].camera == Pinhole(461.6, 460.3, 363.0, 248.1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cam1:", "cam2:", "cameras cam0, cam2; expected cam0, cam1, … without a gap"),
        ("cam0:", "camera:", "expected cam0"),
        (
            "camera_model: pinhole",
            "camera_model: cubic",
            ":2: camera_model is 'cubic'; expected one of pinhole",
        ),
        ("distortion_model: radtan", "distortion_model: cubic", ":4: distortion_model is 'cubic'"),
        ("-0.27, 0.06,", "0.06,", ":5: distortion_coeffs has 3 numbers; expected 4"),
        ("461.6,", "", ":3: intrinsics has 3 numbers; expected 4"),
        ("461.6", "461,6,1", "expected 4"),
        ("[752, 480]", "[752, 480, 3]", ":6: resolution has 3 numbers"),
        ("[752, 480]", "752x480", ":6: resolution is one value; expected a list"),
        ("- [1.0, 0.0, 0.0, -0.11]", "- [1.1, 0.0, 0.0, -0.11]", ":15: T_cn_cnm1 is not a rigid motion"),
        ("- [0.0, 0.0, 0.0, 1.0]", "- [0.0, 0.0, 0.0]", "rows of T_cn_cnm1 differ in length"),
        ("  - [0.0, 0.0, 0.0, 1.0]\n", "", "T_cn_cnm1 is 3 x 4; expected 4 x 4"),
        ("- [0.0, 0.0, 0.0, 1.0]", "- [0.0, 0.0, 1.0, 1.0]", "last row of T_cn_cnm1"),
    ],
)
def test_damaged_kalibr(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in KALIBR
    with pytest.raises(FormatError, match=message):
        read_kalibr(written(tmp_path, KALIBR.replace(old, new, 1)))


# --- EuRoC ---------------------------------------------------------------------------------------


def test_euroc(tmp_path: Path) -> None:
    found = read_euroc(written(tmp_path, EUROC))
    assert found.camera == Radtan(458.654, 457.296, 367.215, 248.375, -0.28, 0.07, 0.0002, 1.7e-05)
    assert found.size == (752, 480)
    # T_BS takes the sensor's origin to (0.1, 0.2, 0.3) of the body: T_cam_rig takes that back to zero
    assert found.T_cam_rig is not None
    assert np.abs(found.T_cam_rig @ [0.1, 0.2, 0.3, 1.0] - [0, 0, 0, 1]).max() < 1e-15
    assert np.abs(found.T_cam_rig @ [0.1, 1.2, 0.3, 1.0] - [1, 0, 0, 1]).max() < 1e-15


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("sensor_type: camera", "sensor_type: imu", ":3: sensor_type is 'imu'; expected 'camera'"),
        ("camera_model: pinhole", "camera_model: omni", "camera_model is omni, a lens .* fisheye"),
        ("radial-tangential", "cubic", "distortion_model is 'cubic'"),
        ("  rows: 4", "  rows: 3", "expected 3 x 4"),
        ("0.0, -1.0, 0.0, 0.1", "0.0, 1.0, 0.0, 0.1", "T_BS is not a rigid motion"),
        ("resolution: [752, 480]\n", "", "has no resolution"),
        ("[752, 480]", "[752]", "resolution has 1 numbers"),
    ],
)
def test_damaged_euroc(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in EUROC
    with pytest.raises(FormatError, match=message):
        read_euroc(written(tmp_path, EUROC.replace(old, new, 1)))


# --- PTAM and TUM --------------------------------------------------------------------------------


def test_ptam(tmp_path: Path) -> None:
    found = read_ptam(written(tmp_path, PTAM), (640, 480))
    assert isinstance(found.camera, Fov)
    wanted = [0.7 * 640, 0.93 * 480, 0.5 * 640 - 0.5, 0.52 * 480 - 0.5, 0.93]
    assert np.abs(found.camera.params - wanted).max() < 1e-12


def test_relative_parameters_follow_an_image_that_is_halved(tmp_path: Path) -> None:
    """One file, two resolutions.  Averaging 2 x 2 pixels puts pixel u' where 2 u' + 1/2 was: the oracle.

    Without the half pixel at the door the two cameras disagree by a quarter of a pixel of the small image.
    """
    path = written(tmp_path, PTAM)
    large, small = (read_ptam(path, size).camera for size in ((640, 480), (320, 240)))
    X = np.random.default_rng(0).uniform([-1, -1, 1], [1, 1, 3], (50, 3))
    assert np.abs(2 * small.project(X).uv + 0.5 - large.project(X).uv).max() < 1e-12 * 640
    shift = np.array([0.5, 0.5])  # the mistake: centre = c W in both
    off = 2 * (small.project(X).uv + shift) + 0.5 - (large.project(X).uv + shift)
    assert np.abs(off - 0.5).max() < 1e-9


@pytest.mark.parametrize(("c", "u"), [(0.0, -0.5), (1.0, 639.5), (0.5, 319.5), (0.5 / 640, 0.0)])
def test_relative_positions_run_from_edge_to_edge(c: float, u: float) -> None:
    assert pixels_from_relative(c, 640, centre=True) == u


def test_a_reader_without_the_half_pixel_is_seen(tmp_path: Path) -> None:
    """The negative vector: every projection is off by exactly half a pixel, far above rounding."""
    right = read_ptam(written(tmp_path, PTAM), (640, 480)).camera
    wrong = Fov(right.fx, right.fy, 0.5 * 640, 0.52 * 480, 0.93)
    assert np.abs(wrong.project([0.1, 0.2, 1.0]).uv - right.project([0.1, 0.2, 1.0]).uv - 0.5).max() < 1e-9


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no Camera.Parameters"),
        ("Camera.Parameters=0.7 0.9 0.5 0.5 0.9\n", r":1: .* expected Camera.Parameters=\[ fx fy"),
        ("\nCamera.Parameters=[ 0.7 0.9 0.5 0.5 ]\n", ":2: Camera.Parameters has 4 numbers"),
        ("Camera.Parameters=[ 0.7 0.9 0.5 x 0.9 ]\n", ":1: cy is 'x'; expected a number"),
        ("Camera.Parameters=[ 0.7 0.9 0.5 nan 0.9 ]\n", "expected a finite number"),
        ("Camera.Parameters=[ 0.7 0.9 0.5 0.5 3.5 ]\n", ":1: omega=3.5: must be at least 0"),
        ("Camera.Parameters=[ 0 0.9 0.5 0.5 0.9 ]\n", "focal lengths must be more than 0"),
        (PTAM + PTAM, ":4: Camera.Parameters again; line 2 has it already"),
    ],
)
def test_damaged_ptam(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read_ptam(written(tmp_path, text), (640, 480))
    with pytest.raises(ValueError, match=r"need \(width, height\)"):
        read_ptam(written(tmp_path, PTAM), (0, 480))


def test_tum_mono(tmp_path: Path) -> None:
    found = read_tum_mono(written(tmp_path, TUM))
    wanted = [0.349153 * 1280, 0.436593 * 1024, 0.493140 * 1280 - 0.5, 0.499021 * 1024 - 0.5, 0.933271]
    assert np.abs(found.recorded.camera.params - wanted).max() < 1e-12
    assert found.recorded.size == (1280, 1024)
    assert found.rectified is not None
    assert found.rectified.camera == Pinhole(0.4 * 640, 0.53 * 480, 319.5, 239.5)
    assert found.rectified_size == (640, 480)


def test_tum_mono_variants(tmp_path: Path) -> None:
    lines = TUM.splitlines()
    for how in ("crop", "full", "none"):
        found = read_tum_mono(written(tmp_path, "\n".join([lines[0], lines[1], how, lines[3]])))
        assert (found.how, found.rectified) == (how, None)
    absolute = "\n".join(["FOV 450.5 451.5 640.25 512.75 0.9", *lines[1:]])
    assert read_tum_mono(written(tmp_path, absolute)).recorded.camera == Fov(
        450.5, 451.5, 640.25, 512.75, 0.9
    )
    pinhole = "\n".join(["Pinhole 450.5 451.5 640.25 512.75 0", *lines[1:]])
    assert type(read_tum_mono(written(tmp_path, pinhole)).recorded.camera) is Pinhole


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("640 480\n", "", ":3: 3 lines; expected 4"),
        ("1280 1024", "1280", ":2: size is '1280'; expected width and height"),
        ("1280 1024", "1280 10.5", ":2: size is"),
        (" 0.933271", "", ":1: 4 numbers; expected 5"),
        ("0.933271", "9", ":1: omega=9.0: must be"),
        ("0.349153", "Cubic 0.349153", ":1: lens 'cubic'; expected FOV, Pinhole"),
        ("0.349153", "x1", ":1: fx is 'x1'; expected a number"),
        ("0.4 0.53 0.5 0.5 0", "stretch", ":3: 'stretch'; expected crop, full, none"),
        ("0.4 0.53 0.5 0.5 0", "0.4 0.53 0.5 0.5 0.1", ":3: omega is 0.1; expected 0"),
    ],
)
def test_damaged_tum_mono(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in TUM
    with pytest.raises(FormatError, match=message):
        read_tum_mono(written(tmp_path, TUM.replace(old, new, 1)))


# --- every reader --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", READERS)
def test_what_is_no_such_file(tmp_path: Path, name: str) -> None:
    _, read = READERS[name]
    with pytest.raises(FormatError, match="no such file"):
        read(tmp_path / "missing")
    path = tmp_path / "camera.file"
    for data in (
        b"",
        b"\xff\xfe\x00binary",
        b"[" * 5000,
        b"- " * 5000,
        b"a: &a [*a]\n",
        b"{" * 40,
        b"[]",
        b"x",
    ):
        path.write_bytes(data)
        with pytest.raises(FormatError) as told:
            read(path)
        assert "\n" not in str(told.value)


def test_a_file_that_is_too_long(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="more than 1048576 bytes"):
        read_opencv(written(tmp_path, OPENCV + "#" * 2**20))


@pytest.mark.parametrize("name", READERS)
def test_mutations_end_in_a_camera_or_in_one_line(tmp_path: Path, name: str) -> None:
    """300 seeded damages a reader: a byte changed, a stretch cut or doubled."""
    text, read = READERS[name]
    data, rng, path = text.encode(), np.random.default_rng(7), tmp_path / "camera.file"
    refused = 0
    for _ in range(300):
        a, b = sorted(rng.integers(0, len(data), 2).tolist())
        kind = rng.integers(3)
        if kind == 0:
            mutant = data[:a] + bytes([rng.integers(256)]) + data[a + 1 :]
        elif kind == 1:
            mutant = data[:a] + data[min(b, a + 20) :]
        else:
            mutant = data[:b] + data[a:]
        path.write_bytes(mutant)
        told = ""
        try:
            read(path)
        except FormatError as error:
            told = str(error)
        refused += bool(told)
        assert "\n" not in told
    assert refused > 50


# --- real files ----------------------------------------------------------------------------------


def needs(name: str) -> pytest.MarkDecorator:
    return pytest.mark.skipif(catalogue.find(name) is None, reason=f"{name} is not in VSLAM_REF_DATA")


@needs("opencv_samples")
def test_real_opencv_files() -> None:
    folder = catalogue.require("opencv_samples") / "chessboard"
    left = read_opencv(folder / "left_intrinsics.yml")
    assert left.size == (640, 480)
    assert isinstance(left.camera, Radtan)
    assert left.camera.fx == left.camera.fy == 5.3591573396163199e02
    assert left.camera.k3 == 2.3839153080878486e-01
    right = read_opencv(folder / "intrinsics.yml", matrix="M2", distortion="D2")
    assert right.camera.cx == 3.3455744527912015e02
    assert right.camera.params[4] == -1.6916358306948096e-01
    with pytest.raises(FormatError, match="has no D3"):
        read_opencv(folder / "intrinsics.yml", matrix="M2", distortion="D3")


@needs("euroc_calib")
def test_real_euroc_pair() -> None:
    """The baseline is about 0.11 m, along the image's rows."""
    folder = catalogue.require("euroc_calib")
    cam0, cam1 = (read_euroc(folder / f"cam{i}_sensor.yaml") for i in range(2))
    assert cam0.camera.params.tolist()[:4] == [458.654, 457.296, 367.215, 248.375]
    assert cam0.T_cam_rig is not None
    assert cam1.T_cam_rig is not None
    T_cam1_cam0 = cam1.T_cam_rig @ np.linalg.inv(cam0.T_cam_rig)
    assert abs(np.linalg.norm(T_cam1_cam0[:3, 3]) - 0.11) < 0.001
    assert T_cam1_cam0[0, 3] < -0.109


@needs("camera_models")
def test_real_fov_and_radtan_files() -> None:
    folder = catalogue.require("camera_models")
    found = read_tum_mono(folder / "tum_mono_fov_camera.txt").recorded
    assert isinstance(found.camera, Fov)
    assert found.size == (1280, 1024)
    assert found.camera.cx == 0.493140 * 1280 - 0.5
    # the half-space in front is a disc of radius f pi / (2 omega) = 752 px: the sensor's corners, 807 px
    # away, see no ray of this model
    u, v = np.array([-0.5, 639.5, 1279.5]), np.array([-0.5, 511.5, 1023.5])
    valid = found.camera.unproject(np.stack(np.meshgrid(u, v), -1)).valid
    assert valid.tolist() == [[False, True, False], [True, True, True], [False, True, False]]
    assert read_euroc(folder / "euroc_cam0_radtan.yaml").camera.params[4] == -0.28340811
