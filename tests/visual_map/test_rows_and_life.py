"""Rows are names for good; a point dies of two things only; a snapshot stays as it was."""

from __future__ import annotations

from collections.abc import Callable

import hypothesis.strategies as st
import numpy as np
from hypothesis import given

from vslam_ref.systems.visual_map import PreparedPicture, VisualMap, neighbours, shared_points
from vslam_ref.systems.visual_map.rows import FIRST, Rows

MakeMap = Callable[..., VisualMap]


@given(st.lists(st.integers(0, 90), min_size=1, max_size=8))
def test_rows_keep_what_was_written_however_often_they_grow(counts: list[int]) -> None:
    rows, total = Rows(x=((2,), np.float64), k=((), np.int64)), 0
    for count in counts:
        number = rows.append(count, x=np.arange(total, total + count)[:, None] + [0.0, 0.5])
        assert number.tolist() == list(range(total, total + count))
        total += count
    assert len(rows) == total
    np.testing.assert_array_equal(rows["x"], np.arange(total)[:, None] + [0.0, 0.5])
    assert (rows["k"] == 0).all()


def test_columns_are_views_and_frozen_copies_are_not() -> None:
    rows = Rows(x=((), np.float64))
    rows.append(3, x=[1.0, 2.0, 3.0])
    frozen, shown, old = rows.frozen(), rows.shown(), rows["x"]
    rows["x"][0] = 9.0
    rows.append(FIRST, x=4.0)  # beyond the first room: the column moves
    rows["x"][1] = 8.0
    assert frozen["x"].tolist() == [1.0, 2.0, 3.0]
    assert len(frozen) == len(shown) == 3
    assert shown["x"].tolist() == old.tolist() == [9.0, 2.0, 3.0]
    frozen["x"][2] = 7.0
    assert rows["x"][:3].tolist() == [9.0, 8.0, 3.0]


def test_a_point_dies_when_its_source_goes_or_fewer_than_two_are_left(make_map: MakeMap) -> None:
    """Single sightings of a map, one at a time: the source, or another."""
    fresh = make_map()
    seen = fresh.sightings
    for row in range(0, len(seen), 13):
        visual_map = make_map()
        n = int(seen["point"][row])
        is_source = seen["kf"][row] == visual_map.points["source_kf"][n]
        died = visual_map.take_back(np.array([row]))
        assert died.tolist() == ([n] if is_source else [])
        assert np.flatnonzero(~visual_map.alive).tolist() == died.tolist()
        off = visual_map.sightings["point"][~visual_map.sightings["on"]]
        assert set(off.tolist()) == {n}


def test_a_point_lives_to_its_second_last_sighting(make_map: MakeMap) -> None:
    visual_map = make_map()
    n = int(np.argmax(np.bincount(visual_map.sightings["point"])))
    rows = np.flatnonzero(visual_map.sightings["point"] == n)  # the source is the first of them
    assert len(rows) >= 4
    for left in range(len(rows) - 1, 1, -1):
        assert visual_map.take_back(rows[left : left + 1]).tolist() == []
        assert visual_map.alive[n]
    assert visual_map.take_back(rows[1:2]).tolist() == [n]
    assert not visual_map.sightings["on"][rows].any()
    assert visual_map.take_back(rows).tolist() == []  # it dies once


def test_numbers_are_never_used_again(make_map: MakeMap) -> None:
    visual_map = make_map()
    count, sightings = len(visual_map.points), len(visual_map.sightings)
    visual_map.remove(np.arange(count))
    assert not visual_map.alive.any()
    assert not visual_map.sightings["on"].any()
    new = visual_map.add_points([[0.0, 0, 2], [0, 1, 2]], 1, 0, [[60.0, 50], [60, 90]])
    assert new.tolist() == [count, count + 1]
    assert np.flatnonzero(visual_map.sightings["on"]).tolist() == [sightings, sightings + 1]
    assert visual_map.measured_in(1).tolist() == new.tolist()


def test_the_version_moves_with_every_change(make_map: MakeMap) -> None:
    visual_map, versions = make_map(), []
    for change in (
        lambda: visual_map.observe(0, [0], 0, [[1.0, 1.0]]),
        lambda: visual_map.take_back(np.array([0])),
        lambda: visual_map.remove(np.array([1])),
        lambda: visual_map.add_points([[0.0, 0, 2]], 0, 0, [[5.0, 5]]),
    ):
        change()
        versions.append(visual_map.version)
    assert len(set(versions)) == 4


def test_shared_points_and_neighbours_by_counting(make_map: MakeMap) -> None:
    visual_map = make_map(keyframes=7)
    visual_map.take_back(np.random.default_rng(1).random(len(visual_map.sightings)) < 0.2)
    sets = [set(visual_map.measured_in(k).tolist()) for k in range(7)]
    shared = np.stack([shared_points(visual_map, kf) for kf in range(7)])
    assert shared.tolist() == [[len(a & b) for b in sets] for a in sets]
    for kf in range(7):
        near = neighbours(visual_map, kf, 3)
        assert kf not in near
        counts = [int(shared[kf, k]) for k in near]
        others = [int(shared[kf, k]) for k in range(7) if k != kf and k not in near]
        assert counts == sorted(counts, reverse=True)
        assert min(counts) >= max(others)


def test_a_snapshot_does_not_see_what_happens_later(make_map: MakeMap) -> None:
    visual_map = make_map()
    then = visual_map.snapshot()
    kept = {
        "T": then.T_kf_world.copy(),
        "X": then.X_world.copy(),
        "alive": then.alive.copy(),
        "on": then.sightings["on"].copy(),
        "image": then.image(1).copy(),
    }
    picture = PreparedPicture(
        9, tuple(image[-1] for image in (then.image(0), then.image(1))), then.corners[0], then.small[0]
    )
    for _ in range(FIRST):  # beyond the room of the first keyframes
        visual_map.add_keyframe(np.eye(4), picture)
    visual_map.T_kf_world[:] = 0.0
    visual_map.X_world[:] = 0.0
    visual_map.points["tried"][:] = 5
    visual_map.remove(np.arange(10))
    visual_map.add_points(np.zeros((200, 3)), 0, 0, np.full((200, 2), 50.0))
    for name, now in (
        ("T", then.T_kf_world),
        ("X", then.X_world),
        ("alive", then.alive),
        ("on", then.sightings["on"]),
        ("image", then.image(1)),
    ):
        np.testing.assert_array_equal(now, kept[name], err_msg=name)
    assert (then.points["tried"] == 0).all()
    assert len(then.keyframes) == len(then.corners) == len(then.small) == 5
