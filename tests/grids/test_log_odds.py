"""Log-odds and lattices: round trips, bounds, growth that moves nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import entr, expit, logit

from vslam_ref.grids import lattice as lattices
from vslam_ref.grids import log_odds as lo
from vslam_ref.grids.lattice import Lattice

EPS = float(np.finfo(float).eps)


def test_log_odds_are_scipys_logit_and_back() -> None:
    p = np.concatenate([np.linspace(0.001, 0.999, 99), [1e-300, 1 - EPS]])
    np.testing.assert_allclose(lo.log_odds(p), logit(p), rtol=4 * EPS, atol=4 * EPS)
    L = np.linspace(-800, 800, 333)
    np.testing.assert_allclose(lo.probability(L), expit(L), rtol=4 * EPS, atol=1e-300)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 1.1, np.nan])
def test_probabilities_without_log_odds_are_refused(p: float) -> None:
    with pytest.raises(ValueError, match="strictly between 0 and 1"):
        lo.log_odds([0.5, p])


def test_entropy_is_that_of_two_outcomes() -> None:
    L = np.linspace(-30, 30, 121)
    p = expit(-np.abs(L))
    np.testing.assert_allclose(
        lo.entropy_bits(L), (entr(p) + entr(1 - p)) / np.log(2), rtol=1e-13, atol=4 * EPS
    )
    assert lo.entropy_bits(0.0) == 1.0
    assert lo.entropy_bits(1e4) == 0.0


def test_a_cell_is_decided_above_nine_tenths_and_below_one() -> None:
    p = np.array([0.0999, 0.1001, 0.5, 0.8999, 0.9001])
    states = [lo.FREE, lo.UNKNOWN, lo.UNKNOWN, lo.UNKNOWN, lo.OCCUPIED]
    assert lo.states(lo.log_odds(p)).tolist() == states


@given(
    st.floats(0.01, 10),
    st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=1, max_size=5),
)
def test_cells_hold_their_points_and_growth_moves_no_cell(resolution: float, points: list) -> None:
    small = 50 * resolution
    xy = np.array(points) / 500 * small  # within 50 cells of the origin
    grown = Lattice(resolution)
    for point in xy:
        grown = grown.grown(point, point)
    cells = grown.cells_from_world(xy)
    assert grown.inside(cells).all()
    centre = grown.world_from_cells(cells)
    # half a cell, and rounding of coordinates of up to 100 cells
    assert np.abs(centre - xy).max() <= resolution * (0.5 + 1000 * EPS)
    larger = grown.grown([-3 * small, 0.0], [0.0, 3 * small])
    np.testing.assert_allclose(
        larger.world_from_cells(larger.cells_from_world(xy)), centre, atol=1e3 * EPS * small
    )
    layer = np.random.default_rng(0).normal(size=grown.shape)
    moved = larger.moved(layer, grown, -7.0)
    at = larger.cells_from_world(centre)
    np.testing.assert_array_equal(moved[at[:, 0], at[:, 1]], layer[cells[:, 0], cells[:, 1]])
    assert np.count_nonzero(moved == -7.0) == moved.size - layer.size


def test_growth_stops_at_its_limit_and_says_so() -> None:
    inside = Lattice(0.1).grown([0, 0], [300, 300])
    assert inside.size <= lattices.MAX_CELLS
    with pytest.raises(ValueError, match=r"m at 0.1 m needs \d+ cells, more than the limit of 16000000"):
        inside.grown([0, 0], [500, 500])
    with pytest.raises(ValueError, match="more than the limit"):
        Lattice(1e-9).grown([0, 0], [1, 1])


@pytest.mark.parametrize("resolution", [0.0, -0.1, np.nan, np.inf])
def test_a_resolution_must_be_positive(resolution: float) -> None:
    with pytest.raises(ValueError, match="must be positive and finite"):
        Lattice(resolution)


@pytest.mark.parametrize("point", [(np.nan, 0.0), (np.inf, 0.0), (0.0, 1e300)])
def test_points_that_are_nowhere_are_refused(point: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="must be finite"):
        Lattice(0.1).grown(point, (1.0, 1.0))


def test_a_part_lies_where_it_lay() -> None:
    whole = lo.LogOddsGrid(Lattice(0.5, (-3, 2), (4, 6)), np.arange(24.0).reshape(4, 6))
    part = whole.part(slice(1, 3), slice(2, 5))
    at = part.lattice.world_from_cells([[0, 0], [1, 2]])
    np.testing.assert_array_equal(whole.at(at), part.log_odds[[0, 1], [0, 2]])
    assert whole.at([[1e6, 0.0]]) == 0.0
    with pytest.raises(ValueError, match="shape"):
        lo.LogOddsGrid(whole.lattice, np.zeros((2, 2)))
