"""Small sequences in every layout, as files in memory: 12 pictures of 32 x 24 pixels, a camera that moves."""

from __future__ import annotations

import functools
from pathlib import Path

import cv2
import numpy as np

COUNT, SIZE = 12, (32, 24)
CALIB = "# fx fy cx cy width height\n30.0 31.0 15.5 11.5 32 24\n"
SENSOR = """sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0]
resolution: [32, 24]
camera_model: pinhole
intrinsics: [30.0, 31.0, 15.5, 11.5]
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 1.7e-05]
"""
START_NS = 1403636579763555584


def values(k: int, colours: bool = True) -> np.ndarray:
    """Picture k: red, green, blue (24, 32, 3), or its red values alone."""
    v, u = np.indices(SIZE[::-1])
    rgb = np.stack([(5 * u + 3 * v + 7 * k) % 256, (2 * u + 40 + k) % 256, (9 * v + 90) % 256], -1)
    return rgb.astype(np.uint8) if colours else rgb[..., 0].astype(np.uint8)


@functools.cache
def encoded(k: int, suffix: str = ".png", colours: bool = True) -> bytes:
    picture = values(k, colours)
    return cv2.imencode(suffix, picture[..., ::-1] if colours else picture)[1].tobytes()


def turn(k: int) -> np.ndarray:
    """R_world_cam of picture k: a turn about y."""
    c, s = np.cos(0.1 * k), np.sin(0.1 * k)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def place(k: int) -> np.ndarray:
    return np.array([0.1 * k, 0.2, -0.3])


def tum(times: list[float]) -> str:
    """Poses of the pictures, at these times, as TUM writes them."""
    rows = [
        f"{t!r} {' '.join(map(repr, place(k).tolist()))} 0 {np.sin(0.05 * k)!r} 0 {np.cos(0.05 * k)!r}"
        for k, t in enumerate(times)
    ]
    return (
        "# time tx ty tz qx qy qz qw\n" + "\n".join(rows).replace("np.float64(", "").replace(")", "") + "\n"
    )


def numbers(M: np.ndarray) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(M))


def plain() -> dict[str, bytes]:
    files = {f"images/{k:06d}.png": encoded(k) for k in range(COUNT)}
    stamps = [0.05 * k for k in range(COUNT)]
    texts = {
        "calib.txt": CALIB,
        "times.txt": "".join(f"{t!r}\n" for t in stamps),
        "groundtruth_tum.txt": tum(stamps),
    }
    return files | {name: text.encode() for name, text in texts.items()}


def kitti() -> dict[str, bytes]:
    files = {f"image_0/{k:06d}.png": encoded(k, colours=False) for k in range(COUNT)}
    K = np.array([[30.0, 0, 15.5, 0], [0, 31.0, 11.5, 0], [0, 0, 1, 0]])
    poses = "".join(f"{numbers(np.column_stack([turn(k), place(k)]))}\n" for k in range(COUNT))
    texts = {
        "calib.txt": "".join(f"P{i}: {numbers(K)}\n" for i in range(4)),
        "times.txt": "".join(f"{0.1 * k:.6e}\n" for k in range(COUNT)),
        "poses.txt": poses,
    }
    return files | {name: text.encode() for name, text in texts.items()}


def tum_rgbd() -> dict[str, bytes]:
    stamps = [1341847980.72 + 0.05 * k for k in range(COUNT)]
    names = [f"rgb/{t:.6f}.png" for t in stamps]
    files = {name: encoded(k) for k, name in enumerate(names)}
    listed = "# timestamp filename\n" + "".join(f"{t:.6f} {n}\n" for t, n in zip(stamps, names, strict=True))
    texts = {"rgb.txt": listed, "groundtruth.txt": tum([t + 0.004 for t in stamps]), "calib.txt": CALIB}
    return files | {name: text.encode() for name, text in texts.items()}


def euroc() -> dict[str, bytes]:
    """The body's poses; the camera's are T_world_body T_BS."""
    stamps = [START_NS + 50_000_000 * k for k in range(COUNT)]
    files = {f"mav0/cam0/data/{t}.png": encoded(k, colours=False) for k, t in enumerate(stamps)}
    rows = []
    for k, t in enumerate(stamps):
        q = (np.cos(0.05 * k), 0.0, np.sin(0.05 * k), 0.0)
        rows.append(",".join([str(t), *(repr(float(v)) for v in (*place(k), *q))]))
    texts = {
        "mav0/cam0/data.csv": "#timestamp [ns],filename\n" + "".join(f"{t},{t}.png\n" for t in stamps),
        "mav0/cam0/sensor.yaml": SENSOR,
        "mav0/state_groundtruth_estimate0/data.csv": "#time,p,q\n" + "\n".join(rows) + "\n",
    }
    return files | {name: text.encode() for name, text in texts.items()}


def seven_scenes() -> dict[str, bytes]:
    files = {"camera.txt": b"Pinhole 30 31 15.5 11.5\n32 24\nnone\n32 24\n"}
    for k in range(COUNT):
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn(k), place(k)
        files[f"frame-{k:06d}.color.png"] = encoded(k)
        files[f"frame-{k:06d}.depth.png"] = cv2.imencode(".png", np.full((24, 32), 9, np.uint16))[1].tobytes()
        files[f"frame-{k:06d}.pose.txt"] = "".join(f"{numbers(row)}\n" for row in T).encode()
    return files


LAYOUTS = {"plain": plain, "kitti": kitti, "tum": tum_rgbd, "euroc": euroc, "7scenes": seven_scenes}


def put(folder: Path, files: dict[str, bytes]) -> Path:
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return folder
