"""Settings of ORB-SLAM 2 and 3, and of OpenVSLAM and stella_vslam, which took over their names.

::

    File.version: "1.0"            ORB-SLAM3 only; with it the names begin with Camera1 (and Camera2)
    Camera.type: "PinHole"         or KannalaBrandt8 (fisheye), Rectified (no distortion); ORB-SLAM2: none
    Camera.fx, .fy, .cx, .cy       pixels; (0, 0) is the centre of the top-left pixel
    Camera.k1, .k2, .p1, .p2, .k3  of a PinHole, as far as there are any; k1 k2 k3 k4 of KannalaBrandt8
    Camera.width, .height          may be left out
    IMU.T_b_c1, Tbc                4 x 4, the body from the camera: inverted here
    Camera.model, .cols, .rows     of OpenVSLAM: perspective or fisheye, width and height

ORB-SLAM3 itself wants a point in every number (458.0); a whole number is read here.  ``LEFT.K`` and its like
are of the pictures before ORB-SLAM2 rectifies them; ``Camera.fx`` is of the rectified ones, and is read.
"""

from __future__ import annotations

from pathlib import Path

from vslam_ref.arrays import Array
from vslam_ref.datasets.calibration_files.lenses import UNKNOWN, lens_camera, nearest
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.storage_nodes import read_storage
from vslam_ref.datasets.yaml_nodes import Node, rigid
from vslam_ref.geometry import se3

TYPES = {
    "pinhole": "radtan",
    "perspective": "radtan",
    "kannalabrandt8": "fisheye",
    "fisheye": "fisheye",
    "rectified": "pinhole",
}
SENSOR = ("fx", "fy", "cx", "cy")
LENSES = {
    "radtan": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("k1", "k2", "k3", "k4"),
    "pinhole": (),
}
BODY = ("IMU.T_b_c1", "Tbc")
BEFORE = ("LEFT.K", "LEFT.D")


def read_orbslam(path: Path | str) -> CameraFile:
    """Read the first (left) camera.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    return from_settings(read_storage(Path(path)))


def from_settings(top: Node) -> CameraFile:
    """The camera of settings that have been parsed."""
    entries = _flat(top.items())
    prefix = "Camera1" if "Camera1.fx" in entries else "Camera"
    missing = [f"{prefix}.{name}" for name in SENSOR if f"{prefix}.{name}" not in entries]
    if missing:
        raise top.error(f"{top.name} has no {', '.join(missing)}; expected settings of ORB-SLAM")
    sensor = [entries[f"{prefix}.{name}"].number() for name in SENSOR]
    at = entries[f"{prefix}.fx"]
    kind = _kind(entries)
    lens, told = _lens(entries, prefix, kind)
    model = "pinhole" if not lens else "rational" if len(lens) > 5 else kind
    camera = lens_camera(at, model, sensor, lens)
    if any(name in entries for name in BEFORE):
        told += ("Camera.fx and its like are of rectified pictures; LEFT.K, of those before, is not read",)
    return CameraFile(camera, _size(entries), _body(entries), notes=told)


def _flat(entries: dict[str, Node]) -> dict[str, Node]:
    """Entries by names with points: stella_vslam writes those of ``Camera`` as a set of their own."""
    found = dict(entries)
    if "Camera" in entries and entries["Camera"].raw.id == "mapping":
        found |= {f"Camera.{name}": node for name, node in entries["Camera"].items().items()}
    return found


def _kind(entries: dict[str, Node]) -> str:
    """Our name of the lens; ORB-SLAM2 names none, and means the pinhole with distortion."""
    node = next((entries[name] for name in ("Camera.type", "Camera.model") if name in entries), None)
    if node is None:
        return "radtan"
    word = node.text().strip().lower()
    if word in UNKNOWN:
        raise node.error(f"{node.name} is {nearest(word)}")
    return node.choice(TYPES)


def _lens(entries: dict[str, Node], prefix: str, kind: str) -> tuple[list[float], tuple[str, ...]]:
    """Coefficients in OpenCV's order, none where the file has none, and what is to be told."""
    names = LENSES[kind]
    there = {name: entries[f"{prefix}.{name}"] for name in LENSES["radtan"] if f"{prefix}.{name}" in entries}
    if kind == "fisheye":
        lost = [name for name in names if name not in there]
        if lost:
            at = entries[f"{prefix}.fx"]
            raise at.error(f"no {', '.join(f'{prefix}.{n}' for n in lost)}; a fisheye has k1, k2, k3, k4")
        return [there[name].number() for name in names], ()
    values = {name: node.number() for name, node in there.items()}
    if kind == "pinhole":
        odd = [name for name, value in values.items() if value != 0]
        told = f"Camera.type is Rectified: {', '.join(odd)} are not used, as in ORB-SLAM3"
        return [], (told,) if odd else ()
    count = 8 if any(values.get(name) for name in ("k4", "k5", "k6")) else 5 if values else 0
    return [values.get(name, 0.0) for name in names[:count]], ()


def _size(entries: dict[str, Node]) -> tuple[int, int] | None:
    for width, height in (("Camera.width", "Camera.height"), ("Camera.cols", "Camera.rows")):
        if width in entries and height in entries:
            return entries[width].integer(), entries[height].integer()
    return None


def _body(entries: dict[str, Node]) -> Array | None:
    """T_cam_rig, the rig being the body, where the file says where the camera is."""
    node = next((entries[name] for name in BODY if name in entries), None)
    if node is None or node.raw.id == "scalar":
        return None
    return se3.inverse(rigid(node, node.matrix()))
