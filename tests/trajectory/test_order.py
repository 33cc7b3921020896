"""The order of a quaternion's numbers: seen where it is wrong, never where it is right."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.metrics.trajectory import Trajectory, judge_order
from vslam_ref.metrics.trajectory.order import other_order, spread

KINDS = ("smooth", "planar", "keyframes")


def world(rng: np.random.Generator, kind: str) -> Trajectory:
    n = int(rng.integers(6, 60))
    t = np.cumsum(rng.normal(size=(n, 3)), axis=0)
    turns = np.cumsum(rng.normal(scale=rng.uniform(0.05, 0.4), size=(n, 3)), axis=0)
    if kind == "planar":
        t[:, 2] = turns[:, 0] = turns[:, 1] = 0.0
    if kind == "keyframes":
        turns = rng.normal(scale=0.8, size=(n, 3))
    start = Rotation.random(random_state=rng)
    return Trajectory(None, t, (start * Rotation.from_rotvec(turns)).as_matrix())


def found_from(rng: np.random.Generator, truth: Trajectory, noise: float, body: bool = True) -> Trajectory:
    """An estimate in another world, of another scale and body, with errors of some radians and metres."""
    n = len(truth)
    W, X = Rotation.random(2, random_state=rng)
    X = X if body else Rotation.identity()
    R = W * Rotation.from_matrix(truth.R_world_body) * X
    R = R * Rotation.from_rotvec(rng.normal(scale=noise, size=(n, 3)))
    t = 0.4 * W.apply(truth.t_world_body + noise * rng.normal(size=(n, 3))) + 5
    return Trajectory(None, t, R.as_matrix())


def numbers_moved(path: Trajectory, by: int) -> Trajectory:
    """The rotations of a reader that takes the file's four numbers in the wrong order, by SciPy."""
    xyzw = Rotation.from_matrix(path.R_world_body).as_quat()
    wrong = np.stack([np.roll(q, by) for q in xyzw])
    return Trajectory(None, path.t_world_body, Rotation.from_quat(wrong).as_matrix())


def test_the_other_order_is_that_of_the_file() -> None:
    """Numbers w x y z taken for x y z w, and the reverse, come back."""
    path = Trajectory(None, np.zeros((50, 3)), Rotation.random(50, random_state=3).as_matrix())
    read_as_last = numbers_moved(path, 1)  # the file has w x y z; it was read as x y z w
    np.testing.assert_allclose(other_order(read_as_last.R_world_body, False), path.R_world_body, atol=1e-14)
    read_as_first = numbers_moved(path, -1)  # the file has x y z w; it was read as w x y z
    np.testing.assert_allclose(other_order(read_as_first.R_world_body, True), path.R_world_body, atol=1e-14)
    # the two are not each other's
    assert np.abs(other_order(read_as_last.R_world_body, True) - path.R_world_body).max() > 0.5


@pytest.mark.parametrize("kind", KINDS)
def test_the_wrong_order_is_seen(kind: str) -> None:
    """In the estimate, in the truth, in both; w last taken for first and the reverse; any body and world."""
    rng = np.random.default_rng(1)
    seen = asked = 0
    for _ in range(60):
        truth = world(rng, kind)
        estimate = found_from(rng, truth, 0.01)
        for by, first in ((1, False), (-1, True)):
            bad, bad_truth = numbers_moved(estimate, by), numbers_moved(truth, by)
            cases = (
                (bad, truth, (first, None)),
                (estimate, bad_truth, (None, first)),
                (bad, bad_truth, (first, first)),
            )
            for a, b, question in cases:
                order = judge_order(a, b, question)
                assert order is not None
                asked += 1
                seen += order.likely
                assert order.other < 0.05, "of the right order only the noise is left: 0.017 rad, of 3 axes"
    # what turns little, or about one axis only, may hide it
    assert seen >= 0.9 * asked, (seen, asked)


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_said_of_the_right_order(kind: str) -> None:
    """Good and bad estimates, from 0.06 to 180 degrees off, few poses and many: 2400 questions, no alarm."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        truth = world(rng, kind)
        estimate = found_from(rng, truth, 10 ** rng.uniform(-3, 0.5), body=bool(rng.integers(2)))
        for question in ((False, None), (None, False), (False, False), (True, None)):
            order = judge_order(estimate, truth, question)
            assert order is None or not order.likely, order


def test_nothing_is_said_of_rotations_that_are_wrong_otherwise() -> None:
    """All alike (a program that writes 0 0 0 1), at random, or of the world in the body."""
    rng = np.random.default_rng(3)
    for _ in range(150):
        truth = world(rng, str(rng.choice(KINDS)))
        right = found_from(rng, truth, 0.01)
        n = len(truth)
        for R in (
            np.tile(np.eye(3), (n, 1, 1)),
            Rotation.random(n, random_state=rng).as_matrix(),
            np.swapaxes(right.R_world_body, 1, 2),
        ):
            estimate = Trajectory(None, right.t_world_body, R)
            for question in ((False, None), (None, False), (False, False)):
                order = judge_order(estimate, truth, question)
                assert order is None or not order.likely, order


def test_where_nothing_can_be_seen_there_is_no_judgement() -> None:
    """Pure translation, a straight line, four poses, positions that do not fit."""
    rng = np.random.default_rng(4)
    truth = world(rng, "smooth")
    n = len(truth)
    still = Trajectory(None, truth.t_world_body, np.tile(np.eye(3), (n, 1, 1)))
    # the identity reads as a half turn in the other order, which is as constant
    assert judge_order(still, still, (False, None)) is None
    line = Trajectory(None, np.arange(n)[:, None] * [1.0, 2, 3], truth.R_world_body)
    assert judge_order(numbers_moved(line, 1), line, (False, None)) is None
    few = truth.take(np.arange(4))
    assert judge_order(numbers_moved(few, 1), few, (False, None)) is None
    lost = Trajectory(None, rng.normal(size=(n, 3)), truth.R_world_body)
    assert judge_order(numbers_moved(lost, 1), truth, (False, None)) is None


def test_the_spread_is_a_mean_angle_whatever_the_signs_of_quaternions() -> None:
    angles = np.array([0.01, -0.01, 0.03, -0.03])
    R = Rotation.from_rotvec(angles[:, None] * [0, 0.6, 0.8]).as_matrix()
    # arcsin against its first order: a relative error of angle^2 / 24
    assert spread(R) == pytest.approx(np.sqrt(np.mean(angles**2)), rel=1e-4)
    quarters = Rotation.from_rotvec(np.arange(4)[:, None] * [0, 0, np.pi / 2])
    assert spread(quarters.as_matrix()) == pytest.approx(np.pi / 2)  # all around: the mean of cos^2 is a half
    assert spread(np.tile(R[:1], (9, 1, 1))) < 1e-7
