"""One small scene in every bundle format, and what each file means by the format's definition.

Nothing here uses the readers.  ``*_residuals`` answer with predicted minus measured, (n, 2), in the file's
own pixels: a reader is right if its problem has the same residuals, up to the direction of v.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from vslam_ref.datasets.bundle_files import BundleFile
from vslam_ref.geometry.cameras import projection

POINTS = np.array([[0.3, -0.2, 0.1], [-0.4, 0.5, -0.3], [0.6, 0.4, 0.2], [-0.5, -0.6, 0.5], [0.1, 0.7, -0.6]])
TURNS = np.array([[0.05, -0.1, 0.02], [-0.2, 0.15, 0.1], [0.1, 0.3, -0.05]])
SHIFTS = np.array([[0.1, 0.2, 4.0], [-0.3, 0.1, 5.0], [0.2, -0.2, 4.5]])
PAIRS = [(0, 0), (0, 1), (0, 2), (0, 4), (1, 0), (1, 2), (1, 3), (2, 1), (2, 3), (2, 4), (2, 0)]
"""View and point of each observation."""
NOISE = np.random.default_rng(7).normal(0.0, 1.5, (len(PAIRS), 2))
COLOURS = [(255, 0, 10), (0, 200, 30), (1, 2, 3), (90, 80, 70), (128, 128, 128)]


def residuals(file: BundleFile) -> np.ndarray:
    """Residuals (n, 2) of a problem by the cameras of this package."""
    problem = file.problem
    scene, seen = problem.scene, problem.seen
    at = projection.pixel_from_world(
        scene.intrinsics[problem.lens_of_view[seen.view]],
        scene.T_cam_world[seen.view],
        scene.X_world[seen.point],
        lens=problem.model.lens,
    )
    assert at.valid.all()
    return np.asarray(at.uv - seen.uv)


def cost(r: np.ndarray) -> float:
    return float(0.5 * (r * r).sum())


# --- BAL: P = R X + t, p = -P_xy / P_z, f (1 + k1 |p|^2 + k2 |p|^4) p ------------------------------


def looking_back(R: np.ndarray, t: np.ndarray, lens: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Pixels of BAL and Bundler, one camera and point a row."""
    P = np.einsum("nij,nj->ni", R, X) + t
    p = -P[:, :2] / P[:, 2:]
    q = (p * p).sum(1)
    return np.asarray((lens[:, 0] * (1 + lens[:, 1] * q + lens[:, 2] * q * q))[:, None] * p)


def bal_cameras() -> np.ndarray:
    """Cameras (3, 9) that look along -z at the points."""
    lenses = np.array([[500.0, -0.1, 0.02], [520.0, 0.05, 0.0], [480.0, 0.0, -0.03]])
    return np.hstack([TURNS, SHIFTS * [1, 1, -1], lenses])


def bal_text() -> str:
    cameras = bal_cameras()
    view, point = np.array(PAIRS).T
    R = Rotation.from_rotvec(cameras[:, :3]).as_matrix()
    uv = looking_back(R[view], cameras[view, 3:6], cameras[view, 6:], POINTS[point]) + NOISE
    lines = [f"{len(cameras)} {len(POINTS)} {len(PAIRS)}"]
    lines += [f"{i} {j}     {u!r} {v!r}" for (i, j), (u, v) in zip(PAIRS, uv.tolist(), strict=True)]
    lines += [repr(value) for value in [*cameras.ravel().tolist(), *POINTS.ravel().tolist()]]
    return "\n".join(lines) + "\n"


def bal_residuals(text: str) -> np.ndarray:
    """Residuals of a BAL file, v upwards, in the order of its lines."""
    values = np.array(text.split(), dtype=np.float64)
    views, points, seen = values[:3].astype(int)
    rows = values[3 : 3 + 4 * seen].reshape(seen, 4)
    cameras = values[3 + 4 * seen :][: 9 * views].reshape(views, 9)
    X = values[3 + 4 * seen + 9 * views :].reshape(points, 3)
    view, point = rows[:, :2].astype(int).T
    R = Rotation.from_rotvec(cameras[:, :3]).as_matrix()
    return looking_back(R[view], cameras[view, 3:6], cameras[view, 6:], X[point]) - rows[:, 2:]


# --- Bundler ---------------------------------------------------------------------------------------


def bundler_text() -> str:
    """The scene of BAL with one more camera, number 1, that was not placed."""
    cameras = bal_cameras()
    R = Rotation.from_rotvec(cameras[:, :3]).as_matrix()
    number = (0, 2, 3)
    zero = ["0 0 0", "0 0 0", "0 0 0", "0 0 0", "0 0 0"]
    blocks = []
    for k, camera in enumerate(cameras):
        rows = [camera[6:], *R[k], camera[3:6]]
        blocks.append([" ".join(map(repr, map(float, row))) for row in rows])
    lines = ["# Bundle file v0.3", f"4 {len(POINTS)}"]
    lines += [line for block in (blocks[0], zero, blocks[1], blocks[2]) for line in block]
    view, point = np.array(PAIRS).T
    uv = looking_back(R[view], cameras[view, 3:6], cameras[view, 6:], POINTS[point]) + NOISE
    for j, X in enumerate(POINTS.tolist()):
        mine = [k for k in range(len(PAIRS)) if PAIRS[k][1] == j]
        sights = [f"{number[PAIRS[k][0]]} {10 + k} {uv[k, 0]!r} {uv[k, 1]!r}" for k in mine]
        sights = [sight.replace("np.float64(", "").replace(")", "") for sight in sights]
        lines += [" ".join(map(repr, X)), " ".join(map(str, COLOURS[j])), f"{len(mine)} {' '.join(sights)}"]
    return "\n".join(lines) + "\n"


# --- libmv -----------------------------------------------------------------------------------------

LIBMV_LENS = (800.0, 320.5, 241.25, -0.1, 0.03, 0.01, 0.002, -0.003)
IMAGES, TRACKS = (7, 3, 1000000), (12, -5, 0, 2, 9)


def libmv_pixel(R: np.ndarray, t: np.ndarray, X: np.ndarray, lens: tuple[float, ...]) -> list[float]:
    """Pixel of one point: libmv's distortion, written out."""
    f, cx, cy, k1, k2, k3, p1, p2 = lens
    x, y, z = (float(v) for v in R @ X + t)
    x, y = x / z, y / z
    q = x * x + y * y
    radial = 1 + k1 * q + k2 * q**2 + k3 * q**3
    u = x * radial + 2 * p1 * x * y + p2 * (q + 2 * x * x)
    v = y * radial + 2 * p2 * x * y + p1 * (q + 2 * y * y)
    return [f * u + cx, f * v + cy]


def libmv_bytes(order: str = "<", space: bytes = b"P") -> bytes:
    R = Rotation.from_rotvec(TURNS).as_matrix()
    lens = LIBMV_LENS if space == b"P" else (1.0, *(0.0,) * 7)
    out = [b"v" if order == "<" else b"V", space, struct.pack(f"{order}8f", *lens)]
    out.append(struct.pack(f"{order}i", len(R)))
    for k in range(len(R)):  # the rotation column by column
        out.append(struct.pack(f"{order}i12f", IMAGES[k], *R[k].T.ravel(), *SHIFTS[k]))
    out.append(struct.pack(f"{order}i", len(POINTS)))
    out += [struct.pack(f"{order}i3f", TRACKS[k], *X) for k, X in enumerate(POINTS)]
    out.append(struct.pack(f"{order}i", len(PAIRS)))
    for (i, j), noise in zip(PAIRS, NOISE, strict=True):
        xy = np.array(libmv_pixel(R[i], SHIFTS[i], POINTS[j], lens)) + noise / (1 if space == b"P" else 800)
        out.append(struct.pack(f"{order}2i2f", IMAGES[i], TRACKS[j], *xy))
    return b"".join(out)


def libmv_residuals(space: bytes = b"P") -> np.ndarray:
    """Residuals in doubles; the file has 24 bits of each number."""
    return -NOISE / (1 if space == b"P" else 800)


# --- COLMAP ----------------------------------------------------------------------------------------

COLMAP_CAMERAS = {
    4: ("OPENCV", (640, 480), (500.0, 510.0, 320.0, 240.0, -0.1, 0.02, 0.001, -0.002)),
    9: ("SIMPLE_RADIAL", (800, 600), (600.0, 400.0, 300.0, 0.05)),
    11: ("FOV", (100, 100), (90.0, 90.0, 50.0, 50.0, 0.9)),  # no image has it
}
CAMERA_OF_IMAGE, IMAGE_IDS, POINT_IDS = (4, 9, 4), (5, 2, 8), (100, 3, 7, 2, 1)


def colmap_pixel(camera: int, X_cam: np.ndarray) -> list[float]:
    """COLMAP's pixel, counted from the outer corner of the image."""
    model, _, params = COLMAP_CAMERAS[camera]
    x, y = (float(v) for v in X_cam[:2] / X_cam[2])
    q = x * x + y * y
    if model == "SIMPLE_RADIAL":
        f, cx, cy, k = params
        return [f * x * (1 + k * q) + cx, f * y * (1 + k * q) + cy]
    fx, fy, cx, cy, k1, k2, p1, p2 = params
    radial = k1 * q + k2 * q * q
    u = x + x * radial + 2 * p1 * x * y + p2 * (q + 2 * x * x)
    v = y + y * radial + 2 * p2 * x * y + p1 * (q + 2 * y * y)
    return [fx * u + cx, fy * v + cy]


def colmap_texts() -> dict[str, str]:
    quaternions = Rotation.from_rotvec(TURNS).as_quat()[:, [3, 0, 1, 2]]
    cameras = ["# Camera list with one line of data per camera:"]
    for key, (model, (width, height), params) in COLMAP_CAMERAS.items():
        cameras.append(f"{key} {model} {width} {height} {' '.join(map(repr, params))}")
    images = ["# Image list with two lines of data per image:"]
    track: dict[int, list[str]] = {j: [] for j in range(len(POINTS))}
    for i, key in enumerate(IMAGE_IDS):
        pose = " ".join(repr(float(v)) for v in [*quaternions[i], *SHIFTS[i]])
        images.append(f"{key} {pose} {CAMERA_OF_IMAGE[i]} photo{i}.jpg")
        features = ["12.5 13.5 -1"]
        for (view, j), noise in zip(PAIRS, NOISE, strict=True):
            if view == i:
                X_cam = Rotation.from_rotvec(TURNS[i]).as_matrix() @ POINTS[j] + SHIFTS[i]
                u, v = np.array(colmap_pixel(CAMERA_OF_IMAGE[i], X_cam)) + noise
                track[j].append(f"{key} {len(features)}")
                features.append(f"{float(u)!r} {float(v)!r} {POINT_IDS[j]}")
        images.append(" ".join(features))
    points = ["# 3D point list with one line of data per point:"]
    for j, X in enumerate(POINTS.tolist()):
        head = f"{POINT_IDS[j]} {' '.join(map(repr, X))} {' '.join(map(str, COLOURS[j]))} 0.5"
        points.append(f"{head} {' '.join(track[j])}")
    texts = {"cameras.txt": cameras, "images.txt": images, "points3D.txt": points}
    return {name: "\n".join(lines) + "\n" for name, lines in texts.items()}


def write_colmap_texts(folder: Any, texts: dict[str, str]) -> Any:
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def colmap_binary(texts: dict[str, str] | None = None) -> dict[str, bytes]:
    """The model in COLMAP's binary form, packed from its text by the form's definition."""
    numbers = ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE")
    numbers += ("FULL_OPENCV", "FOV")
    words = {}
    for name, text in (texts or colmap_texts()).items():
        words[name] = [line.split() for line in text.splitlines() if not line.startswith("#")]
    cameras = [struct.pack("<Q", len(words["cameras.txt"]))]
    for key, model, width, height, *params in words["cameras.txt"]:
        cameras.append(struct.pack("<IiQQ", int(key), numbers.index(model), int(width), int(height)))
        cameras.append(struct.pack(f"<{len(params)}d", *map(float, params)))
    images = [struct.pack("<Q", len(words["images.txt"]) // 2)]
    for head, features in zip(words["images.txt"][::2], words["images.txt"][1::2], strict=True):
        images.append(struct.pack("<I7dI", int(head[0]), *map(float, head[1:8]), int(head[8])))
        images.append(" ".join(head[9:]).encode() + b"\0" + struct.pack("<Q", len(features) // 3))
        for u, v, point in zip(*(features[axis::3] for axis in range(3)), strict=True):
            images.append(struct.pack("<ddQ", float(u), float(v), int(point) % 2**64))
    points = [struct.pack("<Q", len(words["points3D.txt"]))]
    for row in words["points3D.txt"]:
        points.append(
            struct.pack("<Q3d3Bd", int(row[0]), *map(float, row[1:4]), *map(int, row[4:7]), float(row[7]))
        )
        points.append(struct.pack(f"<Q{len(row) - 8}I", (len(row) - 8) // 2, *map(int, row[8:])))
    parts = {"cameras.bin": cameras, "images.bin": images, "points3D.bin": points}
    return {name: b"".join(records) for name, records in parts.items()}


def colmap_rigs(T_second: np.ndarray, reference: int = 4, second: int = 9) -> dict[str, str]:
    """Rigs and frames for the sample: images 5 and 2 in one frame of two cameras, image 8 in another.

    ``T_second (4, 4)`` is the second camera's pose in the rig.  The frames have the poses of images 5 and 8.
    """
    quaternions = Rotation.from_rotvec(TURNS).as_quat()[:, [3, 0, 1, 2]]
    pose = [" ".join(repr(float(v)) for v in [*quaternions[i], *SHIFTS[i]]) for i in range(3)]
    q = Rotation.from_matrix(T_second[:3, :3]).as_quat()[[3, 0, 1, 2]]
    in_rig = " ".join(repr(float(v)) for v in [*q, *T_second[:3, 3]])
    rigs = f"# rigs\n6 2 CAMERA {reference} CAMERA {second} 1 {in_rig}\n"
    frames = f"# frames\n1 6 {pose[0]} 2 CAMERA 4 5 CAMERA 9 2\n7 6 {pose[2]} 1 CAMERA 4 8\n"
    return {"rigs.txt": rigs, "frames.txt": frames}


def colmap_rigs_binary(texts: dict[str, str]) -> dict[str, bytes]:
    """Rigs and frames in the binary form."""
    (rig,), frames = (
        [line.split() for line in texts[name].splitlines()[1:]] for name in ("rigs.txt", "frames.txt")
    )
    rigs = struct.pack("<QIIiIiIB", 1, int(rig[0]), 2, 0, int(rig[3]), 0, int(rig[5]), 1)
    out = [struct.pack("<Q", len(frames))]
    for row in frames:
        out.append(struct.pack("<II7dI", int(row[0]), int(row[1]), *map(float, row[2:9]), int(row[9])))
        for at in range(10, len(row), 3):
            out.append(struct.pack("<iIQ", 0, int(row[at + 1]), int(row[at + 2])))
    return {"rigs.bin": rigs + struct.pack("<7d", *map(float, rig[7:])), "frames.bin": b"".join(out)}
