"""Kalibr's camchain: one entry ``cam0``, ``cam1``, … per camera.

::

    cam0:
      camera_model: pinhole
      intrinsics: [fu, fv, pu, pv]           pixels; (0, 0) is the centre of the top-left pixel
      distortion_model: radtan               or equidistant, fov, none
      distortion_coeffs: [k1, k2, p1, p2]
      resolution: [width, height]
      T_cam_imu:                             4 x 4, metres, if an IMU was calibrated
      T_cn_cnm1:                             4 x 4, this camera from the one before, from cam1 on
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.yaml_nodes import Node, build, read_yaml, rigid
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan

MODELS: dict[str, tuple[type[Camera], int]] = {
    "radtan": (Radtan, 4),
    "equidistant": (Fisheye, 4),
    "fov": (Fov, 1),
    "none": (Pinhole, 0),
}


def read_kalibr(path: Path | str) -> tuple[CameraFile, ...]:
    """Read all cameras of a camchain, in their order.

    ``T_cam_rig`` is ``T_cam_imu`` where given.  Without an IMU the rig is cam0; T_cn_cnm1 are chained.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    top = read_yaml(Path(path))
    entries = top.items()
    names = sorted((n for n in entries if re.fullmatch(r"cam\d{1,3}", n)), key=lambda n: int(n[3:]))
    if names != [f"cam{i}" for i in range(len(names))] or not names:
        raise top.error(f"cameras {', '.join(names) or 'none'}; expected cam0, cam1, … without a gap")
    found: list[CameraFile] = []
    before: Array | None = None
    for name in names:
        node = entries[name]
        before = _pose(node, before, first=not found)
        size = node.get("resolution").size() if "resolution" in node.items() else None
        found.append(CameraFile(_camera(node), size, before, name))
    return tuple(found)


def _camera(node: Node) -> Camera:
    kind = node.get("camera_model")
    if kind.text() != "pinhole":
        raise kind.error(f"camera_model is {kind.text()!r}; only pinhole is known here")
    intrinsics = node.get("intrinsics")
    make, count = node.get("distortion_model").choice(MODELS)
    k = node.get("distortion_coeffs").vector(count).tolist() if count else []
    camera: Camera = build(intrinsics, make, *intrinsics.vector(4).tolist(), *k)
    return camera


def _pose(node: Node, before: Array | None, *, first: bool) -> Array | None:
    """T_cam_rig: given, or chained from the camera before."""
    entries = node.items()
    if "T_cam_imu" in entries:
        return rigid(entries["T_cam_imu"], entries["T_cam_imu"].matrix())
    if first:
        return np.eye(4)
    if "T_cn_cnm1" in entries and before is not None:
        return rigid(entries["T_cn_cnm1"], entries["T_cn_cnm1"].matrix()) @ before
    return None
