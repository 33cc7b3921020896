"""The verdict on cases with a known answer, the recording, and, slow, the comparison itself."""

from __future__ import annotations

import numpy as np
import precision as command
import pytest
from freak_pairs import key_points

from vslam_ref.datasets import catalogue
from vslam_ref.features.freak import describe


def test_verdict_is_yes_only_if_no_row_is_below() -> None:
    better = [("a", np.array([[0.6, 0.5], [0.4, 0.5]])), ("b", np.array([[0.7, 0.6]]))]
    assert command.verdict(better)
    assert command.verdict([("a", np.array([[0.5, 0.5]]))])
    assert not command.verdict([*better, ("c", np.array([[0.50, 0.51]]))])


def test_interval_is_students() -> None:
    """Of 0, 2 the mean is 1, the standard error 1, and t(0.975, 1) = tan(0.475 pi)."""
    low, high = command.interval(np.array([0.0, 2.0]))
    assert high - 1 == pytest.approx(np.tan(0.475 * np.pi), rel=1e-9)
    assert 1 - low == pytest.approx(high - 1, rel=1e-12)


def test_recording_holds_pictures_and_keeps_small() -> None:
    held = command.Contrib()
    assert {"graf1", "graf3", "desk", "desk, blur 3"} <= set(held.held)
    assert all(len(xy) == len(octave) == len(bits) > 50 for xy, octave, bits in held.held.values())
    assert all(bits.shape[1] == 64 for _, _, bits in held.held.values())
    assert command.RECORDING.stat().st_size < 500_000


def test_every_method_describes_all_key_points(wall: np.ndarray) -> None:
    points = key_points(wall, 40)
    assert len(describe(wall, points.uv, points.scale).kept) == len(points.octave) > 20
    for method, width in ((command.ours, 64), (command.house_orb, 32), (command.opencv_orb, 32)):
        bits = method("wall", wall, points)
        assert bits.shape == (len(points.octave), width)
        assert bits.any(1).all()


@pytest.mark.slow
def test_precision_over_rendered_pairs_is_at_least_contribs() -> None:
    """All rows but graf, which stands apart and is below: ``make freak-precision`` shows each."""
    if catalogue.find("opencv_samples") is None:
        pytest.skip("opencv_samples is not in VSLAM_REF_DATA")
    found, result = command.study({name: command.METHODS[name]() for name in ("ours", "contrib FREAK")})
    table = [(name, part) for name, part in command.rows(found, result) if name != "graf"]
    assert len(table) == 8
    assert command.verdict(table)
