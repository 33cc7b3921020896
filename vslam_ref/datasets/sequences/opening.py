"""Opening a sequence: a folder, a video, a data set's name or a rendered scene's."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets import catalogue, trajectories
from vslam_ref.datasets.known import DATA_SETS
from vslam_ref.datasets.picture_size import HEAD, picture_size
from vslam_ref.datasets.pictures import Picture, read_picture
from vslam_ref.datasets.sequences import scenes
from vslam_ref.datasets.sequences.cameras import KINDS, read_camera
from vslam_ref.datasets.sequences.contents import Contents, read_folder
from vslam_ref.datasets.sequences.films import VideoFile, is_film
from vslam_ref.datasets.sequences.record import MissingPictureError, Sequence
from vslam_ref.datasets.sequences.times import by_rate, odd, read_times
from vslam_ref.datasets.text import FormatError
from vslam_ref.geometry.cameras import Camera
from vslam_ref.metrics.trajectory import MAX_DIFFERENCE, Trajectory, associate
from vslam_ref.metrics.trajectory.partners import left_out, percent, reasons
from vslam_ref.support.errors import InputError, suggestion
from vslam_ref.worlds.rendered import NAMES

DEEP = "values of 16 bits: 0 to 65535 became 0 to 255"
LOOKED_AT = 32
"""Pictures whose heads are read to find the size of all."""


class Wanted(NamedTuple):
    """What the user gave beside the source; None where it was left out."""

    camera: Camera | Path | None
    times: Path | None
    rate: float | None
    truth: Path | None
    camera_needed: bool


def open_sequence(
    source: str | Path,
    *,
    camera: Camera | Path | str | None = None,
    times: Path | str | None = None,
    rate: float | None = None,
    truth: Path | str | None = None,
    camera_needed: bool = True,
) -> Sequence:
    """Open pictures in their order, with times, camera and truth as far as they are there.

    Parameters
    ----------
    source : str or Path
        A folder in one of the layouts of :mod:`.contents`; a video file; the name of a data set that
        ``VSLAM_REF_DATA`` finds; or a rendered scene, as ``desk`` or ``desk:7`` with the seed 7.
    camera : Camera, or path of a camera file, optional
        Takes precedence over that of the source.  Any file that :func:`.cameras.read_camera` knows.
    times : path, optional
        A file with one time a line, seconds.
    rate : float, optional
        Pictures a second: the k-th picture, from 0, is at k / rate.  Not with ``times``.
    truth : path, optional
        A trajectory of the camera in one of the formats of :mod:`.trajectories`.
    camera_needed : bool
        Whether a source without a camera is refused.

    Returns
    -------
    Sequence
        One picture has been decoded to see its size; those of a video all, once, to count them.

    Raises
    ------
    FormatError
        If the source or a file beside it is malformed, or the camera is for another size of pictures.
    InputError
        If there is no such source, it has no camera and one is needed, or arguments contradict each other.

    Examples
    --------
    >>> sequence = open_sequence("desk")
    >>> len(sequence), sequence.size, sequence.image(3).grey.dtype
    (600, (640, 480), dtype('uint8'))
    """
    given = camera if isinstance(camera, Camera) else None if camera is None else Path(camera)
    clock, poses = (None if path is None else Path(path) for path in (times, truth))
    options = Wanted(given, clock, rate, poses, camera_needed)
    if times is not None and rate is not None:
        raise InputError("both a file of times and a rate were given: give one of them")
    if rate is not None and not 0 < rate < 1e6:
        raise InputError(f"rate {rate:g}: need pictures a second, more than 0")
    place = _place(str(source))
    if place is None:
        return _rendered(str(source), options)
    return _film(place, options) if place.is_file() else _folder(place, options)


def _place(source: str) -> Path | None:
    """File or folder that a source means; None for a scene.  A folder or file goes before a name."""
    path = Path(source)
    try:
        there = path.exists() and source != ""
    except (OSError, ValueError):  # a name that no file can have
        there = False
    if there:
        if path.is_file() and not is_film(path):
            raise FormatError(path, None, "no video by its name; expected a folder of pictures, or a video")
        return path
    if scenes.is_scene(source):
        return None
    names = {data_set.name for data_set in DATA_SETS}
    if source in names:
        return catalogue.require(source)
    known = [*NAMES, *names]
    what = f"no folder, video, scene or data set {source!r}{suggestion(source, known)}"
    raise InputError(f"{what}; scenes: {', '.join(NAMES)}")


def _folder(folder: Path, options: Wanted) -> Sequence:
    found = read_folder(folder)
    size, bits = _look(folder, found.pictures)

    def picture(number: int) -> Picture:
        path = found.pictures[number]
        if not path.is_file():
            raise MissingPictureError(path, None, "no such file")
        return read_picture(path)

    camera, camera_from, odd_camera = _camera(options, size, found.camera, folder)
    taken = Taken(str(folder), size, len(found.pictures), picture, camera, camera_from)
    return _joined(taken, found, options, (*((DEEP,) if bits == 16 else ()), *odd_camera))


def _film(path: Path, options: Wanted) -> Sequence:
    film = VideoFile(path)
    camera, camera_from, odd_camera = _camera(options, film.size, None, path)
    taken = Taken(str(path), film.size, len(film.times), film.picture, camera, camera_from)
    return _joined(taken, Contents("video", (), film.times), options, (*film.notes, *odd_camera))


def _rendered(source: str, options: Wanted) -> Sequence:
    if options.camera is not None:
        raise InputError(f"scene {source} has its own camera: leave --camera out")
    scene = scenes.open_scene(source)
    count, place = len(scene.times), f"scene {source}"
    taken = Taken(source, scene.size, count, lambda k: Picture(scene.frame(k)), scene.camera, place)
    found = Contents("rendered", (), scene.times, None, scene.trajectory(), np.arange(count), place)
    return _joined(taken, found, options, ())


class Taken(NamedTuple):
    """Pictures of a source: its name, their size and number, how to get one, and by which camera."""

    name: str
    size: tuple[int, int]
    total: int
    picture: Callable[[int], Picture]
    camera: Camera | None
    camera_from: str


def _joined(taken: Taken, found: Contents, options: Wanted, told: tuple[str, ...]) -> Sequence:
    """The sequence: pictures, their times, and the truth in the same clock."""
    times, odd_times = _clock(taken.total, found.times, options)
    truth, truth_from, unpaired = _truth(options, found, times)
    return Sequence(
        name=taken.name,
        layout=found.layout,
        size=taken.size,
        times=times,
        numbers=np.arange(taken.total),
        picture=taken.picture,
        camera=taken.camera,
        camera_from=taken.camera_from,
        truth=truth,
        truth_from=truth_from,
        told=(*found.notes, *told, *odd_times, *unpaired),
    )


def _look(folder: Path, pictures: tuple[Path, ...]) -> tuple[tuple[int, int], int]:
    """Size that most pictures have by their heads, and the bits of a value of one of these."""
    some = np.unique(np.linspace(0, len(pictures) - 1, min(LOOKED_AT, len(pictures))).astype(int))
    heads: dict[Path, tuple[int, int]] = {}
    for path in (pictures[k] for k in some):
        if path.is_file():
            with path.open("rb") as stream:
                size = picture_size(stream.read(HEAD))
            if size is not None:
                heads[path] = size
    ranked = Counter(heads.values()).most_common()
    count = f"{len(pictures)} pictures"
    looked = count if len(some) == len(pictures) else f"the {len(some)} of {count} that were looked at"
    why = FormatError(folder, None, f"none of {looked} can be read")
    for path, size in sorted(heads.items(), key=lambda item: [s for s, _ in ranked].index(item[1])):
        try:
            found = read_picture(path)
        except FormatError as error:
            why = FormatError(folder, None, f"none of {looked} can be read, as {error}")
            continue
        if found.grey.shape == size[::-1]:
            return size, found.bits
    raise why


def _camera(
    options: Wanted, size: tuple[int, int], own: Path | None, source: Path
) -> tuple[Camera | None, str, tuple[str, ...]]:
    """The camera that was given, else the source's own; where it comes from, and what is odd about it."""
    if isinstance(options.camera, Camera):
        return options.camera, "given", ()
    path = options.camera or own
    if path is not None:
        read = read_camera(path, size)
        return read.camera, str(path), tuple(f"{path.name}: {note}" for note in read.notes)
    if not options.camera_needed:
        return None, "", ()
    what = f"{source}: no camera beside the pictures, and none was given"
    raise InputError(f"{what}: give --camera FILE; it may be {KINDS}")


def _clock(count: int, own: Array | None, options: Wanted) -> tuple[Array, list[str]]:
    """Times of all pictures, seconds, and what is to be told about them."""
    if options.times is not None:
        times = read_times(options.times)
        if len(times) != count:
            what = f"{len(times)} times for {count} pictures; expected one for each"
            raise FormatError(options.times, None, what)
        return times, odd(times)
    if own is None or options.rate is not None:
        times, sentence = by_rate(count, options.rate)
        return times, [sentence]
    return own, odd(own)


def _truth(options: Wanted, found: Contents, times: Array) -> tuple[Trajectory | None, str, list[str]]:
    """The true trajectory in the clock of the pictures, where it is from, and what is to be told."""
    truth, numbers, place, told = found.truth, found.truth_numbers, found.truth_from, []
    if options.truth is not None:
        file, place = trajectories.read(options.truth), str(options.truth)
        truth, told = file.trajectory, [f"{place}: {note}" for note in file.notes]
        numbers = file.places if truth.times is None else None
        if numbers is not None and file.lines != len(times):
            what = f"{file.lines} poses without times for {len(times)} pictures; expected one for each"
            raise FormatError(options.truth, None, what)
    if truth is None:
        return None, "", []
    stamps = truth.times if numbers is None else times[numbers]
    assert stamps is not None
    order = np.argsort(stamps, kind="stable")  # stamps of pictures may fall
    truth = Trajectory(stamps[order], truth.t_world_body[order], truth.R_world_body[order])
    by_count = options.rate is not None or (found.times is None and options.times is None)
    return truth, place, told + _unpaired(np.unique(times), stamps[order], by_count)


def _unpaired(times: Array, stamps: Array, by_count: bool) -> list[str]:
    """Pictures without a true pose, and the likely reason; ``by_count``: times come from a rate."""
    out = left_out(times, stamps, associate(times, stamps), MAX_DIFFERENCE)
    if not out.total:
        return []
    why = reasons(out, MAX_DIFFERENCE, who="sequence", options=False)
    what = (
        f"{out.total} of {out.poses} pictures with different times ({percent(out.total, out.poses)}) have no"
    )
    told = f"{what} true pose within {MAX_DIFFERENCE:g} s: {'; '.join(why)}"
    spans = [float(clock[-1] - clock[0]) for clock in (times, stamps)]
    if by_count and min(spans) > 0 and abs(spans[0] / spans[1] - 1) > 0.01:
        rate = (len(times) - 1) / spans[1]
        lasts = f"the pictures last {spans[0]:.4g} s, the truth {spans[1]:.4g} s"
        told += f"; {lasts}: they last as long with --rate {rate:.4g}"
    return [told]
