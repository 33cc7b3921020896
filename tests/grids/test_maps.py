"""S, D and the plain map against a slow cell-by-cell account of the rules, and the rules' consequences.

``Slow`` keeps a dictionary per cell and does what the module says, one cell at a time; only the crossed
cells come from :mod:`rays`, which has an oracle of its own.  Sums are the same, so values agree to a few eps.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from vslam_ref import _kernels
from vslam_ref.grids import (
    AS_PRINTED,
    MapConfig,
    PlainMap,
    Scan,
    StaticDynamicMap,
    beam_marks,
    rays,
    static_dynamic,
)
from vslam_ref.grids.log_odds import FREE, OCCUPIED, UNKNOWN, states
from vslam_ref.grids.scan import BeamCounts, LaserScanner

BACKENDS = ["numpy", "numba"]


@pytest.fixture(params=BACKENDS)
def backend(request: pytest.FixtureRequest) -> object:
    if request.param == "numba":
        pytest.importorskip("numba", reason="the twins need numba")
    with _kernels.use_backend(request.param) as name:
        yield name


class Slow:
    """The rules, one cell at a time."""

    def __init__(self, config: MapConfig) -> None:
        self.c, self.cells, self.plain = config, {}, {}
        self.grazed = 0

    def state(self, cell: tuple[int, int]) -> int:
        odds = math.exp(self.cells[cell]["s"]) if cell in self.cells else 1.0
        p = odds / (1 + odds)
        return OCCUPIED if p > 0.9 else FREE if p < 0.1 else UNKNOWN

    def update(self, pose: np.ndarray, scan: Scan) -> None:
        c, s = self.c, self.c.sensor
        observed: dict[tuple[int, int], str] = {}
        hits = []
        start = pose[:2] / c.resolution
        for angle, r in zip(scan.angles, scan.ranges, strict=True):
            if not r > 0 or (r >= scan.max_range and c.no_return == "ignore"):
                continue
            length = min(r, c.usable_range, scan.max_range)
            direction = np.array([np.cos(pose[2] + angle), np.sin(pose[2] + angle)])
            end = (pose[:2] + length * direction) / c.resolution
            is_hit = r < scan.max_range and r <= c.usable_range
            crossed = [tuple(cell) for cell in rays.crossed_cells(start, [end]).cells.tolist()]
            longer = 1 if abs(end[0] - start[0]) >= abs(end[1] - start[1]) else 0
            for cell in crossed:
                near = is_hit and c.graze > 0 and abs(cell[longer] - crossed[-1][longer]) <= c.graze
                if not near or cell not in observed:
                    observed[cell] = "graze" if near else "miss"
            if is_hit:
                x, y = beam_marks.end_cells(end[None])[0].tolist()
                hits.append((y, x))
        observed |= dict.fromkeys(hits, "hit")
        before = {cell: self.state(cell) for cell in self.cells}
        for cell, what in observed.items():
            self.one(cell, what, before, scan.time)
            self.grazed += what == "graze"
            e = s.s_high if what == "hit" else s.s_miss
            most = math.log(c.s_most / (1 - c.s_most))
            value = self.plain.get(cell, 0.0) + math.log(e / (1 - e))
            self.plain[cell] = min(max(value, -most), most)

    def one(self, cell: tuple[int, int], what: str, before: dict, now: float) -> None:
        c, s = self.c, self.c.sensor
        fresh = {"s": 0.0, "d": 0.0, "seen": -math.inf, "last_hit": -math.inf, "since": None}
        m = self.cells.setdefault(cell, fresh)
        state = before.get(cell, UNKNOWN)
        if what == "hit":
            if m["last_hit"] == -math.inf:
                m["since"] = now
            elif now - m["seen"] > c.hit_gap:
                m["since"] += now - m["seen"]
            m["last_hit"] = now
            r = c.explained_by
            near = [(cell[0] + i, cell[1] + j) for i in range(-r, r + 1) for j in range(-r, r + 1)]
            wait = math.inf if c.settle_seconds is None else c.settle_seconds
            lines = [
                [before.get((cell[0] + n * i, cell[1] + n * j)) for n in (1, 2)]
                for i in (-1, 0, 1)
                for j in (-1, 0, 1)
                if (i, j) != (0, 0)
            ]
            if c.settle_in_line is not None and [OCCUPIED, OCCUPIED] in lines:
                wait = min(wait, c.settle_in_line)
            settled = now - m["since"] >= wait
            if state == FREE and settled:
                m["s"], state = 0.0, UNKNOWN
            if r > 0 and any(before.get(n) == OCCUPIED for n in near):
                state = OCCUPIED
            p_s = s.s_low if state == FREE else s.s_high
            high = FREE if c.d_high_where == "free" else UNKNOWN
            p_d = s.d_high if state == high else s.d_low
        else:
            if now - m["last_hit"] > c.hit_gap:
                m["last_hit"] = -math.inf
            p_s, p_d = s.s_miss, s.d_miss
            if what == "graze" and state != FREE:
                p_s = 0.5 if state == OCCUPIED else s.s_graze
        if c.d_memory == "text" or now - m["seen"] > c.d_lifetime:
            m["d"] = 0.0
        m["seen"] = now
        for key, p, most in (("s", p_s, c.s_most), ("d", p_d, c.d_most)):
            bound = math.log(most / (1 - most))
            m[key] = min(max(m[key] + math.log(p / (1 - p)), -bound), bound)


def world(rng: np.random.Generator, n: int) -> list[tuple[np.ndarray, Scan]]:
    """A wandering laser, noisy walls, something that comes and goes; gaps in time; broken beams."""
    out, time = [], 5.0
    angles = np.linspace(-2.0, 2.0, 32)
    for k in range(n):
        time += rng.choice([0.3, 0.3, 0.3, 1.7])
        pose = np.array([0.13 * np.sin(k / 5), 0.11 * np.cos(k / 7), 0.05 * k])
        ranges = 2.0 + 0.3 * np.sin(3 * (angles + pose[2])) + rng.normal(0, 0.03, len(angles))
        if k % 9 > 4:
            ranges[10:14] = 1.2
        ranges[rng.random(len(angles)) < 0.05] = rng.choice([np.nan, 0.0, -1.0, 50.0, np.inf])
        out.append((pose, Scan(angles, ranges, 50.0, time)))
    return out


CONFIGS = {
    "default": MapConfig(settle_seconds=2.0),
    "printed": AS_PRINTED,
    "text": MapConfig(d_memory="text", explained_by=0),
    "unknown": MapConfig(d_high_where="unknown", settle_seconds=None),
    "text-unknown": MapConfig(d_memory="text", d_high_where="unknown", usable_range=1.9, no_return="free"),
    "grazing": MapConfig(d_memory="text", explained_by=0, graze=3, settle_in_line=0.3, settle_seconds=2.0),
    "grazing-wide": MapConfig(graze=8, settle_in_line=0.0, explained_by=2, settle_seconds=None),
    "wide": MapConfig(explained_by=2, settle_seconds=1.0, d_lifetime=0.5, resolution=0.07),
}


@pytest.mark.parametrize("name", CONFIGS)
def test_maps_are_those_of_the_slow_account(name: str, backend: str) -> None:
    """45 additions of numbers up to 7: 45 * 7 * eps."""
    config = CONFIGS[name]
    slow, fast, plain = Slow(config), StaticDynamicMap(config), PlainMap(config)
    for pose, scan in world(np.random.default_rng(3), 45):
        slow.update(pose, scan)
        fast.update(pose, scan)
        plain.update(pose, scan)
    assert (slow.grazed > 0) == (config.graze > 0)
    cells = np.array(sorted(slow.cells)) - fast.lattice.corner[::-1]
    at = cells[:, 0], cells[:, 1]
    assert np.count_nonzero(fast.observed()) == len(cells)
    tolerance = 45 * 7 * np.finfo(float).eps
    for layer, key in (("static", "s"), ("dynamic", "d"), ("seen", "seen"), ("last_hit", "last_hit")):
        expected = [slow.cells[cell][key] for cell in sorted(slow.cells)]
        np.testing.assert_allclose(fast.layers[layer][at], expected, atol=tolerance, err_msg=layer)
    expected = [slow.plain[cell] for cell in sorted(slow.plain)]
    np.testing.assert_allclose(plain.occupied().log_odds[at], expected, atol=tolerance)
    assert set(states(fast.static().log_odds[at]).tolist()) == {FREE, UNKNOWN, OCCUPIED}


SCANNER = LaserScanner(1, 0.0, 1.0, 50.0)


def look(grid: StaticDynamicMap | PlainMap, time: float, distance: float) -> None:
    grid.update([0.0, 0.0, 0.0], SCANNER.scan(np.array([distance]), time))


def p_at(grid: object, x: float) -> float:
    return float(1 / (1 + np.exp(-grid.at([[x, 0.05]])[0])))  # type: ignore[attr-defined]


def test_s_keeps_nothing_of_what_walks_by_on_free_floor(backend: str) -> None:
    """A walker is never in S; it is in D where it is, at once, and nowhere else one look later."""
    grid = StaticDynamicMap()
    for k in range(6):
        look(grid, 0.1 * k, 4.05)
    for k in range(10):
        x = 3.05 - 0.2 * k
        look(grid, 0.6 + 0.1 * k, x)
        assert p_at(grid.dynamic(), x) > 0.9
        assert p_at(grid.static(), x) < 0.1
    for k in range(3):
        look(grid, 1.6 + 0.1 * k, 4.05)
        assert (grid.dynamic().states != OCCUPIED).all()
    assert [p_at(grid.static(), 3.05 - 0.2 * k) < 0.1 for k in range(10)] == [True] * 10
    assert p_at(grid.static(), 4.05) > 0.9


def test_what_stood_there_from_the_first_is_static_until_it_leaves(backend: str) -> None:
    """The other side: S believes a person who was never seen to come, and lets go after some misses."""
    grid = StaticDynamicMap()
    for k in range(20):
        look(grid, 0.1 * k, 2.05)
    assert p_at(grid.static(), 2.05) > 0.9
    assert p_at(grid.dynamic(), 2.05) < 0.1
    misses = 0
    while p_at(grid.static(), 2.05) > 0.1:
        misses += 1
        look(grid, 2.0 + 0.1 * misses, 4.05)
    c = grid.config
    step = math.log(c.sensor.s_miss / (1 - c.sensor.s_miss))
    most = math.log(c.s_most / (1 - c.s_most))
    assert misses == math.ceil((most + math.log(9)) / -step)


@pytest.mark.parametrize("settle", [None, 3.0])
def test_a_chair_put_down_on_free_floor_is_dynamic_for_ever_unless_it_settles(
    settle: float | None, backend: str
) -> None:
    grid = StaticDynamicMap(MapConfig(settle_seconds=settle))
    for k in range(10):
        look(grid, 0.1 * k, 4.05)
    for k in range(600):  # a minute
        look(grid, 1.0 + 0.1 * k, 2.05)
    static, dynamic = p_at(grid.static(), 2.05), p_at(grid.dynamic(), 2.05)
    if settle is None:
        assert static < 0.01
        assert dynamic > 0.9
    else:
        assert static > 0.9
        assert dynamic < 0.1


@pytest.mark.parametrize(
    ("gap", "looked_at", "more", "settles"),
    [(0.4, True, 8, True), (0.8, True, 8, False), (0.8, False, 8, True), (9.0, False, 2, False)],
)
def test_settling_needs_the_whole_time_and_no_long_miss(
    gap: float, looked_at: bool, more: int, settles: bool, backend: str
) -> None:
    """Not to be looked at is no miss, the robot may turn away; but it is no time of staying either."""
    grid = StaticDynamicMap(MapConfig(settle_seconds=3.0, hit_gap=0.5))
    for k in range(10):
        look(grid, 0.1 * k, 4.05)
    for k in range(12):
        look(grid, 1.0 + 0.2 * k, 2.05)
    end = 1.0 + 0.2 * 11
    for k in range(1, int(gap / 0.1)):
        look(grid, end + 0.1 * k, 4.05 if looked_at else np.nan)
    for k in range(more):
        look(grid, end + gap + 0.2 * k, 2.05)
    assert (grid.static().at([[2.05, 0.05]])[0] > -2.0) == settles


def test_a_hit_beside_a_wall_is_the_walls(backend: str) -> None:
    for reach, moving in ((0, True), (1, False)):
        grid = StaticDynamicMap(MapConfig(explained_by=reach))
        for k in range(8):
            look(grid, 0.1 * k, 4.05)
        look(grid, 0.8, 3.95)  # range noise
        assert (p_at(grid.dynamic(), 3.95) > 0.9) == moving
        look(grid, 0.9, 3.75)  # three cells before the wall: something is there
        assert p_at(grid.dynamic(), 3.75) > 0.9


def test_d_forgets_what_is_not_looked_at(backend: str) -> None:
    c = MapConfig(d_lifetime=1.0, d_memory="formula")
    beams = LaserScanner(2, 0.0, np.pi / 2, 50.0)
    grid = StaticDynamicMap(c)
    for k in range(6):
        grid.update([0, 0, 0], beams.scan(np.array([4.05, 4.05]), 0.1 * k))
    for time in (0.7, 0.8):
        grid.update([0, 0, 0], beams.scan(np.array([2.05, 4.05]), time))
    assert p_at(grid.dynamic(), 2.05) > 0.9
    grid.update([0, 0, 0], beams.scan(np.array([np.nan, 4.05]), 1.7))
    assert p_at(grid.dynamic(), 2.05) > 0.9
    grid.update([0, 0, 0], beams.scan(np.array([np.nan, 4.05]), 1.9))
    assert p_at(grid.dynamic(), 2.05) == 0.5


def test_with_memory_d_believes_a_walker_at_the_second_look_only(backend: str) -> None:
    """Free floor has been missed often: the memory of that outweighs one hit.  So A§4.3 sees no walker that
    is in another cell at every look."""
    for memory, at_once in (("formula", False), ("text", True)):
        grid = StaticDynamicMap(MapConfig(d_memory=memory))
        for k in range(6):
            look(grid, 0.1 * k, 4.05)
        look(grid, 0.6, 2.05)
        assert (p_at(grid.dynamic(), 2.05) > 0.9) == at_once
        look(grid, 0.7, 2.05)
        assert p_at(grid.dynamic(), 2.05) > 0.9


def test_without_memory_d_is_the_table_and_only_of_the_last_scan(backend: str) -> None:
    grid = StaticDynamicMap(MapConfig(d_memory="text"))
    beams = LaserScanner(2, 0.0, np.pi / 2, 50.0)
    for k in range(8):
        grid.update([0, 0, 0], beams.scan(np.array([4.05, 4.05]), 0.1 * k))
    for k in range(2):  # twice: no more than once
        grid.update([0, 0, 0], beams.scan(np.array([2.05, np.nan]), 0.8 + 0.1 * k))
        assert p_at(grid.dynamic(), 2.05) == pytest.approx(0.95)
        assert grid.dynamic().at([[0.05, 2.05]]) == 0.0


def test_s_is_never_above_the_plain_map() -> None:
    """Of the printed table: the only difference is that a hit on free floor lowers S."""
    rng = np.random.default_rng(1)
    s, plain = StaticDynamicMap(AS_PRINTED), PlainMap(AS_PRINTED)
    for pose, scan in world(rng, 80):
        s.update(pose, scan)
        plain.update(pose, scan)
        assert (s.static().log_odds <= plain.occupied().log_odds + 1e-12).all()
    assert (s.static().log_odds < plain.occupied().log_odds - 1).any()


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize("no_return", ["ignore", "free"])
def test_every_beam_is_counted_and_broken_ones_change_nothing(no_return: str, backend: str) -> None:
    ranges = np.array([np.nan, np.inf, -np.inf, -1.0, 0.0, 50.0, 81.91, 2.05])
    grid = StaticDynamicMap(MapConfig(no_return=no_return))
    scanner = LaserScanner(8, 0.0, 0.3, 50.0)
    report = grid.update([0, 0, 0], scanner.scan(ranges, 1.0))
    assert report.beams == BeamCounts(hits=1, no_return=3, not_a_number=1, not_positive=3)
    assert report.beams.beams == 8 == grid.beams.beams
    alone = StaticDynamicMap(MapConfig())
    alone.update([0, 0, 0], Scan(scanner.angles[7:], ranges[7:], 50.0, 1.0))
    if no_return == "ignore":
        assert np.array_equal(grid.observed(), alone.observed())
    else:
        assert grid.observed().sum() > 800  # three beams of 30 m, free all the way
        assert np.count_nonzero(grid.static().log_odds > 0) == 1


def test_a_scan_of_broken_beams_only_is_a_scan(backend: str) -> None:
    grid = StaticDynamicMap()
    report = grid.update([0, 0, 0], Scan(np.zeros(3), np.full(3, np.nan), 50.0, 1.0))
    assert report.beams.hits == 0
    assert grid.scans == 1
    assert not grid.observed().any()
    grid.update([0, 0, 0], Scan(np.zeros(0), np.zeros(0), 50.0, 2.0))
    assert grid.scans == 2


def test_stamps_that_run_backwards_or_stand_still_are_counted(backend: str) -> None:
    grid = StaticDynamicMap(MapConfig(d_memory="text"))
    backward = []
    for time in (1.0, 2.0, 2.0, 1.5, 3.0):
        report = grid.update([0, 0, 0], SCANNER.scan(np.array([2.05]), time))
        backward.append(report.backward)
    assert backward == [False, False, True, True, False]
    assert (grid.scans, grid.backward_stamps) == (5, 2)
    assert p_at(grid.static(), 2.05) > 0.9  # nothing was lost


@pytest.mark.parametrize(
    ("pose", "scan", "what"),
    [
        ([0, 0], Scan(np.zeros(1), np.ones(1), 50.0, 9.0), "three finite numbers"),
        ([0, np.nan, 0], Scan(np.zeros(1), np.ones(1), 50.0, 9.0), "three finite numbers"),
        ([0, 0, np.inf], Scan(np.zeros(1), np.ones(1), 50.0, 9.0), "three finite numbers"),
        ([0, 0, 0], Scan(np.zeros(2), np.ones(3), 50.0, 9.0), "one range per beam"),
        ([0, 0, 0], Scan(np.zeros((1, 2)), np.ones((1, 2)), 50.0, 9.0), "one range per beam"),
        ([0, 0, 0], Scan(np.full(1, np.nan), np.ones(1), 50.0, 9.0), "angles of a scan must be finite"),
        ([0, 0, 0], Scan(np.zeros(1), np.ones(1), 0.0, 9.0), "max_range"),
        ([0, 0, 0], Scan(np.zeros(1), np.ones(1), np.nan, 9.0), "max_range"),
        ([0, 0, 0], Scan(np.zeros(1), np.ones(1), 50.0, np.nan), "time"),
        ([1e6, 0, 0], Scan(np.zeros(1), np.ones(1), 50.0, 9.0), "more than the limit"),
        ([1e300, 0, 0], Scan(np.zeros(1), np.ones(1), 50.0, 9.0), "within reach"),
    ],
)
def test_a_refused_scan_leaves_the_map_as_it_was(pose: list, scan: Scan, what: str) -> None:
    grid = StaticDynamicMap()
    look(grid, 1.0, 2.05)
    layers = {name: layer.copy() for name, layer in grid.layers.items()}
    with pytest.raises(ValueError, match=what):
        grid.update(pose, scan)
    assert (grid.scans, grid.time, grid.beams.beams) == (1, 1.0, 1)
    for name, layer in layers.items():
        np.testing.assert_array_equal(layer, grid.layers[name])


@pytest.mark.parametrize(
    "change",
    [
        {"resolution": 0.0},
        {"usable_range": np.inf},
        {"usable_range": 0.0},
        {"no_return": "perhaps"},
        {"d_memory": "both"},
        {"d_high_where": "occupied"},
        {"explained_by": -1},
        {"settle_seconds": 0.0},
        {"settle_in_line": -1.0},
        {"graze": -1},
        {"d_lifetime": 0.0},
        {"hit_gap": 0.0},
        {"s_most": 0.5},
        {"d_most": 1.0},
    ],
)
def test_settings_that_mean_nothing_are_refused(change: dict) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        dataclasses.replace(MapConfig(), **change)


def test_a_wrong_number_of_beams_is_refused() -> None:
    with pytest.raises(ValueError, match="this scanner has 1 beams"):
        SCANNER.scan(np.ones(2), 0.0)
    for bad in ((0, 0.0, 1.0, 5.0), (3, np.nan, 1.0, 5.0), (3, 0.0, 1.0, 0.0)):
        with pytest.raises(ValueError, match=r"beams=|first_angle=|max_range="):
            LaserScanner(*bad)


def test_the_map_grows_beyond_its_borders_and_nothing_moves(backend: str) -> None:
    """The same scans, with the map grown beforehand or on the way, to all four sides."""
    grown, ready = StaticDynamicMap(), StaticDynamicMap()
    far = [(0, 0), (9, 1), (-13, 2), (1, 17), (2, -11)]
    ready.reserve(np.array([[-40.0, -40.0], [40.0, 40.0]]))
    for k, (x, y) in enumerate(far):
        for grid in (grown, ready):
            grid.update([x, y, 0.4 * k], Scan(np.linspace(-3, 3, 50), np.full(50, 4.0), 50.0, float(k)))
    assert grown.lattice.size < ready.lattice.size
    rows, columns = np.nonzero(ready.observed())
    xy = ready.lattice.world_from_cells(np.stack([rows, columns], 1))
    np.testing.assert_array_equal(grown.static().at(xy), ready.static().log_odds[rows, columns])
    assert grown.observed().sum() == len(rows)


def test_a_wall_met_at_a_small_angle_keeps_its_cells_where_grazing_counts_less(backend: str) -> None:
    """Beams at 5 to 40 degrees along a wall that is known: a plain table frees cells of it, and for good.

    Seen head on before, the wall is static.  Then beams run along it; each passes through cells of the wall
    in front of its own end.  With three grazed cells none at 10 degrees or more may be freed.
    """
    kept = {}
    for graze in (0, 3):
        grid = StaticDynamicMap(MapConfig(d_memory="text", explained_by=0, graze=graze, settle_seconds=None))
        for k in range(6):  # the wall y = 1.05, from x = -1.5 to 6, from near
            xs = np.arange(-1.5, 6.0, 0.05)
            angles, ranges = np.arctan2(1.05 - 0.05, xs - 3.0), np.hypot(xs - 3.0, 1.0)
            grid.update([3.0, 0.05, 0.0], Scan(angles, ranges, 50.0, 0.1 * k))
        wall = np.stack([np.arange(-0.95, 5.0, 0.1), np.full(60, 1.05)], 1)
        assert (grid.static().at(wall) > 2.2).all()
        for k in range(40):  # then from its side, half a degree between beams: 11 degrees at 5 m
            angles = np.deg2rad(np.arange(11.0, 60.0, 0.5) + 0.5 * (k % 2) - 0.25)
            grid.update([0.0, 0.05, 0.0], Scan(angles, 1.0 / np.sin(angles), 50.0, 1.0 + 0.1 * k))
        kept[graze] = float((grid.static().at(wall) > 2.2).mean())
    assert kept[3] == 1.0
    assert kept[0] < 0.95  # cells at small angles are lost


def test_a_wall_that_was_freed_comes_back_in_its_line_and_a_person_at_the_wall_does_not(
    backend: str,
) -> None:
    """A cell of a wall was seen free.  Hit again, it is static after ``settle_in_line``, not before.

    Somebody who stands against the wall for as long continues no line: S keeps that cell free.
    """
    config = MapConfig(d_memory="text", explained_by=0, settle_in_line=1.0, settle_seconds=10.0)
    grid = StaticDynamicMap(config)
    heights = np.arange(-0.3, 0.31, 0.1)
    angles, beams = np.arctan2(heights, 3.0), np.hypot(heights, 3.0)
    past, stands = beams.copy(), beams.copy()
    past[3], stands[3] = 4.0, 2.9  # the middle beam looks through the wall; or meets somebody before it
    for k in range(4):
        grid.update([0.05, 0.05, 0.0], Scan(angles, past, 50.0, 0.2 * k))
    freed, person = [[3.05, 0.05]], [[2.95, 0.05]]
    assert p_at(grid.static(), 3.05) < 0.1
    assert p_at(grid.static(), 2.95) < 0.1
    path = []
    for k in range(8):
        grid.update([0.05, 0.05, 0.0], Scan(angles, beams, 50.0, 1.0 + 0.2 * k))
        path.append(float(grid.static().at(freed)[0]))
    # hits at 1.0 ... 2.4 s: five before a second has passed, then three that count
    assert all(v < -2.2 for v in path[:5])
    assert path[5] == pytest.approx(math.log(4.0))
    assert path[7] > 2.2
    for k in range(8):
        grid.update([0.05, 0.05, 0.0], Scan(angles, stands, 50.0, 3.0 + 0.2 * k))
    assert grid.static().at(person)[0] < -2.2


def test_no_line_goes_on_beyond_the_maps_border() -> None:
    """The cell behind the next one is outside: neither the map's other side nor its corner stands for it."""
    s = np.zeros((6, 8))
    s[0, 5] = s[-1, 5] = s[0, 0] = 5.0
    assert not static_dynamic._continues_line(s, np.array([1]), np.array([5]))[0]
    s[2, 5] = s[3, 5] = 5.0
    assert static_dynamic._continues_line(s, np.array([1]), np.array([5]))[0]
