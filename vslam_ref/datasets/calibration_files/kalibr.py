"""Kalibr's camchain: one entry ``cam0``, ``cam1``, … per camera.

::

    cam0:
      camera_model: pinhole
      intrinsics: [fu, fv, pu, pv]           pixels; (0, 0) is the centre of the top-left pixel
      distortion_model: radtan               or equidistant, fov, none
      distortion_coeffs: [k1, k2, p1, p2]
      resolution: [width, height]
      T_cam_imu:                             4 x 4, metres, if an IMU was calibrated; or
      T_imu_cam:                             its inverse, as OpenVINS writes it
      T_cn_cnm1:                             4 x 4, this camera from the one before, from cam1 on

The models omni, ds and eucm are read where their numbers make them a pinhole (see :mod:`.lenses`).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.calibration_files.lenses import UNKNOWN, nearest, wide_sensor
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.storage_nodes import read_storage
from vslam_ref.datasets.yaml_nodes import Node, build, rigid
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan

MODELS: dict[str, tuple[type[Camera], int]] = {
    "radtan": (Radtan, 4),
    "plumb_bob": (Radtan, 4),
    "equidistant": (Fisheye, 4),
    "equi": (Fisheye, 4),
    "fov": (Fov, 1),
    "none": (Pinhole, 0),
}
WIDE, BARE = ("omni", "ds", "eucm"), ("ds", "eucm")
"""Models that are a pinhole for some numbers, and those of them that have no distortion beside."""
APART = 1e-3
"""Two poses of one camera that differ by more than this, in metres and radians, are told."""


def read_kalibr(path: Path | str) -> tuple[CameraFile, ...]:
    """Read all cameras of a camchain, in their order.

    The rig is the IMU where a camera says where it is; the others follow along the chain of T_cn_cnm1, in
    both directions.  Without an IMU the rig is cam0.  ``T_cam_rig`` is None where no chain leads there.

    Raises
    ------
    FormatError
        Where the file is not as the module says.
    """
    return from_chain(read_storage(Path(path)))


def from_chain(top: Node) -> tuple[CameraFile, ...]:
    """The cameras of a camchain that has been parsed."""
    entries = top.items()
    names = sorted((n for n in entries if re.fullmatch(r"cam\d{1,3}", n)), key=lambda n: int(n[3:]))
    if names != [f"cam{i}" for i in range(len(names))] or not names:
        raise top.error(f"cameras {', '.join(names) or 'none'}; expected cam0, cam1, … without a gap")
    nodes = [entries[name] for name in names]
    poses, told = _poses(nodes)
    found = []
    for node, T_cam_rig, notes in zip(nodes, poses, told, strict=True):
        size = node.get("resolution").size() if "resolution" in node.items() else None
        camera, odd = _camera(node)
        found.append(CameraFile(camera, size, T_cam_rig, node.name, notes=(*odd, *notes)))
    return tuple(found)


def _camera(node: Node) -> tuple[Camera, tuple[str, ...]]:
    """The camera, and what is to be told about it."""
    kind, intrinsics, entries = node.get("camera_model"), node.get("intrinsics"), node.items()
    word = kind.text().strip().lower()
    if word in WIDE:
        sensor = wide_sensor(word, intrinsics)
    elif word == "pinhole":
        sensor = intrinsics.vector(4).tolist()
    elif word in UNKNOWN:
        raise kind.error(f"camera_model is {nearest(word)}")
    else:
        raise kind.error(f"camera_model is {kind.text()!r}; expected one of pinhole, {', '.join(WIDE)}")
    if word in BARE and "distortion_model" not in entries:
        make, count = MODELS["none"]
    else:
        make, count = node.get("distortion_model").choice(MODELS)
    if count and word in BARE:
        model = node.get("distortion_model")
        raise model.error(f"distortion_model is {model.text()!r} beside {word}; expected none")
    k = node.get("distortion_coeffs").vector(count).tolist() if count else []
    camera: Camera = build(intrinsics, make, *sensor, *k)
    unused = not count and "distortion_coeffs" in entries and entries["distortion_coeffs"].vector().any()
    told = f"{node.name}: distortion_model is none, so distortion_coeffs are not used"
    return camera, (told,) if unused else ()


def _poses(nodes: list[Node]) -> tuple[list[Array | None], list[tuple[str, ...]]]:
    """T_cam_rig of each camera, and what is to be told about it."""
    given = [_given(node) for node in nodes]
    links = [None if k == 0 else _rigid(node, "T_cn_cnm1") for k, node in enumerate(nodes)]
    poses: list[Array | None] = list(given)
    if all(pose is None for pose in poses):
        poses[0] = np.eye(4)
    told: list[tuple[str, ...]] = [()] * len(nodes)
    for k in range(1, len(nodes)):
        before, link, here = poses[k - 1], links[k], poses[k]
        if before is None or link is None:
            continue
        if here is None:
            poses[k] = link @ before
        elif (off := float(np.abs(link @ before - here).max())) > APART:
            what = f"{nodes[k].name}: its pose to the IMU and T_cn_cnm1 differ by {off:.2g}"
            told[k] = (f"{what} (metres, or radians); the pose to the IMU is taken",)
    for k in range(len(nodes) - 1, 0, -1):
        after, link = poses[k], links[k]
        if poses[k - 1] is None and after is not None and link is not None:
            poses[k - 1] = se3.inverse(link) @ after
    return poses, told


def _given(node: Node) -> Array | None:
    """T_cam_imu, from either direction; both must say the same."""
    there, back = _rigid(node, "T_cam_imu"), _rigid(node, "T_imu_cam")
    if back is None:
        return there
    T_cam_imu = se3.inverse(back)
    if there is not None and np.abs(there - T_cam_imu).max() > APART:
        raise node.get("T_imu_cam").error(
            "T_imu_cam is not the inverse of T_cam_imu; expected one of the two"
        )
    return T_cam_imu if there is None else there


def _rigid(node: Node, name: str) -> Array | None:
    entries = node.items()
    return rigid(entries[name], entries[name].matrix()) if name in entries else None
