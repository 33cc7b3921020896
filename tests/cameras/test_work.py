"""A few slow points do not cost the others' time: the inverse drops what is solved."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry.cameras import Camera, _radtan_inverse, pixel_grid
from vslam_ref.geometry.cameras._roots import solve_increasing


@pytest.mark.parametrize("name", ["radtan, left01-14", "radtan, turns back", "rational"])
def test_unprojecting_an_image_asks_for_a_dozen_values_a_pixel(
    cameras: dict[str, Camera], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Newton doubles its digits: 3 to 5 values for the radius, as many in the plane, 4 more for the field,
    the bracket and the ratio of the start.  With the whole batch kept to the end there are over 50.
    """
    asked = []
    radial = _radtan_inverse.radial

    def counting(k: np.ndarray, q: np.ndarray) -> object:
        asked.append(q.size)
        return radial(k, q)

    monkeypatch.setattr(_radtan_inverse, "radial", counting)
    camera = cameras[name]
    uv = pixel_grid((320, 240)) * 2.0
    camera.unproject(uv)
    assert 4 < sum(asked) / (320 * 240) < 18


def test_slow_equations_are_solved_as_well_as_fast_ones() -> None:
    """x + a x^9 = y has the slope 1 at 0 and 1 + 9 a x^8 at x: for a = 1e8 Newton crosses a sharp bend."""
    a = np.array([0.0, 1.0, 1e4, 1e8])
    x = np.array([0.5, 0.7, 0.9, 0.99])

    def f(x: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return x + a[at] * x**9, 1 + 9 * a[at] * x**8

    found = solve_increasing(f, f(x, np.arange(4))[0], np.ones(4))
    assert np.abs(found - x).max() < 1e-15 * 8
