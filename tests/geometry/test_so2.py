"""SO(2): angles, matrices, and the edges at +-pi."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import polar

from vslam_ref.geometry import so2

EPS = float(np.finfo(float).eps)
ANGLES = st.floats(-1e3, 1e3)
BATCHES = [(), (1,), (3, 1, 2)]


@given(ANGLES)
def test_wrap_is_the_same_rotation_in_the_half_open_interval(angle: float) -> None:
    wrapped = float(so2.wrap(angle))
    assert -np.pi < wrapped <= np.pi
    mpmath.mp.dps = 50
    turns = (mpmath.mpf(angle) - mpmath.mpf(wrapped)) / (2 * mpmath.pi)
    # 2 pi itself is off by 2.4e-16, times the turns, and the sum by eps |angle|
    assert abs(turns - mpmath.nint(turns)) < 2 * EPS * (1 + abs(angle))


@given(st.floats(-np.pi, np.pi, exclude_min=True))
def test_wrap_leaves_what_is_inside_bit_for_bit(angle: float) -> None:
    assert float(so2.wrap(angle)) == angle


@pytest.mark.parametrize(
    ("angle", "expected"),
    [
        (np.pi, np.pi),
        (-np.pi, np.pi),  # the excluded end
        (3 * np.pi, np.pi),
        (-3 * np.pi, np.pi),
        (2 * np.pi, 0.0),
        (0.0, 0.0),
        (np.nextafter(np.pi, 4), np.pi),  # -pi + 3e-16 rounds to the excluded end
        (np.nextafter(-np.pi, -4), np.pi),
        (np.pi + 1e-9, -np.pi + 1e-9),
        (-np.pi - 1e-9, np.pi - 1e-9),
    ],
)
def test_wrap_at_the_edges(angle: float, expected: float) -> None:
    wrapped = float(so2.wrap(angle))
    assert -np.pi < wrapped <= np.pi
    assert abs(wrapped - expected) <= 2 * np.spacing(np.pi)


@pytest.mark.parametrize("tiny", [5e-324, 1e-300, 1e-17, 1e-16])
def test_wrap_a_hair_beyond_the_end_stays_inside(tiny: float) -> None:
    for angle in (np.pi + tiny, -np.pi - tiny, -np.pi + tiny, 2 * np.pi - tiny, -tiny):
        assert -np.pi < float(so2.wrap(angle)) <= np.pi


@given(st.floats(-np.pi, np.pi, exclude_min=True))
def test_log_after_exp(angle: float) -> None:
    assert abs(float(so2.log(so2.exp(angle))) - angle) <= 4 * EPS * max(1, abs(angle))


@given(st.floats(-np.pi, np.pi))
def test_exp_is_the_matrix_exponential(angle: float) -> None:
    mpmath.mp.dps = 50
    exact = mpmath.expm(mpmath.matrix([[0, -angle], [angle, 0]]))
    assert max(abs(float(exact[i, j]) - so2.exp(angle)[i, j]) for i in range(2) for j in range(2)) <= EPS


@given(st.floats(-np.pi, np.pi), st.floats(-10, 10), st.floats(-10, 10))
def test_act_is_the_matrix_product(angle: float, x: float, y: float) -> None:
    assert np.abs(so2.rotate(angle, [x, y]) - so2.exp(angle) @ [x, y]).max() <= 4 * EPS * (abs(x) + abs(y))


@pytest.mark.parametrize("batch", BATCHES)
def test_batches_are_the_single_results(batch: tuple[int, ...]) -> None:
    phi = np.random.default_rng(1).uniform(-9, 9, batch)
    x = np.random.default_rng(2).normal(size=(*batch, 2))
    R = so2.exp(phi)
    assert so2.wrap(phi).shape == batch
    assert R.shape == (*batch, 2, 2)
    assert so2.log(R).shape == batch
    assert so2.rotate(phi, x).shape == (*batch, 2)
    assert so2.nearest(R).shape == (*batch, 2, 2)
    for i in np.ndindex(batch):
        assert np.abs(R[i] - so2.exp(phi[i])).max() <= EPS
        assert abs(so2.log(R)[i] - so2.wrap(phi[i])) <= 8 * EPS


@pytest.mark.parametrize("seed", range(5))
def test_nearest_is_the_polar_factor(seed: int) -> None:
    """For a matrix of positive determinant SciPy's orthogonal polar factor is the nearest rotation."""
    rng = np.random.default_rng(seed)
    M = so2.exp(rng.uniform(-3, 3)) + 0.3 * rng.normal(size=(2, 2))
    assert np.linalg.det(M) > 0
    assert np.abs(so2.nearest(M) - polar(M)[0]).max() < 32 * EPS


def test_nearest_of_a_reflected_matrix_is_the_best_of_a_fine_grid() -> None:
    M = np.array([[1.0, 0.2], [0.3, -0.4]])
    assert np.linalg.det(M) < 0
    grid = so2.exp(np.linspace(-np.pi, np.pi, 20001))
    best = np.linalg.norm(grid - M, axis=(1, 2)).min()
    found = np.linalg.norm(so2.nearest(M) - M)
    assert found <= best
    assert best - found < (2 * np.pi / 20000) ** 2


def test_nearest_refuses_what_has_none() -> None:
    with pytest.raises(ValueError, match="undefined"):
        so2.nearest([[1.0, 0.0], [0.0, -1.0]])
