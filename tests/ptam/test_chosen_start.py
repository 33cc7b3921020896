"""A start from two chosen pictures: it is tried once, and its answer is final."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.systems.ptam import ChosenStart, Ptam
from vslam_ref.systems.ptam.start import Attempt

from .conftest import Film, Run
from .test_system import LARGEST_SHARE, path_error


def start(film: Film, first: int, last: int, *, count: int = 45, without: tuple[int, ...] = ()) -> Run:
    """Show the film's first pictures, without some, to a system whose start is chosen."""
    system = Ptam(film.camera, chosen=ChosenStart(first, last))
    numbers = [k for k in range(count) if k not in without]
    outcomes = [system.step(k, film.pictures[k]) for k in numbers]
    system.finish()
    return Run(system, outcomes)


def test_it_starts_there_and_tracks_all_from_there_on(film: Film) -> None:
    done = start(film, 5, 13)
    assert done.system.started_at == (5, 13)
    numbers, _ = done.system.trajectory()
    assert numbers.tolist() == list(range(5, 45))
    assert path_error(film, done) < LARGEST_SHARE
    tried = [o.number for o in done.outcomes if o.attempt is not None]
    assert tried == [13]


def test_a_start_that_cannot_be_is_refused_once_and_for_all(film: Film) -> None:
    """The camera rests from 5 to 6; the pictures after them would have started by themselves."""
    system = Ptam(film.camera, chosen=ChosenStart(5, 6))
    pictures = [*film.pictures[:6], film.pictures[5], *film.pictures[6:20]]
    outcomes = [system.step(k, grey) for k, grey in enumerate(pictures)]
    assert system.map is None
    tried = [o.attempt for o in outcomes if o.attempt is not None]
    assert len(tried) == 1
    assert isinstance(tried[0], Attempt)
    assert system.chosen is not None
    assert system.chosen.no_start() == f"pictures 5 and 6 make no start: {tried[0].reason}"
    assert tried[0].reason
    automatic = Ptam(film.camera)
    for k, grey in enumerate(pictures):
        automatic.step(k, grey)
    assert automatic.map is not None


@pytest.mark.parametrize(
    ("without", "count", "reason"),
    [
        ((5,), 20, "picture 5 could not be looked at"),
        ((13,), 20, "picture 13 could not be looked at"),
        ((), 10, "the pictures ended before number 13"),
        ((13,), 13, "the pictures ended before number 13"),
    ],
    ids=["first is missing", "last is missing", "too early an end", "last is missing at the end"],
)
def test_what_was_not_seen_is_told(film: Film, without: tuple[int, ...], count: int, reason: str) -> None:
    done = start(film, 5, 13, count=count, without=without)
    assert done.system.map is None
    assert done.system.chosen is not None
    assert reason in done.system.chosen.no_start()


@pytest.mark.parametrize(("bare", "number"), [(5, 5), (9, 9)], ids=["the first", "one between"])
def test_a_picture_without_corners_ends_it(film: Film, bare: int, number: int) -> None:
    system = Ptam(film.camera, chosen=ChosenStart(5, 13))
    for k in range(16):
        system.step(k, np.full_like(film.pictures[k], 90) if k == bare else film.pictures[k])
    assert system.map is None
    assert system.chosen is not None
    assert f"corners are found in picture {number}: need 80" in system.chosen.no_start()


@pytest.mark.parametrize(("first", "last"), [(3, 3), (4, 3), (-1, 3)])
def test_the_first_must_be_earlier(first: int, last: int) -> None:
    with pytest.raises(ValueError, match="need the first one earlier"):
        ChosenStart(first, last)
