"""Cameras as drawn stand where they are, and their corners are the corners of the picture."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry import camera_pose, se3
from vslam_ref.geometry.cameras import Fov, Pinhole
from vslam_ref.geometry.multiview import Views
from vslam_ref.plot.multiview import SIZE, frustum, scene_figure

T = se3.exp([0.3, -0.2, 1.0, 0.5, -0.4, 1.2])


@pytest.mark.parametrize(
    "camera",
    [Pinhole(500.0, 520.0, 300.0, 250.0), Fov(400.0, 400.0, 320.0, 240.0, 0.8)],
    ids=["pinhole", "fov"],
)
def test_a_pyramid_is_the_cameras(camera: Pinhole | Fov) -> None:
    pyramid = frustum(camera, T, 0.1)
    np.testing.assert_allclose(pyramid[0], camera_pose.centre_from_pose(T), atol=1e-14)
    seen = camera.pixel_from_world(T, pyramid[1:])
    assert seen.valid.all()
    w, h = SIZE
    corners = np.array([[0, 0], [w, 0], [w, h], [0, h]]) - 0.5
    np.testing.assert_allclose(seen.uv, corners, atol=1e-9)
    np.testing.assert_allclose(se3.act(T, pyramid[1:])[:, 2], 0.1, atol=1e-14)


def test_the_figure_shows_every_picture_of_the_point_up_to_three() -> None:
    views = Views(Pinhole(500.0, 500.0, 320.0, 240.0), [se3.exp([-0.2 * k, 0, 0, 0, 0, 0]) for k in range(5)])
    X = np.array([[0.1, 0.2, 4.0], [0.3, 0.0, 5.0]])
    uv = views.project(X).uv
    for mask, pictures in (([True] * 5, 3), ([True, False, False, True, False], 2)):
        figure = scene_figure(
            views,
            [f"p{k}" for k in range(5)],
            X,
            X[0],
            uv[0],
            np.array(mask),
            [uv[:, k] for k in range(5)],
            real=True,
        )
        titles = [axes.get_title() for axes in figure.axes]
        assert len(titles) == 1 + pictures
        assert titles[1] == "p0: error 0.00 px"
        assert "plaster temple" in titles[0]
