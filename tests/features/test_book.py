"""What the chapter reads, in plain loops, is what the library runs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features import book
from vslam_ref.features.corners import detect, in_rows, shi_tomasi
from vslam_ref.features.fast import corner_score, segment_test
from vslam_ref.features.levels import halve
from vslam_ref.features.patch_search import search, zmssd
from vslam_ref.features.refinement import refine
from vslam_ref.features.templates import cut, warp

Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")


def test_halves(wall: Bytes) -> None:
    np.testing.assert_array_equal(book.halve(wall[:31, :40]), halve(wall[:31, :40]))


@pytest.mark.parametrize("arc", [9, 10, 12])
def test_corners_and_scores(arc: int, wall: Bytes) -> None:
    image = wall[100:140, 60:110]
    inner = [(x, y) for y in range(3, 37) for x in range(3, 47)]
    expected = [[x, y] for x, y in inner if book.is_corner(image, x, y, 12, arc)]
    assert segment_test(image, 12, arc).tolist() == expected
    some = expected[::5]
    assert corner_score(image, some, arc).tolist() == [book.corner_score(image, x, y, arc) for x, y in some]


def test_eigenvalues(wall: Bytes) -> None:
    """An eigenvalue by LAPACK against a root: some 10 eps of the larger one, below 255^2 / 2."""
    xy = np.random.default_rng(0).integers(5, 200, (30, 2))
    expected = [book.shi_tomasi(wall, x, y) for x, y in xy]
    assert np.abs(shi_tomasi(wall, xy) - expected).max() < 10 * np.finfo(float).eps * 255**2


def test_patches_and_comparisons(wall: Bytes) -> None:
    rng = np.random.default_rng(1)
    uv, M = rng.uniform(30, 200, (20, 2)), np.eye(2) + rng.normal(0, 0.3, (20, 2, 2))
    patch = warp(wall, uv, M).patch
    corners = detect(wall[:80, :100], 15)
    found = search(wall[:80, :100], corners, patch, uv[:, ::-1] % 80, 12.0, limit=np.inf)
    listed = [tuple(c) for c in corners.xy.tolist()]
    for k in range(20):
        np.testing.assert_array_equal(book.warped_patch(wall, uv[k], M[k]), patch[k])
        best = book.best_corner(wall[:80, :100], listed, patch[k], uv[k, ::-1] % 80, 12.0)
        assert best == found.corner[k]
    a, b = patch[0], patch[1]
    assert abs(book.zmssd(a, b) - zmssd(a.reshape(64), b.reshape(64))) < 1e-6


def test_steps_with_three_unknowns_are_those_with_the_offset_taken_away(wall: Bytes) -> None:
    """Ten steps of the book against the fast refinement, where both converge: the last step is below 0.01."""
    corners = detect(wall, 25, suppress=True)
    xy = corners.xy[(corners.xy >= 12).all(1) & (corners.xy < [308, 228]).all(1)][:40]
    patch = cut(wall, xy).patch
    start = xy + np.random.default_rng(2).uniform(-0.6, 0.6, (len(xy), 2))
    found = refine(wall, patch, start)
    assert found.ok.sum() > 20
    for k in np.flatnonzero(found.ok):
        step = book.Step(start[k], 0.0)
        for _ in range(10):
            before = step.u
            step = book.refine_step(wall, patch[k], step.u, step.b)
            if np.hypot(*(step.u - before)) < 0.01:
                break
        assert np.abs(step.u - found.uv[k]).max() < 1e-9  # the same steps, and the same end
    assert in_rows(xy, wall.shape).shape == wall.shape
