"""Numbers of a run against the truth, on paths whose errors are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vslam_ref.datasets.sequences import Sequence
from vslam_ref.experiments.visual_slam.numbers import accuracy
from vslam_ref.experiments.visual_slam.paths import trajectory
from vslam_ref.geometry import se3
from vslam_ref.metrics.trajectory import Trajectory

N = 30
CENTRES = np.stack([np.cos(0.2 * np.arange(N)), np.sin(0.2 * np.arange(N)), 0.1 * np.arange(N)], 1)
FRAME = se3.exp([0.3, -1.0, 2.0, 0.4, 0.5, -0.7])


def sequence(times: np.ndarray | None = None, truth: bool = True, **more: Any) -> Sequence:
    """N pictures along a helix."""
    stamps = 0.1 * np.arange(N) if times is None else times
    path = Trajectory(0.1 * np.arange(N), CENTRES, np.broadcast_to(np.eye(3), (N, 3, 3)))
    return Sequence(
        "helix", "plain", (4, 4), stamps, np.arange(N), lambda k: None, truth=path if truth else None, **more
    )  # type: ignore[arg-type]


def poses(centres: np.ndarray) -> np.ndarray:
    """T_cam_world (n, 4, 4) of cameras that do not turn in their own world, which is turned by FRAME."""
    T = np.tile(np.eye(4), (len(centres), 1, 1))
    T[:, :3, 3] = centres
    return se3.inverse(FRAME @ T)


def test_a_path_that_is_true_up_to_a_similarity_has_no_error() -> None:
    got = accuracy(sequence(), np.arange(N), poses(0.25 * CENTRES))
    assert got.rmse == pytest.approx(0.0, abs=1e-12)
    assert got.percent == pytest.approx(0.0, abs=1e-10)
    assert got.drift == pytest.approx(1.0, abs=1e-10)
    assert got.alignment is not None
    assert got.alignment.scale == pytest.approx(4.0)
    assert got.reason == ""


def test_percent_is_of_the_true_path_that_was_covered() -> None:
    """A zigzag of 0.01 in z that no similarity takes away; 20 of the 30 pictures have a pose."""
    wrong = CENTRES[:20] + 0.01 * (-1.0) ** np.arange(20)[:, None] * [0, 0, 1]
    got = accuracy(sequence(), np.arange(20), poses(wrong))
    assert got.rmse == pytest.approx(0.01, rel=0.02)
    length = np.linalg.norm(np.diff(CENTRES[:20], axis=0), axis=1).sum()
    assert got.percent == pytest.approx(100 * got.rmse / length, rel=1e-12)


def test_drift_is_below_one_where_the_map_grows() -> None:
    """Steps of the last third are twice as long: the scale that brings it to the truth is half."""
    step = np.diff(CENTRES, axis=0)
    step[19:] *= 2.0
    grown = np.concatenate([CENTRES[:1], CENTRES[0] + np.cumsum(step, axis=0)])
    got = accuracy(sequence(), np.arange(N), poses(grown))
    assert got.drift == pytest.approx(0.5, abs=1e-9)


def test_of_equal_stamps_only_the_first_is_compared() -> None:
    times = 0.1 * np.arange(N)
    times[11] = times[10]
    wrong = CENTRES.copy()
    wrong[11] += 5.0
    assert accuracy(sequence(times), np.arange(N), poses(wrong)).rmse == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("numbers", "centres", "what"),
    [
        (np.arange(2), CENTRES[:2], "2 pictures have a pose and a true pose: need 3"),
        (np.arange(0), CENTRES[:0], "0 pictures"),
        (np.arange(9), np.zeros((9, 3)), "no scale can be found"),
    ],
)
def test_what_cannot_be_compared_says_why(numbers: np.ndarray, centres: np.ndarray, what: str) -> None:
    got = accuracy(sequence(), numbers, poses(centres))
    assert got[:4] == (None, None, None, None)
    assert what in got.reason


def test_clocks_that_do_not_meet_are_told_as_by_evaluate() -> None:
    """The offset that would make them meet, but no options that ``run ptam`` does not have."""
    late = accuracy(sequence(0.1 * np.arange(N) + 7200.0), np.arange(N), poses(0.25 * CENTRES))
    assert late.rmse is None
    assert (
        "0 pairs of poses within 0.01 s: need 3; estimate 7200.000 to 7202.900 s, truth 0.000 to"
        in late.reason
    )
    assert "7200 s (2 h) ahead of the truth's: with -7200 s added to its times, 30 of 30 poses" in late.reason
    assert "--" not in late.reason
    times = 0.1 * np.arange(N) + 7200.0
    times[20:] -= 1.55
    fallen = accuracy(sequence(times), np.arange(N), poses(0.25 * CENTRES))
    assert "first mend the times of the pictures, which go back at 1 of them" in fallen.reason


def test_without_truth_there_is_nothing_and_no_reason() -> None:
    got = accuracy(sequence(truth=False), np.arange(N), poses(CENTRES))
    assert got.rmse is None
    assert got.reason == ""


def test_a_trajectory_is_in_the_order_of_time_and_holds_the_cameras_places() -> None:
    """Stamps that fall, and two that are equal, which keep their order."""
    got = trajectory(np.array([0.2, 0.0, 0.2, 0.1]), poses(CENTRES[:4]))
    assert got.times is not None
    np.testing.assert_array_equal(got.times, [0.0, 0.1, 0.2, 0.2])
    np.testing.assert_allclose(got.t_world_body, se3.act(FRAME, CENTRES[[1, 3, 0, 2]]), atol=1e-12)
