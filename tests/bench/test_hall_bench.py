"""The parts of ``bench hall`` do what their names say; times are not asserted."""

from __future__ import annotations

import pytest

from vslam_ref.bench import hall
from vslam_ref.support.timing import Paired
from vslam_ref.worlds.rendered import scene


def test_a_picture_and_a_warp_are_timed() -> None:
    found = hall.timed(scene("rotation", size=(64, 48), frames=1), 0)
    assert list(found.seconds) == ["OpenCV", "ours"]
    assert found.ratio["OpenCV"] == 1.0
    assert min(found.seconds.values()) > 0


def test_rows_are_means_of_both_cameras(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of four pictures take 10 ms and two 30 ms, one made up for the other."""
    times = iter([0.01, 0.03, 0.01, 0.03] * 2)

    def timed(made: object, k: int) -> Paired:
        seconds = next(times)
        return Paired({"OpenCV": 0.001, "ours": seconds}, {"OpenCV": 1.0, "ours": 1000 * seconds})

    monkeypatch.setattr(hall, "timed", timed)
    monkeypatch.setattr(hall, "scene", lambda name: scene("rotation", size=(64, 48), frames=8))
    rows = hall.pictures("numba", quick=True)
    assert [r["value"] for r in rows] == pytest.approx([50.0, 20.0, 20.0] * 2)
    assert [r["met"] for r in rows] == ["yes", None, None] * 2
