"""A pose without a guess: three points, patches followed, keyframes that look alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Fov, Pinhole
from vslam_ref.systems.ptam.tracker import recover
from vslam_ref.systems.ptam.tracker.recover import Known

CAMERAS = [Pinhole(400.0, 410.0, 319.5, 239.5), Fov(390.0, 380.0, 319.5, 239.5, 0.9)]
T = se3.exp([0.3, -0.1, 0.4, 0.2, -0.3, 0.1])


def matches(camera: Pinhole | Fov, wrong: int, n: int = 80) -> tuple[Array, Known]:
    """Points and places with half a pixel of noise on their levels; the first ones wrong."""
    rng = np.random.default_rng(1)
    z = rng.uniform(2, 5, n)
    X_cam = np.column_stack([rng.uniform(-0.5, 0.5, n) * z, rng.uniform(-0.4, 0.4, n) * z, z])
    level = rng.integers(0, 3, n)
    uv = camera.project(X_cam).uv + 0.5 * 2.0 ** level[:, None] * rng.standard_normal((n, 2))
    uv[:wrong] = rng.uniform([0, 0], [639, 479], (wrong, 2))
    return se3.act(se3.inverse(T), X_cam), Known(np.arange(n), uv, level)


@pytest.mark.parametrize("camera", CAMERAS, ids=["pinhole", "fov"])
@pytest.mark.parametrize("wrong", [0, 24, 40])
def test_three_points_among_wrong_matches(camera: Pinhole | Fov, wrong: int) -> None:
    """Half wrong: a draw is right with 1/8, so none of 200 with 3e-12.

    Three points with a pixel of noise each, 1/400 radians: some hundredths, to be refined afterwards.
    """
    X, known = matches(camera, wrong)
    found = recover.by_three_points(camera, X, known, np.random.default_rng(2))
    assert found is not None
    assert np.abs(se3.log(se3.compose(found.T_cam_world, se3.inverse(T)))).max() < 0.05
    assert found.ok[wrong:].mean() > 0.8
    assert found.ok[:wrong].sum() <= 2  # 3 to 12 pixels of 640 x 480, by chance: one in a thousand


def test_no_agreement_gives_none() -> None:
    X, known = matches(CAMERAS[0], 80)
    assert recover.by_three_points(CAMERAS[0], X, known, np.random.default_rng(2)) is None
    few = Known(known.point[:7], known.uv[:7], known.level[:7])
    assert recover.by_three_points(CAMERAS[0], X[:7], few, np.random.default_rng(2)) is None


def test_the_generator_decides() -> None:
    X, known = matches(CAMERAS[0], 40)
    a, b = (recover.by_three_points(CAMERAS[0], X, known, np.random.default_rng(5)) for _ in range(2))
    assert a is not None
    assert b is not None
    np.testing.assert_array_equal(a.T_cam_world, b.T_cam_world)


def test_patches_are_followed_to_where_their_points_are(desk: Any) -> None:
    known = recover.known_in(desk.map, 0)
    went = recover.follow_known(desk.pictures[0], desk.pictures[9], known, 15.0)
    assert len(went.point) > 0.5 * len(known.point)
    truth = desk.map.camera.pixel_from_world(desk.pose(9), desk.map.X_world[went.point]).uv
    error = np.hypot(*(went.uv - truth).T) / 2.0**went.level
    assert np.median(error) < 0.3
    assert np.mean(error < 1.5) > 0.9


def test_the_picture_itself_is_most_alike(desk: Any) -> None:
    for kf in range(2):
        again = recover.picture_of(desk.map, kf)
        assert recover.most_alike(desk.map, again, 2)[0] == kf
        assert all((a == b).all() for a, b in zip(again.levels, desk.pictures[6 * kf].levels, strict=True))
    assert recover.most_alike(desk.map, desk.pictures[9], 2)[0] == 1  # nearer in time, and in view
