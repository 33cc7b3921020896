"""ATE and RPE: what they measure, what they must not see, and which mistakes they notice."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import logm
from scipy.spatial.transform import Rotation

from vslam_ref.geometry.alignment import Alignment
from vslam_ref.metrics.trajectory import (
    Trajectory,
    absolute_error,
    evaluate,
    pose_logarithms,
    relative_error,
    rotation_angle,
    summary,
)
from vslam_ref.metrics.trajectory.ate import move

EPS = float(np.finfo(float).eps)
Make = tuple[Callable[..., Trajectory], ...]


def homogeneous(path: Trajectory) -> np.ndarray:
    T = np.tile(np.eye(4), (len(path), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = path.R_world_body, path.t_world_body
    return T


def test_another_world_frame_is_no_error(make: Make) -> None:
    random_path, moved, _ = make
    truth = random_path(1)
    found = evaluate(moved(truth, 2), truth, "se3")
    # coordinates below 60 m, extents of some metres in each direction
    assert found.absolute.stats.max < 60 * 50 * EPS
    assert found.relative.translation.max() < 60 * 50 * EPS
    assert found.relative.rotation.max() < 50 * EPS
    assert evaluate(moved(truth, 2), truth, "none").absolute.stats.rmse > 1


def test_a_common_scale_is_an_error_of_se3_and_none_of_sim3(make: Make) -> None:
    random_path, moved, _ = make
    truth = random_path(3)
    estimate = moved(truth, 4, scale=0.25)
    found = evaluate(estimate, truth, "sim3")
    assert found.numbers()["scale"] == pytest.approx(4.0, rel=1e-12)
    assert found.numbers()["ate_max"] < 1e-11
    assert found.numbers()["rpe_trans_rmse"] < 1e-11
    rigid = evaluate(estimate, truth, "se3").numbers()
    assert rigid["scale"] == 1.0
    # a quarter of the extent: three quarters of the spread about the mean are left
    spread = np.sqrt(np.mean(np.sum((truth.t_world_body - truth.t_world_body.mean(0)) ** 2, 1)))
    assert rigid["ate_rmse"] == pytest.approx(0.75 * spread, rel=1e-12)


def test_errors_are_those_of_the_definition_with_4_by_4_matrices(make: Make) -> None:
    """Independent: inverse and product of homogeneous matrices, angle and statistics by SciPy and NumPy."""
    random_path, _, noisy = make
    truth = random_path(5)
    estimate = noisy(truth, 6)
    for frames, overlapping in ((1, True), (3, True), (3, False), (39, True)):
        T, T_hat = homogeneous(truth), homogeneous(estimate)
        starts = range(0, 40 - frames, 1 if overlapping else frames)
        E = np.array(
            [
                np.linalg.inv(np.linalg.inv(T[k]) @ T[k + frames])
                @ np.linalg.inv(T_hat[k])
                @ T_hat[k + frames]
                for k in starts
            ]
        )
        got = relative_error(estimate, truth, frames, overlapping=overlapping)
        assert got.start.tolist() == list(starts)
        np.testing.assert_allclose(got.translation, np.linalg.norm(E[:, :3, 3], axis=1), atol=1e-12)
        np.testing.assert_allclose(got.rotation, Rotation.from_matrix(E[:, :3, :3]).magnitude(), atol=1e-13)
    e = absolute_error(estimate, truth, "none")
    distance = np.linalg.norm(estimate.t_world_body - truth.t_world_body, axis=1)
    rmse, mean, median, largest, std = e.stats
    assert rmse == pytest.approx(np.sqrt((distance**2).sum() / 40), rel=1e-14)
    assert (mean, median) == pytest.approx((distance.mean(), np.median(distance)), rel=1e-14)
    assert (largest, std) == pytest.approx((distance.max(), distance.std()), rel=1e-13)


def test_steps_of_one_frame_do_not_care_whether_they_overlap(make: Make) -> None:
    random_path, _, noisy = make
    truth = random_path(7)
    a, b = (relative_error(noisy(truth, 8), truth, overlapping=overlap) for overlap in (True, False))
    np.testing.assert_array_equal(a.translation, b.translation)


def test_relative_errors_do_not_see_the_world_frame(make: Make) -> None:
    random_path, moved, noisy = make
    truth = random_path(9)
    estimate = noisy(truth, 10)
    a, b = relative_error(estimate, truth), relative_error(moved(estimate, 11), moved(truth, 12))
    np.testing.assert_allclose(a.translation, b.translation, atol=1e-12)
    np.testing.assert_allclose(a.rotation, b.rotation, atol=1e-13)


def test_one_wrong_turn_is_one_relative_error_and_many_absolute_ones() -> None:
    n, turn = 21, np.radians(10)
    x = np.linspace(0, 20, n)
    straight = Trajectory(None, np.stack([x, 0 * x, 0 * x], 1), np.tile(np.eye(3), (n, 1, 1)))
    R = Rotation.from_rotvec([0, 0, turn]).as_matrix()
    late = x > 10
    t, Rs = straight.t_world_body.copy(), straight.R_world_body.copy()
    t[late] = (t[late] - [10, 0, 0]) @ R.T + [10, 0, 0]
    Rs[late] = R
    bent = Trajectory(None, t, Rs)
    relative = relative_error(bent, straight)
    assert np.flatnonzero(relative.rotation > 1e-9).tolist() == [10]
    assert relative.rotation_stats_deg.max == pytest.approx(10.0, abs=1e-12)
    # one step of 1 m that is turned by 10 degrees misses its end by the chord
    assert np.flatnonzero(relative.translation > 1e-9).tolist() == [10]
    assert relative.translation[10] == pytest.approx(2 * np.sin(turn / 2), rel=1e-12)
    assert np.count_nonzero(absolute_error(bent, straight, "none").errors > 1e-9) == 10


def test_turning_the_camera_about_the_wrong_side_is_noticed(make: Make) -> None:
    """``T_aligned = R_est @ R_align`` for ``R_align @ R_est``: steps are then taken in the wrong frame."""
    random_path, moved, noisy = make
    truth = random_path(13)
    estimate = moved(noisy(truth, 14, 1e-3), 15)
    good = absolute_error(estimate, truth)
    R = good.alignment.R_target_source
    flipped = Trajectory(truth.times, good.aligned.t_world_body, estimate.R_world_body @ R)
    assert relative_error(good.aligned, truth).translation_stats.rmse < 0.01
    assert relative_error(flipped, truth).translation_stats.rmse > 0.1


def test_motions_chained_in_the_wrong_order_are_noticed(make: Make) -> None:
    """``R_k+1 = dR @ R_k`` for ``R_k @ dR``: the classic slip of a visual odometry."""
    random_path, _, _ = make
    truth = random_path(16)
    T = homogeneous(truth)
    steps = np.linalg.inv(T[:-1]) @ T[1:]
    right, wrong = [T[0]], [T[0]]
    for step in steps:
        right.append(right[-1] @ step)
        wrong.append(step @ wrong[-1])
    results = []
    for chain in (np.array(right), np.array(wrong)):
        path = Trajectory(truth.times, chain[:, :3, 3], chain[:, :3, :3])
        results.append(evaluate(path, truth, "se3").numbers())
    assert results[0]["ate_rmse"] < 1e-11
    assert results[1]["ate_rmse"] > 1
    assert results[1]["rpe_trans_rmse"] > 0.5


def test_a_transposed_alignment_is_noticed(make: Make) -> None:
    random_path, moved, noisy = make
    truth = random_path(17)
    estimate = moved(noisy(truth, 18), 19)
    good = absolute_error(estimate, truth)
    a = good.alignment
    wrong = Alignment(a.scale, a.R_target_source.T, a.t_target_source, 0.0, "", True)
    errors = np.linalg.norm(move(wrong, estimate).t_world_body - truth.t_world_body, axis=1)
    assert good.stats.rmse < 0.2 < 1 < summary(errors).rmse


def test_pose_logarithms_are_matrix_logarithms(make: Make) -> None:
    random_path, _, noisy = make
    truth = random_path(20, 12)
    estimate = noisy(truth, 21, 0.7)
    for xi, T, T_hat in zip(
        pose_logarithms(estimate, truth), homogeneous(truth), homogeneous(estimate), strict=True
    ):
        L = np.real(logm(np.linalg.inv(T) @ T_hat))
        np.testing.assert_allclose(xi, [*L[:3, 3], L[2, 1], L[0, 2], L[1, 0]], atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-150, 1e-12, 1e-4, 1.0, np.pi - 1e-9, np.pi])
def test_the_angle_of_a_rotation_is_right_at_every_size(angle: float) -> None:
    c, s = np.cos(angle), np.sin(angle)
    got = float(rotation_angle([[c, -s, 0], [s, c, 0], [0, 0, 1]]))
    assert got == pytest.approx(angle, rel=4 * EPS, abs=0.0)


def test_a_path_on_a_line_is_measured_and_flagged() -> None:
    x = np.linspace(0, 5, 8)[:, None] * [1.0, 2.0, 0.5]
    path = Trajectory(None, x, np.tile(np.eye(3), (8, 1, 1)))
    found = evaluate(path, path, "sim3")
    assert found.numbers()["ate_max"] < 1e-14
    assert "on one line" in found.absolute.alignment.reason


def still(n: int) -> Trajectory:
    return Trajectory(np.arange(float(n)), np.ones((n, 3)), np.tile(np.eye(3), (n, 1, 1)))


def test_what_stands_still_has_no_scale(make: Make) -> None:
    truth = make[0](22, 8)
    estimate = Trajectory(truth.times, np.ones((8, 3)), truth.R_world_body)
    with pytest.raises(ValueError, match=r"no scale can be found: .*source lie at one place.*align with se3"):
        evaluate(estimate, truth, "sim3")
    assert evaluate(estimate, truth, "se3").numbers()["ate_rmse"] > 0


def untimed(path: Trajectory) -> Trajectory:
    return Trajectory(None, path.t_world_body, path.R_world_body)


def later(path: Trajectory, seconds: float) -> Trajectory:
    assert path.times is not None
    return Trajectory(path.times + seconds, path.t_world_body, path.R_world_body)


@pytest.mark.parametrize(
    ("estimate", "truth", "mode", "words"),
    [
        (
            still(2),
            still(9),
            "none",
            "2 pairs of poses within 0.01 s: need 3; estimate 0.000 to 1.000 s, truth",
        ),
        (
            later(still(9), 100.0),
            still(9),
            "se3",
            "0 pairs of poses within 0.01 s: need 3; estimate 100.000 to",
        ),
        (untimed(still(2)), untimed(still(2)), "se3", "2 pairs of poses: need 3 or more"),
        (
            untimed(still(4)),
            untimed(still(5)),
            "se3",
            "4 estimated and 5 true poses without times: need equally",
        ),
        (untimed(still(4)), still(4), "se3", "the estimate has no times and the other has"),
        (still(4), untimed(still(4)), "se3", "the truth has no times and the other has"),
        (still(4), still(4), "SE3", "alignment 'SE3': need one of none, se3, sim3"),
    ],
)
def test_what_cannot_be_compared_is_told_in_one_line(
    estimate: Trajectory, truth: Trajectory, mode: str, words: str
) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        evaluate(estimate, truth, mode)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("frames", [0, 4, -1])
def test_a_step_must_fit_into_the_path(frames: int) -> None:
    with pytest.raises(ValueError, match=rf"steps of {frames} frames in 4 pairs: need 1 to 3"):
        relative_error(still(4), still(4), frames)


@pytest.mark.parametrize(
    ("times", "t", "R", "words"),
    [
        (None, np.zeros((3, 2)), np.zeros((3, 3, 3)), r"need \(N, 3\) and"),
        (None, np.zeros((3, 3)), np.zeros((2, 3, 3)), r"need \(N, 3\) and"),
        (np.zeros(2), np.zeros((3, 3)), np.zeros((3, 3, 3)), r"times \(2,\): need \(3,\)"),
        (np.array([0.0, 2, 1]), np.zeros((3, 3)), np.zeros((3, 3, 3)), "must not fall"),
        (np.array([0.0, np.nan, 1]), np.zeros((3, 3)), np.zeros((3, 3, 3)), "finite"),
        (None, np.full((3, 3), np.nan), np.zeros((3, 3, 3)), "positions must be finite"),
    ],
)
def test_a_trajectory_is_checked_when_it_is_made(
    times: np.ndarray | None, t: np.ndarray, R: np.ndarray, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        Trajectory(times, t, R)


def test_no_errors_have_no_summary() -> None:
    with pytest.raises(ValueError, match="N >= 1"):
        summary([])
