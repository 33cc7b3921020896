"""Undistortion maps and bilinear samples, against OpenCV and SciPy."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from vslam_ref.geometry.cameras import (
    Camera,
    Fisheye,
    Fov,
    Pinhole,
    pixel_grid,
    sample_bilinear,
    undistortion_map,
)

SIZE = (752, 480)


def test_maps_are_opencvs(opencv_camera: Camera) -> None:
    """OpenCV stores float32 maps: half a unit in the last place of the coordinate, and its own steps."""
    camera = opencv_camera
    new = Pinhole(400.0, 410.0, 375.0, 240.0)
    angle = 0.05
    R = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    found = undistortion_map(camera, new, SIZE, R)
    k = camera.params[4:] if len(camera.params) > 4 else np.zeros(4)
    make = cv2.fisheye.initUndistortRectifyMap if isinstance(camera, Fisheye) else cv2.initUndistortRectifyMap
    u, v = make(camera.matrix, k, R, new.matrix, SIZE, cv2.CV_32FC1)
    assert found.uv.shape == (480, 752, 2)
    assert found.valid.any()
    off = np.abs(found.uv - np.stack([u, v], -1)).max(axis=-1)
    # OpenCV follows the polynomial beyond the field, where it turns back; we flag
    assert (off[found.valid] < 2e-6 * (1 + np.abs(u) + np.abs(v))[found.valid]).all()


def test_a_map_between_equal_cameras_is_the_identity(camera: Camera) -> None:
    found = undistortion_map(camera, camera, (300, 200))
    assert np.abs(found.uv - pixel_grid((300, 200)))[found.valid].max() < 1e-9


def test_straight_lines_become_straight() -> None:
    """Draw a line's image through a FOV lens, undistort the picture, and find the line straight."""
    camera = Fov(fx=200.0, fy=200.0, cx=159.5, cy=119.5, omega=1.1)
    new = Pinhole(120.0, 120.0, 159.5, 119.5)
    rays = camera.unproject(pixel_grid((320, 240)))
    distance = rays.xn[..., 1] - 0.5 * rays.xn[..., 0] - 0.3  # of the ray from the line, in the plane z = 1
    picture = np.exp(-((distance / 0.03) ** 2))
    seen = undistortion_map(camera, new, (320, 240))
    straight = sample_bilinear(picture, seen.uv).values
    columns = np.arange(60, 260, 20)
    v = (straight[:, columns] * np.arange(240)[:, None]).sum(0) / straight[:, columns].sum(0)
    line = new.cy + new.fy * (0.5 * (columns - new.cx) / new.fx + 0.3)
    assert np.abs(v - line).max() < 0.05  # of a pixel: linear interpolation of a bump 4 px wide
    bent = (picture[:, columns] * np.arange(240)[:, None]).sum(0) / picture[:, columns].sum(0)
    assert np.abs(bent - np.polyval(np.polyfit(columns, bent, 1), columns)).max() > 1.0


@pytest.mark.parametrize("channels", [None, 3])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32, np.float64])
def test_samples_are_scipys(channels: int | None, dtype: type) -> None:
    """Two products and three sums of grey values below 255."""
    rng = np.random.default_rng(0)
    shape = (23, 31) if channels is None else (23, 31, channels)
    image = rng.uniform(0, 255, shape).astype(dtype)
    uv = rng.uniform(-3, 34, (40, 5, 2))
    uv[0, :, 0], uv[1, :, 1], uv[2] = 30.0, 22.0, 0.0  # the last column, the last row, the corner
    found = sample_bilinear(image, uv, fill=-7.0)
    planes = image[..., None] if channels is None else image
    for c in range(planes.shape[-1]):
        wanted = map_coordinates(planes[..., c].astype(float), [uv[..., 1], uv[..., 0]], order=1, cval=np.nan)
        inside = (uv >= 0).all(-1) & (uv[..., 0] <= 30) & (uv[..., 1] <= 22)
        assert np.array_equal(found.inside, inside)
        got = found.values if channels is None else found.values[..., c]
        assert np.abs(got - wanted)[inside].max() < 1e-12
        assert (got[~inside] == -7.0).all()


def test_samples_at_centres_are_the_pixels() -> None:
    image = np.arange(12).reshape(3, 4)
    assert np.array_equal(sample_bilinear(image, pixel_grid((4, 3))).values, image)
    assert sample_bilinear(np.array([[5]]), [0.0, 0.0]).values == 5.0
    assert not sample_bilinear(image, [np.nan, 0.0]).inside


def test_remap_of_opencv_agrees_to_its_table() -> None:
    """cv2.remap rounds positions to 1/32 px: half of that times the steepest slope, in each direction."""
    rng = np.random.default_rng(1)
    image = rng.uniform(0, 1, (60, 80)).astype(np.float32)
    uv = rng.uniform(1, 58, (40, 40, 2))
    by_opencv = cv2.remap(
        image, uv[..., 0].astype(np.float32), uv[..., 1].astype(np.float32), cv2.INTER_LINEAR
    )
    assert np.abs(sample_bilinear(image, uv).values - by_opencv).max() < 2 / 64 + 1e-5


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pixel_grid((0, 4)), "need .width, height."),
        (lambda: sample_bilinear(np.zeros(4), [0.0, 0.0]), "image has shape"),
        (lambda: sample_bilinear(np.zeros((0, 4)), [0.0, 0.0]), "not empty"),
        (lambda: sample_bilinear(np.zeros((4, 4)), [0.0, 0.0, 0.0]), "uv has shape"),
        (
            lambda: undistortion_map(Pinhole(1, 1, 0, 0), Pinhole(1, 1, 0, 0), (2, 2), np.eye(4)),
            "R_target_camera",
        ),
    ],
)
def test_bad_input_is_refused(call: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()  # type: ignore[operator]
