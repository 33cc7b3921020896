r"""Where between the pixels?  Inverse compositional refinement, with an offset of brightness.

Wanted are the place u and the offset b of the least :math:`\sum_d r^2`,

.. math:: r(d) = T(d) + b - I(u + d)

predicted minus measured, over the inner 6 x 6 pixels of the template T.  A step moves the *template* by
delta: T(d + delta) is nearer to I(u + d).  Its slopes g do not change, so the matrix is made once.  The
offset takes the mean of everything with it:

.. math:: S = \sum (g - \bar g)(g - \bar g)^T, \qquad S\, \delta = - \sum (g - \bar g)\, r .

Moving the template by delta is moving the place by -delta: :math:`u \leftarrow u - \delta`.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, as_array
from vslam_ref.features.levels import Bytes, grey
from vslam_ref.features.templates import BEFORE, SIDE, bilinear

INNER = SIDE - 2
"""Pixels of a template with neighbours on all sides, 6 x 6."""
LEAST_SLOPE = 1.0 / 24.0
"""Squared grey levels per squared pixel: what rounding alone, of variance 1/12, gives half a difference."""
FARTHEST = 4.0
"""Pixels; a template that is half a patch away from where it started has found something else."""
STEPS, NEAR = 10, 0.01


class State(IntEnum):
    """How a refinement ended."""

    OK = 0
    FLAT = 1
    OUTSIDE = 2
    ASTRAY = 3
    SLOW = 4

    @property
    def reason(self) -> str:
        """The state in words; empty for OK."""
        return {
            State.OK: "",
            State.FLAT: "the template has no slope in some direction",
            State.OUTSIDE: "the patch leaves the image",
            State.ASTRAY: f"the patch moved by more than {FARTHEST:g} pixels",
            State.SLOW: f"no convergence in {STEPS} steps",
        }[self]


class Refined(NamedTuple):
    """Places between pixels.

    Attributes
    ----------
    uv : ndarray, shape (N, 2)
        Pixels of the level.  Where the state is not OK, the last place inside the image.
    offset : ndarray, shape (N,)
        b: image minus template, in grey levels.
    state : ndarray of int8, shape (N,)
        A :class:`State`.
    """

    uv: Array
    offset: Array
    state: NDArray[np.int8]

    @property
    def ok(self) -> BoolArray:
        """Which ended well."""
        return np.asarray(self.state == State.OK)


def refine(image: ArrayLike, patch: ArrayLike, uv: ArrayLike) -> Refined:
    """Move templates from where they were found to where they fit best.

    Implements :eq:`eq-inverse-compositional`.

    Parameters
    ----------
    image : array_like of uint8, shape (H, W)
        One level.
    patch : array_like of uint8, shape (N, 8, 8)
        Templates as this level should show them.
    uv : array_like, shape (N, 2)
        Start, in pixels of the level: within about 2 pixels of the answer.

    Returns
    -------
    Refined

    Raises
    ------
    ValueError
        If the image is not grey with 8 bits, or shapes do not fit.

    Notes
    -----
    With noise of sigma grey levels in the image, the covariance of the place is sigma^2 S^-1: a slope of 20
    grey levels per pixel (root mean square, both ways) and sigma = 2 make 2 / (6 * 20) = 0.02 pixels.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(30.0), np.arange(30.0))
    >>> image, moved = (np.rint(120 + 60 * np.sin((x - a) / 2) + 50 * np.cos((y + a) / 2)).astype(np.uint8)
    ...                 for a in (0.0, 0.3))
    >>> from vslam_ref.features import templates
    >>> refine(moved, templates.cut(image, [[14, 15]]).patch, [[14.0, 15.0]]).uv.round(1)
    array([[14.3, 14.7]])
    """
    whole, given, at = grey("image", image, 2), np.asarray(patch), as_array("uv", uv, 2)
    if given.dtype != np.uint8 or given.shape != (len(at), SIDE, SIDE) or at.ndim != 2:
        raise ValueError(
            f"templates are {given.dtype} of shape {given.shape}, uv {at.shape}: "
            f"need uint8 (N, {SIDE}, {SIDE}) and (N, 2)"
        )
    flat = np.ascontiguousarray(given).reshape(-1, SIDE * SIDE)
    return Refined(*_refine(whole.reshape(-1), whole.shape[1], flat, at))


class _Model(NamedTuple):
    """Of each template: inner pixels T (N, 36), slopes without mean (2, N, 36), inverse of S (N, 2, 2)."""

    T: Array
    g: Array
    inverse: Array
    flat: BoolArray


def _model(patch: Bytes) -> _Model:
    """What does not change while the templates move."""
    T = patch.reshape(-1, SIDE, SIDE).astype(np.float64)
    gx = (T[:, 1:-1, 2:] - T[:, 1:-1, :-2]) / 2
    gy = (T[:, 2:, 1:-1] - T[:, :-2, 1:-1]) / 2
    g = np.stack([gx, gy]).reshape(2, len(T), INNER * INNER)
    g = g - g.mean(-1, keepdims=True)
    a, b, c = (np.einsum("nk,nk->n", g[i], g[j]) for i, j in ((0, 0), (0, 1), (1, 1)))  # eq-refine-matrix
    smaller = (a + c - np.sqrt((a - c) ** 2 + 4 * b * b)) / 2
    is_flat = smaller <= LEAST_SLOPE * INNER * INNER
    det = np.where(is_flat, 1.0, a * c - b * b)
    inverse = np.stack([np.stack([c, -b], -1), np.stack([-b, a], -1)], -2) / det[:, None, None]
    return _Model(T[:, 1:-1, 1:-1].reshape(len(T), INNER * INNER), g, inverse, is_flat)


@accelerated("patches:refine")
def _refine(flat: Bytes, width: int, patch: Bytes, uv: Array) -> tuple[Array, Array, NDArray[np.int8]]:
    """Places (N, 2), offsets (N,) and states (N,) of templates (N, 64)."""
    height, model = len(flat) // width, _model(patch)
    step = np.arange(1.0 - BEFORE, INNER + 1 - BEFORE)
    dx, dy = np.tile(step, INNER), np.repeat(step, INNER)
    place, offset = uv.copy(), np.zeros(len(uv))
    state = np.where(model.flat, State.FLAT, State.SLOW).astype(np.int8)
    for _ in range(STEPS):
        going = np.flatnonzero(state == State.SLOW)
        x, y = place[going, 0], place[going, 1]
        low, high = step[0], step[-1]
        inside = (x + low >= 0) & (x + high <= width - 1) & (y + low >= 0) & (y + high <= height - 1)
        state[going[~inside]] = State.OUTSIDE
        on = going[inside]
        seen = bilinear(flat, width, place[on, 0, None] + dx, place[on, 1, None] + dy)
        residual = model.T[on] - seen  # r without b, which the mean-free slopes do not see
        offset[on] = -residual.mean(1)
        slope = np.einsum("ink,nk->ni", model.g[:, on], residual)
        moved = np.einsum("nij,nj->ni", model.inverse[on], slope)  # eq-inverse-compositional: -delta
        place[on] += moved
        astray = np.hypot(*(place[on] - uv[on]).T) > FARTHEST
        near = np.hypot(*moved.T) < NEAR
        state[on] = np.where(astray, State.ASTRAY, np.where(near, State.OK, State.SLOW))
    return place, offset, state
