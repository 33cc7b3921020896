"""Reader of COLMAP's text model."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.datasets.bundle_files.colmap.models import HALF, MODELS, common_model, params_from_colmap
from vslam_ref.datasets.bundle_files.loading import FARTHEST, UNIT_TOLERANCE, load, require_once
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.text import FormatError, decoded, number
from vslam_ref.estimation.bundle.problem import BundleProblem, Observations, Scene
from vslam_ref.geometry import quaternion, se3
from vslam_ref.geometry.cameras import Camera

FILES = ("cameras.txt", "images.txt", "points3D.txt")
POSE = ("QW", "QX", "QY", "QZ", "TX", "TY", "TZ")
POINT = ("X", "Y", "Z", "R", "G", "B", "ERROR")


class _Camera(NamedTuple):
    line: int
    model: str
    size: tuple[int, int]
    params: list[float]


class _Image(NamedTuple):
    """An image; of its features the places (F, 2) and the points' numbers (F,), -1 for none."""

    line: int
    pose: list[float]
    camera: int
    name: str
    uv: Array
    point: IntArray


class _Point(NamedTuple):
    """A point: values X Y Z R G B ERROR; its track (n, 2) of image numbers and features."""

    line: int
    values: list[float]
    track: IntArray


def read_colmap(folder: Path | str, *, max_bytes: int | None = None) -> BundleFile:
    """Read a text model; its intrinsics are fixed by default.

    Parameters
    ----------
    folder : Path or str
        With ``cameras.txt``, ``images.txt`` and ``points3D.txt``; other files are not opened.
    max_bytes : int, optional
        Limit of each file's size; see :func:`.loading.load`.

    Raises
    ------
    FormatError
        Where a file is not as the package says, the files disagree, or the camera models are of two families.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise FormatError(folder, None, f"no such folder; expected one with {', '.join(FILES)}")
    cameras = _cameras(folder / FILES[0], max_bytes)
    images = _images(folder / FILES[1], max_bytes, cameras)
    points = _points(folder / FILES[2], max_bytes)
    _require_tracks(folder / FILES[2], images, points)
    used = {image.camera for image in images.values()}
    lenses = {key: camera for key, camera in cameras.items() if key in used}
    model = _model(folder / FILES[0], lenses)
    params = np.array([_params(folder / FILES[0], model, camera) for camera in lenses.values()])
    seen, unmatched = _observations(folder / FILES[1], images, points)
    values = np.array([point.values for point in points.values()]).reshape(-1, len(POINT))
    scene = Scene(_poses(folder / FILES[1], images), values[:, :3], params)
    place = {key: k for k, key in enumerate(lenses)}
    problem = BundleProblem(model, scene, seen, [place[image.camera] for image in images.values()])  # type: ignore[arg-type]
    return BundleFile(
        problem,
        "colmap",
        view_names=tuple(image.name for image in images.values()),
        view_ids=np.array(list(images), dtype=np.int64),
        point_ids=np.array(list(points), dtype=np.int64),
        colours=values[:, 3:6].astype(np.uint8),
        image_sizes=np.array([camera.size for camera in lenses.values()]),
        camera_models=tuple(camera.model for camera in lenses.values()),
        notes=_notes(unmatched, len(cameras) - len(lenses)),
    )


def _lines(path: Path, max_bytes: int | None) -> Iterator[tuple[int, str]]:
    """Line number and stripped text of every line, empty ones and comments too."""
    text = decoded(path, load(path, max_bytes))
    return ((k, line.strip()) for k, line in enumerate(text.split("\n"), 1))


def _records(
    path: Path, lines: Iterator[tuple[int, str]], right: str, fits: Callable[[int], bool], most: int = -1
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
        key = _whole(path, line, words[0], name)
        if key in found:
            what = f"{name} {key} again; line {found[key]} has it already, expected another"
            raise FormatError(path, line, what)
        found[key] = line
        yield line, key, words


def _whole(path: Path, line: int, word: str, name: str, *, least: int = 0) -> int:
    if not re.fullmatch(r"-?[0-9]{1,18}", word) or int(word) < least:
        raise FormatError(path, line, f"{name} is {word[:40]!r}; expected a whole number, at least {least}")
    return int(word)


def _numbers(path: Path, line: int, words: Sequence[str], name: Callable[[int], str]) -> list[float]:
    """Finite numbers below ``FARTHEST``; ``name`` is a word's by its place."""
    values = [number(path, line, word, name(k)) for k, word in enumerate(words)]
    for k, value in enumerate(values):
        if not abs(value) < FARTHEST:
            raise FormatError(path, line, f"{name(k)} is {value:g}; expected less than {FARTHEST:g}")
    return values


def _cameras(path: Path, max_bytes: int | None) -> dict[int, _Camera]:
    found: dict[int, _Camera] = {}
    right = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS"
    for line, key, words in _records(path, _lines(path, max_bytes), right, lambda n: n >= 4):
        model = words[1]
        if model not in MODELS:
            raise FormatError(path, line, f"MODEL is {model[:40]!r}; expected one of {', '.join(MODELS)}")
        names = MODELS[model].parameters
        size = tuple(_whole(path, line, words[k], name) for k, name in ((2, "WIDTH"), (3, "HEIGHT")))
        if len(words) - 4 != len(names):
            right = f"expected {len(names)} for {model}: {', '.join(names)}"
            raise FormatError(path, line, f"{len(words) - 4} parameters; {right}")
        params = _numbers(path, line, words[4:], names.__getitem__)
        found[key] = _Camera(line, model, (size[0], size[1]), params)
    return found


def _images(path: Path, max_bytes: int | None, cameras: dict[int, _Camera]) -> dict[int, _Image]:
    found: dict[int, _Image] = {}
    lines, right = _lines(path, max_bytes), f"IMAGE_ID {' '.join(POSE)} CAMERA_ID NAME"
    for line, key, words in _records(path, lines, right, lambda n: n == 10, most=9):
        pose = _numbers(path, line, words[1:8], POSE.__getitem__)
        camera = _whole(path, line, words[8], "CAMERA_ID")
        if camera not in cameras:
            raise FormatError(path, line, f"CAMERA_ID is {camera}; expected one of cameras.txt")
        below, features = next(lines, (line + 1, None))
        if features is None:
            raise FormatError(path, line, "the file ends here; expected a line of X Y POINT3D_ID below")
        uv, point = _features(path, below, features)
        found[key] = _Image(line, pose, camera, words[9], uv, point)
    if not found:
        raise FormatError(path, None, "no image; expected at least one, two lines each")
    return found


def _features(path: Path, line: int, text: str) -> tuple[Array, IntArray]:
    words = text.split()
    if len(words) % 3:
        raise FormatError(path, line, f"{len(words)} words; expected X Y POINT3D_ID again and again")
    uv = [
        _numbers(path, line, words[axis::3], lambda k, axis=axis: f"{'XY'[axis]} of feature {k}")  # type: ignore[misc]
        for axis in (0, 1)
    ]
    point = [
        _whole(path, line, word, f"POINT3D_ID of feature {k}", least=-1) for k, word in enumerate(words[2::3])
    ]
    return np.array(uv, dtype=np.float64).T.reshape(-1, 2), np.array(point, dtype=np.int64)


def _points(path: Path, max_bytes: int | None) -> dict[int, _Point]:
    found: dict[int, _Point] = {}
    right = f"POINT3D_ID {' '.join(POINT)} and pairs IMAGE_ID POINT2D_IDX"
    for line, key, words in _records(path, _lines(path, max_bytes), right, lambda n: n >= 8 and n % 2 == 0):
        values = _numbers(path, line, words[1:8], POINT.__getitem__)
        for name, value in zip("RGB", values[3:6], strict=True):
            if not (0 <= value <= 255 and value == int(value)):
                raise FormatError(path, line, f"{name} is {value:g}; expected a whole number from 0 to 255")
        track = [_whole(path, line, word, "a number of TRACK") for word in words[8:]]
        found[key] = _Point(line, values, np.array(track, dtype=np.int64).reshape(-1, 2))
    return found


def _require_tracks(path: Path, images: dict[int, _Image], points: dict[int, _Point]) -> None:
    """Every track must name features that name this point: the two files say the same twice."""
    for key, point in points.items():
        for image, feature in point.track.tolist():
            if image not in images:
                raise FormatError(path, point.line, f"TRACK names image {image}; expected one of images.txt")
            named = images[image].point
            if feature >= len(named) or named[feature] != key:
                point_there = named[feature] if feature < len(named) else "none"
                what = f"TRACK names feature {feature} of image {image}, which has point {point_there}"
                raise FormatError(path, point.line, f"{what}; expected {key}")
    counts = {key: len(point.track) for key, point in points.items()}
    for image in images.values():
        for key in image.point[image.point >= 0].tolist():
            if key in counts:
                counts[key] -= 1
    for key, left in counts.items():
        if left:
            has = len(points[key].track)
            what = f"TRACK of point {key} has {has} features, images.txt {has - left}; expected the same"
            raise FormatError(path, points[key].line, what)


def _model(path: Path, lenses: dict[int, _Camera]) -> type[Camera]:
    names = [camera.model for camera in lenses.values()]
    model = common_model(names)
    if model is None:
        first = names[0]
        other = next(camera for camera in lenses.values() if common_model((first, camera.model)) is None)
        what = f"MODEL {other.model} beside {first}: no model here can say both"
        raise FormatError(path, other.line, f"{what}; expected models of one family")
    return model


def _params(path: Path, model: type[Camera], camera: _Camera) -> Array:
    params = params_from_colmap(camera.model, camera.params, model)
    try:
        model.from_params(params)
    except ValueError as error:
        raise FormatError(path, camera.line, str(error)) from None
    return params


def _poses(path: Path, images: dict[int, _Image]) -> Array:
    values = np.array([image.pose for image in images.values()])
    with np.errstate(over="ignore"):
        length = np.linalg.norm(values[:, :4], axis=1)
    bad = np.flatnonzero(~(np.abs(length - 1.0) <= UNIT_TOLERANCE))
    if len(bad):
        line = list(images.values())[bad[0]].line
        what = f"quaternion of length {length[bad[0]]:.6g}; expected 1 within {UNIT_TOLERANCE:g}"
        raise FormatError(path, line, what)
    R = quaternion.matrix(quaternion.normalise(values[:, :4]))
    return se3.from_rt(R, values[:, 4:])


def _observations(
    path: Path, images: dict[int, _Image], points: dict[int, _Point]
) -> tuple[Observations, int]:
    """Features with a point, and how many have none."""
    place = {key: k for k, key in enumerate(points)}
    place[-1] = -1
    parts: list[IntArray] = []
    for image in images.values():
        found = [place.get(key, -2) for key in image.point.tolist()]
        if -2 in found:
            k = found.index(-2)
            what = f"POINT3D_ID of feature {k} is {image.point[k]}; expected -1 or one of points3D.txt"
            raise FormatError(path, image.line + 1, what)
        parts.append(np.array(found, dtype=np.int64))
    point = np.concatenate(parts)
    view = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    uv = np.concatenate([image.uv for image in images.values()])
    keep = point >= 0
    view, point = view[keep], point[keep]
    all_images, ids = list(images.values()), list(points)
    require_once(
        path,
        view,
        point,
        lambda k: all_images[view[k]].line + 1,
        lambda k: f"image {all_images[view[k]].name[:80]!r} sees point {ids[point[k]]}",
    )
    return Observations(view, point, uv[keep] - HALF), int((~keep).sum())


def _notes(unmatched: int, unused: int) -> tuple[str, ...]:
    left_out = {"features without a point": unmatched, "cameras without an image": unused}
    return tuple(f"{count} {what} were left out" for what, count in left_out.items() if count)
