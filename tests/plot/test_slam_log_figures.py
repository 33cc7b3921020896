"""Figures of a recorded log say what their bands are."""

from __future__ import annotations

import numpy as np

from vslam_ref.plot.slam_log import Drawn, error_figure


def test_the_band_of_the_errors_has_a_name():
    times = np.arange(3.0)
    none = np.zeros((0, 2))
    run = Drawn("ekf", none, none, np.zeros((0, 2, 2)), times, np.full((3, 3), 0.1), np.ones((3, 3)))
    figure = error_figure({"ekf": run}, "a log")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["±3σ", "error"]
