"""Distances from the curve of a ray, with and without a lens, and what a search on it can be fooled by."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from vslam_ref.arrays import Array
from vslam_ref.features import Corners, detect
from vslam_ref.features.corners import in_rows
from vslam_ref.features.templates import cut
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole
from vslam_ref.systems.ptam.mapper import book, curve_search, new_points
from vslam_ref.systems.ptam.settings import Settings

PINHOLE, LENS = Pinhole(200.0, 190.0, 159.5, 119.5), Fov(180.0, 170.0, 159.5, 119.5, 0.9)
T_B_A = se3.exp([-0.3, 0.05, 0.1, 0.05, -0.1, 0.08])


def curve(camera: Camera, bearing: Array, T_b_a: Array = T_B_A) -> Array:
    """Densely sampled pixels (n, 2) of a ray's points from near to very far, as b sees them."""
    depth = 1.0 / np.linspace(1e-6, 3.0, 20_000)
    return np.asarray(camera.project(se3.act(T_b_a, depth[:, None] * bearing)).uv)


@pytest.mark.parametrize("camera", [PINHOLE, LENS])
def test_the_distance_is_that_from_the_sampled_curve(camera: Camera) -> None:
    """A line: exact.  A lens bends it by at most some 1/150 px: d^2 / 300 of the distance d is missed.

    For a pinhole e is the line's equation times 1/|x_n|, whose own slope adds a share of d/|x_n f|; twice
    the bound of the bend covers both.  Neighbouring samples lie 0.01 px apart.
    """
    rng = np.random.default_rng(0)
    for _ in range(30):
        a = camera.unproject(rng.uniform([40, 30], [280, 210])).bearing
        there = curve(camera, a)
        k = rng.integers(4_000, 16_000)
        along = there[k + 1] - there[k - 1]
        normal = np.array([-along[1], along[0]]) / np.hypot(*along)
        for offset in (-2.0, 0.5, 1.5):
            u = there[k] + offset * normal
            true = np.hypot(*(there - u).T).min()
            assert abs(book.curve_distance(camera, a, u, T_B_A) - true) < 2 * offset**2 / 150 + 0.003


def test_a_straight_line_through_the_lens_is_missed() -> None:
    """The chord between the ends of a curve leaves it by pixels: the lens cannot be forgotten."""
    a = LENS.unproject([100.0, 30.0]).bearing
    there = curve(LENS, a, se3.exp([-0.5, 0, 0, 0, 0, 0]))
    there = there[(there >= 0).all(1) & (there < [320, 240]).all(1)]
    middle = (there[0] + there[-1]) / 2
    assert np.hypot(*(there - middle).T).min() > 2.0


@pytest.mark.parametrize("r", [0.5, 3.0, 40.0])
def test_depths_of_two_rays_that_meet(r: float) -> None:
    """The point's distances from both centres; rounding grows with one over the parallax squared."""
    rng = np.random.default_rng(1)
    a = rng.normal(size=(20, 3)) * [0.3, 0.3, 0] + [0, 0, 1]
    X_a = r * a / np.linalg.norm(a, axis=1)[:, None]
    X_b = se3.act(T_B_A, X_a)
    distance = np.linalg.norm(X_b, axis=1)
    found = curve_search.ray_depths(X_a / r, X_b / distance[:, None], T_B_A)
    parallax = 0.05 / r  # at least, with a base line of 0.32 that nobody looks along
    np.testing.assert_allclose(found, np.stack([np.full(20, r), distance], 1), rtol=1e-13 / parallax**2)


def test_rays_that_pass_each_other() -> None:
    """Along z and along x, 0.2 apart in y: nearest at distance 1 of the one and 2 of the other."""
    T_b_a = se3.from_rt(np.eye(3), np.array([2.0, 0.2, -1.0]))
    found = curve_search.ray_depths(np.array([[0.0, 0, 1]]), np.array([[1.0, 0, 0]]), T_b_a)
    np.testing.assert_allclose(found, [[1.0, 2.0]], atol=1e-15)


def picture(spots: dict[tuple[int, int], int]) -> Any:
    """Pictures with one pattern at several places, with a grey level of its own, on a quiet ground."""
    rng = np.random.default_rng(2)
    image = np.full((100, 160), 100, np.uint8)
    for (x, y), grey in spots.items():
        spot = np.full((8, 8), 130, np.uint8)
        spot[4:, 4:], spot[1:4, 1:4] = grey, 60
        image[y - 4 : y + 4, x - 4 : x + 4] = spot
    return np.clip(image + rng.normal(0, 0.6, image.shape), 0, 255).round().astype(np.uint8)


def side(image: Any, places: list[tuple[int, int]], camera: Camera, T: Array) -> new_points.Side:
    xy = np.array(sorted(places, key=lambda p: (p[1], p[0])))
    every = detect(image, 10)
    corners = Corners(xy, in_rows(xy, image.shape)) if len(every.xy) == 0 else every
    return new_points.Side(0, 0, image, corners, curve_search.with_bearings(camera, xy, 0), T)


@pytest.mark.parametrize("search_back", [True, False])
def test_a_look_alike_on_the_line_is_refused_by_the_way_back(search_back: bool, settings: Settings) -> None:
    """Repeated texture: a spot that b does not show finds its twin, on its line, at a possible depth.

    Points move to the right along their rows.  The twin moved by 5 px; the match of the hidden spot says
    55 px and fits both views to the pixel.
    Searched back, the twin finds itself, which is a little more alike.
    """
    camera = Pinhole(200.0, 200.0, 79.5, 49.5)
    T_b_a = se3.from_rt(np.eye(3), np.array([0.5, 0.0, 0.0]))
    in_a, in_b = {(60, 50): 205, (110, 50): 220}, {(115, 50): 220}
    a = side(picture(in_a), list(in_a), camera, se3.identity())
    b = side(picture(in_b), list(in_b), camera, T_b_a)
    s = replace(settings.mapper, search_back=search_back)
    xy = np.array([[60, 50]])
    assert cut(a.image, xy).inside.all()
    found = new_points.match(camera, xy, a, b, 0.1, s, settings.features)
    assert len(found.row) == (0 if search_back else 1)
    if not search_back:
        assert np.hypot(*(found.uv_b[0] - [115, 50])) < 0.3
        error = camera.unproject(found.uv_b[0]).bearing @ curve_search.essential(T_b_a) @ a.peaks.bearing[0]
        assert abs(error) < 2e-3  # a wrong point that fits its two views


def test_nothing_to_search() -> None:
    none = curve_search.with_bearings(PINHOLE, np.zeros((0, 2), int), 0)
    one = curve_search.with_bearings(PINHOLE, np.array([[50, 50]]), 0)
    image, gates = np.zeros((100, 100), np.uint8), curve_search.Gates(0, 0.1, 2.0, 0.5)
    patch = cut(image, one.xy).patch
    assert curve_search.search_curve(patch, one, image, none, T_B_A, gates).corner.tolist() == [-1]
    assert curve_search.search_curve(patch[:0], none, image, one, T_B_A, gates).corner.tolist() == []
