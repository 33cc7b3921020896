"""A walk round a building without pictures: points on its walls, exact features, a map that has drifted.

The map is what a system without loop closing would have: neighbours in time share points, a place that is
seen again has points of its own.  Poses come from steps that err in direction and scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vslam_ref.features.orb import OrbFeatures
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.alignment import align
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.systems.orbslam import spanning_tree
from vslam_ref.systems.orbslam.feature_map import DescribedPicture, FeatureMap

CAMERA = Pinhole(300.0, 300.0, 320.0, 240.0)
SHAPE = (480, 640)
SIDE, RADIUS, STEP = 9.0, 1.5, 0.7
LOOK = np.array([[0.0, 0, 1.0], [-1.0, 0, 0], [0, -1.0, 0]])


@dataclass
class Walk:
    """The map; true poses (K, 4, 4) and points; length of the map's unit at each keyframe (K,), over that of
    the first; and which true point each feature of a keyframe shows."""

    map: FeatureMap
    true: np.ndarray
    X: np.ndarray
    scale: np.ndarray
    shows: list[np.ndarray]

    def ate(self) -> float:
        """Of all keyframes, the culled ones where their parents take them, metres, scale aligned."""
        poses = spanning_tree.settled_poses(self.map)
        centres = (se3.inverse(T)[:, :3, 3] for T in (poses, self.true))
        return align(*centres, with_scale=True).rmse

    def revisits(self, kf: int) -> list[int]:
        """Earlier keyframes that see the same true points, the likeliest first: an oracle of recognition."""
        common = np.array([len(np.intersect1d(self.shows[kf], self.shows[k])) for k in range(kf)])
        near = self.map.covisible(kf)[:kf]
        common[near > 0] = 0
        order = np.argsort(-common, kind="stable")
        return order[common[order] >= 30][:2].tolist()


def walk_poses(laps: float) -> np.ndarray:
    """Poses T_kf_world round a square with round corners, looking ahead."""
    arc = RADIUS * np.pi / 2
    straight = SIDE - 2 * RADIUS
    s = np.arange(0.0, laps * 4 * (straight + arc), STEP)
    k, rest = np.divmod(s, straight + arc)
    along, angle = np.minimum(rest, straight), np.maximum(rest - straight, 0.0) / RADIUS
    x = RADIUS + along + RADIUS * np.sin(angle) - SIDE / 2
    y = RADIUS * (1 - np.cos(angle)) - SIDE / 2
    turn = k * np.pi / 2
    xy = np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y], -1)
    R = so3.exp((turn + angle)[:, None] * [0.0, 0, 1.0]) @ LOOK
    return se3.inverse(se3.from_rt(R, np.concatenate([xy, np.zeros((len(s), 1))], -1)))


def wall_points(rng: np.random.Generator, density: int) -> np.ndarray:
    """Points on the outer and the inner walls, 1.2 m beside the path."""
    found = []
    for half in (SIDE / 2 + 1.2, SIDE / 2 - 1.2):
        n = int(8 * half * density)
        along, k = rng.uniform(-half, half, n), rng.integers(4, size=n)
        depth = half + rng.uniform(-0.2, 0.2, n)
        turn = k * np.pi / 2
        found.append(
            np.stack(
                [
                    np.cos(turn) * along + np.sin(turn) * depth,
                    np.sin(turn) * along - np.cos(turn) * depth,
                    rng.uniform(-1.2, 1.2, n),
                ],
                -1,
            )
        )
    return np.concatenate(found)


def draw_walk(
    seed: int = 0,
    *,
    laps: float = 1.15,
    density: int = 11,
    drift: float = 1.25,
    look_alike: bool = False,
    twin: bool = False,
) -> Walk:
    """Walk, and map.  ``look_alike``: the third side has descriptors of the first one, elsewhere on it.

    ``twin``: at the same places on it, so that both sides look alike in every point.
    """
    rng = np.random.default_rng(seed)
    true, X = walk_poses(laps), wall_points(rng, density)
    word = rng.integers(0, 256, (len(X), 32), dtype=np.uint8)
    if look_alike or twin:
        first, third = (np.flatnonzero(sign * X[:, 1] > SIDE / 2 - 1.5) for sign in (-1.0, 1.0))
        count = min(len(first), len(third))
        first, third = first[np.argsort(X[first, 0])[:count]], third[np.argsort(-X[third, 0])[:count]]
        word[third] = word[first]  # at about the same place along the wall, at any height and depth
        if twin:
            X[third] = X[first] * [-1.0, -1.0, 1.0]
    made, shows, scale = FeatureMap(CAMERA, SHAPE, 8, 1.2), [], drift ** (np.arange(len(true)) / len(true))
    T = [true[0]]
    for k in range(1, len(true)):
        step = true[k] @ np.linalg.inv(true[k - 1])
        step[:3, 3] *= scale[k]
        T.append(se3.exp([0, 0, 0, *(6e-4 * rng.standard_normal(3))]) @ step @ T[-1])
    number, last = np.full(len(X), -1), np.full(len(X), -99)
    for k, pose in enumerate(T):
        seen = _seen(true[k], X)
        bits = np.packbits(rng.random((len(seen), 256)) < 0.03, axis=1)
        features = OrbFeatures(
            CAMERA.pixel_from_world(true[k], X[seen]).uv,
            _level(true[k], X[seen]),
            np.zeros(len(seen)),
            np.ones(len(seen)),
            word[seen] ^ bits,
        )
        made.add_keyframe(pose, DescribedPicture(k, features, np.zeros(len(seen), np.uint8)))
        new = k - last[seen] > 12  # seen long ago, or never: a point of its own
        number[seen[new]] = made.add_points(np.zeros((int(new.sum()), 3)), k)
        last[seen] = k
        # where this keyframe has them, in its own unit: the mean of all that see a point is its place
        made.X_world[number[seen]] += se3.act(np.linalg.inv(pose), scale[k] * se3.act(true[k], X[seen]))
        made.see(k, np.arange(len(seen)), number[seen])
        spanning_tree.link(made, k)
        shows.append(seen)
    made.X_world[:] /= np.maximum(made.times_seen(), 1)[:, None]
    once = np.flatnonzero(made.times_seen() < 2)
    made.remove_points(once)
    made.refresh(np.flatnonzero(made.alive))
    return Walk(made, true, X, scale, shows)


def _seen(T: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Points in the picture, up to 6 m away ahead."""
    X_cam = se3.act(T, X)
    at = CAMERA.project(X_cam)
    inside = at.valid & (at.uv > 0).all(1) & (at.uv < (639, 479)).all(1)
    near = (X_cam[:, 2] > 0.5) & (np.linalg.norm(X_cam, axis=1) < 6.0)
    return np.flatnonzero(inside & near)


def _level(T: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Octave on which a point of a certain size shows: nearer, larger."""
    distance = np.linalg.norm(se3.act(T, X), axis=1)
    return np.clip(np.rint(np.log(6.0 / distance) / np.log(1.2)), 0, 7).astype(np.int64)
