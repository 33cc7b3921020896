"""The inverse sensor's table: its cells, its reasons, and what it refuses."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from vslam_ref.grids import InverseSensor
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS, FREE, OCCUPIED, UNKNOWN

MISS, HIT, GRAZE = 0, 1, 2
HIGH_S = {(UNKNOWN, HIT), (OCCUPIED, HIT)}
HIGH_D = {"free": {(FREE, HIT)}, "unknown": {(UNKNOWN, HIT)}}


@pytest.mark.parametrize("where", ["free", "unknown"])
def test_the_table_is_high_where_the_page_says_and_low_elsewhere(where: str) -> None:
    steps = InverseSensor().steps(where)  # type: ignore[arg-type]
    for table, high in ((steps.static, HIGH_S), (steps.dynamic, HIGH_D[where])):
        assert {(int(a), int(b)) for a, b in np.argwhere(table > 0)} == high
        assert (table[:, [MISS, HIT]] != 0).all()


def test_the_reasons_of_the_values_are_true() -> None:
    """Each number in a reason, recomputed."""
    steps = InverseSensor().steps()
    hit, miss = steps.static[UNKNOWN, HIT], steps.static[UNKNOWN, MISS]
    assert hit < DECIDED_LOG_ODDS < 2 * hit
    assert 3 * miss < -DECIDED_LOG_ODDS < 2 * miss
    assert abs(miss) < hit
    assert steps.dynamic[FREE, HIT] > DECIDED_LOG_ODDS
    assert steps.dynamic[FREE, HIT] + steps.dynamic[FREE, MISS] == pytest.approx(0.0, abs=1e-12)
    graze = steps.static[:, GRAZE]
    assert graze[FREE] == miss
    assert graze[UNKNOWN] == pytest.approx(miss / 2, rel=0.05)
    assert graze[OCCUPIED] == 0.0
    np.testing.assert_array_equal(steps.dynamic[:, GRAZE], steps.dynamic[:, MISS])
    for f in dataclasses.fields(InverseSensor):
        assert f.metadata["reason"]


@pytest.mark.parametrize(
    "bad",
    [
        {"s_high": 0.5},
        {"s_high": 1.0},
        {"s_miss": 0.5},
        {"s_graze": 0.5},
        {"d_low": 0.0},
        {"d_high": float("nan")},
    ],
)
def test_values_on_the_wrong_side_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(bad))):
        InverseSensor(**bad)


def test_an_unknown_reading_is_refused() -> None:
    with pytest.raises(ValueError, match="d_high_where='everywhere'"):
        InverseSensor().steps("everywhere")  # type: ignore[arg-type]
