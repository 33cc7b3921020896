"""For every reader of ``vslam_ref.datasets`` a small file (or folder), and what a valid record of it is.

A new reader needs a row here: a house test finds every reader and fails for one without.  ``check`` answers
with what is wrong with a record that was read from a damaged file, or "".
"""

from __future__ import annotations

import bz2
import gzip
import importlib
import io
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

import bundle_samples
import cv2
import numpy as np
import pose_graph_samples
import scipy.io
import vocabulary_samples
from camera_samples import OST, RAW
from sequence_samples import CALIB, LAYOUTS, SIZE

from vslam_ref.datasets.bundle_files import BundleFile
from vslam_ref.datasets.trajectories import TrajectoryFile
from vslam_ref.estimation.bundle.families import sensors
from vslam_ref.geometry.cameras import Camera


class Sample(NamedTuple):
    """A whole file or folder, and how it is read.

    Parameters
    ----------
    files : mapping of name to content
        One of them is damaged each time.
    arguments : callable, optional
        What the reader is given for a folder with the files; by default the only file, or the folder.
    binary : bool
        Whether the files are no text.
    check : callable, optional
        What is wrong with a record, or "".
    """

    files: dict[str, bytes]
    arguments: Callable[[Path], tuple[Any, ...]] | None = None
    binary: bool = False
    check: Callable[[Any], str] | None = None

    def given(self, folder: Path) -> tuple[Any, ...]:
        """Arguments of the reader."""
        if self.arguments is not None:
            return self.arguments(folder)
        return (folder / next(iter(self.files)),) if len(self.files) == 1 else (folder,)

    def wrong(self, record: Any) -> str:
        """What is wrong with a record, or ""."""
        return not_finite(record) or (self.check(record) if self.check else "")


def reader(name: str) -> Callable[..., Any]:
    """Find a reader by "module:function", the module inside ``vslam_ref.datasets``."""
    module, function = name.split(":")
    found: Callable[..., Any] = getattr(importlib.import_module(f"vslam_ref.datasets.{module}"), function)
    return found


# --- what is right ---------------------------------------------------------------------------------

MAY_BE_NAN = {
    ("SlamLog", "wheelbase"): "a differential drive has none",
    ("LogTruth", "T_world_vehicle"): "the GPS knows no heading",
    ("CarmenLog", "ranges"): "the maps count readings that are none",
}


def not_finite(value: Any, place: str = "record") -> str:
    """First number inside a record that is not finite, or ""."""
    if isinstance(value, np.ndarray):
        bad = value.dtype.kind == "f" and not np.isfinite(value).all()
        return f"{place} has numbers that are not finite" if bad else ""
    if isinstance(value, float):
        return "" if np.isfinite(value) else f"{place} is {value}"
    return next(filter(None, (not_finite(part, f"{place}.{name}") for name, part in _parts(value))), "")


def _parts(value: Any) -> Iterator[tuple[str, Any]]:
    kind = type(value).__name__
    if is_dataclass(value) and not isinstance(value, type):
        named = [(field.name, getattr(value, field.name)) for field in fields(value)]
    elif hasattr(value, "_fields"):
        named = list(zip(value._fields, value, strict=True))
    elif isinstance(value, dict):
        named = [(str(key), part) for key, part in value.items()]
    elif isinstance(value, tuple | list):
        named = [(str(k), part) for k, part in enumerate(value)]
    else:
        named = []
    return ((name, part) for name, part in named if (kind, name) not in MAY_BE_NAN)


def bundle_wrong(file: BundleFile) -> str:
    """Rotations are rotations, focal lengths positive, and everything is small enough to be squared."""
    scene = file.problem.scene
    R = scene.T_cam_world[:, :3, :3]
    if np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() > 1e-9 or not (np.linalg.det(R) > 0).all():
        return "a rotation is none"
    if not (sensors(file.problem.model, scene.intrinsics)[:, :2] > 0).all():
        return "a focal length is not positive"
    largest = max(
        np.abs(a).max(initial=0.0) for a in (scene.T_cam_world, scene.X_world, file.problem.seen.uv)
    )
    return "" if largest <= 1e15 else f"a coordinate of {largest:g}"


def trajectory_wrong(file: TrajectoryFile) -> str:
    """Rotations are rotations as far as the format prints them; times do not go back."""
    R, times = file.trajectory.R_world_body, file.trajectory.times
    if np.abs(np.swapaxes(R, 1, 2) @ R - np.eye(3)).max() > 2e-3:
        return "a rotation is none"
    return "" if times is None or (np.diff(times) >= 0).all() else "times go back"


def log_wrong(log: Any) -> str:
    """Times do not go back; ranges are not negative."""
    if (np.diff(log.times) < 0).any():
        return "times go back"
    return "" if all((sighting.polar[:, 0] >= 0).all() for sighting in log.sightings) else "a negative range"


def camera_wrong(file: Any) -> str:
    """A camera can be made of its own parameters again, and sizes are sizes."""
    for one in file if isinstance(file, tuple) and not hasattr(file, "_fields") else (file,):
        recorded = getattr(one, "recorded", one)
        if not isinstance(recorded.camera, Camera) or recorded.camera.fx <= 0:
            return "no camera"
        if recorded.size is not None and min(recorded.size) < 1:
            return f"size {recorded.size}"
    return ""


def pose_wrong(T: np.ndarray) -> str:
    """A rigid motion."""
    right = T.shape == (4, 4) and np.abs(T[:3, :3].T @ T[:3, :3] - np.eye(3)).max() < 1e-12
    return "" if right and (T[3] == (0, 0, 0, 1)).all() else "no rigid motion"


# --- the samples -----------------------------------------------------------------------------------

TUM = "# time tx ty tz qx qy qz qw\n" + "".join(
    f"{100 + k / 10:.4f} {k * 0.1:.3f} 0.2 -0.3 0 0 {np.sin(k / 20):.9f} {np.cos(k / 20):.9f}\n"
    for k in range(8)
)
KITTI = "".join(
    f"{np.cos(k / 9):.9e} 0 {np.sin(k / 9):.9e} {k} 0 1 0 0.5 {-np.sin(k / 9):.9e} 0 {np.cos(k / 9):.9e} 2\n"
    for k in range(6)
)
EUROC = "#timestamp,px,py,pz,qw,qx,qy,qz\n" + "".join(
    f"{1403636580838555648 + k * 50000000},{k * 0.1:.3f},0.2,-3,{np.cos(k / 9):.9f},0,0,{np.sin(k / 9):.9f}\n"
    for k in range(8)
)
NAMED = "stamp_ms;x;y;z;qw;qx;qy;qz;quality\n" + "".join(
    f"{1403636580838 + k * 50};{k * 0.1:.3f};0.2;-3;{np.cos(k / 9):.9f};0;0;{np.sin(k / 9):.9f};good\n"
    for k in range(8)
)
VINS = "".join(
    f"{1403636580838555648 + k * 50000000},{k},2,-3,{np.cos(k / 9):.5f},0,0,{np.sin(k / 9):.5f},1,0,0,\n"
    for k in (0, 1, 3, 2, 4, 4, 5)
)
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
MESSAGE = """header:
  stamp:
    sec: 1700000000
height: 480
width: 752
distortion_model: plumb_bob
d: [-0.28, 0.07, 0.0002, 1.7e-05, 0.0]
k: [458.5, 0.0, 367.25, 0.0, 457.25, 248.5, 0.0, 0.0, 1.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 480
  width: 752
---
"""
SETTINGS = """%YAML:1.0
File.version: "1.0"
Camera.type: "PinHole"
Camera1.fx: 458.5
Camera1.fy: 457.25
Camera1.cx: 367.25
Camera1.cy: 248.5
Camera1.k1: -0.28
Camera1.k2: 0.07
Camera1.p1: 0.0002
Camera1.p2: 1.7e-05
Camera.width: 752
Camera.height: 480
IMU.T_b_c1: !!opencv-matrix
   rows: 4
   cols: 4
   dt: f
   data: [0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0]
"""
STORED_XML = """<?xml version="1.0"?>
<opencv_storage>
<image_width>752</image_width>
<image_height>480</image_height>
<camera_matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    458.5 0. 367.25 0. 457.25 248.5 0. 0. 1.</data></camera_matrix>
<distCoeffs type_id="opencv-matrix">
  <rows>1</rows>
  <cols>5</cols>
  <dt>d</dt>
  <data type_id="binary">
    MWQgICAgICAgICAgICAgICAgICAgICAgAAAAAAAAyL8AAAAAAACoP/yp8dJNYlA/
    LUMc6+I2Kr+4HoXrUbiePw==</data></distCoeffs>
</opencv_storage>
"""
STORED_JSON = """{
    "image_width": 752, "image_height": 480,
    "camera_matrix": {
        "type_id": "opencv-matrix", "rows": 3, "cols": 3, "dt": "d",
        "data": [ 458.5, 0.0, 367.25, 0.0, 457.25, 248.5, 0.0, 0.0, 1.0 ]
    },
    "distortion_coefficients": [[-0.28, 0.07, 0.0002, 1.7e-05, 0.0]]
}
"""
KALIBR = """cam0:
  camera_model: pinhole
  intrinsics: [461.6, 460.3, 363.0, 248.1]
  distortion_model: radtan
  distortion_coeffs: [-0.27, 0.06, 0.0008, 0.0003]
  resolution: [752, 480]
cam1:
  camera_model: pinhole
  intrinsics: [460.0, 459.0, 370.0, 250.0]
  distortion_model: equidistant
  distortion_coeffs: [-0.01, 0.02, -0.01, 0.002]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
"""
SENSOR = """%YAML:1.0
sensor_type: camera
comment: cam0
T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] # fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.7e-05]
"""
PTAM = "Tracker.Rotation=1 // another variable\nCamera.Parameters=[ 0.7 0.93 0.5 0.52 0.93 ]\n"
TUM_MONO = "0.349153 0.436593 0.493140 0.499021 0.933271\n1280 1024\n0.4 0.53 0.5 0.5 0\n640 480\n"
NIST = """NIST/ITL StRD
Dataset Name:  Toy               (Toy.dat)
               Starting Values   (lines 11 to 12)
               Certified Values  (lines 11 to 17)
               Data              (lines 19 to 21)
               Lower Level of Difficulty
Model:         Miscellaneous Class
               2 Parameters (b1 and b2)
               y = b1*x
                   + b2  +  e
  b1 =   5           1            2.0E+00  1.0E-01
  b2 =   0.5        -1           -3.0E+00  2.0E-01

Residual Sum of Squares:                    4.0E-01
Residual Standard Deviation:                6.3E-01
Degrees of Freedom:                                 1
Number of Observations:                             3
Data:   y      x
      -1.0E0   1E0
       1.5     2
       3.0     3.0E0
"""
TEMPLE = """2
a.png 1520.4 0 302.32 0 1525.9 246.87 0 0 1 1 0 0 0 1 0 0 0 1 -0.02 -0.03 0.6
b.png 1520.4 0 302.32 0 1525.9 246.87 0 0 1 0 -1 0 1 0 0 0 0 1 0.04 0.05 0.7
"""
CARMEN = "# a comment\nPARAM laser_front_laser_resolution 1.0\n" + "".join(
    f"FLASER 5 1.5 2 81.91 0.5 3 {k}.5 0.1 0.2 {k} 0 0.2 {976052857.337 + k / 4:.6f} nohost {k}\n"
    f"ODOM {k} 0 0 0 0 0 0 nohost 0\n"
    for k in range(4)
)
LASER_HEAD = "4 -1.570796 3.141593 1.570796 30.0 0.01 0 3 1.5 2 3.5 2 11 12"
ROBOT_LASER = "".join(
    f"ROBOTLASER1 {LASER_HEAD} {k}.5 0.1 0.2 {k} 0 0.2 0.3 0.05 0.5 0.4 9 {976052857.3 + k:.1f} nohost {k}\n"
    for k in range(4)
)
RAW_LASER = "".join(
    f"ODOM {k} 0 0.2 0 0 0 {976052857.1 + k:.1f} nohost 0\n"
    f"RAWLASER1 {LASER_HEAD} {976052857.3 + k:.1f} nohost {k}\n"
    for k in range(4)
)
ROS_MAP = """image: map.pgm
mode: trinary
resolution: 0.05
origin: [-1.0, 2.5, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
MRCLAM = {
    "Barcodes.dat": "# subject barcode\n1 5\n2 14\n6 63\n7 81\n8 7\n",
    "Robot1_Odometry.dat": "# t v w\n100.0 0.1 0.0\n100.5 0.1 0.2\n101.0 0.1 0.2\n101.5 0.0 0.0\n",
    "Robot1_Measurement.dat": "# t code r b\n100.2 63 2.0 0.1\n100.2 5 1.0 0.0\n100.9 63 1.9 0.1\n",
}
MRCLAM_TRUTH = {
    "Barcodes.dat": MRCLAM["Barcodes.dat"],
    "Robot1_Groundtruth.dat": "# t x y th\n99.0 1 2 3.1\n99.1 1 2 3.2\n101.6 1.1 2 3.3\n",
    "Landmark_Groundtruth.dat": "# s x y sx sy\n6 1 2 0 0\n7 3 4 0 0\n8 0 0 0 0\n",
}
GRAPH = """ODOMETRY 0 1 0.5 0 0 1 0 0 1 0 1
LANDMARK 1 5 10 2 1 0 1
ODOMETRY 1 3 0.5 0 0 1 0 0 1 0 1
LANDMARK 3 5 9.5 2 1 0 1
LANDMARK 3 7 4 -3 1 0 1
"""


def _matlab(**vectors: Any) -> bytes:
    stream = io.BytesIO()
    scipy.io.savemat(stream, {name: np.asarray(vector)[:, None] for name, vector in vectors.items()})
    return stream.getvalue()


_TIME = np.arange(0, 1001, 25, dtype=np.int32)
DRIVE = _matlab(time=_TIME, speed=np.ones(len(_TIME)), steering=np.zeros(len(_TIME)))
_FIXES = np.arange(0, 1001, 20, dtype=np.int32)
GPS = _matlab(timeGps=_FIXES, Lo_m=_FIXES / 1e3, La_m=_FIXES * 0.0)
_GREY = (np.add.outer(np.arange(24), np.arange(32)) % 7 * 36).astype(np.uint8)


def _encoded(texts: dict[str, str]) -> dict[str, bytes]:
    return {name: content.encode() for name, content in texts.items()}


def _one(name: str, content: str) -> dict[str, bytes]:
    return {name: content.encode()}


def _folder(folder: Path) -> tuple[Path]:
    return (folder,)


def _picture(suffix: str) -> dict[str, bytes]:
    return {f"a{suffix}": cv2.imencode(suffix, _GREY)[1].tobytes()}


class _Log(NamedTuple):
    """As much of a log as the reader of a truth needs."""

    clock_start: float
    times: np.ndarray
    controls: np.ndarray


_MRCLAM_LOG = _Log(100.0, np.array([0.0, 1.5]), np.zeros((2, 2)))
_PARK_LOG = _Log(0.0, _TIME / 1e3, np.stack([np.ones(len(_TIME)), np.zeros(len(_TIME))], -1))

_BAL = bundle_samples.bal_text()
_BUNDLER = bundle_samples.bundler_text()
_COLMAP = _encoded(bundle_samples.colmap_texts())
_RIGS = bundle_samples.colmap_rigs(np.diag([1.0, -1.0, -1.0, 1.0]))
_TWO_FAMILIES = b"4 PINHOLE 640 480 500 510 320 240\n9 OPENCV_FISHEYE 800 600 600 600 400 300 0.1 0 0 0\n"
_LIBMV = bundle_samples.libmv_bytes()

SAMPLES: dict[str, list[Sample]] = {
    "bundle_files.bal:read_bal": [
        Sample(_one("problem.txt", _BAL), check=bundle_wrong),
        Sample({"problem.txt.bz2": bz2.compress(_BAL.encode())}, binary=True, check=bundle_wrong),
        Sample({"problem.txt.gz": gzip.compress(_BAL.encode(), mtime=0)}, binary=True, check=bundle_wrong),
    ],
    "bundle_files.bundler:read_bundler": [
        Sample(
            {"bundle.out": _BUNDLER.encode(), "list.txt": b"a.jpg 0 500\nb.jpg\nc.jpg\nd.jpg 0 510\n"},
            lambda folder: (folder / "bundle.out", folder / "list.txt"),
            check=bundle_wrong,
        )
    ],
    "bundle_files.libmv:read_libmv": [
        Sample({"problem.bin": _LIBMV}, binary=True, check=bundle_wrong),
        Sample({"problem.bin": bundle_samples.libmv_bytes(">", b"N")}, binary=True, check=bundle_wrong),
    ],
    "bundle_files.colmap.reading:read_colmap": [
        Sample(_COLMAP, check=bundle_wrong),
        Sample(bundle_samples.colmap_binary(), binary=True, check=bundle_wrong),
        Sample(_COLMAP | _encoded(_RIGS), check=bundle_wrong),
        Sample(
            bundle_samples.colmap_binary() | bundle_samples.colmap_rigs_binary(_RIGS),
            binary=True,
            check=bundle_wrong,
        ),
        Sample(_COLMAP | {"cameras.txt": _TWO_FAMILIES}, check=bundle_wrong),
    ],
    "bundle_files.by_content:read_bundle": [
        Sample(_one("problem", _BAL), check=bundle_wrong),
        Sample({"problem": _LIBMV}, binary=True, check=bundle_wrong),
        Sample(_one("problem", _BUNDLER), check=bundle_wrong),
    ],
    "bundle_files.by_content:detect": [Sample({"problem.bz2": bz2.compress(_BAL.encode())}, binary=True)],
    "calibration_files.camera_info:read_camera_info": [
        Sample(_one("camera_info.yaml", MESSAGE), check=camera_wrong)
    ],
    "calibration_files.orbslam:read_orbslam": [Sample(_one("settings.yaml", SETTINGS), check=camera_wrong)],
    "calibration_files.ost:read_ost": [Sample(_one("ost.txt", OST), check=camera_wrong)],
    "calibration_files.kitti_raw:read_kitti_raw": [
        Sample(
            _one("calib_cam_to_cam.txt", RAW),
            lambda folder, size=size: (folder / "calib_cam_to_cam.txt", size),
            check=camera_wrong,
        )
        for size in ((1242, 375), (1392, 512))
    ],
    "calibration_files.euroc:read_euroc": [Sample(_one("sensor.yaml", SENSOR), check=camera_wrong)],
    "calibration_files.kalibr:read_kalibr": [Sample(_one("camchain.yaml", KALIBR), check=camera_wrong)],
    "calibration_files.opencv_storage:read_opencv": [
        Sample(_one("camera.yaml", OPENCV), check=camera_wrong),
        Sample(_one("camera.xml", STORED_XML), check=camera_wrong),
        Sample(_one("camera.json", STORED_JSON), check=camera_wrong),
        Sample({"camera.yml.gz": gzip.compress(OPENCV.encode(), mtime=0)}, check=camera_wrong, binary=True),
    ],
    "storage_nodes:read_storage": [
        Sample(_one("a.yaml", OPENCV)),
        Sample(_one("a.xml", STORED_XML)),
        Sample(_one("a.json", STORED_JSON)),
    ],
    "calibration_files.ptam:read_ptam": [
        Sample(
            _one("camera.cfg", PTAM), lambda folder: (folder / "camera.cfg", (640, 480)), check=camera_wrong
        )
    ],
    "calibration_files.tum_mono:read_tum_mono": [Sample(_one("camera.txt", TUM_MONO), check=camera_wrong)],
    "carmen.reading:read": [
        Sample(_one("corrected.log", CARMEN)),
        Sample(_one("robot.log", ROBOT_LASER)),
        Sample(_one("raw.log", RAW_LASER)),
    ],
    "pictures:read_grey": [Sample(_picture(".png"), binary=True), Sample(_picture(".pgm"), binary=True)],
    "pictures:read_channels": [Sample(_picture(".png"), binary=True), Sample(_picture(".pgm"), binary=True)],
    "pictures:read_picture": [Sample(_picture(".png"), binary=True), Sample(_picture(".jpg"), binary=True)],
    "grid_files:read_ros_map": [
        Sample(
            {"map.yaml": ROS_MAP.encode(), "map.pgm": cv2.imencode(".pgm", _GREY)[1].tobytes()},
            lambda folder: (folder / "map.yaml",),
        )
    ],
    "matfile:read_vectors": [
        Sample(
            {"a.mat": _matlab(a=np.arange(5.0), b=np.arange(5, dtype=np.int32))},
            lambda folder: (folder / "a.mat", ("a", "b")),
            binary=True,
        )
    ],
    "middlebury:read_cameras": [Sample(_one("temple_par.txt", TEMPLE))],
    "mrclam:read_log": [Sample(_encoded(MRCLAM), lambda folder: (folder, 1), check=log_wrong)],
    "mrclam:read_truth": [Sample(_encoded(MRCLAM_TRUTH), lambda folder: (folder, 1, _MRCLAM_LOG))],
    "mrclam:read_barcodes": [Sample(_one("Barcodes.dat", MRCLAM["Barcodes.dat"]), lambda folder: (folder,))],
    "nist:read_problem": [Sample(_one("Toy.dat", NIST))],
    "sequences.cameras:read_camera": [
        Sample(_one("calib.txt", CALIB), lambda folder: (folder / "calib.txt", SIZE), check=camera_wrong),
        Sample(
            _one("camera.cfg", PTAM), lambda folder: (folder / "camera.cfg", (640, 480)), check=camera_wrong
        ),
        Sample(_one("camera", OPENCV), lambda folder: (folder / "camera", (640, 480)), check=camera_wrong),
        Sample(
            _one("camera", TUM_MONO), lambda folder: (folder / "camera", (1280, 1024)), check=camera_wrong
        ),
        *(
            Sample(_one("camera", text), lambda folder: (folder / "camera", (752, 480)), check=camera_wrong)
            for text in (MESSAGE, SETTINGS, KALIBR, SENSOR, STORED_XML, STORED_JSON)
        ),
    ],
    "sequences.cameras:read_plain_camera": [Sample(_one("calib.txt", CALIB), check=camera_wrong)],
    "sequences.cameras:read_kitti_camera": [
        Sample({"calib.txt": LAYOUTS["kitti"]()["calib.txt"]}, check=camera_wrong)
    ],
    "sequences.times:read_times": [Sample(_one("times.txt", "0.0\n0.1\n0.1\n0.35\n"))],
    "sequences.contents:read_pose": [
        Sample({"a.pose.txt": LAYOUTS["7scenes"]()["frame-000003.pose.txt"]}, check=pose_wrong)
    ],
    "sequences.contents:read_folder": [Sample(files(), _folder) for files in LAYOUTS.values()],
    "sequences.euroc:read_image_list": [
        Sample({"data.csv": LAYOUTS["euroc"]()["mav0/cam0/data.csv"]}, lambda folder: (folder,))
    ],
    "sequences.euroc:read_truth": [
        Sample(
            {"data.csv": EUROC.encode(), "sensor.yaml": SENSOR.encode()},
            lambda folder: (folder / "data.csv", folder / "sensor.yaml"),
            check=trajectory_wrong,
        )
    ],
    "vocabulary_files.reading:read_vocabulary": [
        Sample({name: data}, binary=name[-1] == "z", check=vocabulary_samples.vocabulary_wrong)
        for name, data in vocabulary_samples.FILES.items()
    ],
    "pose_graph_files.reading:read_pose_graph": [
        Sample(_one("graph.g2o", text), check=pose_graph_samples.pose_graph_wrong)
        for text in pose_graph_samples.TEXTS.values()
    ],
    "trajectories.reading:read": [
        Sample(_one("path.txt", TUM), check=trajectory_wrong),
        Sample(_one("path.csv", EUROC), check=trajectory_wrong),
        Sample(_one("named.csv", NAMED), check=trajectory_wrong),
        Sample(_one("vins.csv", VINS), check=trajectory_wrong),
    ],
    "trajectories.reading:detect": [Sample(_one("path.txt", TUM))],
    "trajectories.reading:read_tum": [Sample(_one("path.txt", TUM), check=trajectory_wrong)],
    "trajectories.reading:read_kitti": [Sample(_one("path.txt", KITTI), check=trajectory_wrong)],
    "trajectories.reading:read_euroc": [Sample(_one("path.csv", EUROC), check=trajectory_wrong)],
    "victoria_park:read_log": [
        Sample(
            {"aa3_dr.mat": DRIVE, "victoria_park.txt": GRAPH.encode()},
            lambda folder: (folder,),
            check=log_wrong,
        )
    ],
    "victoria_park:read_graph": [Sample(_one("victoria_park.txt", GRAPH))],
    "victoria_park:read_truth": [
        Sample({"aa3_gpsx.mat": GPS}, lambda folder: (folder, _PARK_LOG), binary=True)
    ],
}

BLOCKS = {
    "yaml_nodes:read_yaml": "answers with a tree that the readers of calibrations judge",
    "numbers:read_numbers": "is given bytes; the readers of BAL and Bundler use it",
    "text:read_bytes": "any bytes are right",
    "text:read_text": "any text is right",
    "text:read_lines": "any text is right",
    "text:read_columns": "the readers of logs use it",
    "trajectories.rows:read_rows": "answers with words that the readers of trajectories judge",
    "trajectories.stamps:read_stamps": "is given words; the readers of trajectories use it",
}
"""Readers that know no format: what they lack, and why they need no row."""
