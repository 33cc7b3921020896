"""COLMAP's text form: lines into parts.

A line of ``images.txt`` ends with the image's name, which is all that follows the ninth number: names have
blanks, as cameras and people write them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.colmap.models import MODELS
from vslam_ref.datasets.bundle_files.colmap.parts import (
    NO_POINT,
    POSE,
    CameraPart,
    FilePlace,
    ImagePart,
    Parts,
    PointParts,
    number_again,
)
from vslam_ref.datasets.bundle_files.loading import FARTHEST, LARGEST, load
from vslam_ref.datasets.text import FormatError, decoded, is_number, number, read_bytes

FILES = ("cameras.txt", "images.txt", "points3D.txt")
POINT = ("X", "Y", "Z", "R", "G", "B", "ERROR")
NO_POINT_WORDS = ("-1", "18446744073709551615")
"""How programs write that a feature has no point: the second is the binary form's number, printed."""


def text_parts(folder: Path, max_bytes: int | None = None) -> Parts:
    """Read ``cameras.txt``, ``images.txt`` and ``points3D.txt``.

    Parameters
    ----------
    folder : Path
    max_bytes : int, optional
        Limit of each file's size; see :func:`.loading.load`.

    Raises
    ------
    FormatError
        Where a line is not as the package says.
    """
    cameras = _cameras(folder / FILES[0], max_bytes)
    images = _images(folder / FILES[1], max_bytes, cameras)
    return Parts(folder, ".txt", cameras, images, _points(folder / FILES[2], max_bytes))


Lines = Iterator[tuple[int, str]]


def text_lines(data: str) -> Lines:
    """Line number and stripped text of every line, empty ones and comments too."""
    return ((k, line.strip()) for k, line in enumerate(data.split("\n"), 1))


def records(
    path: Path, lines: Lines, right: str, fits: Callable[[int], bool], most: int = -1
) -> Iterator[tuple[int, int, list[str]]]:
    """Line, number and words of the records ``right``, whose first word is their number."""
    found: dict[int, int] = {}
    for line, text in lines:
        if not text or text.startswith("#"):
            continue
        words = text.split(maxsplit=most)
        if not fits(len(words)):
            raise FormatError(path, line, f"{len(words)} words; expected {right}")
        name = right.split()[0]
        key = whole(path, line, words[0], name)
        if key in found:
            raise FormatError(path, line, number_again(name, key, found[key]))
        found[key] = line
        yield line, key, words


def whole(path: Path, line: int, word: str, name: str, *, least: int = 0) -> int:
    """Read a whole number of at most 18 digits."""
    if not re.fullmatch(r"-?[0-9]{1,18}", word) or int(word) < least:
        raise FormatError(path, line, f"{name} is {word[:40]!r}; expected a whole number, at least {least}")
    return int(word)


def small_numbers(path: Path, line: int, words: Sequence[str], name: Callable[[int], str]) -> list[float]:
    """Finite numbers below ``FARTHEST``; ``name`` is a word's by its place."""
    values = [number(path, line, word, name(k)) for k, word in enumerate(words)]
    for k, value in enumerate(values):
        if not abs(value) < FARTHEST:
            raise FormatError(path, line, f"{name(k)} is {value:g}; expected less than {FARTHEST:g}")
    return values


def _cameras(path: Path, max_bytes: int | None) -> dict[int, CameraPart]:
    found: dict[int, CameraPart] = {}
    right = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS"
    lines = text_lines(decoded(path, load(path, max_bytes)))
    for line, key, words in records(path, lines, right, lambda n: n >= 4):
        model = words[1]
        size = tuple(whole(path, line, words[k], name) for k, name in ((2, "WIDTH"), (3, "HEIGHT")))
        params: list[float] = []
        if model in MODELS:
            names = MODELS[model].parameters
            if len(words) - 4 != len(names):
                right = f"expected {len(names)} for {model}: {', '.join(names)}"
                raise FormatError(path, line, f"{len(words) - 4} parameters; {right}")
            params = small_numbers(path, line, words[4:], names.__getitem__)
        found[key] = CameraPart(FilePlace(line), model, (size[0], size[1]), params)
    return found


def _images(path: Path, max_bytes: int | None, cameras: dict[int, CameraPart]) -> dict[int, ImagePart]:
    found: dict[int, ImagePart] = {}
    lines = text_lines(_with_any_names(path, load(path, max_bytes)))
    right = f"IMAGE_ID {' '.join(POSE)} CAMERA_ID NAME"
    for line, key, words in records(path, lines, right, lambda n: n == 10, most=9):
        pose = small_numbers(path, line, words[1:8], POSE.__getitem__)
        camera = whole(path, line, words[8], "CAMERA_ID")
        if camera not in cameras:
            raise FormatError(path, line, f"CAMERA_ID is {camera}; expected one of cameras.txt")
        below, features = next(lines, (line + 1, ""))  # an empty last line is often cut off
        uv, point = _features(path, below, features)
        found[key] = ImagePart(FilePlace(line), pose, camera, words[9], uv, point)
    return found


def _with_any_names(path: Path, data: bytes) -> str:
    """Text of ``images.txt``: names may hold bytes that are no UTF-8, as other systems' file names do."""
    text = data.decode("utf-8-sig", "surrogateescape")
    if any("\udc80" <= c <= "\udcff" for c in text):
        for line, words in enumerate(text.split("\n"), 1):
            if any("\udc80" <= c <= "\udcff" for c in words) and len(words.split(maxsplit=9)) != 10:
                raise FormatError(path, line, "not a text file; UTF-8 expected")
    return text


def _features(path: Path, line: int, text: str) -> tuple[Array, IntArray]:
    words = text.split()
    if len(words) % 3:
        right = "X Y POINT3D_ID again and again (an empty line for an image without features)"
        raise FormatError(path, line, f"{len(words)} words; expected {right}")
    uv = [
        small_numbers(path, line, words[axis::3], lambda k, axis=axis: f"{'XY'[axis]} of feature {k}")  # type: ignore[misc]
        for axis in (0, 1)
    ]
    point = [
        NO_POINT
        if word in NO_POINT_WORDS
        else whole(path, line, word, f"POINT3D_ID of feature {k}", least=NO_POINT)
        for k, word in enumerate(words[2::3])
    ]
    return np.array(uv, dtype=np.float64).T.reshape(-1, 2), np.array(point, dtype=np.int64)


def _points(path: Path, max_bytes: int | None) -> PointParts:
    at: list[int] = []
    ids: list[int] = []
    rows: list[list[float]] = []
    tracks: list[list[int]] = []
    if not path.exists():
        alone = "(a model of poses alone, with nothing to adjust, has an empty one)"
        raise FormatError(path, None, f"no such file; expected one line a point {alone}")
    # COLMAP's guide to known poses says to leave this file empty
    lines = text_lines(decoded(path, read_bytes(path, max_bytes or LARGEST)))
    right = f"POINT3D_ID {' '.join(POINT)} and pairs IMAGE_ID POINT2D_IDX"
    for line, key, words in records(path, lines, right, lambda n: n >= 8 and n % 2 == 0):
        values = small_numbers(path, line, words[1:7], POINT.__getitem__)
        for name, value in zip("RGB", values[3:6], strict=True):
            if not (0 <= value <= 255 and value == int(value)):
                raise FormatError(path, line, f"{name} is {value:g}; expected a whole number from 0 to 255")
        if not is_number(words[7]):
            raise FormatError(path, line, f"ERROR is {words[7]!r}; expected a number")
        tracks.append([whole(path, line, word, "a number of TRACK") for word in words[8:]])
        at.append(line)
        ids.append(key)
        rows.append(values)
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    lengths = [len(track) // 2 for track in tracks]
    track = np.array([number for track in tracks for number in track], dtype=np.int64).reshape(-1, 2)
    return PointParts(
        lambda k: FilePlace(at[k]),
        np.array(ids, dtype=np.int64),
        table[:, :3],
        table[:, 3:].astype(np.uint8),
        np.repeat(np.arange(len(ids)), lengths),
        track,
    )
