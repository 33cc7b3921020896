"""Words about times: the unit, the offset, the share left out and its reason; silence where all is right."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.metrics.trajectory import (
    MAX_DIFFERENCE,
    Trajectory,
    associate,
    evaluate,
    pair_up,
    pairing_notes,
)
from vslam_ref.metrics.trajectory.clocks import meeting, speed_lag
from vslam_ref.metrics.trajectory.partners import left_out, percent, reasons

EPOCH = 1_403_636_580.0


def walk(seconds: float = 20.0, rate: float = 20.0, start: float = EPOCH) -> Trajectory:
    """A walk of uneven speed: a sum of sines that never repeats within it."""
    t = np.arange(int(seconds * rate)) / rate
    path = np.stack([np.sin(0.7 * t) * 3, np.cos(1.1 * t + 0.3) * t / 5, np.sin(2.3 * t) * 0.4], axis=1)
    return Trajectory(start + t, path, np.tile(np.eye(3), (len(t), 1, 1)))


def part(path: Trajectory, start: int, stop: int, step: int = 1) -> Trajectory:
    return path.take(np.arange(start, stop, step))


def times_in(path: Trajectory, factor: float) -> Trajectory:
    assert path.times is not None
    return Trajectory(path.times * factor, path.t_world_body, path.R_world_body)


def similar(path: Trajectory, noise: float = 0.01) -> Trajectory:
    """The path as a camera alone would find it: smaller, in another frame, with noise."""
    rng = np.random.default_rng(5)
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    t = 0.3 * (path.t_world_body + noise * rng.normal(size=path.t_world_body.shape)) @ turn.T - 2
    return Trajectory(path.times, t, path.R_world_body)


def told(estimate: Trajectory, truth: Trajectory, limit: float = MAX_DIFFERENCE, offset: float = 0.0) -> str:
    """What is said where there are too few pairs."""
    with pytest.raises(ValueError, match="need 3") as caught:
        pair_up(estimate, truth, limit, offset)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("offset", [7200.0, -5400.0, 18.0, 3.1, 1000.25, -EPOCH])
def test_the_offset_that_is_named_pairs_all_poses(offset: float) -> None:
    """Whatever the clocks, the words name an offset, and with it every pose finds its own true pose."""
    truth = walk()
    estimate = similar(truth).later(offset)
    found = meeting(estimate, truth, MAX_DIFFERENCE)
    assert found is not None
    assert found.factor == 1
    assert found.offset == pytest.approx(-offset, abs=1e-6)
    assert found.pairs == len(estimate)


def test_the_words_name_what_the_options_need() -> None:
    truth = walk()
    message = told(similar(truth).later(7200.0), truth)
    assert (
        "the estimate's clock seems 7200 s (2 h) ahead of the truth's: with --offset -7200, 400 of 400"
        in message
    )
    again = told(similar(truth).later(7200.0 + 5.0), truth, offset=5.0)
    assert "with --offset -7200, 400 of 400 poses" in again  # the whole of it, not what is still to be added
    assert evaluate(similar(truth).later(7200.0), truth, "sim3", offset=-7200.0).pairs.truth.tolist() == list(
        range(400)
    )


def test_a_part_of_the_truth_is_found_by_its_speeds() -> None:
    """Neither the first nor the last poses are of one time: only the motion tells the offset."""
    truth = walk(60.0)
    estimate = similar(part(truth, 417, 801)).later(-EPOCH - 3.7)
    assert speed_lag(estimate, truth) == pytest.approx(EPOCH + 3.7, abs=0.06)
    found = meeting(estimate, truth, MAX_DIFFERENCE)
    assert found is not None
    assert found.offset == pytest.approx(EPOCH + 3.7, abs=1e-5)
    # of another motion nothing is said
    other = Trajectory(estimate.times, np.random.default_rng(2).normal(size=(384, 3)), estimate.R_world_body)
    assert meeting(other, truth, MAX_DIFFERENCE) is None
    assert "are they of the same recording?" in told(other, truth)


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_the_unit_of_either_file_is_named(factor: float, unit: str) -> None:
    truth = walk(start=0.0)
    message = told(times_in(similar(truth), factor), truth)
    assert f"the times of the estimate look like {unit}: divided by {factor:.0f}, 400 of 400 poses" in message
    message = told(similar(truth), times_in(truth, factor))
    assert f"the times of the truth look like {unit}: divided by {factor:.0f}, 400 of 400 poses" in message
    # a unit and an offset
    message = told(times_in(similar(truth), factor), truth.later(EPOCH))
    assert f"look like {unit}: divided by {factor:.0f}, and with --offset 1403636580, 400 of 400" in message


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")]
)
def test_a_unit_that_both_files_have_is_told_by_the_steps(factor: float, unit: str) -> None:
    truth = walk(start=0.0)
    late = similar(truth)
    jitter = np.random.default_rng(3).uniform(-0.004, 0.004, 400)
    assert truth.times is not None
    shaken = Trajectory(np.sort(truth.times + jitter), late.t_world_body, late.R_world_body)
    message = told(times_in(shaken, factor), times_in(truth, factor))
    assert f"the times of both look like {unit}: divide both by {factor:.0f}" in message


def test_clocks_that_differ_by_less_than_a_step_have_two_remedies() -> None:
    truth = walk()
    message = told(similar(truth).later(0.02), truth)
    assert "with --offset -0.02, 400 of 400" in message
    assert "or, if the clocks are right, --max-difference 0.021" in message
    assert len(pair_up(similar(truth).later(0.02), truth, 0.021).truth) == 400


def test_times_without_digits_and_paths_of_few_poses_are_told() -> None:
    truth = walk()
    same = Trajectory(np.full(400, 1.40364e9), truth.t_world_body, truth.R_world_body)
    assert "the 400 poses of the estimate have no more than 1 different times" in told(same, truth)
    assert "the truth has too few poses" in told(truth, part(truth, 0, 2))


# --- what found no partner --------------------------------------------------------------------------


def test_nothing_is_said_of_estimates_that_are_right() -> None:
    """All paired: the same rate, keyframes, a truth ten times as dense, jitter below the limit."""
    truth = walk(rate=200.0)
    rng = np.random.default_rng(1)
    camera = part(truth, 0, 4000, 10)
    assert camera.times is not None
    jitter = Trajectory(
        np.sort(camera.times + rng.uniform(-0.004, 0.004, 400)), camera.t_world_body, camera.R_world_body
    )
    keyframes = camera.take(np.sort(rng.choice(400, 40, replace=False)))
    for estimate in (truth, camera, jitter, keyframes, part(camera, 60, 390)):
        pairs = pair_up(similar(estimate), truth)
        assert pairing_notes(similar(estimate), truth, pairs, MAX_DIFFERENCE) == []


def test_each_reason_is_counted_and_named() -> None:
    """Four before, three after, two in a gap of the truth of 1 s; each counted by hand."""
    truth = walk()
    assert truth.times is not None
    with_gap = truth.take(np.r_[4:200, 220:397])
    pairs = associate(truth.times, with_gap.times)
    out = left_out(truth.times, with_gap.times, pairs, MAX_DIFFERENCE)
    assert (out.poses, out.before, out.after, out.between, out.shared) == (400, 4, 3, 20, 0)
    assert out.total == 27 == 400 - len(pairs.truth)
    assert out.farthest == pytest.approx(0.5, abs=1e-6)
    words = "; ".join(reasons(out, MAX_DIFFERENCE))
    assert words == (
        "4 before the truth begins; 3 after it ends; "
        "20 in gaps of the truth, up to 0.5 s from its nearest pose"
    )
    (note,) = pairing_notes(truth, with_gap, pairs, MAX_DIFFERENCE)
    assert note.startswith(
        "27 of 400 poses of the estimate (7 %) have no true pose within 0.01 s and are left"
    )


def test_rates_are_the_reason_where_each_true_pose_is_used() -> None:
    truth, dense = walk(rate=20.0), walk(rate=200.0)
    (note,) = pairing_notes(dense, truth, pair_up(dense, truth), MAX_DIFFERENCE)
    assert "3600 of 4000 poses of the estimate (90 %)" in note
    assert "as the estimate has more poses (one every 0.005 s, the truth one every 0.05 s)" in note
    assert "--max-difference" not in note  # it would pair none of them


def test_a_limit_that_is_named_lets_the_poses_pass() -> None:
    truth = walk()
    assert truth.times is not None
    late = truth.times + np.where(np.arange(400) // 100 == 2, 0.023, 0.0)
    estimate = Trajectory(late, truth.t_world_body, truth.R_world_body)
    note = pairing_notes(estimate, truth, pair_up(estimate, truth), MAX_DIFFERENCE)[0]
    assert (
        "100 between true poses, 0.023 s from the nearest in the median (--max-difference 0.024 would" in note
    )
    assert len(pair_up(estimate, truth, 0.024).truth) == 400


def test_another_clock_is_named_beside_pairs_only_if_it_explains_more() -> None:
    """Half of the poses lie outside: a clock that is 7 s ahead is told from a path that goes on."""
    truth = walk(20.0)
    wrong = similar(truth).later(7.0)
    notes = pairing_notes(wrong, truth, pair_up(wrong, truth), MAX_DIFFERENCE)
    assert "140 of 400 poses of the estimate (35 %)" in notes[0]
    assert "with --offset -7, 400 of 400 poses of the estimate find a true one; compare" in notes[1]
    right = similar(walk(30.0))
    (only,) = pairing_notes(right, truth, pair_up(right, truth), MAX_DIFFERENCE)
    assert "200 after the truth ends" in only


def test_on_laps_no_other_clock_is_named() -> None:
    """Three laps, of which the truth has most of the last and two more: an offset of laps would pair them."""
    t = np.arange(0, 100, 0.05)
    angle = 2 * np.pi * t / 20
    laps = np.stack([np.cos(angle), np.sin(angle) * (1 + 0.3 * np.cos(angle)), 0 * t], axis=1)
    path = Trajectory(t, laps, np.tile(np.eye(3), (len(t), 1, 1)))
    truth, noise = part(path, 900, 2000), np.random.default_rng(5).normal(scale=0.005, size=(300, 3))
    found = laps[:1200] + np.concatenate([np.zeros((900, 3)), noise])  # where they overlap it is at its worst
    estimate = Trajectory(t[:1200], found, path.R_world_body[:1200])
    left, covered = pairing_notes(estimate, truth, pair_up(estimate, truth), MAX_DIFFERENCE)
    assert "900 before the truth begins" in left
    assert "covers 27 %" in covered


def test_an_estimate_of_a_small_part_is_told() -> None:
    truth = walk()
    notes = {
        share: pairing_notes(e, truth, pair_up(e, truth), MAX_DIFFERENCE)
        for share in (0.4, 0.6)
        for e in (part(truth, 0, int(400 * share)),)
    }
    assert notes[0.4] == ["the estimate covers 40 % of the truth's time: the errors are those of this part"]
    assert notes[0.6] == []


def test_paths_without_times_have_no_notes() -> None:
    path = Trajectory(None, np.eye(3), np.tile(np.eye(3), (3, 1, 1)))
    assert pairing_notes(path, path, pair_up(path, path), MAX_DIFFERENCE) == []
    with pytest.raises(ValueError, match=r"poses without times cannot be moved by 2.5 s"):
        path.later(2.5)


def test_a_share_is_never_rounded_to_nothing_or_all() -> None:
    assert [percent(*s) for s in ((0, 5), (1, 5000), (1, 2), (4999, 5000), (5, 5))] == [
        "0 %", "below 0.1 %", "50 %", "over 99.9 %", "100 %",
    ]  # fmt: skip
