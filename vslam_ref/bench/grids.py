"""``vslam-ref bench grids``: occupancy grids on this machine, beside Bresenham loops in plain Python.

===== =========================================================================================
goal  what is measured
===== =========================================================================================
OG-1  one scan of 360 beams into 400 x 400 cells, against Bresenham loops; 30 x NumPy, 300 x Numba
RL    real logs at 0.1 m: scans a second into S and D; 20 NumPy, 200 Numba
===== =========================================================================================

The peer is the way in which teaching code does it (that of PythonRobotics' ray casting grid map): for every
beam a list of the cells of Bresenham's line, for every cell of the list a free value, for every end four
occupied cells.  PythonRobotics cannot be installed as a package, so the same algorithm is written here.
It does less than we do: its lines leave out cells that a beam cuts, and it adds no evidence.

The ratio of OG-1 is that of the plain grid (one log-odds addition per cell).  S and D are shown beside it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.bench.rows import Row, measured, on_each_backend, row
from vslam_ref.datasets import carmen, catalogue
from vslam_ref.grids import MapConfig, StaticDynamicMap, static_dynamic
from vslam_ref.grids.beam_marks import BeamsInCells
from vslam_ref.grids.log_odds import log_odds
from vslam_ref.grids.plain import apply_plain
from vslam_ref.support.timing import paired

BEAMS, CELLS, RESOLUTION, HALF = 360, 400, 0.1, 19.5
GOALS_OG_1 = {"numpy": 30.0, "numba": 300.0}
GOALS_RL = {"numpy": 20.0, "numba": 200.0}
LOGS = ("intel", "aces", "csail", "edmonton", "fhw", "freiburg-079")


def run(quick: bool = False) -> dict[str, Any]:
    """Measure everything on one thread; ``rows`` is a list of flat records."""
    rows = measured("grids", on_each_backend(quick, one_scan, real_logs))
    return {"rows": rows, "threads": 1, "peer": "Bresenham loops in plain Python"}


def room() -> tuple[Array, Array]:
    """Angles and ranges (360,) in a square room whose walls have ripples."""
    angles = np.arange(BEAMS) * 2 * np.pi / BEAMS
    square = HALF / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    return angles, np.minimum(square * (0.85 + 0.15 * np.cos(7 * angles)), HALF)


def bresenham(start: tuple[int, int], end: tuple[int, int]) -> Array:
    """Cells of the line from ``start`` to ``end``, by Bresenham's algorithm with integers."""
    (x, y), (x1, y1) = start, end
    dx, dy = abs(x1 - x), -abs(y1 - y)
    sx, sy = (1 if x < x1 else -1), (1 if y < y1 else -1)
    error = dx + dy
    cells = [(x, y)]
    while (x, y) != (x1, y1):
        twice = 2 * error
        if twice >= dy:
            error += dy
            x += sx
        if twice <= dx:
            error += dx
            y += sy
        cells.append((x, y))
    return np.array(cells)


def peer(ox: list[float], oy: list[float]) -> Array:
    """A map (400, 400) from the ends of beams, by loops over beams and cells."""
    grid = np.ones((CELLS, CELLS)) / 2
    low = -CELLS * RESOLUTION / 2
    centre = (round(-low / RESOLUTION), round(-low / RESOLUTION))
    for x, y in zip(ox, oy, strict=True):
        ix, iy = round((x - low) / RESOLUTION), round((y - low) / RESOLUTION)
        for cell in bresenham(centre, (ix, iy)):
            grid[cell[0]][cell[1]] = 0.0
        for i, j in ((ix, iy), (ix + 1, iy), (ix, iy + 1), (ix + 1, iy + 1)):
            grid[i][j] = 1.0
    return grid


def scan_in_cells() -> BeamsInCells:
    """All hits, of :func:`room`."""
    angles, ranges = room()
    start = np.full(2, CELLS / 2 + 0.5)
    ends = start + ranges[:, None] / RESOLUTION * np.stack([np.cos(angles), np.sin(angles)], 1)
    return BeamsInCells(start, ends, np.ones(BEAMS, dtype=np.bool_))


def one_scan(backend: str, quick: bool) -> list[Row]:
    """OG-1."""
    angles, ranges = room()
    ox, oy = (ranges * np.cos(angles)).tolist(), (ranges * np.sin(angles)).tolist()
    beams = scan_in_cells()
    plain, evidence = np.zeros(CELLS * CELLS), log_odds([0.3, 0.8])
    fills = (0.0, 0.0, -np.inf, -np.inf, 0.0)
    layers = static_dynamic.Layers(*(np.full(CELLS * CELLS, fill) for fill in fills))
    rules, clock = static_dynamic.rules_of(MapConfig()), [0.0]

    def s_and_d() -> None:
        clock[0] += 0.1
        static_dynamic.apply_scan(layers, CELLS, beams, rules, clock[0])

    things: dict[str, Callable[[], object]] = {
        "plain grid": lambda: apply_plain(plain, CELLS, beams, evidence, 6.9),
        "S and D": s_and_d,
        "Bresenham loops": lambda: peer(ox, oy),
    }
    took, ratio = paired(things, 3 if quick else 15)
    rows = [row("OG-1", f"{name}, one scan", backend, 1e3 * took[name], "ms") for name in things]
    ratios = (ratio["Bresenham loops"], took["Bresenham loops"] / took["S and D"])
    case, goal = "Bresenham loops / plain grid", GOALS_OG_1[backend]
    rows.append(row("OG-1", case, backend, ratios[0], "x", goal, below=False))
    return [*rows, row("OG-1", "Bresenham loops / S and D", backend, ratios[1], "x")]


def real_logs(backend: str, quick: bool) -> list[Row]:
    """Scans a second into S and D, the map growing on the way; logs that are not found are left out."""
    folder = catalogue.find("carmen_2d")
    rows = []
    for name in LOGS if folder else ():
        log = carmen.read(folder / f"{name}-corrected.log.gz")  # type: ignore[operator]
        scans = list(log.scans())[: 100 if quick else 500]
        StaticDynamicMap().update(*scans[0])
        rates = []
        for _ in range(1 if quick else 3):
            grid = StaticDynamicMap()
            began = time.perf_counter()
            for pose, scan in scans:
                grid.update(pose, scan)
            rates.append(len(scans) / (time.perf_counter() - began))
        case = f"{name}, {len(scans)} scans of {log.scanner.beams} beams"
        rate, goal = float(np.median(rates)), GOALS_RL[backend]
        rows.append(row("RL", case, backend, rate, "scans/s", goal, below=False))
    return rows
