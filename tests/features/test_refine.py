"""Refinement on pictures whose shift is known because they are drawn from a formula.

The bound.  At the answer u the equations say sum (g - mean g)(T(d) - B(u + d)) = 0, B the interpolated
image.  With f the true grey levels and e the error of u, T - B = (T - f) - (B - f) - grad f . e to first
order.  Call the first two terms eps (36 numbers, their mean taken off): e = S^-1 sum (g - mean g) eps.  S is
the Gram matrix of the slopes, so |e| <= |eps| / sqrt(smallest eigenvalue of S).  The test computes eps with
the formula and SciPy's interpolation at the true place.  Slopes from differences are off by (0.7)^2 / 6 = 8 %
at most, second-order terms by about as much: |e| may be 1.25 times the bound, and 0.01 more, as the iteration
ends with a step below 0.01.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from vslam_ref.features.corners import detect
from vslam_ref.features.refinement import State, refine
from vslam_ref.features.templates import cut

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]
pytestmark = pytest.mark.usefixtures("backend")
CENTRE = np.array([30, 28])


class Waves:
    """A sum of six plane waves around 128, of at most 0.7 radians per pixel."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        angle, size = rng.uniform(0, 2 * np.pi, 6), rng.uniform(0.3, 0.7, 6)
        self.k = np.stack([size * np.cos(angle), size * np.sin(angle)], 1)
        self.phase, self.height = rng.uniform(0, 2 * np.pi, 6), rng.uniform(8, 17, 6)

    def at(self, uv: Array) -> Array:
        value: Array = 128 + np.sum(self.height * np.sin(uv @ self.k.T + self.phase), -1)
        return value

    def slope(self, uv: Array) -> Array:
        value: Array = (self.height * np.cos(uv @ self.k.T + self.phase)) @ self.k
        return value

    def draw(self, shift: Array, offset: float = 0.0) -> Bytes:
        y, x = np.mgrid[0:60, 0:64].astype(float)
        grey = self.at(np.stack([x, y], -1) - shift) + offset
        return np.rint(np.clip(grey, 0, 255)).astype(np.uint8)


def bound(waves: Waves, image: Bytes, shift: Array, offset: float) -> float:
    step = np.arange(-3.0, 3.0)
    d = np.stack(np.meshgrid(step, step), -1).reshape(-1, 2)
    f = waves.at(CENTRE + d)
    seen = map_coordinates(image.astype(float), (CENTRE + shift + d).T[::-1], order=1)
    eps = (np.rint(f) - f) - (seen - offset - f)
    g = waves.slope(CENTRE + d)
    g = g - g.mean(0)
    return float(np.linalg.norm(eps - eps.mean()) / np.sqrt(np.linalg.eigvalsh(g.T @ g)[0]))


@pytest.mark.parametrize("offset", [0.0, 25.0, -30.0])
def test_known_shifts_are_found_within_the_bound(offset: float) -> None:
    rng = np.random.default_rng(int(abs(offset)))
    errors, used = [], 0
    for seed in range(60):
        waves, shift = Waves(seed), rng.uniform(-0.9, 0.9, 2)
        image = waves.draw(shift, offset)
        if bound(waves, image, shift, offset) > 0.3:  # hardly any slope that the offset would not take
            continue
        used += 1
        found = refine(image, cut(waves.draw(np.zeros(2)), [CENTRE]).patch, [CENTRE])
        assert found.state[0] == State.OK
        error = float(np.linalg.norm(found.uv[0] - CENTRE - shift))
        assert error <= 1.25 * bound(waves, image, shift, offset) + 0.01
        assert abs(found.offset[0] - offset) < 2.0
        errors.append(error)
    assert used > 20
    assert (
        np.sqrt(np.mean(np.square(errors))) < 0.08
    )  # the bound is 0.17 in the middle, and one third of it a usual error


def test_all_at_once_is_one_by_one() -> None:
    waves = Waves(4)
    first, second = waves.draw(np.zeros(2)), waves.draw(np.array([0.4, -0.3]))
    xy = np.array([[20, 20], [30, 28], [40, 33], [3, 3], [25, 40]])
    patch = cut(first, xy).patch
    together = refine(second, patch, xy)
    for k in range(len(xy)):
        alone = refine(second, patch[k : k + 1], xy[k : k + 1])
        assert np.allclose(alone.uv[0], together.uv[k], atol=1e-9)
        assert alone.state[0] == together.state[k]


def test_how_it_can_end() -> None:
    x = np.arange(64)
    ramp = np.broadcast_to((3 * x).astype(np.uint8), (60, 64))
    wave = np.broadcast_to(np.rint(128 + 90 * np.sin(0.6 * x)).astype(np.uint8), (60, 64))
    waves = Waves(2).draw(np.zeros(2))
    patches = {
        State.FLAT: (ramp, cut(ramp, [CENTRE]).patch, CENTRE),  # an offset explains a shifted plane
        State.OUTSIDE: (waves, cut(waves, [[30, 30]]).patch, np.array([2.0, 30.0])),
        State.OK: (waves, cut(waves, [CENTRE]).patch, CENTRE),
    }
    for state, (image, patch, at) in patches.items():
        found = refine(image, patch, [at])
        assert found.state[0] == state
        assert bool(State(found.state[0]).reason) == (state != State.OK)
        assert found.ok[0] == (state == State.OK)
    assert refine(wave, cut(wave, [CENTRE]).patch, [CENTRE]).state[0] == State.FLAT  # no slope along the wave


def test_a_patch_that_wanders_is_given_up() -> None:
    """A template that is a negative of the image pushes away from itself."""
    states = set()
    for seed in range(20):
        waves = Waves(seed).draw(np.zeros(2))
        states.add(int(refine(waves, cut(255 - waves, [CENTRE]).patch, [CENTRE + 0.4]).state[0]))
    assert State.ASTRAY in states


def test_noise_moves_it_as_much_as_the_matrix_says() -> None:
    """Covariance sigma^2 S^-1: the mean of e^T S e / sigma^2 over n places is 2, its deviation 2 / sqrt(n).

    The template's own rounding adds 1/12; interpolation lowers noise, but not at whole places.
    Band: four deviations, and 15 % for slopes that are differences.
    """
    waves, sigma, rng = Waves(11), 3.0, np.random.default_rng(5)
    clean = waves.draw(np.zeros(2))
    corners = detect(clean, 5).xy
    xy = corners[(corners >= 8).all(1) & (corners < 52).all(1)][:1]
    xy = np.repeat(xy if len(xy) else CENTRE[None], 1, 0)
    patch = cut(clean, xy).patch
    step = np.arange(-3.0, 3.0)
    d = np.stack(np.meshgrid(step, step), -1).reshape(-1, 2)
    g = waves.slope(xy[0] + d)
    g = g - g.mean(0)
    S, ratios = g.T @ g, []
    for _ in range(400):
        noisy = np.rint(np.clip(clean + sigma * rng.standard_normal(clean.shape), 0, 255)).astype(np.uint8)
        found = refine(noisy, patch, xy)
        e = found.uv[0] - xy[0]
        ratios.append(e @ S @ e / sigma**2)
    assert abs(np.mean(ratios) - 2.0) < 4 * 2 / np.sqrt(400) + 0.3 * 2


def test_shapes_that_do_not_fit_are_refused() -> None:
    image = np.zeros((30, 30), np.uint8)
    with pytest.raises(ValueError, match=r"need uint8 \(N, 8, 8\)"):
        refine(image, np.zeros((1, 7, 7), np.uint8), [[10, 10]])
