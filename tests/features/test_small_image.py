"""The turn of a camera from small blurred images: pictures drawn through K R K^-1."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.features.small_images import SmallImage, plane_motion, rotation, small_image
from vslam_ref.geometry import se2, so3
from vslam_ref.geometry.cameras import Pinhole
from vslam_ref.worlds.pictures import painted_wall, picture

CAMERA = Pinhole(500.0, 500.0, 319.5, 239.5)


def turned(seed: int, phi: list[float]) -> tuple[SmallImage, SmallImage]:
    """Two small images of a wall so large that a turned camera does not see its end."""
    wall = painted_wall(np.random.default_rng(seed), 500)
    K = CAMERA.matrix
    H = K @ so3.exp(phi) @ np.linalg.inv(K)
    return small_image(picture(wall, blur=3.0)), small_image(picture(wall, H, blur=3.0))


@pytest.mark.parametrize(
    "phi", [[0.0, 0.03, 0.0], [0.03, 0.0, 0.0], [0.0, 0.0, 0.06], [-0.02, 0.025, -0.04], [0.0, -0.05, 0.02]]
)
def test_a_turn_is_found_to_a_fraction_of_a_small_pixel(phi: list[float]) -> None:
    """A small pixel is 16 / 500 = 0.032 radians: within a tenth of it, and the sign of each axis."""
    a, b = turned(3, phi)
    found = plane_motion(a, b)
    assert found.reason == ""
    R = rotation(CAMERA, a.value.shape, a.level, found.T_b_a)
    assert np.linalg.norm(so3.log(R @ so3.exp(phi).T)) < 0.1 * 16 / 500
    back = plane_motion(b, a)
    assert np.abs(found.T_b_a @ back.T_b_a - np.eye(3)).max() < 0.2


def test_brightness_does_not_count() -> None:
    a, b = turned(4, [0.01, 0.02, 0.03])
    brighter = SmallImage(b.value + 30.0, b.level)
    assert np.allclose(plane_motion(a, b).T_b_a, plane_motion(a, brighter).T_b_a, atol=1e-9)


def test_a_motion_of_the_plane_is_found() -> None:
    """Waves of two pixels' slope, drawn at moved places: what remains is the linear interpolation."""
    rng = np.random.default_rng(0)
    k, phase = rng.normal(0, 0.25, (8, 2)), rng.uniform(0, 6, 8)
    y, x = np.mgrid[0:30, 0:40] - np.array([14.5, 19.5])[:, None, None]
    at = np.stack([x, y], -1)
    T = se2.matrix(se2.exp([1.5, -0.8, 0.07]))
    back = (at - T[:2, 2]) @ T[:2, :2]
    a, b = (SmallImage(20 * np.sin(p @ k.T + phase).sum(-1), 4) for p in (at, back))
    found = plane_motion(a, b)
    assert np.abs(found.T_b_a - T).max() < 0.02
    assert found.rms < 0.5


def test_size_level_and_what_is_refused() -> None:
    assert [small_image(np.zeros(s, np.uint8)).value.shape for s in ((480, 640), (370, 1226), (20, 500))] == [
        (30, 40),
        (23, 76),
        (20, 500),
    ]
    assert small_image(np.zeros((60, 80), np.uint8), 3).level == 4
    with pytest.raises(ValueError, match="at least 20 x 20"):
        small_image(np.zeros((19, 500), np.uint8))
    flat = small_image(np.full((480, 640), 9, np.uint8))
    assert plane_motion(flat, flat).reason == "the image is flat"
    with pytest.raises(ValueError, match="need the same"):
        plane_motion(flat, SmallImage(flat.value, 3))
