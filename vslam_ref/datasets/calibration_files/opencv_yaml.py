"""OpenCV's FileStorage YAML: ``%YAML:1.0`` of versions 3 and 4, ``%YAML 1.2`` of version 5.

Matrices are entries ``rows``, ``cols``, ``dt``, ``data``, with or without the tag ``!!opencv-matrix``.
OpenCV has no rule for names; those of its samples, of ROS and of this package are known::

    camera_matrix             3 x 3: fx, 0, cx, 0, fy, cy, 0, 0, 1
    distortion_coefficients   k1 k2 p1 p2 [k3 [k4 k5 k6]], or k1 k2 k3 k4 of a fisheye
    image_width, image_height
    camera_model              pinhole | radtan | rational | fisheye | fov  (or distortion_model)
    standard_deviations       of fx, fy, cx, cy and the coefficients; 0: not estimated (this package's)

OpenCV's pixel (0, 0) is the centre of the top-left pixel, as ours.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.yaml_nodes import Node, build, read_yaml
from vslam_ref.geometry.cameras import MODELS, Camera
from vslam_ref.support.files import write_bytes

MATRIX = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "M1", "M")
DISTORTION = ("distortion_coefficients", "distCoeffs", "dist_coeffs", "Distortion_Coefficients", "D", "D1")
WIDTH, HEIGHT = ("image_width", "image_Width"), ("image_height", "image_Height")
STD = "standard_deviations"
SYNONYMS = {
    "plumb_bob": "radtan",
    "radial-tangential": "radtan",
    "rational_polynomial": "rational",
    "equidistant": "fisheye",
}
COUNTS = {"pinhole": (0,), "radtan": (4, 5), "rational": (8,), "fisheye": (4,), "fov": (1,)}


def read_opencv(
    path: Path | str, *, matrix: str | None = None, distortion: str | None = None, model: str | None = None
) -> CameraFile:
    """Read one camera.

    Parameters
    ----------
    path : Path or str
        YAML file.
    matrix, distortion : str, optional
        Names of the two entries, for files with several cameras, as ``M2`` and ``D2``.
    model : str, optional
        ``radtan``, ``fisheye``, … where the file does not say; default: by the number of coefficients.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    top = read_yaml(Path(path))
    entries = top.items()
    node = top.get(*((matrix,) if matrix else MATRIX))
    sensor = _sensor(node)
    names = [name for name in ((distortion,) if distortion else DISTORTION) if name in entries]
    if distortion and not names:
        top.get(distortion)
    coefficients = _coefficients(entries[names[0]]) if names else np.zeros(0)
    at = entries[names[0]] if names else node
    name = model or _named_model(entries) or _model_of(coefficients)
    camera = _camera(at, name, sensor, coefficients)
    title = entries["camera_name"].text() if "camera_name" in entries else ""
    std = _std(entries[STD], len(camera.params)) if STD in entries else None
    return CameraFile(camera, _size(entries), name=title, std=std)


def _std(node: Node, count: int) -> tuple[float, ...]:
    """Standard deviations of the parameters."""
    values = node.matrix().ravel()
    if len(values) != count or not (values >= 0).all():
        raise node.error(f"{node.name}: expected {count} numbers, none below 0")
    return tuple(values.tolist())


def _sensor(node: Node) -> Array:
    """fx, fy, cx, cy of a camera matrix."""
    K = node.matrix()
    if K.shape != (3, 3):
        raise node.error(f"{node.name} is {K.shape[0]} x {K.shape[1]}; expected 3 x 3")
    wanted = np.array([[K[0, 0], 0, K[0, 2]], [0, K[1, 1], K[1, 2]], [0, 0, 1.0]])
    if not np.array_equal(K, wanted):
        what = "has other numbers than fx, fy, cx, cy; expected 0 there and 1 at the end"
        raise node.error(f"{node.name} {what}")
    return K[[0, 1, 0, 1], [0, 1, 2, 2]]


def _coefficients(node: Node) -> Array:
    """Distortion coefficients, trailing zeros beyond the rational model left out."""
    values = (node.matrix() if node.raw.id == "mapping" else node.vector()).ravel()
    if len(values) in (12, 14) and not values[8:].any():
        values = values[:8]
    if len(values) > 8:
        what = f"has {len(values)} numbers; no thin prism or tilt here, expected up to 8"
        raise node.error(f"{node.name} {what}")
    return values


def _named_model(entries: dict[str, Node]) -> str | None:
    """Model that the file names, by our name."""
    for key in ("camera_model", "distortion_model"):
        if key in entries:
            return entries[key].choice({name: name for name in MODELS} | SYNONYMS)
    return "fisheye" if "fisheye_model" in entries and entries["fisheye_model"].number() else None


def _model_of(coefficients: Array) -> str:
    return "pinhole" if len(coefficients) == 0 else "radtan" if len(coefficients) <= 5 else "rational"


def _camera(node: Node, name: str, sensor: Array, coefficients: Array) -> Camera:
    if name not in MODELS:
        raise ValueError(f"model={name!r}: must be one of {', '.join(MODELS)}")
    if len(coefficients) not in COUNTS[name] and not (name == "pinhole" and not coefficients.any()):
        right = " or ".join(map(str, COUNTS[name]))
        raise node.error(f"{node.name}: {len(coefficients)} coefficients for {name}; expected {right}")
    k = coefficients.tolist() if name != "pinhole" else []
    camera: Camera = build(node, MODELS[name], *sensor.tolist(), *k)
    return camera


def _size(entries: dict[str, Node]) -> tuple[int, int] | None:
    width, height = ([entries[n] for n in names if n in entries] for names in (WIDTH, HEIGHT))
    return (width[0].integer(), height[0].integer()) if width and height else None


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
