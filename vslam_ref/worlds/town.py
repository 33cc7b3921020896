r"""A drive through a town, mapped by one camera whose scale drifts: keyframes, common points, loops.

::

     +--+--+--+       streets of a square grid; at each corner left, right or straight on, by chance
     |  |  |  |       a keyframe every few metres; T_kf_world true, and as mapped: every step errs in
     +--+--+--+       rotation, direction and scale, and the errors add up
     |  |  |  |       shared: common points of neighbours in time, fewer with distance and turn
     +--+--+--+       loops: a street driven again in the same direction, recognised

The size is that of a well-known drive, KITTI 00: 3.7 km, 1136 keyframes, 40 loops.  Places are recognised in
the map as it was mapped, so that common points join neighbours in time only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se3, sim3, so3


@dataclass(frozen=True)
class TownConfig:
    """Streets, keyframes and noises.

    Parameters
    ----------
    keyframes : int
    step_m, block_m : float
        Metres between keyframes, and between corners.
    corners : int
        Of the grid, each way.
    loops : int
        At most.
    turn, sideways, log_scale : float
        Standard deviations of a step's rotation (radians about the vertical; a fifth of it about the other
        axes), of its direction (metres per metre), and of its log-scale.
    loop_m, loop_rad, loop_log : float
        Standard deviations of a loop's measurement: translation (metres), rotation (radians), log-scale.
    points, reach_m : float
        Common points of a keyframe with itself, and metres after which they have become fewer by e.
    """

    keyframes: int = 1136
    step_m: float = 3.3
    block_m: float = 90.0
    corners: int = 5
    loops: int = 40
    turn: float = 2e-3
    sideways: float = 0.01
    log_scale: float = 4e-3
    loop_m: float = 0.1
    loop_rad: float = 3e-3
    loop_log: float = 0.01
    points: float = 300.0
    reach_m: float = 12.0

    def __post_init__(self) -> None:
        """Refuse towns that mean nothing."""
        if self.keyframes < 10 or self.corners < 2 or self.loops < 0:
            raise ValueError("need keyframes >= 10, corners >= 2 and loops >= 0")
        if not (0 < self.step_m < self.block_m / 4 and self.reach_m > 0 and self.points > 0):
            raise ValueError("need 0 < step_m < block_m / 4, and reach_m and points above 0")


class TownMap(NamedTuple):
    """The map of a drive.

    Attributes
    ----------
    true, T_kf_world : ndarray, shape (K, 4, 4)
        In truth (metres), and as mapped.
    shared : ndarray of int, shape (K, K)
        Common points, counts.
    parent : ndarray of int, shape (K,)
        The earlier keyframe with most common points; -1 for the first.
    loops : ndarray of int, shape (L, 2)
        An earlier keyframe and the later one that recognised it.
    S_loop : ndarray, shape (L, 4, 4)
        From the later one's frame and unit to those of the earlier one, as measured.
    """

    true: Array
    T_kf_world: Array
    shared: NDArray[np.int64]
    parent: IntArray
    loops: IntArray
    S_loop: Array


def make_town(rng: np.random.Generator, config: TownConfig | None = None) -> TownMap:
    """Drive through a town and map it.

    Parameters
    ----------
    rng : numpy.random.Generator
    config : TownConfig, optional

    Returns
    -------
    TownMap

    Examples
    --------
    >>> town = make_town(np.random.default_rng(0), TownConfig(keyframes=150, corners=2, loops=5))
    >>> town.shared.shape, len(town.loops)
    ((150, 150), 5)
    """
    c = config or TownConfig()
    poses, heading = drive(rng, c)
    mapped, scale = _mapped(rng, poses, c)
    apart = np.linalg.norm(poses[:, None, :3, 3] - poses[None, :, :3, 3], axis=-1)
    alike = np.maximum(np.cos(heading[:, None] - heading), 0.0)
    lag = np.abs(np.arange(c.keyframes)[:, None] - np.arange(c.keyframes))
    expected = np.where(
        lag * c.step_m < 10 * c.reach_m, c.points * np.exp(-apart / c.reach_m) * alike**2, 0.0
    )
    shared = np.triu(rng.poisson(expected), 1)
    shared[np.arange(c.keyframes - 1), np.arange(1, c.keyframes)] += 1  # the tracker was never lost
    shared = shared + shared.T
    parent = np.array([-1, *(int(np.argmax(shared[k, :k])) for k in range(1, c.keyframes))])
    loops = _loops(apart, alike, lag, c)
    i, j = loops.T
    exact = sim3.between(poses[i], poses[j])
    exact[:, :3, :3] *= (scale[i] / scale[j])[:, None, None]
    exact[:, :3, 3] *= scale[i, None]  # in the unit that the map has at i
    sigma = np.repeat([c.loop_m, c.loop_rad, c.loop_log], [3, 3, 1])
    S_loop = sim3.compose(exact, sim3.exp(sigma * rng.standard_normal((len(loops), 7))))
    return TownMap(se3.inverse(poses), se3.inverse(mapped), shared, parent, loops, S_loop)


def drive(rng: np.random.Generator, c: TownConfig) -> tuple[Array, Array]:
    """Poses T_world_kf (K, 4, 4) along the streets in metres, z ahead and y down; headings (K,), radians."""
    fine = c.step_m / 8
    length = c.step_m * (c.keyframes + 10)
    corner, way = np.array([0, 0]), np.array([1, 0])
    line = [np.zeros(2)]
    while (len(line) - 1) * c.block_m < length:
        corner = corner + way
        line.append(c.block_m * corner)
        turns = [way, np.array([-way[1], way[0]]), np.array([way[1], -way[0]])]
        inside = [w for w in turns if ((corner + w >= 0) & (corner + w < c.corners)).all()]
        way = inside[int(rng.integers(len(inside)))]
    at = np.arange(0.0, length, fine)
    corners = np.array(line)
    along = c.block_m * np.arange(len(corners))
    xy = np.stack([np.interp(at, along, corners[:, k]) for k in range(2)], -1)
    box = np.ones(24) / 24  # three keyframes long: corners are cut
    xy = np.stack([np.convolve(xy[:, k], box, "valid") for k in range(2)], -1)
    ahead = np.gradient(xy, axis=0)
    rows = 8 * np.arange(c.keyframes)
    heading = np.unwrap(np.arctan2(ahead[rows, 1], ahead[rows, 0]))
    look = np.array([[0.0, 0, 1.0], [-1.0, 0, 0], [0, -1.0, 0]])  # x to the right, y down, z ahead
    R = so3.exp(heading[:, None] * [0.0, 0, 1.0]) @ look
    return se3.from_rt(R, np.concatenate([xy[rows], np.zeros((c.keyframes, 1))], -1)), heading


def _mapped(rng: np.random.Generator, poses: Array, c: TownConfig) -> tuple[Array, Array]:
    """Poses (K, 4, 4) as mapped, and the length (K,) of the map's unit at each, over that of the first."""
    n = len(poses) - 1
    scale = np.exp(np.append(0.0, np.cumsum(c.log_scale * rng.standard_normal(n))))
    turn = c.turn * rng.standard_normal((n, 3)) * [0.2, 1.0, 0.2]
    step = se3.between(poses[:-1], poses[1:])
    length = np.linalg.norm(step[:, :3, 3], axis=1, keepdims=True)
    step[:, :3, 3] += c.sideways * length * rng.standard_normal((n, 3)) * [1.0, 0.2, 0.0]
    step[:, :3, 3] *= scale[:-1, None]
    step = step @ se3.exp(np.concatenate([np.zeros((n, 3)), turn], -1))
    found = [poses[0]]
    for one in step:
        found.append(found[-1] @ one)
    return np.array(found), scale


def _loops(apart: Array, alike: Array, lag: IntArray, c: TownConfig) -> IntArray:
    """Pairs (earlier, later) at one place with one heading, spread evenly over the drive, (L, 2)."""
    near = np.where((lag * c.step_m > 2 * c.block_m) & (alike > 0.9), apart, np.inf)
    near[np.triu_indices(len(near))] = np.inf  # [later, earlier]
    later = np.flatnonzero(near.min(1) < 1.5 * c.step_m)
    chosen = later[np.unique(np.linspace(0, len(later) - 1, min(c.loops, len(later))).astype(int))]
    return np.column_stack([near[chosen].argmin(1), chosen]).astype(np.int64)
