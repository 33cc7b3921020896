"""The flat board whose corners are known, and what one image shows of it.

::

        X_board (x along a row, y down the columns, z = 0 on the board)

        o---- x     corner number  row * columns + column,
        |           the order in which checkerboard detectors give them
        y
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray

LEAST_CORNERS = 4
"""A homography has 8 numbers, a corner gives 2."""


@dataclass(frozen=True)
class Board:
    """A checkerboard, by its inner corners.

    Parameters
    ----------
    columns, rows : int
        Inner corners along a row and along a column, both at least 2.
    square : float
        Side of a square, metres or any other unit; it sets the unit of the poses and changes no intrinsics.

    Raises
    ------
    ValueError
        On fewer corners, or a side that is not a positive number.

    Examples
    --------
    >>> Board(3, 2, 0.025).points[-1].tolist()
    [0.05, 0.025, 0.0]
    """

    columns: int
    rows: int
    square: float = 1.0

    def __post_init__(self) -> None:
        if self.columns < 2 or self.rows < 2:
            raise ValueError(
                f"board {self.columns}x{self.rows}: needs at least 2 inner corners in each direction"
            )
        if not (np.isfinite(self.square) and self.square > 0.0):
            raise ValueError(f"square={self.square}: the side of a square must be a positive number")

    @classmethod
    def from_text(cls, text: str, square: float = 1.0) -> Board:
        """Board from words such as ``9x6``: inner corners along a row, x, inner corners along a column.

        Raises
        ------
        ValueError
            On other words.
        """
        found = re.fullmatch(r"(\d{1,3})[xX](\d{1,3})", text.strip())
        if found is None:
            numbers = re.findall(r"\d{1,3}", text)
            right = "x".join(numbers) if len(numbers) == 2 else "9x6"
            raise ValueError(f"board {text!r}: write {right}, inner corners along a row, then along a column")
        return cls(int(found[1]), int(found[2]), square)

    @property
    def points(self) -> Array:
        """Corners X_board, shape (rows * columns, 3), row by row."""
        y, x = np.mgrid[: self.rows, : self.columns].astype(np.float64)
        return self.square * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)


class BoardView(NamedTuple):
    """Corners of one image: where they are on the board (N, 3) and in the image (N, 2), pixels."""

    X_board: Array
    uv: Array


class BoardCorners(NamedTuple):
    """All corners of all views, view after view.

    Attributes
    ----------
    X_board : ndarray, shape (M, 3)
        In the unit of the squares' sides, usually metres.
    uv : ndarray, shape (M, 2)
        Pixels.
    view : ndarray of int, shape (M,)
        Number of the view, never falling.
    first : ndarray of int, shape (V,)
        Where each view begins.
    """

    X_board: Array
    uv: Array
    view: IntArray
    first: IntArray

    @property
    def views(self) -> int:
        """Number of views V."""
        return len(self.first)

    def of(self, view: int) -> BoardView:
        """Corners of one view."""
        mine = self.view == view
        return BoardView(self.X_board[mine], self.uv[mine])


def stack(views: Sequence[tuple[ArrayLike, ArrayLike]]) -> BoardCorners:
    """Check views and put them into one table.

    Parameters
    ----------
    views : sequence of (X_board, uv)
        :class:`BoardView` or plain pairs, of shapes (N, 3) with z = 0, and (N, 2).  N may differ.

    Raises
    ------
    ValueError
        If there is no view, shapes do not fit, a number is not finite, a view has fewer than four corners
        or all of them on a line, or a corner does not lie in the board's plane.

    Examples
    --------
    >>> board = Board(2, 2)
    >>> stack([(board.points, board.points[:, :2])] * 3).first.tolist()
    [0, 4, 8]
    """
    if len(views) == 0:
        raise ValueError("no view: nothing to calibrate from")
    pairs = [(np.asarray(X, dtype=np.float64), np.asarray(uv, dtype=np.float64)) for X, uv in views]
    for number, (X, uv) in enumerate(pairs):
        _check(number, X, uv)
    counts = np.array([len(X) for X, _ in pairs])
    return BoardCorners(
        np.concatenate([X for X, _ in pairs]),
        np.concatenate([uv for _, uv in pairs]),
        np.repeat(np.arange(len(pairs)), counts),
        np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp),
    )


def _check(number: int, X: Array, uv: Array) -> None:
    at = f"view {number}"
    if X.ndim != 2 or X.shape[1:] != (3,) or uv.shape != (len(X), 2):
        raise ValueError(f"{at}: X_board has shape {X.shape} and uv {uv.shape}; need (N, 3) and (N, 2)")
    if not (np.isfinite(X).all() and np.isfinite(uv).all()):
        raise ValueError(f"{at}: a corner is not finite")
    if len(X) < LEAST_CORNERS:
        raise ValueError(f"{at}: {len(X)} corners; a homography needs {LEAST_CORNERS}")
    if X[:, 2].any():
        raise ValueError(f"{at}: z of the board's corners must be 0, all in one plane")
    for what, points in (("board", X[:, :2]), ("image", uv)):
        centred = points - points.mean(axis=0)
        singular = np.linalg.svd(centred, compute_uv=False)
        if not singular[1] > 1e-6 * singular[0]:
            raise ValueError(f"{at}: all corners lie on one line of the {what}")
