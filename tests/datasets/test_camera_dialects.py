"""Camera files as other programs write them: each dialect gives the camera that its program means."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from vslam_ref.datasets.calibration_files import (
    read_camera_info,
    read_euroc,
    read_kalibr,
    read_opencv,
    read_orbslam,
    read_tum_mono,
)
from vslam_ref.datasets.sequences import read_camera
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fisheye, Pinhole, Radtan, Rational

SENSOR = (458.5, 457.25, 367.25, 248.5)
SIZE = (752, 480)
FIVE = (-0.2834, 0.0739, 0.00019, 1.76e-05, 0.015)
RADTAN = Radtan(*SENSOR, *FIVE)


def written(tmp_path: Path, text: str | bytes, name: str = "camera.file") -> Path:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


# --- OpenCV's storage: OpenCV itself is the oracle ---------------------------------------------------


def stored(path: Path, flags: int = 0) -> Path:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE | flags)
    storage.write("calibration_time", 'Thu 05 Mar 2026 "noon"')
    storage.write("image_width", SIZE[0])
    storage.write("image_height", SIZE[1])
    storage.write("camera_matrix", RADTAN.matrix)
    storage.write("distortion_coefficients", np.array([FIVE]))
    storage.write("one", np.array([[1.5]]))
    storage.release()
    return path


@pytest.mark.parametrize("suffix", [".yml", ".yaml", ".xml", ".json", ".yml.gz", ".xml.gz", ".json.gz"])
@pytest.mark.parametrize("flags", [0, cv2.FILE_STORAGE_WRITE_BASE64])
def test_every_form_of_this_opencv(tmp_path: Path, suffix: str, flags: int) -> None:
    path = stored(tmp_path / f"camera{suffix}", flags if not suffix.endswith("gz") else 0)
    found = read_opencv(path)
    assert found.camera == RADTAN
    assert found.size == SIZE
    assert found.notes == ()
    assert read_camera(path, SIZE).camera == RADTAN
    renamed = path.rename(tmp_path / "no_suffix")  # the content says what it is
    assert read_opencv(renamed).camera == read_camera(renamed, SIZE).camera == RADTAN


def test_single_precision_in_base_64(tmp_path: Path) -> None:
    path = tmp_path / "camera.yml"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_WRITE_BASE64)
    storage.write("K", RADTAN.matrix.astype(np.float32))
    storage.write("D", np.array([FIVE], np.float32))
    storage.release()
    assert np.abs(read_opencv(path).camera.params - RADTAN.params).max() < 458 * 2.0**-24


@pytest.mark.parametrize("data", ["MWQ!", "MWQg", "eHh4eHh4eHh4eHh4eHh4eHh4eHh4eHh4AAAAAAAAAAA="])
def test_damaged_base_64(tmp_path: Path, data: str) -> None:
    text = f"K:\n  rows: 3\n  cols: 3\n  dt: d\n  data: !!binary {data}\n"
    with pytest.raises(FormatError, match=r"camera.file:5: data .*base 64|expected 3 x 3"):
        read_opencv(written(tmp_path, text))


def test_keys_without_a_blank_as_opencv_reads_them(tmp_path: Path) -> None:
    path = written(
        tmp_path, "%YAML:1.0\nCamera.fx:458.5\nCamera.fy:457.25\nCamera.cx:367\nCamera.cy: 248\n", "a.yml"
    )
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    values = [storage.getNode(f"Camera.{name}").real() for name in ("fx", "fy", "cx", "cy")]
    assert read_orbslam(path).camera.params.tolist() == values == [458.5, 457.25, 367.0, 248.0]


@pytest.mark.parametrize(
    ("keys", "size"),
    [
        (("K", "D"), None),
        (("mtx", "dist"), None),
        (("camera_matrix", "dist_coeff"), None),
        (("cameraMatrix1", "distCoeffs1"), None),
        (("M1", "D1"), None),
    ],
)
@pytest.mark.parametrize("form", ["yaml", "json", "json with tabs"])
def test_lists_of_rows_as_python_programs_write_them(
    tmp_path: Path, keys: tuple[str, str], size: object, form: str
) -> None:
    content = {keys[0]: RADTAN.matrix.tolist(), keys[1]: [list(FIVE)], "image_size": list(SIZE)}
    if form == "yaml":
        import yaml

        text = yaml.safe_dump(content)
    else:
        text = json.dumps(content, indent="\t" if "tabs" in form else 2)
    found = read_opencv(written(tmp_path, text))
    assert found.camera == RADTAN
    assert found.size == SIZE
    assert size is None


def test_the_second_camera_has_its_own_distortion(tmp_path: Path) -> None:
    """M2 without a named distortion must not be paired with D1."""
    content = {
        "M1": RADTAN.matrix.tolist(),
        "D1": list(FIVE),
        "M2": RADTAN.matrix.tolist(),
        "D2": [0.5, 0, 0, 0, 0],
    }
    assert read_opencv(written(tmp_path, json.dumps(content)), matrix="M2").camera.params[4] == 0.5


def test_a_distortion_of_another_name_is_not_lost(tmp_path: Path) -> None:
    content = {"camera_matrix": RADTAN.matrix.tolist(), "my_distortion": list(FIVE)}
    with pytest.raises(
        FormatError, match=r"my_distortion may hold distortion coefficients.*use distortion_coeff"
    ):
        read_opencv(written(tmp_path, json.dumps(content)))


@pytest.mark.parametrize("count", [12, 14])
def test_thin_prism_and_tilt(tmp_path: Path, count: int) -> None:
    """Zeros behind the eighth number are no lens; others have none here, and the line says what to do."""
    eight = [0.5, -0.1, 3e-4, -2e-4, 0.02, 0.9, -0.05, 0.01]
    content = {"K": RADTAN.matrix.tolist(), "D": [*eight, *[0.0] * (count - 8)]}
    assert read_opencv(written(tmp_path, json.dumps(content))).camera == Rational(*SENSOR, *eight)
    content["D"][-1] = 1e-3  # type: ignore[index]
    what = "a thin prism" if count == 12 else "a tilted sensor"
    with pytest.raises(
        FormatError, match=f"D has {count} numbers, of {what}.*rational: calibrate again with"
    ):
        read_opencv(written(tmp_path, json.dumps(content)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a>", "expected XML"),
        ("<a></a>", ":1: <a>; expected <opencv_storage>"),
        ("<opencv_storage></opencv_storage>", "holds no entries"),
        ("<!DOCTYPE a [<!ENTITY b 'b'>]>\n<opencv_storage/>", ":1: declares a document type"),
        ("<_>" * 100, "nested too deeply"),
        ("<opencv_storage>\n<K type_id='opencv-matrix'><rows>3</rows><cols>3</cols>\n<data>1 2</data></K>"
         "</opencv_storage>", ":3: K has 2 numbers; expected 3 x 3"),
        ("<opencv_storage><K><_><_>1 x</_></_></K></opencv_storage>", "expected"),
        ("<?xml version='1.0' encoding='klingon'?><opencv_storage/>", "camera.file"),
    ],
)  # fmt: skip
def test_damaged_xml(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read_opencv(written(tmp_path, text))


def test_small_files_that_would_become_large(tmp_path: Path) -> None:
    """A packed file of a few kilobytes, and aliases of aliases: refused, without the memory."""
    bomb = gzip.compress(b"a: " + b"0" * 50_000_000)
    with pytest.raises(FormatError, match="more than 1048576 bytes unpacked"):
        read_opencv(written(tmp_path, bomb))
    half = gzip.compress(b"K: 1")[:-6]
    with pytest.raises(FormatError, match="damaged gzip file"):
        read_opencv(written(tmp_path, half))
    row = "r: &r [" + "1, " * 60_000 + "1]\n"
    with pytest.raises(FormatError, match=r"60001 numbers; at most 4096|rows; expected a matrix of a few"):
        read_opencv(written(tmp_path, row + "K: [" + "*r, " * 30_000 + "*r]\n"))
    laughs = "".join(
        f"a{k + 1}: &a{k + 1} [*a{k}, *a{k}, *a{k}, *a{k}, *a{k}, *a{k}, *a{k}, *a{k}]\n" for k in range(20)
    )
    with pytest.raises(FormatError, match="K"):
        read_opencv(written(tmp_path, "a0: &a0 [1]\n" + laughs + "K: *a20\n"))


# --- ROS ---------------------------------------------------------------------------------------------

MESSAGE = """header:
  stamp:
    sec: 1700000000
    nanosec: 120000000
  frame_id: camera
height: 480
width: 752
distortion_model: plumb_bob
d: [-0.2834, 0.0739, 0.00019, 1.76e-05, 0.015]
k: [458.5, 0.0, 367.25, 0.0, 457.25, 248.5, 0.0, 0.0, 1.0]
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [450.0, 0.0, 370.0, 0.0, 0.0, 450.0, 250.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
"""


def upper(text: str) -> str:
    """As ROS 1 writes it."""
    for name in "dkrp":
        text = text.replace(f"\n{name}: ", f"\n{name.upper()}: ")
    return text


@pytest.mark.parametrize("end", ["", "---\n", "---", "---\r\n"])
@pytest.mark.parametrize("form", [str, upper])
def test_ros_messages(tmp_path: Path, form: type, end: str) -> None:
    path = written(tmp_path, form(MESSAGE) + end)
    found = read_camera_info(path)
    assert (found.camera, found.size, found.notes) == (RADTAN, SIZE, ())
    assert read_camera(path, SIZE) == found


def test_many_messages(tmp_path: Path) -> None:
    """The same camera again and again says nothing; another one is told; a long topic is read."""
    later = MESSAGE.replace("sec: 1700000000", "sec: 1700000001")
    assert read_camera_info(written(tmp_path, "---\n".join([MESSAGE, later, later]))).notes == ()
    other = read_camera_info(written(tmp_path, "---\n".join([MESSAGE, later, later.replace("458.5", "500")])))
    assert other.camera == RADTAN
    assert "1 of 3 messages say something else" in other.notes[0]
    long = written(tmp_path, "---\n".join([MESSAGE] * 3000))
    assert long.stat().st_size > 1.2e6
    assert read_camera_info(long).notes == ()
    assert read_camera(long, SIZE).camera == RADTAN


@pytest.mark.parametrize(
    ("model", "d", "camera"),
    [
        ("plumb_bob", FIVE[:4], Radtan(*SENSOR, *FIVE[:4])),
        ("rational_polynomial", (*FIVE, 0.9, -0.05, 0.01), Rational(*SENSOR, *FIVE, 0.9, -0.05, 0.01)),
        ("rational_polynomial", (*FIVE, 0, 0, 0, 0, 0, 0, 0, 0, 0), Rational(*SENSOR, *FIVE, 0, 0, 0)),
        ("rational_polynomial", FIVE, Rational(*SENSOR, *FIVE, 0, 0, 0)),
        ("equidistant", (0.01, -0.02, 0.003, 0.0004), Fisheye(*SENSOR, 0.01, -0.02, 0.003, 0.0004)),
        ("plumb_bob", (), Pinhole(*SENSOR)),
        ('""', (), Pinhole(*SENSOR)),
        ("none", (0.0,) * 5, Pinhole(*SENSOR)),
    ],
)
def test_ros_lenses(tmp_path: Path, model: str, d: tuple, camera: object) -> None:
    text = MESSAGE.replace("plumb_bob", model).replace(f"d: {list(FIVE)}", f"d: {list(map(float, d))}")
    found = read_camera_info(written(tmp_path, text))
    if model == "plumb_bob" and not d:
        camera = Pinhole(*SENSOR)
    assert found.camera == camera
    assert found.notes == ()


def test_more_numbers_than_a_plumb_bob_has(tmp_path: Path) -> None:
    """OpenCV goes by their number, and so does ROS; it is told."""
    text = MESSAGE.replace("0.015]", "0.015, 0.9, -0.05, 0.01]")
    found = read_camera_info(written(tmp_path, text))
    assert found.camera == Rational(*SENSOR, *FIVE, 0.9, -0.05, 0.01)
    assert "plumb_bob has 4 or 5 coefficients, here are 8" in found.notes[0]


def test_binning_and_region(tmp_path: Path) -> None:
    """A point's pixel in the small picture is the mean of the places of the pixels it was made of."""
    text = MESSAGE.replace("binning_x: 0", "binning_x: 2").replace("binning_y: 0", "binning_y: 4")
    text = text.replace("x_offset: 0", "x_offset: 32").replace("y_offset: 0", "y_offset: 16")
    text = text.replace("  height: 0", "  height: 400").replace("  width: 0", "  width: 640")
    found = read_camera_info(written(tmp_path, text))
    assert found.size == (320, 100)
    assert "320x100" in found.notes[0]
    X = np.random.default_rng(0).uniform([-0.3, -0.2, 1], [0.3, 0.2, 2], (40, 3))
    small, whole = found.camera.project(X).uv, RADTAN.project(X).uv
    # column u of the small picture is made of the columns 32 + 2 u and 32 + 2 u + 1, rows likewise of four
    back = np.stack([32 + 2 * small[:, 0] + 0.5, 16 + 4 * small[:, 1] + 1.5], axis=1)
    assert np.abs(back - whole).max() < 1e-10
    full = MESSAGE.replace("  height: 0", "  height: 480").replace("  width: 0", "  width: 752")
    assert read_camera_info(written(tmp_path, full)).notes == ()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "k: [458.5, 0.0, 367.25, 0.0, 457.25, 248.5, 0.0, 0.0, 1.0]",
            f"k: {[0.0] * 9}",
            ":10: k has fx = 0.*not calibrated",
        ),
        ("248.5, 0.0, 0.0, 1.0", "248.5, 0.0, 0.0", ":10: k has 8 numbers; expected 9"),
        ("k: [458.5, 0.0", "k: [458.5, 0.1", "expected fx 0 cx 0 fy cy"),
        ("plumb_bob", "thin_prism_fisheye", "thin_prism_fisheye, a lens .* fisheye .*: calibrate again"),
        ("plumb_bob", "magic", ":8: distortion_model is 'magic'; expected one of"),
        ("plumb_bob", "equidistant", "5 coefficients for fisheye; expected 4"),
        ("  x_offset: 0", "  x_offset: 800", "roi"),
        ("binning_x: 0", "binning_x: 1000", "leaves no pixel"),
        ("width: 752", "wide: 752", "has no width"),
    ],
)  # fmt: skip
def test_damaged_messages(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in MESSAGE
    with pytest.raises(FormatError, match=message):
        read_camera_info(written(tmp_path, MESSAGE.replace(old, new, 1)))


# --- ORB-SLAM ----------------------------------------------------------------------------------------


def settings(
    prefix: str = "Camera", *, lens: str = "radtan", head: str = "%YAML:1.0\n", **more: object
) -> str:
    names = {"radtan": ("k1", "k2", "p1", "p2", "k3"), "fisheye": ("k1", "k2", "k3", "k4"), "none": ()}[lens]
    lines = [f"{prefix}.{n}: {v}" for n, v in zip(("fx", "fy", "cx", "cy"), SENSOR, strict=True)]
    lines += [f"{prefix}.{n}: {v:.8f} # lens" for n, v in zip(names, FIVE, strict=False)]
    lines += [f"{key.replace('__', '.')}: {value}" for key, value in more.items()]
    return head + "\n".join(lines) + "\nORBextractor.nFeatures: 1000\n"


FOUR = Fisheye(*SENSOR, *FIVE[:4])


@pytest.mark.parametrize(
    "head", ["%YAML:1.0\n", "%YAML:1.0\n---\n", "", "\ufeff%YAML:1.0\n\n#----\n", "---\n"]
)
@pytest.mark.parametrize(
    ("prefix", "lens", "more", "camera"),
    [
        ("Camera", "radtan", {}, RADTAN),
        ("Camera", "radtan", {"Camera__type": '"PinHole"'}, RADTAN),
        (
            "Camera1",
            "radtan",
            {"Camera__type": '"PinHole"', "File__version": '"1.0"', "Camera2__fx": 1.0},
            RADTAN,
        ),
        ("Camera", "fisheye", {"Camera__type": '"KannalaBrandt8"'}, FOUR),
        ("Camera1", "fisheye", {"Camera__type": '"KannalaBrandt8"', "Camera2__k1": 1.0}, FOUR),
        ("Camera1", "none", {"Camera__type": '"Rectified"', "Stereo__b": 0.11}, Pinhole(*SENSOR)),
        ("Camera1", "none", {"Camera__type": '"PinHole"'}, Pinhole(*SENSOR)),
        ("Camera", "fisheye", {"Camera__model": '"fisheye"', "Camera__setup": '"monocular"'}, FOUR),
        ("Camera", "radtan", {"Camera__model": '"perspective"'}, RADTAN),
    ],
)
def test_settings(tmp_path: Path, head: str, prefix: str, lens: str, more: dict, camera: object) -> None:
    path = written(tmp_path, settings(prefix, lens=lens, head=head, **more))
    found = read_orbslam(path)
    assert found.camera == camera
    assert (found.size, found.notes, found.T_cam_rig) == (None, (), None)
    assert read_camera(path, SIZE) == found


def test_sizes_of_settings(tmp_path: Path) -> None:
    assert read_orbslam(written(tmp_path, settings(Camera__width=752, Camera__height=480))).size == SIZE
    assert read_orbslam(written(tmp_path, settings(Camera__cols=752, Camera__rows=480))).size == SIZE


@pytest.mark.parametrize("name", ["IMU.T_b_c1", "Tbc"])
def test_where_the_camera_is_in_the_body(tmp_path: Path, name: str) -> None:
    """T_b_c1 takes the camera's origin to its place in the body; T_cam_rig takes that back to zero."""
    T = se3.exp([0.1, -0.2, 0.3, 0.4, 0.5, -0.6])
    data = ", ".join(f"{v:.9f}" for v in T.ravel())
    text = settings() + f"{name}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [{data}]\n"
    found = read_orbslam(written(tmp_path, text))
    assert found.T_cam_rig is not None
    assert np.abs(found.T_cam_rig @ T[:, 3] - [0, 0, 0, 1]).max() < 1e-8


def test_what_is_odd_in_settings_is_told(tmp_path: Path) -> None:
    left = settings(LEFT__K="[1]", LEFT__D="[1]")
    assert "LEFT.K" in read_orbslam(written(tmp_path, left)).notes[0]
    rectified = settings("Camera1", Camera__type="Rectified")
    found = read_orbslam(written(tmp_path, rectified))
    assert found.camera == Pinhole(*SENSOR)
    assert "k1, k2, p1, p2, k3 are not used" in found.notes[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (settings(Camera__type="Omni"), "Camera.type is omni, a lens .*fisheye|Camera.type is 'Omni'"),
        (
            settings(Camera__model="equirectangular"),
            "equirectangular, a lens that no camera here has.*fisheye",
        ),
        (
            settings(lens="none", Camera__type="KannalaBrandt8"),
            "no Camera.k1, Camera.k2, Camera.k3, Camera.k4",
        ),
        (settings().replace("Camera.cy", "Camera.c"), "has no Camera.cy; expected settings of ORB-SLAM"),
        (settings().replace("458.5", "4x5"), ":2: Camera.fx is '4x5'; expected a number"),
        (settings(Camera__width="no", Camera__height=3), "Camera.width is 'no'"),
    ],
)
def test_damaged_settings(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read_orbslam(written(tmp_path, text))


def test_a_camera_that_is_a_set_of_entries(tmp_path: Path) -> None:
    text = "Camera:\n  model: perspective\n  fx: 458.5\n  fy: 457.25\n  cx: 367.25\n  cy: 248.5\n"
    text += "  cols: 752\n  rows: 480\n"
    path = written(tmp_path, text)
    assert read_orbslam(path).camera == Pinhole(*SENSOR)
    assert read_camera(path, SIZE).size == SIZE


# --- Kalibr and the others ---------------------------------------------------------------------------


def chain(*cameras: dict[str, object]) -> str:
    lines = []
    for k, more in enumerate(cameras):
        entries = {
            "camera_model": "pinhole",
            "distortion_coeffs": list(FIVE[:4]),
            "distortion_model": "radtan",
            "intrinsics": list(SENSOR),
            "resolution": list(SIZE),
        } | more
        lines += [f"cam{k}:", *(f"  {name}: {value}" for name, value in entries.items())]
    return "\n".join(lines) + "\n"


A, B, C = (
    se3.exp(v) for v in ([0.1, 0.2, 0.3, 0.5, 0, 0.2], [0.11, 0, 0, 0, 0.1, 0], [0, 0.2, 0, 0.3, 0, 0])
)


@pytest.mark.parametrize(
    ("cameras", "right"),
    [
        ([{"T_imu_cam": A.tolist()}], [np.linalg.inv(A)]),
        ([{"T_cam_imu": A.tolist()}], [A]),
        ([{"T_cam_imu": A.tolist(), "T_imu_cam": np.linalg.inv(A).tolist()}], [A]),
        ([{"T_imu_cam": A.tolist()}, {"T_cn_cnm1": B.tolist()}], [np.linalg.inv(A), B @ np.linalg.inv(A)]),
        ([{}, {"T_cn_cnm1": B.tolist()}, {"T_cn_cnm1": C.tolist()}], [np.eye(4), B, C @ B]),
        ([{}, {"T_cn_cnm1": B.tolist(), "T_cam_imu": A.tolist()}], [np.linalg.inv(B) @ A, A]),
        ([{}, {"T_cam_imu": A.tolist()}], [None, A]),
        ([{"T_imu_cam": A.tolist()}, {"T_imu_cam": C.tolist()}], [np.linalg.inv(A), np.linalg.inv(C)]),
        ([{}, {}], [np.eye(4), None]),
    ],
)
def test_poses_in_a_chain(tmp_path: Path, cameras: list, right: list) -> None:
    found = read_kalibr(written(tmp_path, chain(*cameras)))
    for one, T in zip(found, right, strict=True):
        assert one.notes == ()
        assert (one.T_cam_rig is None) == (T is None)
        if T is not None:
            assert np.abs(one.T_cam_rig - T).max() < 1e-12


def test_poses_that_contradict_each_other(tmp_path: Path) -> None:
    both = {"T_cam_imu": A.tolist(), "T_imu_cam": A.tolist()}
    with pytest.raises(FormatError, match="T_imu_cam is not the inverse of T_cam_imu"):
        read_kalibr(written(tmp_path, chain(both)))
    second = {"T_cn_cnm1": B.tolist(), "T_cam_imu": (B @ B @ A).tolist()}
    found = read_kalibr(written(tmp_path, chain({"T_cam_imu": A.tolist()}, second)))[1]
    assert np.abs(found.T_cam_rig - B @ B @ A).max() < 1e-12
    assert "cam1: its pose to the IMU and T_cn_cnm1 differ by" in found.notes[0]


BARE = {"distortion_model": "none", "distortion_coeffs": []}


def model_pixel(kind: str, p: tuple[float, ...], X: np.ndarray) -> np.ndarray:
    """Kalibr's formulas of the wide models, without distortion: the oracle of what makes a pinhole."""
    x, y, z = X.T
    d = np.linalg.norm(X, axis=1)
    if kind == "omni":
        depth = z + p[0] * d
    elif kind == "ds":
        shifted = p[0] * d + z
        depth = p[1] * np.sqrt(x * x + y * y + shifted**2) + (1 - p[1]) * shifted
    else:
        depth = p[0] * np.sqrt(p[1] * (x * x + y * y) + z * z) + (1 - p[0]) * z
    return np.stack([SENSOR[0] * x / depth + SENSOR[2], SENSOR[1] * y / depth + SENSOR[3]], axis=1)


@pytest.mark.parametrize(
    ("kind", "p"),
    [("omni", (0.0,)), ("ds", (0.0, 0.0)), ("eucm", (0.0, 1.2)), ("eucm", (0.6, 0.0))],
)
def test_wide_models_that_are_a_pinhole(tmp_path: Path, kind: str, p: tuple[float, ...]) -> None:
    one = {"camera_model": kind, "intrinsics": [*p, *SENSOR], **BARE}
    found = read_kalibr(written(tmp_path, chain(one)))[0].camera
    X = np.random.default_rng(0).uniform([-1, -1, 1], [1, 1, 3], (50, 3))
    assert np.abs(found.project(X).uv - model_pixel(kind, p, X)).max() < 1e-10


@pytest.mark.parametrize(
    ("kind", "p"),
    [
        ("omni", (1.7,)),
        ("ds", (-0.3, 0.55)),
        ("ds", (0.0, 0.5)),
        ("eucm", (0.6, 1.1)),
        ("mei", ()),
        ("ucm", (1.0,)),
    ],
)
def test_wide_models_that_no_camera_has(tmp_path: Path, kind: str, p: tuple[float, ...]) -> None:
    one = {"camera_model": kind, "intrinsics": [*p, *SENSOR], **BARE}
    with pytest.raises(
        FormatError, match=f"camera_model is {kind}.*nearest supported model is fisheye"
    ) as told:
        read_kalibr(written(tmp_path, chain(one)))
    assert "calibrate again with 'vslam-ref calibrate --model fisheye'" in str(told.value)


def test_omni_keeps_its_distortion_and_ds_has_none(tmp_path: Path) -> None:
    one = {"camera_model": "omni", "intrinsics": [0.0, *SENSOR]}
    assert read_kalibr(written(tmp_path, chain(one)))[0].camera == Radtan(*SENSOR, *FIVE[:4])
    two = {"camera_model": "ds", "intrinsics": [0.0, 0.0, *SENSOR]}
    with pytest.raises(FormatError, match="distortion_model is 'radtan' beside ds; expected none"):
        read_kalibr(written(tmp_path, chain(two)))


def test_openvins_header(tmp_path: Path) -> None:
    path = written(tmp_path, "%YAML:1.0\n\n" + chain({"T_imu_cam": A.tolist(), "timeshift_cam_imu": 0.0}))
    assert np.abs(read_camera(path, SIZE).T_cam_rig - np.linalg.inv(A)).max() < 1e-12  # type: ignore[operator]


def test_euroc_names_the_nearest_model(tmp_path: Path) -> None:
    text = "sensor_type: camera\ncamera_model: omni\nintrinsics: [1, 2, 3, 4, 5]\n"
    with pytest.raises(FormatError, match=r":2: camera_model is omni, a lens .*fisheye"):
        read_euroc(written(tmp_path, text))


@pytest.mark.parametrize(
    ("line", "camera"),
    [
        ("RadTan 458.5 457.25 367.25 248.5 -0.2834 0.0739 0.00019 1.76e-05", Radtan(*SENSOR, *FIVE[:4])),
        ("458.5 457.25 367.25 248.5 -0.2834 0.0739 0.00019 1.76e-05", Radtan(*SENSOR, *FIVE[:4])),
        ("EquiDistant 458.5 457.25 367.25 248.5 -0.2834 0.0739 0.00019 1.76e-05", FOUR),
        ("KannalaBrandt 458.5 457.25 367.25 248.5 -0.2834 0.0739 0.00019 1.76e-05", FOUR),
    ],
)
def test_lenses_of_dso(tmp_path: Path, line: str, camera: object) -> None:
    path = written(tmp_path, f"{line}\n752 480\ncrop\n640 480\n")
    assert read_tum_mono(path).recorded.camera == camera
    assert read_camera(path, SIZE).camera == camera


def test_a_note_about_the_camera_reaches_the_sequence(tmp_path: Path) -> None:
    from vslam_ref.datasets.sequences import open_sequence

    cv2.imwrite(str(tmp_path / "0.png"), np.zeros((480, 752), np.uint8))
    path = written(tmp_path, settings(LEFT__K="[1]"), "orb.yaml")
    assert any("orb.yaml: Camera.fx" in note for note in open_sequence(tmp_path, camera=path).notes)
