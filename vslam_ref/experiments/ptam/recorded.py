"""The pictures that PTAM is judged on, from ``recorded.toml``: first pictures and bounds, fixed before.

::

    recorded.toml -> RecordedSequence -> open_recorded -> Sequence from an offset to the last picture
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from vslam_ref.datasets import catalogue, trajectories
from vslam_ref.datasets.pictures import Picture
from vslam_ref.datasets.sequences import Sequence, open_sequence
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.metrics.trajectory import Trajectory
from vslam_ref.worlds.rendered import Effects, scene

TABLE = Path(__file__).with_name("recorded.toml")


@dataclass(frozen=True)
class RecordedSequence:
    """One recorded sequence; shares between 0 and 1, errors in ``error_unit``, None where nothing is asked.

    Attributes
    ----------
    name, what : str
    data_set : str
        Empty for a rendered scene of this name.
    offsets : tuple of int
        First pictures of the runs; of a rendered scene, its seeds.
    start_within : int
        Pictures within which a run must have started.
    error : {"rmse", "percent"}
        Which error is judged: the ATE, or its share of the true path.
    error_scale : float
        From the truth's unit to ``error_unit``.
    second : str
        File of another path in the data set, or empty.
    refined_drift : tuple of float
        Band of the drift with the refined camera; empty where none is asked for.
    camera : tuple of float
        fx, fy, cx, cy where the data set has no camera.
    noise, exposure : float
        Of a rendered scene: grey levels, and a share.
    all_start, must_not_start, seen : bool
    beside : tuple of mapping
        Of other systems.
    revisits : tuple of (int, int)
        Pictures of one place, the earlier one first.
    """

    name: str
    what: str
    offsets: tuple[int, ...]
    start_within: int
    seen: bool
    data_set: str = ""
    least_all: float | None = None
    least_after: float | None = None
    error: str = "rmse"
    error_unit: str = ""
    error_scale: float = 1.0
    most_error: float | None = None
    second: str = ""
    most_second: float | None = None
    most_refined: float | None = None
    refined_drift: tuple[float, ...] = ()
    camera: tuple[float, ...] = ()
    noise: float = 0.0
    exposure: float = 0.0
    all_start: bool = False
    must_not_start: bool = False
    beside: tuple[Mapping[str, Any], ...] = field(default=())
    revisits: tuple[tuple[int, int], ...] = ()


def recorded() -> dict[str, RecordedSequence]:
    """Every sequence of PTAM's table, by its name."""
    return read_table(TABLE)


@cache
def read_table(path: Path) -> dict[str, RecordedSequence]:
    """Every sequence of a table, by its name."""
    rows = tomllib.loads(path.read_text(encoding="utf-8"))["sequence"]
    return {row["name"]: RecordedSequence(**{k: _frozen(v) for k, v in row.items()}) for row in rows}


def _frozen(value: Any) -> Any:
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


def open_recorded(each: RecordedSequence, offset: int, pictures: int | None = None) -> Sequence:
    """Pictures from an offset to the last, or as many as are asked for.

    Raises
    ------
    ValueError
        If the data set is not found, with where to get it.
    """
    if not each.data_set:
        made = scene(each.name, offset, effects=Effects(noise=each.noise, exposure=each.exposure))
        exact = open_sequence(f"{each.name}:{offset}").part(0, pictures)
        return replace(exact, picture=lambda k: Picture(made.frame(k)))
    folder = catalogue.require(each.data_set)
    camera = Pinhole(*each.camera) if each.camera else None
    end = None if pictures is None else offset + pictures
    return open_sequence(folder, camera=camera).part(offset, end, 1)


def found(each: RecordedSequence) -> bool:
    """Whether the pictures of a row are here: those of a rendered scene always are."""
    return not each.data_set or catalogue.find(each.data_set) is not None


def second_path(each: RecordedSequence) -> Trajectory | None:
    """The other path of a data set, or None."""
    if not each.second:
        return None
    return trajectories.read(catalogue.require(each.data_set) / each.second, "tum").trajectory
