"""Lenses of several families in one problem: each family has a block of columns of the intrinsics.

A camera model is one formula with its own parameters, so a phone's radial-tangential lens and an action
camera's fisheye cannot share columns.  Their sets of intrinsics stand in one array all the same, each in the
block of its family, zero elsewhere::

    columns    0 ... 8           9 ... 16
    set 0      Radtan's nine     0                 of_set[0] = 0
    set 1      0                 Fisheye's eight   of_set[1] = 1

Observations are divided by the family of their lens, each part is projected and linearised by its own model,
and the parts are put together again.  A free direction moves a set along the rows of its own block only; one
without an entry there has no column in the system of the views.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.geometry.cameras import Camera


class FamilyPart(NamedTuple):
    """Observations of one family: its model, its columns of the intrinsics, their numbers (m,)."""

    model: type[Camera]
    columns: slice
    rows: IntArray


@dataclass(frozen=True)
class Families:
    """Which camera model each set of intrinsics has.

    Parameters
    ----------
    models : tuple of type of Camera
        The families, two or more, all different.
    of_set : tuple of int, length L
        Family of each set of intrinsics, from 0.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Fisheye, Pinhole
    >>> both = Families((Pinhole, Fisheye), (0, 1, 1))
    >>> both.width, both.columns(1)
    (12, slice(4, 12, None))
    """

    models: tuple[type[Camera], ...]
    of_set: tuple[int, ...]

    def __post_init__(self) -> None:
        if len(set(self.models)) < max(2, len(self.models)):
            raise ValueError("families: need two camera models or more, all different")
        if not all(0 <= family < len(self.models) for family in self.of_set):
            raise ValueError(f"families of the sets {self.of_set}: there are {len(self.models)}, from 0")

    @property
    def width(self) -> int:
        """Columns of the intrinsics."""
        return sum(len(model.names()) for model in self.models)

    def columns(self, family: int) -> slice:
        """Columns of a family's block."""
        begin = sum(len(model.names()) for model in self.models[:family])
        return slice(begin, begin + len(self.models[family].names()))

    @property
    def own(self) -> BoolArray:
        """Which columns are those of a set's own block, (L, width)."""
        mask = np.zeros((len(self.of_set), self.width), dtype=np.bool_)
        for number, family in enumerate(self.of_set):
            mask[number, self.columns(family)] = True
        return mask

    def parts(self, lens: IntArray) -> Iterator[FamilyPart]:
        """Observations, whose sets of intrinsics are ``lens (n,)``, by family; no empty part."""
        family = np.asarray(self.of_set, dtype=np.int64)[lens]
        for number, model in enumerate(self.models):
            rows = np.flatnonzero(family == number)
            if len(rows):
                yield FamilyPart(model, self.columns(number), rows)


CameraModel = type[Camera] | Families
"""One camera model for all sets of intrinsics, or one for each."""


def width(model: CameraModel) -> int:
    """Columns of the intrinsics.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> width(Pinhole)
    4
    """
    return model.width if isinstance(model, Families) else len(model.names())


def model_of_set(model: CameraModel, number: int) -> tuple[type[Camera], slice]:
    """Camera model of a set of intrinsics, and its columns."""
    if isinstance(model, Families):
        family = model.of_set[number]
        return model.models[family], model.columns(family)
    return model, slice(0, len(model.names()))


def own_columns(model: CameraModel, sets: int) -> BoolArray:
    """Which columns of the intrinsics belong to each of ``sets`` sets, (L, p)."""
    return model.own if isinstance(model, Families) else np.ones((sets, len(model.names())), dtype=np.bool_)


def parts_of(model: CameraModel, lens: IntArray) -> Iterator[FamilyPart]:
    """Observations, whose sets of intrinsics are ``lens (n,)``, by camera model.

    Yields
    ------
    FamilyPart
    """
    if isinstance(model, Families):
        yield from model.parts(lens)
    else:
        yield FamilyPart(model, slice(0, len(model.names())), np.arange(len(lens)))


def camera_of(model: CameraModel, intrinsics: Array, number: int) -> Camera:
    """Camera of a set of intrinsics (L, p).

    Raises
    ------
    ValueError
        Where the numbers make no such camera.
    """
    kind, columns = model_of_set(model, number)
    return kind.from_params(intrinsics[number, columns])


def sensors(model: CameraModel, intrinsics: Array) -> Array:
    """Focal lengths and centre (fx, fy, cx, cy), pixels, of every set of intrinsics (L, p), shape (L, 4)."""
    rows = [intrinsics[k, model_of_set(model, k)[1]][:4] for k in range(len(intrinsics))]
    return np.array(rows).reshape(-1, 4)


def directions(model: CameraModel, names: tuple[str, ...]) -> Array:
    """Directions (p, q) of named intrinsics; ``f`` is one focal length, fx and fy changed alike.

    A name that several families have is one direction of each set, in its own block.

    Raises
    ------
    ValueError
        On a name that no model has.
    """
    blocks = (
        [(0, model)]
        if not isinstance(model, Families)
        else [(model.columns(k).start, kind) for k, kind in enumerate(model.models)]
    )
    basis = np.zeros((width(model), len(names)))
    for column, name in enumerate(names):
        members = ("fx", "fy") if name == "f" else (name,)
        able = [(start, kind.names()) for start, kind in blocks if set(members) <= set(kind.names())]
        if not able:
            have = "; ".join(f"{kind.__name__} has f, {', '.join(kind.names())}" for _, kind in blocks)
            raise ValueError(f"intrinsic {name!r}: {have}")
        for start, known in able:
            basis[[start + known.index(member) for member in members], column] = 1.0
    return basis
