"""The shapes that the book draws are the ones that it talks about."""

from __future__ import annotations

import numpy as np
import pytest

plane = pytest.importorskip("vslam_ref.plot.plane", reason="matplotlib draws the figures")


@pytest.mark.parametrize("sigmas", [1.0, 2.0])
def test_every_point_of_an_ellipse_has_the_same_normalised_distance(sigmas: float) -> None:
    mean, cov = np.array([3.0, -1.0]), np.array([[4.0, 1.5], [1.5, 1.0]])
    e = plane.ellipse_points(mean, cov, sigmas) - mean
    # eigh is exact to eps ||P||, P^-1 amplifies by the condition number, here 8
    assert np.allclose(np.einsum("ni,ij,nj->n", e, np.linalg.inv(cov), e), sigmas**2, rtol=1e-13)


def test_the_ellipse_of_a_singular_covariance_is_a_line() -> None:
    points = plane.ellipse_points([0.0, 0.0], [[9.0, 0.0], [0.0, 0.0]], 1.0, points=360)
    # an eigenvalue that should be 0 may be eps ||P||; its root is what the line may be wide
    assert np.ptp(points[:, 1]) <= 2 * np.sqrt(9 * np.finfo(float).eps)
    assert np.ptp(points[:, 0]) == pytest.approx(6.0)


def test_a_vehicle_looks_where_it_heads() -> None:
    style = pytest.importorskip("vslam_ref.plot.style")
    _, (axes,) = style.new_figure(3.0)
    plane.draw_vehicle(axes, [2.0, 1.0, np.pi / 2], size=1.0)
    corners = axes.patches[0].get_xy()
    assert np.allclose(corners[0], [2.0, 2.0])  # the tip lies one unit ahead: up
    assert np.allclose(corners[1], [1.5, 0.5])  # the left rear corner lies at the left
