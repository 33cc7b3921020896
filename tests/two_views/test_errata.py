"""Section 2.2.2 of the report: five points are said to give the camera's intrinsic parameters."""

from __future__ import annotations

import numpy as np

from vslam_ref.geometry.multiview import essential_from_motion, two_views
from vslam_ref.geometry.multiview.two_views import apart


def test_a_wrong_focal_length_fits_five_points_exactly(pair) -> None:
    """With 500 and with 700 pixels five pairs of pixels fit to rounding, by two motions in front."""
    both = 0
    for seed in range(20):
        s = pair(np.random.default_rng(seed), 5)
        uv_a, uv_b = 500.0 * s.a, 500.0 * s.b
        motions = []
        for focal in (500.0, 700.0):
            a, b = uv_a / focal, uv_b / focal
            found = two_views.five_point_essentials([a], [b])
            for E in found.E[found.valid]:
                # 1e-12 pixels: rounding, not a small misfit
                assert np.abs(focal * two_views.essential_sampson(E, a, b)).max() < 1e-9
            candidates = two_views.essential_motions(found.E[found.valid]).reshape(-1, 4, 4)
            if len(candidates) == 0:
                continue
            front = two_views.cheirality(candidates, a, b).front.all(axis=1)
            motions.append(candidates[front])
        if len(motions) == 2 and min(map(len, motions)) > 0:
            both += 1
            gaps = [apart(p, q) for p in motions[0] for q in motions[1]]
            assert min(gaps) > 1e-3  # another motion each: the pixels decide for neither focal length
    assert both >= 15


def test_more_points_do_tell_a_wrong_focal_length(pair) -> None:
    """The claim fails for five; twenty pairs no longer fit the wrong focal length."""
    s = pair(np.random.default_rng(0), 20)
    wrong_a, wrong_b = s.a * 500.0 / 700.0, s.b * 500.0 / 700.0
    right = two_views.essential_sampson(essential_from_motion(s.T_b_a), s.a, s.b)
    wrong = two_views.essential_sampson(two_views.linear_essential(wrong_a, wrong_b).E, wrong_a, wrong_b)
    assert 500 * np.abs(right).max() < 1e-9
    assert 700 * np.sqrt(np.mean(wrong**2)) > 0.5
