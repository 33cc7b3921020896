"""``vslam-ref grid``: its files, its numbers, bad input; and what it finds in real logs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cv2", reason="pictures and films need OpenCV")

import cv2

from vslam_ref import _kernels, cli
from vslam_ref.datasets import carmen, catalogue, grid_files
from vslam_ref.experiments.grid_log.mapping import GridConfig, bounds, map_log
from vslam_ref.grids import AS_PRINTED, MapConfig, PlainMap, StaticDynamicMap
from vslam_ref.grids.log_odds import DECIDED_LOG_ODDS

FOLDER = catalogue.find("carmen_2d")
needs_logs = pytest.mark.skipif(FOLDER is None, reason="carmen_2d is not in VSLAM_REF_DATA")
KEYS = {"scans", "backward_stamps", "beams", "cells", "seconds", "scans_per_s", "entropy", "dynamic_cells"}
KEYS |= {"dynamic_objects", "backend"}


def room(path: Path, scans: int = 60, far: float | None = None) -> Path:
    """A log in a room of 8 m x 6 m through which a disc of 0.3 m walks at 1 m/s; exact ranges.

    ``far`` puts the last pose there.
    """
    angles = carmen.scanner(180).angles
    lines = []
    for k in range(scans):
        t = 0.2 * k
        c, s = np.cos(angles), np.sin(angles)
        with np.errstate(divide="ignore"):
            walls = np.minimum(np.where(c > 0, 5.0 / c, np.inf), 3.0 / np.abs(s))
        centre = np.array([2.0, -4.0 + 1.0 * (t - 4.0)])
        along = centre @ np.stack([c, s])
        square = along**2 - centre @ centre + 0.3**2
        disc = np.where((square > 0) & (along > 0), along - np.sqrt(np.maximum(square, 0)), np.inf)
        r = np.minimum(np.minimum(walls, disc), 81.91)
        x = 0.0 if far is None or k < scans - 1 else far
        words = " ".join(f"{v:.2f}" for v in r)
        lines.append(f"FLASER 180 {words} {x} 0 0 {x} 0 0 {t:.3f} host {t:.3f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def run(*words: object) -> int:
    return cli.main(["grid", *map(str, words)])


def test_beams_without_return_that_clear_the_way_stay_in_the_map(tmp_path: Path) -> None:
    """Beams into the open reach farther than any wall of the log: the map must have room for them.

    Ten beams, a degree apart and nearly upright, share no cell of 0.1 m beyond 6 m, and end at 30 m.
    """
    path = room(tmp_path / "a.log", scans=3)
    words = [line.split() for line in path.read_text().splitlines()]
    for line in words:
        line[2 + 170 : 2 + 180] = ["81.91"] * 10
    path.write_text("\n".join(" ".join(line) for line in words) + "\n")
    more = ["--set", "video_frames=0", "--set"]
    assert run(path, "--out", tmp_path / "free", *more, "map.no_return=free") == 0
    assert run(path, "--out", tmp_path / "ignored", *more, "map.no_return=ignore") == 0
    cells = [
        json.loads((tmp_path / name / "result.json").read_text())["cells"] for name in ("free", "ignored")
    ]
    assert cells[0] - cells[1] > 10 * (30 - 6) / 0.1


def test_a_run_writes_its_maps_film_numbers_and_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, target = tmp_path / "out", tmp_path / "numbers.json"
    assert run(room(tmp_path / "a.log"), "--out", out, "--json", target) == 0
    numbers = json.loads(target.read_text())
    assert set(numbers) >= KEYS
    assert (numbers["scans"], numbers["backward_stamps"], numbers["beams"]) == (60, 0, 60 * 180)
    assert numbers["dynamic_objects"] == 1
    assert numbers["config"]["map.resolution"] == 0.1
    assert json.loads((out / "result.json").read_text()) == numbers
    names = {"static", "dynamic", "plain"}
    assert {p.name for p in out.iterdir()} == {
        *(f"{n}.{s}" for n in names for s in ("png", "yaml")),
        *("maps.npz", "maps.png", "maps.svg", "tracks.csv", "result.json", "report.html", "animation.webm"),
    }
    printed = capsys.readouterr().out
    assert f"{numbers['entropy']:.4g}" in printed
    assert re.search(rf"backend:? +{_kernels.backend()}", printed)
    assert numbers["backend"] == _kernels.backend()
    assert "report.html" in printed
    page = (out / "report.html").read_text()
    assert "http" not in page
    assert "<script" not in page
    assert '<video src="animation.webm" controls' in page
    data = np.load(out / "maps.npz", allow_pickle=False)
    assert set(data.files) >= {"log_odds_s", "log_odds_d", "origin_xy", "resolution", "times"}
    assert data["times"].tolist() == pytest.approx([round(0.2 * k, 3) for k in range(60)])
    static = grid_files.read_ros_map(out / "static.yaml")
    assert static.grid.log_odds.shape == data["log_odds_s"].shape
    np.testing.assert_allclose(static.origin_xy, data["origin_xy"], atol=1e-12)
    np.testing.assert_array_equal(static.grid.states, np.sign(np.trunc(data["log_odds_s"] / np.log(9))) + 1)
    film = cv2.VideoCapture(str(out / "animation.webm"))
    assert int(film.get(cv2.CAP_PROP_FRAME_COUNT)) == 60
    assert int(film.get(cv2.CAP_PROP_FRAME_WIDTH)) == 320
    # the walker went along x = 2 at 1 m/s
    rows = np.genfromtxt(out / "tracks.csv", delimiter=",", names=True)
    speed = np.polyfit(rows["time_s"], rows["y_m"], 1)[0]
    assert speed == pytest.approx(1.0, abs=0.1)  # its near side turns a little as it goes by
    assert np.abs(rows["x_m"] - 1.8).max() < 0.25


def test_resolution_and_settings_are_taken(tmp_path: Path) -> None:
    log = room(tmp_path / "a.log", 12)
    words = ("--resolution", 0.2, "--set", "map.d_memory=formula", "--set", "video_frames=0")
    assert run(log, "--out", tmp_path / "o", *words) == 0
    numbers = json.loads((tmp_path / "o" / "result.json").read_text())
    assert numbers["resolution"] == 0.2
    assert numbers["config"]["map.d_memory"] == "formula"
    assert not (tmp_path / "o" / "animation.webm").exists()


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("--resolution", "0"), "resolution"),
        (("--resolution", "nan"), "resolution"),
        (("--resolution", "fine"), "invalid float"),
        (("--resolution", "0.0001"), "more than the limit"),
        (("--set", "map.nothing=1"), "unknown setting"),
        (("--set", "map.d_high_where=all"), "expected one of free, unknown"),
        (("--json", "no/such/folder/x.json"), "does not exist"),
    ],
)
def test_bad_words_are_one_line_and_leave_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], what: str
) -> None:
    log = room(tmp_path / "a.log", 3)
    assert run(log, "--out", tmp_path / "out", *words) == 2
    error = capsys.readouterr().err
    assert what in error
    assert error.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["a.log"]


def test_bad_logs_are_one_line_with_their_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(tmp_path / "none.log", "--out", tmp_path / "out") == 2
    assert "no such file; expected a CARMEN log" in capsys.readouterr().err
    (tmp_path / "b.log").write_text("ODOM 1 2 3\n")
    assert run(tmp_path / "b.log", "--out", tmp_path / "out") == 2
    assert "b.log: no FLASER line (ODOM found)" in capsys.readouterr().err
    assert run(room(tmp_path / "c.log", 5, far=1e6), "--out", tmp_path / "out") == 2
    error = capsys.readouterr().err
    assert "c.log:5: a map of" in error
    assert "the pose farthest off, (1e+06, 0) m, is here" in error
    assert not (tmp_path / "out").exists()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("years of work")
    assert run(room(tmp_path / "d.log", 3), "--out", tmp_path / "full") == 2
    assert [p.name for p in (tmp_path / "full").iterdir()] == ["thesis.tex"]


def test_an_earlier_result_is_replaced_whole(tmp_path: Path) -> None:
    log, out = room(tmp_path / "a.log", 8), tmp_path / "out"
    assert run(log, "--out", out) == 0
    assert run(log, "--out", out, "--video", "none") == 0
    assert not (out / "animation.webm").exists()
    assert "<video" not in (out / "report.html").read_text()


# -- real logs -------------------------------------------------------------------------------------


@needs_logs
def test_stamps_that_run_backwards_or_stand_still_are_counted_and_the_map_is_whole() -> None:
    """intel: 4 backward.  csail: 404 of 405 stand still.  All scans are used, and stamps change no cell of S.

    (Without settling, whose very matter is time.)
    """
    assert FOLDER is not None
    config = GridConfig(map=MapConfig(settle_seconds=None))
    for name, backward in (("intel", 4), ("csail", 404)):
        log = carmen.read(FOLDER / f"{name}-corrected.log.gz")
        mapped = map_log(log, config)
        numbers = mapped.numbers()
        assert (numbers["scans"], numbers["backward_stamps"]) == (len(log.times), backward)
        even = StaticDynamicMap(config.map)
        for k, (pose, scan) in enumerate(log.scans()):
            even.update(pose, scan._replace(time=float(k)))
        cells = np.argwhere(even.observed())
        xy = even.lattice.world_from_cells(cells)
        np.testing.assert_array_equal(mapped.map.static().at(xy), even.static().log_odds[tuple(cells.T)])


WALKERS = {34: (7.6, 0.7), 594: (-2.1, -4.2), 979: (12.0, 2.8), 989: (10.1, 1.8), 1010: (7.0, 1.6)}
"""freiburg-079: seconds from the start -> where a person begins to walk, read off the raw scans."""


@needs_logs
@pytest.mark.slow
def test_people_of_freiburg_are_found_to_move() -> None:
    """The five walks that a look at the raw scans finds are found, and at most four other things.

    (Two are: legs of tables, some of which a beam meets now and then.)
    """
    assert FOLDER is not None
    log = carmen.read(FOLDER / "freiburg-079-corrected.log.gz")
    mapped = map_log(log, GridConfig(video_frames=0))
    starts = [(t.times[0] - log.times[0], t.places[0]) for t in mapped.tracker.moved.values()]
    for seconds, place in WALKERS.items():
        near = [abs(t - seconds) < 4 and np.linalg.norm(p - place) < 1.0 for t, p in starts]
        assert any(near), f"nobody walks at {seconds} s"
    assert len(starts) <= len(WALKERS) + 4


@needs_logs
@pytest.mark.slow
def test_s_keeps_fewer_smears_of_freiburg_than_a_plain_grid_and_its_walls() -> None:
    """Floor by hindsight, from counts alone: cells missed twenty times or more and hit in less than a tenth
    of all looks of the whole log.  Walls: what the plain grid ends with.

    Measured: 270 and 377 cells of floor ever occupied in S and in the plain grid, 2 and 7 at the end, of
    33864; S has 97 % of the plain grid's walls.  The printed table alone has 62 %.
    """
    assert FOLDER is not None
    log = carmen.read(FOLDER / "freiburg-079-corrected.log.gz")
    grids = {"s": StaticDynamicMap(), "plain": PlainMap(), "printed": StaticDynamicMap(AS_PRINTED)}
    corners = bounds(log, 30.0, 0.1)
    for grid in grids.values():
        grid.reserve(corners)
    s = grids["s"]
    looks, hits = np.zeros(s.lattice.shape), np.zeros(s.lattice.shape)
    ever = {name: np.zeros(s.lattice.shape, bool) for name in grids}

    def now(name: str) -> np.ndarray:
        grid = grids[name]
        return (grid.occupied() if name == "plain" else grid.static()).log_odds > DECIDED_LOG_ODDS

    for pose, scan in log.scans():
        for grid in grids.values():
            grid.update(pose, scan)
        looks += s.layers["seen"] == s.time
        hits += s.layers["last_hit"] == s.time
        for name in ever:
            ever[name] |= now(name)
    floor = (looks - hits >= 20) & (hits < 0.1 * looks)
    assert floor.sum() > 30_000
    smears = {name: int((ever[name] & floor).sum()) for name in ever}
    left = {name: int((now(name) & floor).sum()) for name in ever}
    assert smears["s"] < 0.8 * smears["plain"]
    assert left["s"] < left["plain"]
    walls = now("plain")
    assert (now("s") & walls).sum() > 0.95 * walls.sum()
    assert (now("printed") & walls).sum() < 0.7 * walls.sum()
