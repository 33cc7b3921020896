"""Exercise 19.1: a corridor in two maps, with the mistakes that are usually made."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

EXERCISE = "19_corridor"
L9 = np.log(9.0)


def logit(p: float) -> float:
    return float(np.log(p / (1 - p)))


def test_a_reading_frees_what_is_before_it_and_says_nothing_of_what_is_behind(answer: ModuleType) -> None:
    seen = np.asarray(answer.observe(3.4, 7))
    if seen[3] == answer.MISS:
        pytest.fail("the cell in which the beam ends is a hit, although the beam also crosses it")
    if (seen[4:] != answer.UNSEEN).any():
        pytest.fail("nothing is known of what lies behind the end of a beam")
    assert seen.tolist() == [1, 1, 1, 2, 0, 0, 0]
    assert np.asarray(answer.observe(3.0, 5)).tolist() == [1, 1, 1, 2, 0], "cell 3 is [3, 4): 3.0 is in it"
    assert np.asarray(answer.observe(0.2, 3)).tolist() == [2, 0, 0]


@pytest.mark.parametrize("reading", [np.inf, 5.0, 80.0])
def test_no_return_frees_the_whole_corridor(answer: ModuleType, reading: float) -> None:
    assert np.asarray(answer.observe(reading, 5)).tolist() == [1] * 5


@pytest.mark.parametrize("reading", [np.nan, 0.0, -2.0, -np.inf])
def test_broken_readings_say_nothing(answer: ModuleType, reading: float) -> None:
    assert np.asarray(answer.observe(reading, 4)).tolist() == [0] * 4


def test_the_table(answer: ModuleType) -> None:
    """All states of S_{t-1} with miss and hit."""
    S = np.array([-3.0, 0.0, 3.0, -3.0, 0.0, 3.0, 1.0])
    before = S.copy()
    seen = np.array([answer.MISS] * 3 + [answer.HIT] * 3 + [answer.UNSEEN])
    new, D = (np.asarray(a, dtype=float) for a in answer.update(S, seen))
    assert np.array_equal(S, before), "the map that is given must not be changed"
    steps = new - before
    if np.allclose(steps[3], logit(0.8)):
        pytest.fail("a hit on free floor is no sign of something static: low, not high")
    if np.allclose(D[:6], [logit(0.05)] * 3 + [logit(0.05), logit(0.95), logit(0.05)]):
        pytest.fail("D is high where S was *free*; where it is undetermined, a hit is a wall not yet known")
    np.testing.assert_allclose(steps[:3], logit(0.3), atol=1e-12, err_msg="a miss lowers S in every state")
    np.testing.assert_allclose(steps[3:6], [logit(0.3), logit(0.8), logit(0.8)], atol=1e-12)
    np.testing.assert_allclose(D[:3], logit(0.05), atol=1e-12)
    np.testing.assert_allclose(D[3:6], [logit(0.95), logit(0.05), logit(0.05)], atol=1e-12)
    assert (new[6], D[6]) == (1.0, 0.0), "a cell that was not seen keeps its S, and has no D"


def test_the_table_is_looked_up_with_the_map_before_the_scan(answer: ModuleType) -> None:
    """Just above free: the hit lowers or raises S by what it was, not by what it becomes."""
    edge = -L9 + 0.01  # undecided
    new, D = answer.update(np.array([edge]), np.array([answer.HIT]))
    assert D[0] < 0, "S_{t-1} was undetermined here: D is low"
    assert new[0] == pytest.approx(edge + logit(0.8))
    edge = -L9 - 0.01  # decided free: stays in D as long as it is hit
    S = np.array([edge])
    for _ in range(5):
        S, D = answer.update(S, np.array([answer.HIT]))
        assert D[0] == pytest.approx(logit(0.95))


def test_s_is_bounded_and_d_forgets(answer: ModuleType) -> None:
    S = np.zeros(1)
    for _ in range(100):
        S, D = answer.update(S, np.array([answer.MISS]))
    assert S[0] == pytest.approx(-answer.S_BOUND)
    assert D[0] == pytest.approx(logit(0.05)), "D is of this observation alone"
    _, D = answer.update(S, np.array([answer.HIT]))
    assert D[0] == pytest.approx(logit(0.95)), "one hit on free floor decides D, however often it was free"


def test_evidence_adds_up_and_is_not_counted_twice(answer: ModuleType) -> None:
    """Two hits on unknown floor are twice one hit."""
    one, _ = answer.update(np.zeros(1), np.array([answer.HIT]))
    two, _ = answer.update(np.asarray(one), np.array([answer.HIT]))
    if two[0] > 2.5 * one[0]:
        pytest.fail("the prior odds count twice: the table's value is evidence, to be added to S once")
    assert two[0] == pytest.approx(2 * one[0])


def test_a_walker_a_wall_and_a_chair(answer: ModuleType) -> None:
    """A wall at 8; somebody walks by; a chair is put down at 4 and settles after 3 seconds."""
    n, S, hit_for = 10, np.zeros(10), np.zeros(10)
    readings = [8.5] * 8 + [6.5, 5.5, 3.5, 2.5] + [8.5] * 2 + [4.5] * 20
    for reading in readings:
        S = np.asarray(answer.settled(hit_for, S, 3.0))
        seen = np.asarray(answer.observe(reading, n))
        S, D = (np.asarray(a) for a in answer.update(S, seen))
        hit_for = np.where(seen == answer.HIT, hit_for + 0.25, np.where(seen == answer.MISS, 0.0, hit_for))
        if reading in (6.5, 5.5, 3.5, 2.5):
            assert D[int(reading)] > L9
            assert S[int(reading)] < -L9
    assert S[8] > L9
    assert S[4] > L9, "the chair has settled"
    assert D[4] < 0
    assert (S[[2, 3]] < -L9).all()


def test_settling_touches_free_cells_only(answer: ModuleType) -> None:
    S = np.array([-5.0, -5.0, -1.0, 5.0])
    before = S.copy()
    out = np.asarray(answer.settled(np.array([3.0, 2.9, 9.0, 9.0]), S, 3.0))
    assert out.tolist() == [0.0, -5.0, -1.0, 5.0]
    assert np.array_equal(S, before), "the map that is given must not be changed"
