"""What a folder of pictures holds, by its layout.

=========  =====================================  ============================================================
layout     is recognised by                       and may hold
=========  =====================================  ============================================================
euroc      ``mav0/cam0/data.csv``                 ``sensor.yaml``, ``state_groundtruth_estimate0/``
tum        ``rgb.txt``                            ``groundtruth.txt``
kitti      ``image_0/`` or ``image_2/``           ``times.txt``, ``poses.txt`` or ``../../poses/NN.txt``
7scenes    ``frame-*.color.png``                  ``frame-*.pose.txt``
plain      ``images/``, or pictures in the        ``times.txt``, ``groundtruth_tum.txt``, else
           folder itself                          ``colmap_trajectory_tum.txt``
=========  =====================================  ============================================================

Of each but EuRoC's a camera file may stand beside: ``calib.txt``, ``camera.yaml``, ``camera.txt`` or
``camera.cfg``.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets import trajectories
from vslam_ref.datasets.sequences import listing
from vslam_ref.datasets.sequences.euroc import read_image_list, read_truth
from vslam_ref.datasets.sequences.times import LONGEST, read_times
from vslam_ref.datasets.text import FormatError, number, read_columns, read_lines
from vslam_ref.geometry import se3
from vslam_ref.metrics.trajectory import Trajectory

CAMERAS = ("calib.txt", "camera.yaml", "camera.txt", "camera.cfg")
TRUTHS = ("groundtruth_tum.txt", "colmap_trajectory_tum.txt")
EXPECTED = "expected images/, image_0/, rgb.txt, mav0/, frame-*.color.png, or pictures"


class Contents(NamedTuple):
    """What was found.

    Attributes
    ----------
    layout : str
    pictures : tuple of Path
        In their order; some may be missing.
    times : ndarray, shape (N,), or None
        Seconds.
    camera : Path or None
        A camera file of any kind.
    truth : Trajectory or None
        T_world_cam; its times count only where ``truth_numbers`` is None.
    truth_numbers : ndarray of int, shape (K,), or None
        To which pictures the poses of the truth belong.
    truth_from : str
    notes : tuple of str
    """

    layout: str
    pictures: tuple[Path, ...]
    times: Array | None = None
    camera: Path | None = None
    truth: Trajectory | None = None
    truth_numbers: IntArray | None = None
    truth_from: str = ""
    notes: tuple[str, ...] = ()


def read_folder(folder: Path) -> Contents:
    """Find out what a folder holds; no picture is opened.

    Raises
    ------
    FormatError
        If the layout is none of those above, or one of its files is malformed.
    """
    if not folder.is_dir():
        raise FormatError(folder, None, "no such folder")
    for base in (folder / "mav0", folder, folder.parent):
        if (base / "cam0" / "data.csv").is_file() and (base != folder.parent or folder.name == "cam0"):
            return _euroc(base)
    if (folder / "rgb.txt").is_file():
        return _tum(folder)
    for name in ("image_0", "image_2"):
        if (folder / name).is_dir():
            return _kitti(folder, name)
    if (folder / "images").is_dir():
        return _plain(folder, folder / "images")
    if next(folder.glob("frame-*.color.*"), None) is not None:
        return _seven_scenes(folder)
    try:
        return _plain(folder, folder)
    except FormatError as error:
        if error.path == folder:
            raise FormatError(folder, None, f"no sequence of pictures; {EXPECTED}") from None
        raise


def _camera_beside(folder: Path) -> Path | None:
    return next((folder / name for name in CAMERAS if (folder / name).is_file()), None)


def _with_times(found: list[Path], times: Path) -> tuple[tuple[Path, ...], Array | None]:
    """Pictures, those that are missing put in, and their times if there is such a file."""
    filled = listing.with_gaps(found)
    if not times.is_file():
        return tuple(filled), None
    stamps = read_times(times)
    for pictures in (found, filled):
        if len(pictures) == len(stamps):
            return tuple(pictures), stamps
    raise FormatError(times, None, f"{len(stamps)} times for {len(found)} pictures; expected one for each")


def _plain(folder: Path, pictures: Path) -> Contents:
    listed, times = _with_times(listing.pictures_in(pictures), folder / "times.txt")
    notes = []
    path = next((folder / name for name in TRUTHS if (folder / name).is_file()), None)
    if path is None:
        return Contents("plain", listed, times, _camera_beside(folder))
    file = trajectories.read_tum(path)
    truth = file.trajectory
    notes += _told(file, path)
    if path.name == TRUTHS[1]:
        notes.append(f"{path.name} is COLMAP's reconstruction, not an independent truth")
    stamps, numbers = truth.times, None
    if times is None and stamps is not None and np.array_equal(stamps, np.arange(len(listed))):
        times, numbers = stamps, np.arange(len(listed))
        notes.append(f"no times: those of the pictures are their numbers, as in {path.name}")
    return Contents("plain", listed, times, _camera_beside(folder), truth, numbers, path.name, tuple(notes))


def _kitti(folder: Path, name: str) -> Contents:
    """Pictures of the left grey or left colour camera; poses beside, or in the benchmark's place."""
    listed, times = _with_times(listing.pictures_in(folder / name), folder / "times.txt")
    places = (folder / "poses.txt", folder.parent.parent / "poses" / f"{folder.name}.txt")
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        return Contents("kitti", listed, times, _camera_beside(folder))
    file = trajectories.read_kitti(path)
    notes = [] if name == "image_0" else ["the poses are those of camera 0, beside this one"]
    notes += _told(file, path)
    if file.lines != len(listed):
        raise FormatError(path, None, f"{file.lines} poses for {len(listed)} pictures; expected one for each")
    camera = _camera_beside(folder)
    return Contents("kitti", listed, times, camera, file.trajectory, file.places, path.name, tuple(notes))


def _tum(folder: Path) -> Contents:
    path = folder / "rgb.txt"
    stamps, listed = [], []
    for line, text in read_lines(path):
        words = text.split(maxsplit=1)
        if len(words) != 2:
            raise FormatError(path, line, f"{len(words)} column; expected 2: time, name of a picture")
        stamps.append(number(path, line, words[0], "time"))
        if abs(stamps[-1]) >= LONGEST:
            raise FormatError(path, line, f"time is {words[0]} s; expected less than {LONGEST:g}")
        listed.append(listing.inside(folder, path, line, words[1]))
    if not listed:
        raise FormatError(path, None, "no picture; expected lines of time and name")
    truth = folder / "groundtruth.txt"
    camera = _camera_beside(folder)
    if not truth.is_file():
        return Contents("tum", tuple(listed), np.array(stamps), camera)
    file = trajectories.read_tum(truth)
    notes = tuple(_told(file, truth))
    return Contents("tum", tuple(listed), np.array(stamps), camera, file.trajectory, None, truth.name, notes)


def _euroc(base: Path) -> Contents:
    stamps, pictures = read_image_list(base / "cam0")
    camera = base / "cam0" / "sensor.yaml"
    truth = base / "state_groundtruth_estimate0" / "data.csv"
    known = camera if camera.is_file() else None
    if not truth.is_file() or known is None:
        notes = (
            "truth left out: it is the body's, and no sensor.yaml says where the camera is",
        ) * truth.is_file()
        return Contents("euroc", pictures, stamps, known, notes=notes)
    file = read_truth(truth, camera)
    notes = tuple(_told(file, truth))
    return Contents("euroc", pictures, stamps, known, file.trajectory, None, "data.csv", notes)


def _told(file: trajectories.TrajectoryFile, path: Path) -> list[str]:
    """What the reader of the truth noticed."""
    return [f"{path.name}: {note}" for note in file.notes]


def _seven_scenes(folder: Path) -> Contents:
    """Pictures ``frame-NNNNNN.color.png``, each with its pose, camera to world, 4 x 4."""
    listed = tuple(listing.with_gaps(listing.pictures_in(folder, ".color")))
    poses, numbers, gone = [], [], 0
    for k, picture in enumerate(listed):
        path = picture.with_name(f"{picture.name.partition('.')[0]}.pose.txt")
        if not path.is_file():
            gone += 1
            continue
        poses.append(read_pose(path))
        numbers.append(k)
    camera = _camera_beside(folder)
    if not poses:
        return Contents("7scenes", listed, None, camera)
    T = np.stack(poses)
    truth = Trajectory(None, T[:, :3, 3], T[:, :3, :3])
    notes = (f"{gone} picture(s) without a pose",) * (gone > 0)
    return Contents("7scenes", listed, None, camera, truth, np.array(numbers), "frame-*.pose.txt", notes)


def read_pose(path: Path) -> Array:
    """Read a rigid motion (4, 4), four rows of four numbers; its rotation is made exact.

    Raises
    ------
    FormatError
        If it is none: more than 1e-3 off a rotation, or another last row than 0 0 0 1.
    """
    table = read_columns(path, ("a column",) * 4)
    T = table.values
    if T.shape != (4, 4) or (T[3] != (0, 0, 0, 1)).any():
        raise FormatError(path, None, f"{len(T)} rows, or a last one that is not 0 0 0 1; expected 4 x 4")
    R, off = T[:3, :3], np.inf
    if (np.abs(R) < 2).all() and np.linalg.det(R) > 0:
        off = float(np.abs(R.T @ R - np.eye(3)).max())
    if not off <= trajectories.UNIT_TOLERANCE:
        raise FormatError(path, None, f"no rotation (R^T R is {off:.3g} off the identity); expected one")
    if not (np.abs(T[:3, 3]) < LONGEST).all():
        raise FormatError(path, None, f"a position of {T[:3, 3]} m; expected less than {LONGEST:g}")
    U, _, Vt = np.linalg.svd(R)
    return se3.from_rt(U @ Vt, T[:3, 3])
