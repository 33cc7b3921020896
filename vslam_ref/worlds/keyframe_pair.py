r"""Two keyframes that saw the same points, each with depths of its own: what a loop is closed with.

::

        points of a box, 4 to 9 m away
      .   .  x  .   .                   each keyframe has its points along the rays that it saw,
        \    |    /                     at depths z exp(eta), eta ~ N(0, depth_noise^2): a direction is
         a ------- b                    known to a pixel, a depth to some per cent
           S_b_a, scale 1.35            wrong matches exchange the points of b among themselves
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.estimation.similarity import PointMatches
from vslam_ref.geometry import sim3
from vslam_ref.geometry.cameras import Pinhole

CAMERA = Pinhole(500.0, 500.0, 320.0, 240.0)
SCALE = 1.35
"""How much longer the unit of a is."""


class KeyframePair(NamedTuple):
    """Matches of two keyframes, the true ``S_b_a (4, 4)``, and which matches are ``right (N,)``."""

    matches: PointMatches
    S_b_a: Array
    right: BoolArray


def make_keyframe_pair(
    rng: np.random.Generator,
    *,
    count: int = 200,
    wrong: float = 0.6,
    depth_noise: float = 0.03,
    sigma_px: float = 1.0,
) -> KeyframePair:
    """Make two keyframes of one place.

    Parameters
    ----------
    rng : numpy.random.Generator
    count : int
        Matches.
    wrong : float
        Share of wrong matches.
    depth_noise : float
        Standard deviation of the logarithm of a depth; no unit.
    sigma_px : float
        Standard deviation of a pixel's coordinate.

    Returns
    -------
    KeyframePair

    Examples
    --------
    >>> pair = make_keyframe_pair(np.random.default_rng(0), count=50, wrong=0.4)
    >>> len(pair.matches), int(pair.right.sum()), round(float(sim3.scale(pair.S_b_a)), 6)
    (50, 30, 1.35)
    """
    turn, shift = 0.15 * rng.standard_normal(3), 0.3 * rng.standard_normal(3)
    S = sim3.exp(np.concatenate([shift, turn, [np.log(SCALE)]]))
    X = rng.uniform([-2.2, -1.6, 4.0], [2.2, 1.6, 9.0], (count, 3))
    seen = [_seen(rng, points, depth_noise, sigma_px) for points in (X, sim3.act(S, X))]
    (X_a, uv_a), (X_b, uv_b) = seen
    first = round(wrong * count)
    order = np.concatenate([np.roll(np.arange(first), 1), np.arange(first, count)])
    sigma = np.array(max(sigma_px, 1e-3))
    matches = PointMatches(CAMERA, X_a, X_b[order], uv_a, uv_b[order], sigma, sigma)
    return KeyframePair(matches, S, order == np.arange(count))


def _seen(rng: np.random.Generator, X: Array, depth_noise: float, sigma_px: float) -> tuple[Array, Array]:
    """Points as a keyframe has them, and its pixels."""
    uv = CAMERA.project(X).uv + sigma_px * rng.standard_normal((len(X), 2))
    depth = X[:, 2] * np.exp(depth_noise * rng.standard_normal(len(X)))
    bearing = CAMERA.unproject(uv).bearing
    return bearing * (depth / bearing[:, 2])[:, None], uv
