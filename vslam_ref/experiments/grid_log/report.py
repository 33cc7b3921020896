"""What ``vslam-ref grid`` leaves.

::

    OUT/result.json               the numbers that were printed
    OUT/static.png, .yaml         S as a map of ROS' map_server
    OUT/dynamic.png, .yaml        D at the end of the log
    OUT/plain.png, .yaml          the plain grid
    OUT/maps.npz                  log_odds_s, log_odds_d, log_odds_plain, dynamic_scans, origin_xy,
                                  resolution, times
    OUT/tracks.csv                what moved: id, time, x, y
    OUT/maps.png, .svg            the maps, and where and when something moved
    OUT/animation.webm            S with D, and the plain grid, over time
    OUT/report.html               the page: numbers and pictures inside it, the film beside it
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.datasets import grid_files
from vslam_ref.experiments.grid_log.mapping import Mapped
from vslam_ref.grids.log_odds import LogOddsGrid
from vslam_ref.plot.grids import log_figure
from vslam_ref.plot.saving import figure_bytes
from vslam_ref.support import pages
from vslam_ref.support.json_text import to_json

FILM = "animation.webm"
ROWS = (
    ("scans", "scans", ""),
    ("backward_stamps", "stamps that do not move forward", ""),
    ("beams", "beams", ""),
    ("beams_hit", "beams that hit something", ""),
    ("beams_no_return", "beams from which nothing came back", ""),
    ("beams_not_a_number", "beams that are no number", ""),
    ("beams_not_positive", "beams of zero or negative range", ""),
    ("cells", "cells looked at", ""),
    ("static_cells", "cells decided static, S", ""),
    ("plain_cells", "cells decided occupied, plain grid", ""),
    ("dynamic_cells", "cells that were ever decided dynamic, D", ""),
    ("dynamic_objects", "things that moved", ""),
    ("entropy", "mean entropy of S", "bit"),
    ("entropy_plain", "mean entropy of the plain grid", "bit"),
    ("seconds", "time for S and D", "s"),
    ("scans_per_s", "scans per second", "1/s"),
)
"""Key in the JSON, words and unit in the table."""


def number_rows(numbers: Mapping[str, Any]) -> list[list[str]]:
    """Rows of the table of numbers."""
    return [[words, _show(numbers[key]), unit] for key, words, unit in ROWS]


def _show(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def crop(mapped: Mapped) -> tuple[slice, slice]:
    """Rows and columns that hold all cells that were looked at, and one cell around."""
    rows, columns = (np.flatnonzero(mapped.map.observed().any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return slice(0, 1), slice(0, 1)
    return tuple(slice(max(int(v[0]) - 1, 0), int(v[-1]) + 2) for v in (rows, columns))  # type: ignore[return-value]


def write_report(folder: Path, mapped: Mapped, content: Mapping[str, Any]) -> None:
    """Write all but the film into ``folder``."""
    window = crop(mapped)
    maps = {
        "static": mapped.map.static().part(*window),
        "dynamic": mapped.map.dynamic().part(*window),
        "plain": mapped.plain.occupied().part(*window),
    }
    for name, grid in maps.items():
        grid_files.write_ros_map(folder, name, grid)
    np.savez_compressed(
        folder / "maps.npz",
        log_odds_s=maps["static"].log_odds,
        log_odds_d=maps["dynamic"].log_odds,
        log_odds_plain=maps["plain"].log_odds,
        dynamic_scans=mapped.dynamic_scans[window],
        origin_xy=np.array(maps["static"].origin_xy),
        resolution=np.array(maps["static"].resolution),
        times=mapped.log.times,
    )
    _write_tracks(folder / "tracks.csv", mapped)
    figure = _figure(mapped, maps, window)
    for suffix in ("png", "svg"):
        (folder / f"maps.{suffix}").write_bytes(figure_bytes(figure, suffix, mapped.log.path.name))
    (folder / "result.json").write_text(to_json(content), encoding="utf-8", newline="\n")
    page = _page(mapped.log.path.name, content, (folder / "maps.png").read_bytes(), folder)
    (folder / "report.html").write_text(page, encoding="utf-8", newline="\n")


def _write_tracks(path: Path, mapped: Mapped) -> None:
    lines = ["id,time_s,x_m,y_m"]
    for number, track in sorted(mapped.tracker.moved.items()):
        for time, place in zip(track.times, track.places, strict=True):
            lines.append(f"{number},{time:.6f},{place[0]:.4f},{place[1]:.4f}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _figure(mapped: Mapped, maps: Mapping[str, LogOddsGrid], window: tuple[slice, slice]) -> Any:
    cells = np.argwhere(mapped.dynamic_scans[window] > 0)
    static = maps["static"]
    minutes = (mapped.last_dynamic[window][tuple(cells.T)] - mapped.log.times[0]) / 60.0
    return log_figure(
        static.probability,
        maps["plain"].probability,
        static.lattice.extent,
        static.lattice.world_from_cells(cells),
        minutes,
        mapped.log.poses[:, :2],
        [np.array(track.places) for track in mapped.tracker.moved.values()],
        mapped.log.path.name,
    )


def _page(title: str, content: Mapping[str, Any], png: bytes, folder: Path) -> str:
    """``report.html``: numbers and maps in it, the film beside it."""
    data = base64.b64encode(png).decode("ascii")
    names = ("static.yaml", "dynamic.yaml", "plain.yaml", "maps.npz", "tracks.csv", "result.json")
    return pages.page(
        title,
        pages.table([], number_rows(content), caption="Numbers", kind="numbers"),
        pages.image(f"data:image/png;base64,{data}", "Static map, plain grid, what moved"),
        _film(folder / FILM),
        pages.tag("p", pages.links({name: name for name in names}, " ")),
    )


def _film(path: Path) -> pages.Html | None:
    """The film, if there is one."""
    if not path.exists():
        return None
    words = (
        ": S with D in red-orange and the ways of what moved in light blue, the plain grid beside it or "
        "below, the robot in blue."
    )
    film = pages.Html(f'<video src="{path.name}" controls muted loop playsinline></video><br>')
    return pages.tag("p", film, pages.links({path.name: path.name}), words)
