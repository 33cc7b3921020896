"""The building of look-alikes: doors are alike and numbered, the second round sees what the first one saw."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry import se3
from vslam_ref.worlds.rendered.lookalikes import LAP, Repeats, lookalikes, overlap

SIZE = (64, 48)


def test_the_second_round_sees_the_first_and_the_other_side_does_not() -> None:
    made = lookalikes(3, size=SIZE, pictures=24)
    shared = overlap(made)
    assert np.allclose(np.diag(shared), 1.0)  # every point of the grid is seen from where it was taken
    again = np.array([shared[k + 12, k] for k in range(12)])
    assert (again > 0.6).all()
    across = np.array([shared[k, k + 6] for k in range(6)])  # half a round on: the opposite corridor
    assert (across == 0.0).all()


def test_two_rounds_are_at_one_place_but_not_at_one_point() -> None:
    made = lookalikes(4, size=SIZE, pictures=40)
    centre = se3.inverse(made.T_cam_world)[:, :3, 3]
    apart = np.linalg.norm(centre[20:] - centre[:20], axis=1)
    assert made.times[20] == pytest.approx(LAP)
    assert 0.02 < apart.mean() < 1.0


def test_doors_are_one_picture_and_their_numbers_are_not() -> None:
    def doors(repeats: Repeats) -> int:
        made = lookalikes(5, size=SIZE, pictures=2, repeats=repeats)
        tall = np.abs(made.quads.side[:, 1, 2]) == 2.05
        return len(np.unique(made.quads.texture[tall]))

    assert doors(Repeats(numbered=False)) == 1
    assert doors(Repeats()) > 10


def test_the_same_seed_gives_the_same_picture() -> None:
    one, two, other = (lookalikes(seed, size=SIZE, pictures=3).frame(2) for seed in (1, 1, 2))
    assert (one == two).all()
    assert (one != other).any()


def test_numbers_that_mean_nothing_are_refused() -> None:
    for wrong in ({"pictures": 1}, {"repeats": Repeats(doors=2.0)}, {"repeats": Repeats(posters=0)}):
        with pytest.raises(ValueError, match="need"):
            lookalikes(1, **wrong)
