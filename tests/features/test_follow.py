"""Points followed between two pictures of a painted wall, where the second one is drawn, not warped."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.features.corners import detect, shi_tomasi
from vslam_ref.features.following import View, follow
from vslam_ref.worlds.pictures import moved, painted_wall, picture

Bytes = NDArray[np.uint8]
SIZE = (320, 240)
H_B_A = np.array([[1.01, 0.015, 4.0], [-0.015, 1.0, 3.0], [1e-5, 0.0, 1.0]])
pytestmark = pytest.mark.usefixtures("backend")


@pytest.fixture(scope="module")
def pair() -> tuple[View, View]:
    rng = np.random.default_rng(2)
    wall = painted_wall(rng, 250, SIZE)
    return tuple(look(picture(wall, H, size=SIZE, noise=2.0, rng=rng)) for H in (np.eye(3), H_B_A))  # type: ignore[return-value]


def look(image: Bytes) -> View:
    return View(image, detect(image, 8))


def strong(view: View) -> NDArray[np.float64]:
    image = view.image
    xy = detect(image, 15, suppress=True).xy
    xy = xy[(xy >= 20).all(1) & (xy < np.array(image.shape[::-1]) - 20).all(1)]
    return xy[shi_tomasi(image, xy) > 200].astype(float)


def test_points_go_where_the_homography_takes_them(pair: tuple[View, View]) -> None:
    """Refinement with slopes of 15 to 40 grey levels and noise of 2 in both: about 0.05 pixels; a patch that
    changes by 1.5 % over 4 pixels adds 0.06.  A wrong match is off by at least 1.
    """
    uv = strong(pair[0])
    assert len(uv) > 150
    found = follow(*pair, uv, 10.0)
    error = np.hypot(*(found.uv - moved(H_B_A, uv))[found.ok].T)
    assert found.ok.mean() > 0.8
    assert np.median(error) < 0.1
    assert np.mean(error > 0.5) < 0.03


def test_a_guess_saves_a_large_radius(pair: tuple[View, View]) -> None:
    uv = strong(pair[0])
    assert follow(*pair, uv, 2.0, guess=moved(H_B_A, uv) + 0.8).ok.mean() > 0.6
    assert follow(*pair, uv, 2.0).ok.mean() < 0.3


def test_the_way_back_tells_look_alikes_apart() -> None:
    """A row of dots, 8 pixels apart, of rising brightness; in the second picture the first one is missing.

    The first dot then finds the second one, which differs little once the means are taken off.  Seen from
    there, the second dot of the first picture fits better: the match is refused.  All others stay.
    """
    rng = np.random.default_rng(1)
    first = np.full((40, 80), 100.0)
    for k in range(6):
        first[18:21, 20 + 8 * k : 23 + 8 * k] += 80 + 10 * k
    second = first.copy()
    second[18:21, 20:23] = 100.0
    one, two = (look(np.rint(i + rng.normal(0, 1, i.shape)).astype(np.uint8)) for i in (first, second))
    uv = [[21.0 + 8 * k, 19.0] for k in range(6)]
    assert follow(one, two, uv, 10.0).ok.tolist() == [False] + 5 * [True]
    assert follow(one, two, uv, 10.0, home=np.inf).ok.tolist() == 6 * [True]


def test_nothing_to_follow_and_nothing_to_find(pair: tuple[View, View]) -> None:
    blank = look(np.full((240, 320), 90, np.uint8))
    uv = strong(pair[0])[:5]
    for one, two in ((pair[0], blank), (blank, pair[0])):
        found = follow(one, two, uv, 10.0)
        assert not found.ok.any()
        np.testing.assert_array_equal(found.uv, uv)
    assert follow(*pair, np.zeros((0, 2))).uv.shape == (0, 2)
