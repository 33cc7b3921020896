"""Arrays that grow together, one row for each thing; the row is the thing's name."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from vslam_ref.arrays import IntArray

FIRST = 64
"""Rows for which room is made at first; it doubles when they are used up."""


class Rows:
    """Named columns of equal length; rows are added, and never taken away.

    Parameters
    ----------
    **columns : tuple of (shape, dtype)
        Shape of one row's entry, and its type.

    Notes
    -----
    A column is a view: writing into it changes the table.  It may be out of date after :meth:`append`, but
    what it showed stays as it was.

    Examples
    --------
    >>> rows = Rows(xy=((2,), float), alive=((), bool))
    >>> rows.append(2, xy=[[1.0, 2.0], [3.0, 4.0]], alive=True).tolist(), len(rows)
    ([0, 1], 2)
    >>> rows["xy"][1].tolist(), rows["alive"].tolist()
    ([3.0, 4.0], [True, True])
    """

    def __init__(self, **columns: tuple[tuple[int, ...], DTypeLike]) -> None:
        self._room = {name: np.zeros((FIRST, *shape), kind) for name, (shape, kind) in columns.items()}
        self._used = 0

    def __len__(self) -> int:
        return self._used

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._room[name][: self._used]

    def append(self, count: int, **values: Any) -> IntArray:
        """Add ``count`` rows with values (count, ...) or (...); columns without a value are 0.

        Returns
        -------
        ndarray of int64, shape (count,)
            Numbers of the new rows.
        """
        end = self._used + count
        for name, column in self._room.items():
            if end > len(column):
                larger = np.zeros((max(2 * len(column), end), *column.shape[1:]), column.dtype)
                larger[: self._used] = column[: self._used]
                self._room[name] = larger
        for name, value in values.items():
            self._room[name][self._used : end] = value
        self._used = end
        return np.arange(end - count, end)

    def frozen(self) -> Rows:
        """Return a copy of the rows as they are now."""
        copy = Rows()
        copy._room = {name: self[name].copy() for name in self._room}
        copy._used = self._used
        return copy

    def shown(self) -> Rows:
        """Return the rows as they are now without copying; only for columns that are written once."""
        copy = Rows()
        copy._room = {name: self[name] for name in self._room}
        copy._used = self._used
        return copy
