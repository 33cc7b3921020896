"""``vslam-ref ba``: keys, files, and one clear line for bad input."""

from __future__ import annotations

import bz2
import json
from pathlib import Path

import numpy as np
import pytest

from vslam_ref.cli import main
from vslam_ref.datasets.bundle_files import read_bundle

KEYS = {
    *("cameras", "points", "observations", "initial_cost", "final_cost", "iterations"),
    *("seconds", "cpu_seconds", "backend", "reason", "rmse_px"),
}


def bal_text(rng: np.random.Generator, *, behind: bool = False, points: int = 12) -> str:
    """Three cameras on a line, and points; projected by BAL's own definition, then moved."""
    rows, X = [], rng.uniform(-1, 1, (points, 3)) - [0, 0, 5]
    centres = np.array([[-0.5, 0, 0], [0, 0.1, 0], [0.5, 0, 0.1]])
    for i, centre in enumerate(centres):
        for j, point in enumerate(X):
            P = point - centre
            p = -P[:2] / P[2]
            u, v = 500 * (1 - 0.1 * p @ p) * p + rng.normal(0, 0.3, 2)
            rows.append(f"{i} {j} {u:.6f} {v:.6f}")
    cameras = [f"0 0 0 {' '.join(map(str, -c))} 500 -0.1 0" for c in centres]
    moved = X + rng.normal(0, 0.05, X.shape)
    if behind:
        moved[:, 2] = 5.0
    places = [" ".join(map(str, x)) for x in moved]
    return "\n".join([f"3 {points} {len(rows)}", *rows, *cameras, *places]) + "\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "small.txt.bz2"
    path.write_bytes(bz2.compress(bal_text(np.random.default_rng(0)).encode()))
    return path


@pytest.mark.parametrize("backend", ["auto", "numpy"])
def test_numbers_and_files(
    backend: str, file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, ply, told = tmp_path / "adjusted.txt", tmp_path / "scene.ply", tmp_path / "numbers.json"
    wanted = [
        "--json",
        str(told),
        "--ply",
        str(ply),
        "--out",
        str(out),
        "--backend",
        backend,
        "--free",
        "none",
    ]
    assert main(["ba", str(file), *wanted]) == 0
    numbers = json.loads(told.read_text())
    assert set(numbers) >= KEYS
    assert (numbers["cameras"], numbers["points"], numbers["observations"]) == (3, 12, 36)
    assert numbers["final_cost"] < 0.05 * numbers["initial_cost"]
    assert numbers["iterations"] >= 2
    assert numbers["reason"] in ("cost", "gradient")
    printed = capsys.readouterr().out
    assert f"{numbers['final_cost']:.6f}" in printed
    assert printed.count("\n") > numbers["iterations"]
    assert ply.read_bytes().startswith(b"ply\n")
    # the result, read again, is where it ended
    again = tmp_path / "again.json"
    assert main(["ba", str(out), "--json", str(again), "--set", "max_iterations=0"]) == 0
    assert json.loads(again.read_text())["initial_cost"] == pytest.approx(numbers["final_cost"], rel=1e-9)


def test_options_reach_the_solver(file: Path, tmp_path: Path) -> None:
    """Tukey with a scale, no intrinsics, a fixed gauge; the held view stays where it was."""
    told, out = tmp_path / "a.json", tmp_path / "out.txt"
    words = ["--loss", "tukey", "--scale", "2.0", "--free", "none", "--gauge", "fixed"]
    assert main(["ba", str(file), *words, "--json", str(told), "--out", str(out)]) == 0
    numbers = json.loads(told.read_text())
    assert numbers["sigma"] == 2.0
    before, after = read_bundle(file).problem.scene, read_bundle(out).problem.scene
    assert np.abs(after.T_cam_world[0] - before.T_cam_world[0]).max() < 1e-14
    assert np.abs(after.T_cam_world[1] - before.T_cam_world[1]).max() > 1e-6
    assert (after.intrinsics == before.intrinsics).all()


BAD = [
    (["--loss", "tukey", "--scale", "-1"], "--scale '-1'"),
    (["--scale", "3"], "least squares has no scale"),
    (["--free", "g"], "intrinsic 'g'"),
    (["--set", "nope=3"], "unknown setting 'nope'"),
    (["--set", "damping=-1"], "damping"),
    (["--out", "missing_folder/x.txt"], "missing_folder"),
    (["--out", "x.xyz"], "suffix '.xyz' is of no format"),
    (["--ply", "scene.obj"], "the name must end in .ply"),
    (["--out", "x.txt", "--binary"], "x.txt is not a folder's name"),
    (["--binary"], "give --out FOLDER"),
    (["--out", "x.txt", "--json", "x.txt"], "two outputs have one name"),
    (["--out", "x.txt", "--free", "f,cx"], "x.txt cannot be written: cx may move: BAL cannot say it"),
    (["--out", "x.txt", "--free", "fx"], "fx and fy may move apart"),
    (["--loss", "tukey", "--scale", "1e-6"], "no error that is small"),
]


@pytest.mark.parametrize(("words", "told"), BAD)
def test_bad_options(words: list[str], told: str, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ba", str(file), *words]) == 2
    said = capsys.readouterr()
    assert told in said.err
    assert said.err.count("\n") == 1
    assert "cost at the end" not in said.out


def test_nothing_is_written_where_nothing_can_be_adjusted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "behind.txt"
    path.write_text(bal_text(np.random.default_rng(1), behind=True))
    out, told = tmp_path / "out.txt", tmp_path / "numbers.json"
    assert main(["ba", str(path), "--out", str(out), "--json", str(told)]) == 2
    assert "behind its camera" in capsys.readouterr().err
    assert not out.exists()
    assert not told.exists()


def test_damaged_file_names_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "cut.txt"
    text = bal_text(np.random.default_rng(1)).splitlines()
    text[4] = "0 3 nan 1.0"
    path.write_text("\n".join(text))
    assert main(["ba", str(path)]) == 2
    assert f"{path}:5:" in capsys.readouterr().err


def test_weak_problems_are_named(file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A point seen once is told before the table of steps."""
    lines = bz2.decompress(file.read_bytes()).decode().splitlines()
    kept = [line for line in lines[1:37] if not line.startswith(("1 4 ", "2 4 "))]
    path = tmp_path / "weak.txt"
    path.write_text("\n".join([f"3 12 {len(kept)}", *kept, *lines[37:]]))
    assert main(["ba", str(path)]) == 0
    assert "points seen once, whose depth is not measured: 1 (first: 4)" in capsys.readouterr().out


def test_an_adjustment_that_did_not_converge_is_told(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = tmp_path / "a.json"
    assert main(["ba", str(file), "--json", str(told), "--set", "max_iterations=2"]) == 0
    numbers = json.loads(told.read_text())
    assert numbers["converged"] is False
    (note,) = numbers["notes"]
    assert note.startswith("not converged after 2 steps: the last one still lowered the cost by ")
    assert f"note: {note}" in capsys.readouterr().out
    assert main(["ba", str(file), "--json", str(told), "--free", "none"]) == 0
    assert json.loads(told.read_text())["notes"] == []
    assert json.loads(told.read_text())["converged"] is True


def test_v_downwards_is_told_also_in_the_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, told = tmp_path / "down.txt", tmp_path / "a.json"
    lines = [line.split() for line in bal_text(np.random.default_rng(0), points=20).splitlines()]
    lines = [w if k == 0 or len(w) != 4 else [*w[:3], repr(-float(w[3]))] for k, w in enumerate(lines)]
    path.write_text("\n".join(" ".join(words) for words in lines) + "\n")
    assert main(["ba", str(path), "--json", str(told)]) == 0
    (note,) = (note for note in json.loads(told.read_text())["notes"] if "convention" in note)
    assert "v counts downwards" in note
    assert f"note: {note}\n" in capsys.readouterr().out


def colmap_folder(folder: Path, *, fisheye: bool = False, points: bool = True) -> Path:
    """Three cameras, twelve points, exact pixels; the last camera may be a fisheye."""
    rng = np.random.default_rng(3)
    X = rng.uniform(-1, 1, (12, 3)) + [0, 0, 5]
    folder.mkdir()
    model = "OPENCV_FISHEYE 640 480 300 300 320 240 0 0 0 0" if fisheye else "PINHOLE 640 480 300 300 320 240"
    (folder / "cameras.txt").write_text(f"1 PINHOLE 640 480 500 510 320 240\n2 {model}\n")
    images, tracks = [], [[] for _ in X]
    for i, x in enumerate((-0.5, 0.0, 0.5)):
        P = X - [x, 0, 0]
        xn = P[:, :2] / P[:, 2:]
        r = np.linalg.norm(xn, axis=1)[:, None]
        uv = (
            xn * [500, 510] + [320, 240]
            if i < 2
            else 300 * (np.arctan(r) / r * xn if fisheye else xn) + [320, 240]
        )
        images.append(f"{i + 1} 1 0 0 0 {-x} 0 0 {1 if i < 2 else 2} image {i}.jpg")
        images.append(
            " ".join(f"{u!r} {v!r} {j + 1}" for j, (u, v) in enumerate(uv.tolist())) if points else ""
        )
        for j in range(12):
            tracks[j].append(f"{i + 1} {j}")
    (folder / "images.txt").write_text("\n".join(images) + "\n")
    moved = X + rng.normal(0, 0.02, X.shape)
    rows = [
        f"{j + 1} {' '.join(map(repr, x))} 1 2 3 0 {' '.join(tracks[j])}"
        for j, x in enumerate(moved.tolist())
    ]
    (folder / "points3D.txt").write_text("\n".join(rows) + "\n" if points else "")
    return folder


@pytest.mark.parametrize("backend", ["auto", "numpy"])
def test_lenses_of_two_families_are_adjusted_and_written(tmp_path: Path, backend: str) -> None:
    folder, out, told = colmap_folder(tmp_path / "m", fisheye=True), tmp_path / "out", tmp_path / "a.json"
    out.mkdir()
    words = ["--out", str(out), "--json", str(told), "--backend", backend, "--set", "cost=1e-14"]
    assert main(["ba", str(folder), *words]) == 0
    numbers = json.loads(told.read_text())
    assert numbers["rmse_px"] < 1e-4
    assert numbers["notes"] == [
        f"3 image names with blanks in {out}: COLMAP's own reader of text cuts a name at its first blank; "
        "--binary keeps it whole"
    ]
    again = read_bundle(out)
    assert again.view_names == ("image 0.jpg", "image 1.jpg", "image 2.jpg")
    assert again.camera_models == ("PINHOLE", "OPENCV_FISHEYE")


def test_what_a_format_cannot_say_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = colmap_folder(tmp_path / "m", fisheye=True)
    held = tmp_path / "held"
    held.mkdir()
    (held / "rigs.txt").write_text("")
    for out, words in (
        ("x.txt", "of several lens families: BAL has"),
        ("held", "holds rigs.txt and is not empty"),
    ):
        assert main(["ba", str(folder), "--out", str(tmp_path / out)]) == 2
        said = capsys.readouterr()
        assert words in said.err
        assert "step" not in said.out


def test_a_model_of_poses_alone_has_nothing_to_adjust(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["ba", str(colmap_folder(tmp_path / "m", points=False))]) == 2
    error = capsys.readouterr().err
    assert "has 3 cameras and no points: nothing to adjust" in error
    assert error.count("\n") == 1


def test_one_output_that_fails_keeps_no_other_from_being_written(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from vslam_ref.datasets import bundle_files

    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", "out.txt")

    monkeypatch.setattr(bundle_files, "write_bundle", full)
    told, ply = tmp_path / "a.json", tmp_path / "a.ply"
    words = ["--json", str(told), "--ply", str(ply), "--out", str(tmp_path / "out.txt"), "--free", "none"]
    assert main(["ba", str(file), *words]) == 2
    assert capsys.readouterr().err == "vslam-ref: error: No space left on device: out.txt\n"
    assert json.loads(told.read_text())["converged"] is True
    assert ply.read_bytes().startswith(b"ply")
