"""EuRoC's (ASL's) ``sensor.yaml`` of a camera.

::

    sensor_type: camera
    T_BS: {cols: 4, rows: 4, data: [...]}      the body from the sensor, metres
    resolution: [width, height]
    camera_model: pinhole
    intrinsics: [fu, fv, cu, cv]               pixels; (0, 0) is the centre of the top-left pixel
    distortion_model: radial-tangential        or equidistant
    distortion_coefficients: [k1, k2, p1, p2]

``T_BS`` goes the other way than ``T_cam_rig``: it is inverted here.
"""

from __future__ import annotations

from pathlib import Path

from vslam_ref.datasets.calibration_files.lenses import UNKNOWN, nearest
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.storage_nodes import read_storage
from vslam_ref.datasets.yaml_nodes import Node, build, rigid
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fisheye, Pinhole, Radtan

MODELS: dict[str, type[Camera]] = {
    "radial-tangential": Radtan,
    "radtan": Radtan,
    "plumb_bob": Radtan,
    "equidistant": Fisheye,
    "none": Pinhole,
}


def read_euroc(path: Path | str) -> CameraFile:
    """Read one camera; the rig is EuRoC's body.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    return from_sensor(read_storage(Path(path)))


def from_sensor(top: Node) -> CameraFile:
    """The camera of a file that has been parsed."""
    word = top.get("camera_model").text().strip().lower()
    if word in UNKNOWN:
        raise top.get("camera_model").error(f"camera_model is {nearest(word)}")
    for key, right in (("sensor_type", "camera"), ("camera_model", "pinhole")):
        if top.get(key).text() != right:
            raise top.get(key).error(f"{key} is {top.get(key).text()!r}; expected {right!r}")
    model = top.get("distortion_model").choice(MODELS)
    intrinsics = top.get("intrinsics")
    k = [] if model is Pinhole else top.get("distortion_coefficients").vector(4).tolist()
    camera: Camera = build(intrinsics, model, *intrinsics.vector(4).tolist(), *k)
    T_rig_cam = rigid(top.get("T_BS"), top.get("T_BS").matrix())
    name = top.items()["comment"].text() if "comment" in top.items() else ""
    return CameraFile(camera, top.get("resolution").size(), se3.inverse(T_rig_cam), name)
