"""The parts of ``bench features`` do what their names say; times are not asserted."""

from __future__ import annotations

import numpy as np

from vslam_ref.bench import features, freak, orb
from vslam_ref.features import hamming
from vslam_ref.features.orb import extract


def test_the_wall_has_points_enough_and_most_are_found_again() -> None:
    """What is timed is a search that succeeds: 1000 templates, most of them found near where they belong."""
    given = features.scene(*features.images()["wall"])
    assert given.xy.shape == (features.POINTS, 2)
    assert given.templates.inside.all()
    H_b_a = np.array([[1.01, 0.01, 4.0], [-0.01, 1.0, 3.0], [1e-5, 0.0, 1.0]])
    far = np.column_stack([given.xy, np.ones(len(given.xy))]) @ H_b_a.T
    error = np.hypot(*(features.near(given) - far[:, :2] / far[:, 2:]).T)
    assert np.median(error) < 1.0


def test_every_part_runs() -> None:
    given = features.scene(*features.images()["wall"])
    for part in features.parts(given).values():
        part()
    for pair in features.peers(given).values():
        assert set(pair) == {"OpenCV", "ours"}
        pair["OpenCV"]()


def test_orb_is_measured_beside_opencv() -> None:
    """Both find the nearest of each descriptor, at the same distance, and 1000 features."""
    import cv2

    a, b = orb.descriptors(50)
    theirs = cv2.BFMatcher(cv2.NORM_HAMMING).match(a, b)
    ours = hamming.match(a, b, ratio=None, mutual=False)
    assert ours.distance.tolist() == [m.distance for m in theirs]
    image = features.images()["wall"][1]
    assert len(extract(image).uv) == orb.FEATURES
    rows = orb.measure_hamming("numpy", quick=True) + orb.measure_extraction("wall", image, "numpy", True)
    assert [r["goal"] for r in rows] == ["FE-3"] * 3 + ["ORB"] * 3
    assert all(r["value"] > 0 for r in rows)


def test_freak_is_measured_beside_opencvs_orb() -> None:
    image = features.images()["wall"][1]
    rows = freak.measure_description("wall", image, "numpy", True)
    assert [r["goal"] for r in rows] == ["FREAK", "FREAK"]
    assert all(r["value"] > 0 for r in rows)
