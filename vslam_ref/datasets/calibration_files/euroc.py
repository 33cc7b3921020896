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

from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.yaml_nodes import build, read_yaml, rigid
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fisheye, Radtan

MODELS: dict[str, type[Camera]] = {
    "radial-tangential": Radtan,
    "radtan": Radtan,
    "equidistant": Fisheye,
}


def read_euroc(path: Path | str) -> CameraFile:
    """Read one camera; the rig is EuRoC's body.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    top = read_yaml(Path(path))
    for key, right in (("sensor_type", "camera"), ("camera_model", "pinhole")):
        if top.get(key).text() != right:
            raise top.get(key).error(f"{key} is {top.get(key).text()!r}; expected {right!r}")
    model = top.get("distortion_model").choice(MODELS)
    intrinsics = top.get("intrinsics")
    k = top.get("distortion_coefficients").vector(4)
    camera: Camera = build(intrinsics, model, *intrinsics.vector(4).tolist(), *k.tolist())
    T_rig_cam = rigid(top.get("T_BS"), top.get("T_BS").matrix())
    name = top.items()["comment"].text() if "comment" in top.items() else ""
    return CameraFile(camera, top.get("resolution").size(), se3.inverse(T_rig_cam), name)
