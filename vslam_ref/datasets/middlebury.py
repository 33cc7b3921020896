"""Reader of the Middlebury multi-view sets: pictures with exact cameras, such as the temple.

The file ``*_par.txt`` says in its first line how many pictures there are, and in each further line::

    name.png  k11 k12 k13 k21 k22 k23 k31 k32 k33  r11 ... r33  t1 t2 t3

The projection is K [R t], so R and t are ``T_cam_world``; x is to the right, y down.  The note that comes
with the data does not say where in a pixel its position is.  Numbers are returned as filed; the temple's
pictures fit them better with (0.27, -0.82) px added to all pixels, as views that hang upside down show
(:func:`vslam_ref.experiments.multiview.study.principal_offset`).
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import FormatError, numbers, read_lines
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Pinhole

MAX_BYTES = 2**20
"""The largest of these files, with 363 pictures, has 0.2 MiB."""
COLUMNS = ("name", *(f"k{i}{j}" for i in "123" for j in "123"), *(f"r{i}{j}" for i in "123" for j in "123"))
COLUMNS = (*COLUMNS, "t1", "t2", "t3")
ORTHONORMAL = 1e-6
"""Largest entry of R R^T - I that is taken for rounding of the file's digits."""


class Cameras(NamedTuple):
    """The pictures of a set and their cameras.

    Attributes
    ----------
    pictures : tuple of Path
        Beside the file; they need not exist.
    cameras : tuple of Pinhole
    T_cam_world : ndarray, shape (V, 4, 4)
        Metres.
    """

    pictures: tuple[Path, ...]
    cameras: tuple[Pinhole, ...]
    T_cam_world: Array


def read_cameras(path: Path) -> Cameras:
    """Read a ``*_par.txt``.

    Raises
    ------
    FormatError
        If the count disagrees, a line has not 22 columns, a word is not a finite number, a name is a path or
        comes twice, K has a skew or no positive focal length, or R is not a rotation.
    """
    lines = list(read_lines(path, MAX_BYTES))
    if not lines:
        raise FormatError(path, None, "empty; expected the number of pictures, then a line for each")
    first, text = lines[0]
    if not text.isdecimal() or int(text) != len(lines) - 1:
        what = f"says {text!r} pictures, {len(lines) - 1} lines follow; the first line must be their number"
        raise FormatError(path, first, what)
    views = [_view(path, line, text) for line, text in lines[1:]]
    names = [name for name, _, _ in views]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise FormatError(path, lines[k + 1][0], f"{name} comes twice; expected one line a picture")
    return Cameras(
        tuple(path.parent / name for name in names),
        tuple(camera for _, camera, _ in views),
        np.array([T for _, _, T in views]).reshape(-1, 4, 4),
    )


def _view(path: Path, line: int, text: str) -> tuple[str, Pinhole, Array]:
    words = text.split()
    if len(words) != len(COLUMNS):
        raise FormatError(path, line, f"{len(words)} columns; expected 22: name, K (9), R (9), t (3)")
    if Path(words[0]).name != words[0] or words[0] in (".", ".."):
        raise FormatError(path, line, f"name is {words[0]!r}; expected a file name without a folder")
    values = numbers(path, line, words[1:], COLUMNS[1:])
    K, R, t = np.array(values[:9]).reshape(3, 3), np.array(values[9:18]).reshape(3, 3), np.array(values[18:])
    if K[0, 1] != 0 or (K[1:, 0] != 0).any() or K[2, 1] != 0 or K[2, 2] != 1:
        what = "K is not [fx 0 cx; 0 fy cy; 0 0 1]; cameras with a skew are not supported"
        raise FormatError(path, line, what)
    if not (K[0, 0] > 0 and K[1, 1] > 0):
        raise FormatError(path, line, f"focal lengths {K[0, 0]:g}, {K[1, 1]:g}; must be more than 0")
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(R @ R.T - np.eye(3)).max()
        if not (off <= ORTHONORMAL and np.linalg.det(R) > 0):
            what = f"R is not a rotation: R R^T is off by {off:.3g}, determinant {np.linalg.det(R):.3g}"
            raise FormatError(path, line, f"{what}; expected 0 and 1")
    camera = Pinhole(float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    return words[0], camera, se3.nearest(se3.from_rt(R, t))
