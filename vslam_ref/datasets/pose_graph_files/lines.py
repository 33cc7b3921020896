"""The kinds of lines of pose graph files, as tables: what a tag means, and how its numbers are read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.posegraph.spaces import Space
from vslam_ref.geometry import quaternion


class Poses(NamedTuple):
    """Elements (k, ...), and for each how far its quaternion was from length 1, (k,); NaN for a zero one."""

    T: Array
    unit_error: Array


@dataclass(frozen=True)
class Kind:
    """A kind of line.

    Parameters
    ----------
    format : str
        "g2o" or "toro".
    space : {"se2", "se3", "sim3"}
    names : tuple of str
        Columns of its pose.
    poses : callable
        Maps numbers (k, len(names)) to :class:`Poses`.
    extra : tuple of str
        Columns that may follow and mean nothing here.
    information : callable, optional
        Of edges: maps numbers (k, d (d + 1)/2) to matrices (k, d, d).
    entries : tuple of str
        Columns of the information, where they are not those of an upper triangle row by row.
    """

    format: str
    space: Space
    names: tuple[str, ...]
    poses: Callable[[Array], Poses]
    extra: tuple[str, ...] = ()
    information: Callable[[Array], Array] | None = None
    entries: tuple[str, ...] = ()


@dataclass
class Table:
    """Lines of one kind: line numbers, ids (one or two a line), and numbers."""

    lines: list[int] = field(default_factory=list)
    ids: list[tuple[int, ...]] = field(default_factory=list)
    rows: list[list[float]] = field(default_factory=list)

    def values(self) -> Array:
        """Numbers (k, columns)."""
        return np.array(self.rows, dtype=np.float64)


def upper(d: int) -> Callable[[Array], Array]:
    """Reader of symmetric matrices (k, d, d) from their upper triangles (k, d (d + 1)/2), row by row.

    Examples
    --------
    >>> upper(2)(np.array([[1.0, 2.0, 3.0]])).tolist()
    [[[1.0, 2.0], [2.0, 3.0]]]
    """
    rows, columns = np.triu_indices(d)
    return ordered(d, rows, columns)


def ordered(d: int, rows: IntArray, columns: IntArray) -> Callable[[Array], Array]:
    """Reader of symmetric matrices from their entries in some order."""

    def read(values: Array) -> Array:
        found = np.zeros((len(values), d, d))
        found[:, rows, columns] = values
        found[:, columns, rows] = values
        return found

    return read


def unit_quaternions(q: Array) -> tuple[Array, Array]:
    """Quaternions (k, 4) of length 1, and how far theirs was from 1, (k,).

    One of length 0, which is no rotation, becomes the identity with NaN.
    """
    size = np.linalg.norm(q, axis=1)
    good = (size > 1e-12) & np.isfinite(size)
    safe = np.where(good[:, None], q, [1.0, 0.0, 0.0, 0.0])
    return quaternion.normalise(safe), np.where(good, np.abs(size - 1.0), np.nan)


def information_names(d: int) -> tuple[str, ...]:
    """Names of the columns of an upper triangle.

    Examples
    --------
    >>> information_names(2)
    ('I11', 'I12', 'I22')
    """
    return tuple(f"I{i + 1}{j + 1}" for i, j in zip(*np.triu_indices(d), strict=True))
