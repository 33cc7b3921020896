"""OpenCV's FileStorage: YAML (``%YAML:1.0`` of versions 3 and 4, ``%YAML 1.2`` of 5), XML, JSON, and packed.

Matrices are entries ``rows``, ``cols``, ``dt``, ``data`` (also in base 64), with or without the tag
``!!opencv-matrix``, or lists of rows.  OpenCV has no rule for names; those of its samples, of ROS and of this
package are known::

    camera_matrix             3 x 3: fx, 0, cx, 0, fy, cy, 0, 0, 1
    distortion_coefficients   k1 k2 p1 p2 [k3 [k4 k5 k6]], or k1 k2 k3 k4 of a fisheye
    image_width, image_height
    camera_model              pinhole | radtan | rational | fisheye | fov  (or distortion_model)
    standard_deviations       of fx, fy, cx, cy and the coefficients; 0: not estimated (this package's)

OpenCV's pixel (0, 0) is the centre of the top-left pixel, as ours.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.calibration_files.lenses import lens_camera, lens_name, numbers_of
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.storage_nodes import read_storage
from vslam_ref.datasets.yaml_nodes import Node
from vslam_ref.geometry.cameras import MODELS
from vslam_ref.support.files import write_bytes

MATRIX = (
    *("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M", "CameraMatrix", "CameraMat"),
    *("intrinsic_matrix", "mtx"),
)
DISTORTION = (
    *("distortion_coefficients", "distCoeffs", "dist_coeffs", "Distortion_Coefficients", "D", "DistCoeffs"),
    *("distortion_coeffs", "dist_coeff", "dist_coefs", "DistCoeff", "DistortionCoefficients", "dist"),
)
"""With a number behind (M1, D1), they are those of one camera of several."""
LIKELY = re.compile("dist|coef", re.IGNORECASE)
"""In a name of an entry that may hold a lens."""
WIDTH, HEIGHT = ("image_width", "image_Width", "width"), ("image_height", "image_Height", "height")
SIZE = ("image_size", "imageSize", "ImageSize", "img_size", "resolution")
MODEL_NAMES = ("camera_model", "distortion_model")
STD = "standard_deviations"


def read_opencv(
    path: Path | str, *, matrix: str | None = None, distortion: str | None = None, model: str | None = None
) -> CameraFile:
    """Read one camera.

    Parameters
    ----------
    path : Path or str
        YAML, XML or JSON, plain or packed; the content says which.
    matrix, distortion : str, optional
        Names of the two entries, for files with several cameras, as ``M2`` and ``D2``.
    model : str, optional
        ``radtan``, ``fisheye``, … where the file does not say; default: by the number of coefficients.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    return from_entries(read_storage(Path(path)), matrix=matrix, distortion=distortion, model=model)


def from_entries(
    top: Node, *, matrix: str | None = None, distortion: str | None = None, model: str | None = None
) -> CameraFile:
    """:func:`read_opencv`, of a file that has been parsed."""
    if model is not None and model not in MODELS:
        raise ValueError(f"model={model!r}: must be one of {', '.join(MODELS)}")
    entries = top.items()
    node = _matrix(top, entries, (matrix,) if matrix else (*MATRIX, *(f"{name}1" for name in MATRIX)))
    sensor = sensor_of(node)
    at = _coefficients(entries, distortion, node)
    k = [] if at is None else numbers_of(at).tolist()
    camera = lens_camera(at or node, model or _named_model(entries), sensor, k)
    title = entries["camera_name"].text() if "camera_name" in entries else ""
    std = _std(entries[STD], len(camera.params)) if STD in entries else None
    return CameraFile(camera, _size(entries), name=title, std=std)


def _matrix(top: Node, entries: dict[str, Node], names: tuple[str, ...]) -> Node:
    """The entry with the camera matrix."""
    for name in names:
        if name in entries:
            return entries[name]
    known = " or ".join(names[:4]) + ("" if len(names) < 5 else " or the like (M1, mtx)")
    raise top.error(f"{top.name} has no {known}; found: {', '.join(entries) or 'nothing'}")


def _std(node: Node, count: int) -> tuple[float, ...]:
    """Standard deviations of the parameters."""
    values = node.matrix().ravel()
    if len(values) != count or not (values >= 0).all():
        raise node.error(f"{node.name}: expected {count} numbers, none below 0")
    return tuple(values.tolist())


def sensor_of(node: Node) -> list[float]:
    """fx, fy, cx, cy of a camera matrix."""
    K = node.matrix()
    if K.shape != (3, 3):
        raise node.error(f"{node.name} is {K.shape[0]} x {K.shape[1]}; expected 3 x 3")
    wanted = np.array([[K[0, 0], 0, K[0, 2]], [0, K[1, 1], K[1, 2]], [0, 0, 1.0]])
    if not np.array_equal(K, wanted):
        what = "has other numbers than fx, fy, cx, cy; expected 0 there and 1 at the end"
        raise node.error(f"{node.name} {what}")
    sensor: list[float] = K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    return sensor


def _coefficients(entries: dict[str, Node], asked: str | None, node: Node) -> Node | None:
    """The entry with the distortion coefficients; None where the file has none.

    A name that only looks like it is refused: a lens must not be lost because its name is not known here.
    """
    number = re.sub(r".*\D", "", node.name)
    names = [
        name for name in ((asked,) if asked else (f"{n}{number}" for n in DISTORTION)) if name in entries
    ]
    if names:
        return entries[names[0]]
    if asked:
        raise node.error(f"the file has no {asked}; found: {', '.join(entries)}")
    for name, entry in entries.items():
        if LIKELY.search(name) and name not in MODEL_NAMES and entry.raw.id != "scalar":
            known = ", ".join(DISTORTION)
            raise entry.error(
                f"{name} may hold distortion coefficients, under a name of its own; use {known}"
            )
    return None


def _named_model(entries: dict[str, Node]) -> str | None:
    """Model that the file names, by our name."""
    for key in MODEL_NAMES:
        if key in entries and entries[key].text().strip():
            return lens_name(entries[key])
    return "fisheye" if "fisheye_model" in entries and entries["fisheye_model"].number() else None


def _size(entries: dict[str, Node]) -> tuple[int, int] | None:
    width, height = ([entries[n] for n in names if n in entries] for names in (WIDTH, HEIGHT))
    if width and height:
        return width[0].integer(), height[0].integer()
    both = [entries[name] for name in SIZE if name in entries]
    return both[0].size() if both else None


def write_opencv(path: Path | str, file: CameraFile) -> None:
    """Write one camera so that :func:`read_opencv` and ``cv2.FileStorage`` read it, every number in full.

    The model is named in ``camera_model``.  OpenCV has no FOV lens; of such a file it reads the numbers.

    Parameters
    ----------
    path : Path or str
        Where to write; an existing file is replaced only when all is written.
    file : CameraFile
        Camera, size and name; a pose in a rig has no place in this format and is left out.
    """
    camera = file.camera
    model = next(name for name, kind in MODELS.items() if type(camera) is kind)
    lines = ["%YAML:1.0", "---", f"camera_model: {model}"]
    if file.name:
        escaped = file.name.replace("\\", "\\\\").replace('"', '\\"')
        lines.append(f'camera_name: "{escaped}"')
    if file.size is not None:
        lines += [f"image_width: {file.size[0]}", f"image_height: {file.size[1]}"]
    lines += _matrix_lines("camera_matrix", camera.matrix)
    if len(camera.params) > 4:
        lines += _matrix_lines("distortion_coefficients", camera.params[4:, None])
    if file.std is not None:
        lines += _matrix_lines(STD, np.array(file.std)[:, None])
    write_bytes(Path(path), ("\n".join(lines) + "\n").encode())


def _matrix_lines(name: str, values: Array) -> list[str]:
    rows, cols = values.shape
    numbers = [repr(float(v)) for v in values.ravel()]
    chunks = [", ".join(numbers[i : i + 3]) for i in range(0, len(numbers), 3)]
    data = ",\n       ".join(chunks)
    head = [f"{name}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {cols}", "   dt: d"]
    return [*head, f"   data: [ {data} ]"]
