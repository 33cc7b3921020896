"""The parts of ``bench features`` do what their names say; times are not asserted."""

from __future__ import annotations

import numpy as np

from vslam_ref.bench import features


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
