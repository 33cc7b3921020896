"""Comparing patches: OpenCV's matchTemplate at all places, and the best corner by trying all of them."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features.corners import Corners, detect, in_rows
from vslam_ref.features.patch_search import search, variation, zmssd, zncc
from vslam_ref.features.refinement import refine
from vslam_ref.features.templates import cut

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def everywhere(image: Bytes) -> Corners:
    """All pixels with a whole patch, as if they were corners."""
    height, width = image.shape
    y, x = np.mgrid[4 : height - 3, 4 : width - 3]
    return in_rows(np.stack([x.ravel(), y.ravel()], 1), image.shape)


@pytest.mark.parametrize("measure", ["zmssd", "zncc"])
def test_costs_at_all_places_are_opencvs(measure: str, wall: Bytes) -> None:
    """matchTemplate gives sum (T - mean)(I - mean), and its quotient by both norms, in single precision.

    Sums of 64 products up to 255^2 through a Fourier transform: measured noise is below 1e-6 of 64 * 255^2.
    """
    image = wall[40:100, 50:130]
    places = everywhere(image)
    template = cut(wall, [[90, 70]]).patch[0]
    shape = (image.shape[0] - 7, image.shape[1] - 7)
    many = np.broadcast_to(template, (len(places.xy), 8, 8))
    found = search(image, places, many, places.xy, 0.0, measure=measure, limit=np.inf)
    np.testing.assert_array_equal(found.corner, np.arange(len(places.xy)))
    ours = found.cost.reshape(shape)
    if measure == "zncc":
        theirs = 1 - cv2.matchTemplate(image, template, cv2.TM_CCOEFF_NORMED)
        tolerance = 1e-4
    else:
        patches = np.lib.stride_tricks.sliding_window_view(image, (8, 8))
        both = variation(template) + variation(patches)
        theirs = both - 2 * cv2.matchTemplate(image, template, cv2.TM_CCOEFF)
        tolerance = 4e-6 * 64 * 255**2
    assert np.abs(ours - theirs).max() < tolerance
    assert np.unravel_index(ours.argmin(), shape) == (26, 36)  # where it was cut out: (90, 70) - (50, 40) - 4


@pytest.mark.parametrize("measure", ["zmssd", "zncc"])
@pytest.mark.parametrize("radius", [0.0, 2.5, 5.0, 9.7])
def test_the_best_corner_by_trying_all(measure: str, radius: float, wall: Bytes) -> None:
    """Every corner, its distance and its cost from the definition; whole radii at whole places touch corners.

    All sums are integers and exact; the definition's own rounding is some 200 eps of its largest sum.
    """
    rng = np.random.default_rng(int(10 * radius))
    corners = detect(wall, 10)
    uv = np.concatenate([rng.uniform(-5, 325, (40, 2)), rng.integers(0, 240, (40, 2)), [[1e6, 1e6]]])
    patch = cut(wall, corners.xy[(corners.xy >= 4).all(1) & (corners.xy < [317, 237]).all(1)]).patch
    patch = patch[rng.integers(0, len(patch), len(uv))]
    found = search(wall, corners, patch, uv, radius, measure=measure, limit=np.inf)
    whole = cut(wall, corners.xy)
    for k in range(len(uv)):
        near = whole.inside & (((corners.xy - uv[k]) ** 2).sum(1) <= radius**2)
        if not near.any():
            assert found.corner[k] == -1
            assert np.isinf(found.cost[k])
            continue
        a, b = patch[k].reshape(64), whole.patch[near].reshape(-1, 64)
        cost = zmssd(b, a) if measure == "zmssd" else 1 - zncc(b, a)
        slack = 200 * np.finfo(float).eps * (64 * 255**2 if measure == "zmssd" else 1)
        assert abs(found.cost[k] - cost.min()) <= slack
        assert cost[np.flatnonzero(near).tolist().index(found.corner[k])] <= cost.min() + slack


def test_of_equal_corners_the_first_in_row_order_wins() -> None:
    image = np.tile(np.random.default_rng(1).integers(0, 256, (10, 10), dtype=np.uint8), (4, 4))
    corners = in_rows(np.array([[25, 5], [5, 15], [15, 15], [15, 25]]), image.shape)
    template = cut(image, [[15, 15]]).patch
    assert search(image, corners, template, [[15.0, 15.0]], 30.0).corner.tolist() == [0]
    assert search(image, corners, template, [[15.0, 15.0]], 30.0, measure="zncc").corner.tolist() == [0]


def test_brightness_is_no_difference_and_contrast_only_for_zmssd(wall: Bytes) -> None:
    """With the mean forgotten, a picture that is 40 grey levels brighter is found at the wrong places."""
    dim = (wall // 3 + 20).astype(np.uint8)
    corners = detect(dim, 6)
    ok = (corners.xy >= 12).all(1) & (corners.xy < [308, 228]).all(1)
    xy = corners.xy[ok][::7]
    patch = cut(dim, xy).patch
    bright = dim + np.uint8(40)
    found = search(bright, corners, patch, xy + 0.4, 8.0)
    np.testing.assert_array_equal(corners.xy[found.corner], xy)
    assert (found.cost == 0).all()
    forgotten = [
        min(
            (float(np.sum((cut(bright, [c]).patch[0].astype(float) - p) ** 2)), tuple(c))
            for c in corners.xy[(np.hypot(*(corners.xy - at).T) <= 8)]
            if (c >= 4).all() and (c < [317, 237]).all()
        )[1]
        != tuple(at)
        for p, at in zip(patch[:40], xy[:40], strict=True)
    ]
    assert np.mean(forgotten) > 0.2
    strong = (2 * dim).astype(np.uint8)
    assert (search(strong, corners, patch, xy + 0.4, 0.8, measure="zncc").cost < 1e-12).all()
    assert (search(strong, corners, patch, xy + 0.4, 0.8).corner == -1).all()


def test_the_limit_is_a_share_of_the_templates_own_variation(wall: Bytes) -> None:
    corners = in_rows(np.array([[60, 60]]), wall.shape)
    patch = cut(wall, [[100, 90]]).patch
    cost = float(search(wall, corners, patch, [[60, 60]], 1.0, limit=np.inf).cost[0])
    share = cost / float(variation(patch)[0])
    assert search(wall, corners, patch, [[60, 60]], 1.0, limit=share * 1.001).corner[0] == 0
    assert search(wall, corners, patch, [[60, 60]], 1.0, limit=share * 0.999).corner[0] == -1


def test_flat_patches_correlate_with_nothing() -> None:
    image = np.full((20, 20), 90, np.uint8)
    corners = in_rows(np.array([[10, 10]]), image.shape)
    found = search(image, corners, cut(image, [[10, 10]]).patch, [[10, 10]], 1.0, measure="zncc")
    assert found.cost.tolist() == [1.0]
    assert found.corner.tolist() == [-1]


def test_nothing_is_found_near_places_that_are_none(wall: Bytes) -> None:
    patch = np.repeat(cut(wall, [[60, 60]]).patch, 4, 0)
    places = [[np.nan, 60], [60, np.nan], [np.inf, 60], [60, -1e300]]
    found = search(wall, detect(wall), patch, places, 5.0)
    assert (found.corner == -1).all()
    assert np.isinf(found.cost).all()
    assert not refine(wall, patch, places).ok.any()


def test_no_corners_and_no_templates_are_no_error(wall: Bytes) -> None:
    none = in_rows(np.zeros((0, 2), np.int32), wall.shape)
    assert search(wall, none, cut(wall, [[60, 60]]).patch, [[60, 60]], 5.0).corner.tolist() == [-1]
    nobody = np.zeros((0, 8, 8), np.uint8)
    assert search(wall, detect(wall), nobody, np.zeros((0, 2)), 5.0).corner.shape == (0,)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"measure": "ssd"}, "measure is 'ssd'"),
        ({"patch": np.zeros((2, 8, 8), np.uint8)}, r"need uint8 \(N, 8, 8\)"),
        ({"patch": np.zeros((1, 8, 8))}, "templates are float64"),
        ({"image": np.zeros((30, 30), np.uint8)}, "need one shape"),
        ({"radius": np.inf}, "radius is inf"),
        ({"radius": -1.0}, "radius is -1"),
        ({"radius": np.nan}, "radius is nan"),
    ],
)
def test_what_does_not_fit_is_refused(change: dict[str, object], told: str, wall: Bytes) -> None:
    given = {"image": wall, "corners": detect(wall), "patch": cut(wall, [[60, 60]]).patch, "uv": [[60, 60]]}
    with pytest.raises(ValueError, match=told):
        search(**{"radius": 5.0, **given, **change})  # type: ignore[arg-type]
