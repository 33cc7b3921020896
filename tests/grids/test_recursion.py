"""The derivation of A's chapter 4 on exact joint distributions, and what its readings make of a cell.

The oracle is a table of probabilities: all combinations of S_{t-1}, S_t, the past observations o and the
present one, drawn at random in fractions.  No step of the derivation is used to compute its right side.
"""

from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from vslam_ref.grids.recursion import READINGS, TABLES, follow, recursion

Joint = dict[tuple[int, int, int, int], Fraction]
EPS = float(np.finfo(float).eps)


def random_fractions(rng: np.random.Generator, n: int) -> list[Fraction]:
    """n positive fractions that sum to one."""
    parts = [int(v) for v in rng.integers(1, 50, n)]
    return [Fraction(p, sum(parts)) for p in parts]


def joint(seed: int, markov: bool, static: bool = False, silent: bool = False) -> Joint:
    """P(s_before, s_now, past, now); with ``markov``, o_t depends on S_{t-1} and S_t only.

    ``static``: S_t = S_{t-1} always.  ``silent``: S_t does not depend on S_{t-1}, and is 0 or 1 alike.
    """
    rng = np.random.default_rng(seed)
    p_before, p_past = random_fractions(rng, 2), [random_fractions(rng, 2) for _ in range(2)]
    p_now = [random_fractions(rng, 2) for _ in range(2)]
    if static:
        p_now = [[Fraction(1), Fraction(0)], [Fraction(0), Fraction(1)]]
    if silent:
        p_now = [[Fraction(1, 2)] * 2] * 2
    p_sees = {key: random_fractions(rng, 2) for key in itertools.product(range(2), repeat=3)}
    out = {}
    for b, s, past, o in itertools.product(range(2), repeat=4):
        sees = p_sees[b, s, 0 if markov else past][o]
        out[b, s, past, o] = p_before[b] * p_past[b][past] * p_now[b][s] * sees
    assert sum(out.values()) == 1
    return out


def p(j: Joint, s: int, **given: int) -> Fraction:
    """P(S_t = s | given), given some of ``before``, ``past`` and ``now``."""
    names = {"before": 0, "past": 2, "now": 3}
    kept = {k: v for k, v in j.items() if all(k[names[n]] == value for n, value in given.items())}
    return sum(v for k, v in kept.items() if k[1] == s) / sum(kept.values())


def odds(j: Joint, **given: int) -> Fraction:
    return p(j, 1, **given) / p(j, 0, **given)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("before", [0, 1])
def test_the_recursion_holds_exactly_when_the_observation_depends_on_the_two_states_only(
    seed: int, before: int
) -> None:
    """Every step up to the odds recursion needs this one assumption, and no other."""
    for markov in (True, False):
        j = joint(seed, markov)
        for past, now in itertools.product(range(2), repeat=2):
            left = odds(j, before=before, past=past, now=now)
            right = (
                odds(j, now=now, before=before) / odds(j, before=before) * odds(j, before=before, past=past)
            )
            assert (left == right) == markov


def test_recursion_is_the_product_of_odds() -> None:
    j = joint(1, markov=True)
    log = [float(np.log(float(odds(j, **g)))) for g in (
        {"now": 1, "before": 0}, {"before": 0}, {"before": 0, "past": 1}, {"now": 1, "before": 0, "past": 1}
    )]  # fmt: skip
    assert recursion(*log[:3]) == pytest.approx(log[3], abs=20 * EPS)


def test_the_two_assumptions_exclude_each_other() -> None:
    """P(S_t | S_{t-1}) = 0.5: then the past says nothing of S_t.  S_t is S_{t-1}: then P is 0 or 1."""
    silent, static = joint(2, True, silent=True), joint(2, True, static=True)
    for before, past in itertools.product(range(2), repeat=2):
        assert p(silent, 1, before=before) == p(silent, 1, before=before, past=past) == Fraction(1, 2)
        assert p(static, 1, before=before) == p(static, 1, before=before, past=past) == before


def bayes(start: float, evidence: np.ndarray) -> np.ndarray:
    """Posterior of a cell that does not change, from products of likelihoods: no odds, no recursion."""
    like = np.cumprod(np.exp(evidence))
    prior = 1 / (1 + np.exp(-start))
    posterior = prior * like / (prior * like + (1 - prior))
    return np.log(posterior / (1 - posterior))


@pytest.mark.parametrize("start", [0.0, -1.3])
def test_three_readings_of_six_are_bayes_and_the_printed_one_is_not(start: float) -> None:
    evidence = np.array([0.8, -0.3, 0.5, 0.9, -1.2, 0.4])
    truth = bayes(start, evidence)
    right = {
        (reading, table)
        for reading, table in itertools.product(READINGS, TABLES)
        if np.allclose(follow(evidence, reading, table, start), truth, rtol=0, atol=1e-12)
    }
    assert right == {("unchanged", "conditioned"), ("forgetful", "conditioned"), ("printed", "evidence")}


def test_printed_with_the_conditioned_table_counts_the_past_again_and_again() -> None:
    """L_t = 2 L_{t-1} + e: an observation n looks ago weighs 2^n."""
    e = np.array([0.3, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(follow(e, "printed", "conditioned"), 0.3 * 2.0 ** np.arange(5), rtol=4 * EPS)
    # one weak hit, nothing known after: decided after four looks that say nothing
    assert follow(e, "printed", "conditioned")[-1] > np.log(9.0)
    assert follow(e, "printed", "evidence")[-1] == pytest.approx(0.3)


def test_forgetful_readings_remember_nothing_or_not_enough() -> None:
    e = np.array([2.0, 2.0, 0.1])
    np.testing.assert_array_equal(follow(e, "forgetful", "evidence"), e)
    # conditioned and forgetful: the table alone, which holds S_{t-1}; no memory is lost, for another reason
    np.testing.assert_allclose(follow(e, "forgetful", "conditioned"), np.cumsum(e), rtol=4 * EPS)


def test_unknown_readings_are_refused() -> None:
    with pytest.raises(ValueError, match="reading 'both'"):
        follow([1.0], "both", "evidence")  # type: ignore[arg-type]
