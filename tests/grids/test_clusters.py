"""Clusters and tracks: closed forms, and a brute-force account of what lies together."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.grids.clusters import Clusters, TrackConfig, Tracker, find_clusters, slope
from vslam_ref.grids.lattice import Lattice
from vslam_ref.grids.log_odds import LogOddsGrid


def grid(cells: list[tuple[int, int]], shape: tuple[int, int] = (64, 64)) -> LogOddsGrid:
    L = np.full(shape, -3.0)
    L[tuple(np.array(cells, dtype=int).reshape(-1, 2).T)] = 3.0
    return LogOddsGrid(Lattice(0.1, (-10, 5), shape), L)


def flood(cells: set[tuple[int, int]], reach: int) -> set[frozenset[tuple[int, int]]]:
    """Sets of cells that hang together, by search."""
    left, found = set(cells), set()
    while left:
        group, front = set(), {left.pop()}
        while front:
            group |= front
            front = {b for b in left for a in front if max(abs(a[0] - b[0]), abs(a[1] - b[1])) <= reach}
            left -= front
        found.add(frozenset(group))
    return found


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("reach", [1, 2, 3])
def test_clusters_are_what_hangs_together(seed: int, reach: int) -> None:
    rng = np.random.default_rng(seed)
    cells = {tuple(c) for c in rng.integers(0, 64, (90, 2)).tolist()}
    found = find_clusters(grid(sorted(cells)), 0.1 * reach)
    groups = {
        frozenset(map(tuple, found.cells[found.labels == k].tolist())) for k in range(len(found.counts))
    }
    assert groups == flood(cells, reach)
    assert found.counts.sum() == len(cells)


def test_place_and_size_are_those_of_a_rectangle() -> None:
    cells = [(r, c) for r in range(4, 8) for c in range(20, 26)]
    found = find_clusters(grid([*cells, (50, 50)]), 0.3, least_cells=2)
    # rows 4-7 and columns 20-25 of a map whose corner is at (-1, 0.5)
    np.testing.assert_allclose(found.centres, [[-1 + 2.3, 0.5 + 0.6]], atol=1e-12)
    np.testing.assert_allclose(found.sizes, [[0.6, 0.4]], atol=1e-12)
    assert found.counts.tolist() == [24]


def test_no_decided_cell_is_no_cluster() -> None:
    assert len(find_clusters(grid([])).centres) == 0
    assert len(find_clusters(grid([(1, 1)]), least_cells=2).centres) == 0
    assert len(find_clusters(LogOddsGrid(Lattice(0.1), np.zeros((0, 0)))).centres) == 0


def seen(*centres: tuple[float, float]) -> Clusters:
    n, none = len(centres), np.zeros(0, np.int64)
    return Clusters(
        np.array(centres).reshape(n, 2), np.full((n, 2), 0.4), np.full(n, 7), none.reshape(0, 2), none
    )


def test_two_that_meet_keep_their_names_because_they_are_predicted() -> None:
    """They cross 0.3 m apart, where the nearest cluster of before is the other one's."""
    tracker, names = Tracker(TrackConfig(gate=1.0)), set()
    for k in range(41):
        t = 0.25 * k
        a, b = (-5.0 + t, 0.15), (5.0 - t, -0.15)
        tracks = tracker.update(t, seen(a, b) if k % 2 else seen(b, a))
        here = {tuple(track.places[-1]): track.id for track in tracks}
        names.add((here[a], here[b]))
        if k > 5:
            velocity = {track.id: track.velocity for track in tracks}
            np.testing.assert_allclose(velocity[here[a]], [1.0, 0.0], atol=1e-12)
            np.testing.assert_allclose(velocity[here[b]], [-1.0, 0.0], atol=1e-12)
    assert len(names) == 1
    assert len(tracker.moved) == 2


def test_what_is_hidden_for_a_moment_goes_on_and_what_is_lost_ends() -> None:
    for hidden, same in ((3, True), (6, False)):
        tracker = Tracker(TrackConfig(lost_seconds=1.0))
        for k in range(20):
            t = 0.25 * k
            centres = seen((0.8 * t, 0.0)) if not 8 <= k < 8 + hidden else seen()
            tracks = tracker.update(t, centres)
        assert (tracks[0].id == 0) == same


def test_what_goes_to_and_fro_does_not_move() -> None:
    tracker, rng = Tracker(), np.random.default_rng(0)
    for k in range(200):
        tracker.update(0.25 * k, seen((2.0 + rng.uniform(-0.3, 0.3), 0.0)))
    assert tracker.moved == {}
    for k in range(200, 320):  # then it stands still, but for noise, and walks
        x = 2.0 + rng.normal(0, 0.02)
        tracker.update(0.25 * k, seen((x, 0.3 * max(k - 300, 0))))
        assert len(tracker.moved) == (k >= 304)  # 1.2 m away; one step before it was 0.9 m
    walker = Tracker()
    for k in range(12):
        walker.update(0.25 * k, seen((2.0 + rng.normal(0, 0.03), 0.3 * k)))
    (track,) = walker.moved.values()
    # slope of 5 places with noise 0.03 m over 1 s: sigma = 0.03 / sqrt(sum t^2) = 0.03 / 0.79
    assert track.velocity == pytest.approx([0.0, 1.2], abs=5 * 0.038)


def test_slope_is_that_of_polyfit() -> None:
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(0, 3, 9))
    x = rng.normal(size=(9, 2))
    np.testing.assert_allclose(slope(t.tolist(), list(x), 9.0), np.polyfit(t, x, 1)[0], rtol=1e-10)
    recent = t >= t[-1] - 1.0
    expected = np.polyfit(t[recent], x[recent], 1)[0]
    np.testing.assert_allclose(slope(t.tolist(), list(x), 1.0), expected, rtol=1e-9)
    assert slope([1.0], [np.ones(2)], 1.0).tolist() == [0.0, 0.0]


def test_times_must_go_on_and_settings_must_mean_something() -> None:
    tracker = Tracker()
    tracker.update(1.0, seen((0.0, 0.0)))
    with pytest.raises(ValueError, match="must be later"):
        tracker.update(1.0, seen((0.0, 0.0)))
    for bad in ({"join": 0.0}, {"gate": -1.0}, {"least_cells": 0}, {"confirm": 1}, {"wander": 0.5}):
        with pytest.raises(ValueError, match=next(iter(bad))):
            TrackConfig(**bad)
