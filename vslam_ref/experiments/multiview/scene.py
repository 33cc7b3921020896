"""What is looked at: the Middlebury temple, or a simulated pillar with the same kind of cameras."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array, BoolArray
from vslam_ref.datasets import catalogue, matching, middlebury
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.geometry import camera_pose
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.geometry.multiview import Views

Pair = tuple[int, int]

JUDGED_PAIRS: tuple[Pair, ...] = ((0, 1), (5, 6))
"""Pictures 1-2 and 6-7, of which distances to epipolar lines are on record."""


@dataclass(frozen=True)
class MultiviewConfig:
    """Matching, triangulation and the perturbed starts."""

    seed: int = field(default=11, metadata={"reason": "any; fixed for repeatability"})
    ratio: float = field(default=0.75, metadata={"reason": "usual for SIFT; leaves some 3 % wrong matches"})
    pair_angle: float = field(
        default=50.0, metadata={"reason": "SIFT does not survive wider turns", "unit": "degrees"}
    )
    gate_px: float = field(
        default=2.0, metadata={"reason": "Sampson distance; some ten times the noise", "unit": "px"}
    )
    shift_known_px: float = field(
        default=0.2,
        metadata={
            "reason": "standard deviation up to which the principal point's offset counts as measured",
            "unit": "px",
        },
    )
    least_points: int = field(
        default=12, metadata={"reason": "twice what a linear pose needs; fewer are not judged"}
    )
    wrong: float = field(
        default=0.2, metadata={"reason": "share of pixels exchanged on purpose before a resection"}
    )
    start_turn: float = field(
        default=3.0, metadata={"reason": "of the perturbed start: some 80 px", "unit": "degrees"}
    )
    start_shift: float = field(
        default=0.03, metadata={"reason": "of the perturbed start: 5 % of the distance", "unit": "m"}
    )
    every: int = field(default=1, metadata={"reason": "resect every k-th picture; all of them"})

    def __post_init__(self) -> None:
        """Refuse settings that mean nothing."""
        if not (0 < self.ratio <= 1 and 0 < self.pair_angle < 180 and self.gate_px > 0):
            raise ValueError("need 0 < ratio <= 1, 0 < pair_angle < 180 and gate_px > 0")
        if self.least_points < 6 or self.every < 1:
            raise ValueError(f"least_points={self.least_points}, every={self.every}: need at least 6 and 1")
        if not (0 <= self.wrong < 0.5 and self.start_turn >= 0 and self.start_shift >= 0):
            raise ValueError("need 0 <= wrong < 0.5 and a start_turn and start_shift that are not negative")


class World(NamedTuple):
    """Pictures, their cameras, and points seen in them.

    Attributes
    ----------
    names : tuple of str
    views : Views
    uv, mask : ndarray, shapes (N, V, 2) and (N, V)
        Tracks: pixels of N points, and where they are seen.
    pairs : mapping of (i, j) to (uv_i, uv_j)
        Pixels of matches of two pictures, before they are joined.
    real : bool
        Pictures of a data set, or a simulation.
    """

    names: tuple[str, ...]
    views: Views
    uv: Array
    mask: BoolArray
    pairs: Mapping[Pair, tuple[Array, Array]]
    real: bool


def moved(world: World, shift_px: Array) -> World:
    """The world with its pixels moved by (du, dv): as if all principal points were moved back by that."""
    pairs = {key: (a + shift_px, b + shift_px) for key, (a, b) in world.pairs.items()}
    return world._replace(uv=world.uv + shift_px, pairs=pairs)


def load_world(config: MultiviewConfig) -> World:
    """Read the temple where the data set is found, else simulate."""
    folder = catalogue.find("middlebury_temple")
    if folder is None:
        return simulated(config, np.random.default_rng(config.seed))
    found = middlebury.read_cameras(folder / "templeSR_par.txt")
    features = [matching.detect(read_grey(picture)) for picture in found.pictures]
    views = Views(found.cameras[0] if len(set(found.cameras)) == 1 else found.cameras, found.T_cam_world)
    pairs = {
        (i, j): matching.match(features[i], features[j], config.ratio)
        for i, j in near_pairs(views, config.pair_angle)
    }
    tracks = matching.tracks(features, pairs)
    pixels = {(i, j): (features[i].uv[m[:, 0]], features[j].uv[m[:, 1]]) for (i, j), m in pairs.items()}
    names = tuple(picture.stem for picture in found.pictures)
    return World(names, views, tracks.uv, tracks.mask, pixels, True)


def near_pairs(views: Views, degrees: float) -> list[Pair]:
    """Pairs of views whose optical axes differ by less."""
    axes = views.T_cam_world[:, 2, :3]
    limit = np.cos(np.radians(degrees))
    return [(i, j) for i, j in combinations(range(len(views)), 2) if axes[i] @ axes[j] > limit]


def simulated(
    config: MultiviewConfig, rng: np.random.Generator, *, noise_px: float = 0.2, wrong: float = 0.03
) -> World:
    """A pillar of 5 cm radius, 16 cameras on a ring of 60 cm around it, some wrong matches."""
    camera, count, n = Pinhole(1520.4, 1525.9, 302.32, 246.87), 16, 500
    angle = 2 * np.pi * np.arange(count) / count
    p = np.stack([0.6 * np.sin(angle), 0.08 + 0.03 * np.cos(3 * angle), 0.6 * np.cos(angle)], 1)
    views = Views(camera, camera_pose.pose_from_centre(_look_at(p, np.array([0.0, 0.08, 0.0])), p))
    around = rng.uniform(0, 2 * np.pi, n)
    normal = np.stack([np.sin(around), 0 * around, np.cos(around)], 1)
    X = 0.05 * normal * rng.uniform(0.6, 1.0, (n, 1)) + np.stack(
        [0 * around, rng.uniform(0.02, 0.16, n), 0 * around], 1
    )
    seen = views.project(X)
    toward = p - X[:, None]
    facing = np.einsum("nvi,ni->nv", toward, normal) / np.linalg.norm(toward, axis=-1)
    mask = seen.valid & (facing > 0.8) & (rng.random((n, count)) < 0.8)
    uv = seen.uv + rng.normal(0, noise_px, seen.uv.shape)
    off = rng.random((n, count)) < wrong
    uv = np.where(off[..., None], rng.uniform(0, [640, 480], uv.shape), uv)
    keep = mask.sum(axis=1) >= 2
    uv, mask = np.where(mask[..., None], uv, 0.0)[keep], mask[keep]
    pairs = {}
    for i, j in near_pairs(views, config.pair_angle):
        both = mask[:, i] & mask[:, j]
        pairs[i, j] = (uv[both, i], uv[both, j])
    return World(tuple(f"view {i + 1}" for i in range(count)), views, uv, mask, pairs, False)


def _look_at(centres: Array, target: Array) -> Array:
    """Rotations (V, 3, 3) of cameras that look at a point, the world's y upwards in the picture."""
    z = target - centres
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(np.array([0.0, -1.0, 0.0]), z)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], 1)
