"""BAL: what a file means, round trips, sizes that lie, archives that swell, and every malformation."""

from __future__ import annotations

import bz2
import gzip
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import bundle_samples as samples
import numpy as np
import pytest

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import BundleFile, loading, read_bal, read_bundle, write_bal
from vslam_ref.datasets.text import FormatError
from vslam_ref.estimation.bundle import BundleProblem, Observations, Scene
from vslam_ref.geometry import so3
from vslam_ref.geometry.cameras import Fov, Pinhole, Radtan

TEXT = samples.bal_text()
FOLDER = catalogue.find("bal")
needs_bal = pytest.mark.skipif(FOLDER is None, reason="bal is not in VSLAM_REF_DATA")
EPS = float(np.finfo(float).eps)


def written(tmp_path: Path, data: str | bytes, name: str = "problem.txt") -> Path:
    path = tmp_path / name
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


# --- meaning ---------------------------------------------------------------------------------------


def test_the_problem_has_the_residuals_of_bals_own_formula(tmp_path: Path) -> None:
    file = read_bal(written(tmp_path, TEXT))
    expected = samples.bal_residuals(TEXT) * [1, -1]
    # pixels of 1e2 from a chain of ten operations in different order
    np.testing.assert_allclose(samples.residuals(file), expected, rtol=0, atol=1e2 * 50 * EPS)
    np.testing.assert_allclose(expected, -samples.NOISE * [1, -1], rtol=0, atol=1e2 * 50 * EPS)
    assert (file.problem.scene.T_cam_world[:, 2, 3] > 0).all()  # z ahead: the points are in front
    assert file.format == "bal"


def test_each_view_has_its_own_focal_length_and_two_coefficients_that_move(tmp_path: Path) -> None:
    problem = read_bal(written(tmp_path, TEXT)).problem
    assert problem.lens_of_view.tolist() == [0, 1, 2]
    names = Radtan.names()
    moving = [{names[i] for i in np.flatnonzero(column)} for column in problem.free.intrinsics.T]
    assert moving == [{"fx", "fy"}, {"k1"}, {"k2"}]
    assert problem.free.pose.all()
    assert problem.free.point.all()


def test_line_ends_mean_nothing(tmp_path: Path) -> None:
    plain = read_bal(written(tmp_path, TEXT)).problem
    other = read_bal(written(tmp_path, "\n " + TEXT.replace("\n", "\r\n\t\r\n").rstrip(), "b.txt")).problem
    assert other.scene.T_cam_world.tobytes() == plain.scene.T_cam_world.tobytes()
    assert other.seen.uv.tobytes() == plain.seen.uv.tobytes()


@needs_bal
@pytest.mark.parametrize(
    ("name", "sizes", "cost"),
    [
        # published: JuliaSmoothOptimizers' test suite; the other two by the formula here only
        ("problem-16-22106-pre.txt.bz2", (16, 22106, 83718), 4185659.51824972),
        ("dubrovnik-3-7-pre.txt", (3, 7, 19), None),
        ("dubrovnik-1-1-pre.txt", (1, 1, 1), None),
    ],
)
def test_real_problems_have_the_published_cost(
    name: str, sizes: tuple[int, int, int], cost: float | None
) -> None:
    assert FOLDER is not None
    path = FOLDER / name
    raw = bz2.decompress(path.read_bytes()) if path.suffix == ".bz2" else path.read_bytes()
    own = samples.cost(samples.bal_residuals(raw.decode()))
    file = read_bundle(path)
    assert file.problem.sizes == sizes
    found = samples.cost(samples.residuals(file))
    assert found == pytest.approx(own, rel=1e-12)
    if cost is not None:
        assert found == pytest.approx(cost, rel=1e-10)


@needs_bal
def test_reading_costs_little_more_than_turning_words_to_numbers(tmp_path: Path) -> None:
    """Both in the same process and the best of three, so that a busy machine slows both."""
    assert FOLDER is not None
    data = bz2.decompress((FOLDER / "problem-16-22106-pre.txt.bz2").read_bytes())
    path = written(tmp_path, data)

    def best(action: Callable[[], object]) -> float:
        taken = []
        for _ in range(3):
            begin = time.perf_counter()
            action()
            taken.append(time.perf_counter() - begin)
        return min(taken)

    # measured: 2 to 3 times; a loop over lines takes 15 times
    assert best(lambda: read_bal(path)) < 8 * best(lambda: np.array(data.split(), dtype=np.float64))


# --- writing ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["again.txt", "again.txt.gz", "again.txt.bz2"])
def test_what_is_written_reads_back(tmp_path: Path, name: str) -> None:
    file = read_bal(written(tmp_path, TEXT))
    write_bal(tmp_path / name, file)
    again = read_bal(tmp_path / name)
    a, b = file.problem, again.problem
    for one, other in (
        (a.seen.uv, b.seen.uv),
        (a.seen.view, b.seen.view),
        (a.seen.point, b.seen.point),
        (a.scene.X_world, b.scene.X_world),
        (a.scene.intrinsics, b.scene.intrinsics),
        (a.scene.T_cam_world[:, :3, 3], b.scene.T_cam_world[:, :3, 3]),
    ):
        assert (one == other).all()
    # log and exp of a rotation are each within a few eps
    assert np.abs(a.scene.T_cam_world - b.scene.T_cam_world).max() < 20 * EPS
    assert samples.cost(samples.residuals(again)) == pytest.approx(
        samples.cost(samples.residuals(file)), rel=1e-12
    )
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["problem.txt", name])


def small(model: type[Pinhole] | type[Radtan], **values: float) -> BundleFile:
    """Two views that share one set of intrinsics and see one point."""
    given = {"fx": 500.0, "fy": 500.0, "cx": 0.0, "cy": 0.0} | values
    params = [[given.get(name, 0.0) for name in model.names()]]
    T = np.tile(np.eye(4), (2, 1, 1))
    T[1, 0, 3] = 0.5
    T[1, :3, :3] = so3.exp([0.0, np.pi, 0.0])  # the log of a half turn has two answers; both are right
    return BundleFile(
        BundleProblem(model, Scene(T, [[0.0, 0.1, 2.0]], params), Observations([0], [0], [[0.0, 25.0]]))
    )


@pytest.mark.parametrize("model", [Pinhole, Radtan])
def test_shared_intrinsics_are_repeated(tmp_path: Path, model: type[Pinhole] | type[Radtan]) -> None:
    write_bal(tmp_path / "a.txt", small(model))
    again = read_bal(tmp_path / "a.txt").problem
    assert again.scene.intrinsics[:, :6].tolist() == [[500.0, 500.0, 0.0, 0.0, 0.0, 0.0]] * 2
    assert np.abs(again.scene.T_cam_world - small(model).problem.scene.T_cam_world).max() < 20 * EPS
    # BAL's first camera is half a turn here, whose sine is not exactly 0
    assert np.abs(samples.residuals(BundleFile(again))).max() < 500 * 20 * EPS


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"fy": 501.0}, "fy - fx of view 0 is 1"),
        ({"cx": 3.0}, "cx of view 0 is 3: BAL cannot say it"),
        ({"cy": -1.0}, "cy of view 0"),
        ({"p1": 1e-3}, "p1 of view 0"),
        ({"p2": 1e-3}, "p2 of view 0"),
        ({"k3": 1e-3}, "k3 of view 0"),
    ],
)
def test_what_bal_cannot_say_is_refused_and_nothing_is_written(
    tmp_path: Path, values: dict[str, float], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        write_bal(tmp_path / "a.txt", small(Radtan, **values))
    assert list(tmp_path.iterdir()) == []


def test_other_models_and_covariances_are_refused(tmp_path: Path) -> None:
    scene = Scene(np.eye(4)[None], [[0.0, 0.0, 2.0]], [[500.0, 500.0, 0.0, 0.0, 0.9]])
    fov = BundleProblem(Fov, scene, Observations([0], [0], [[0.0, 0.0]]))
    with pytest.raises(ValueError, match="model Fov: BAL has f, k1, k2 only"):
        write_bal(tmp_path / "a.txt", BundleFile(fov))
    scene = Scene(np.eye(4)[None], [[0.0, 0.0, 2.0]], [[500.0, 500.0, 0.0, 0.0]])
    weighted = BundleProblem(Pinhole, scene, Observations([0], [0], [[0.0, 0.0]], 4 * np.eye(2)[None]))
    with pytest.raises(ValueError, match="covariances"):
        write_bal(tmp_path / "a.txt", BundleFile(weighted))


# --- bad input -------------------------------------------------------------------------------------

LINES = TEXT.splitlines()
BODY = 1 + len(samples.PAIRS)
"""Lines before the first camera."""


def replaced(line: int, words: str) -> str:
    """The sample with line ``line``, from 1, replaced."""
    return "\n".join([*LINES[: line - 1], words, *LINES[line:]]) + "\n"


@pytest.mark.parametrize(
    ("data", "line", "words"),
    [
        ("", None, "the file is empty"),
        (" \n\n", None, "the file is empty"),
        ("3 5\n", 1, "'3 5'; expected three counts"),
        ("\n\n3 x 5 1\n", 3, "'3 x 5'; expected three counts"),
        ("-3 5 11\n", 1, "expected three counts"),
        ("3.5 5 11\n", 1, "expected three counts"),
        ("0 5 0\n" + "1\n" * 15, 1, "0 cameras; expected at least one"),
        (replaced(1, "3 5 16"), 1, "16 observations of 5 points by 3 cameras; expected at most one each"),
        (replaced(1, "3000000 1000000 1000000000000"), 1, "need at least"),
        (replaced(1, "3 5 12"), len(LINES), "the file ends after"),
        (replaced(1, "3 5 10"), len(LINES) - 3, "numbers go on; expected"),
        ("\n".join(LINES[:-1]), len(LINES) - 1, "the file ends after"),
        (TEXT + "7\n", len(LINES) + 1, "numbers go on"),
        (replaced(4, "3 2 1.0 2.0"), 4, "camera of an observation is 3; expected a whole number from 0 to 2"),
        (replaced(4, "-1 2 1.0 2.0"), 4, "camera of an observation is -1"),
        (replaced(4, "0 5 1.0 2.0"), 4, "point of an observation is 5; expected a whole number from 0 to 4"),
        (replaced(4, "0 2.5 1.0 2.0"), 4, "point of an observation is 2.5"),
        (replaced(4, "0 2 nan 2.0"), 4, "'nan' is not a number"),
        (replaced(4, "0 2 inf 2.0"), 4, "'inf' is not a number"),
        (replaced(4, "0 2 1e999 2.0"), 4, "'1e999' is not a number; expected a finite number"),
        (replaced(4, "0 2 1_0 2.0"), 4, "'1_0' is not a number"),
        (replaced(4, "0 2 - 2.0"), 4, "'-' is not a number"),
        (replaced(4, "0 2 1.0 2.0 # seen"), 4, "'#' is not a number"),
        (replaced(4, "0 2 1e20 2.0"), 4, "a number is 1e+20; expected less than 1e+15"),
        (replaced(4, "0 2 " + "1" * 500 + " 2.0"), 4, "a word of 500 characters"),
        (replaced(BODY + 1, "2e6"), BODY + 1, "rotation vector is 2e+06; expected radians below 1e6"),
        (replaced(BODY + 7, "0"), BODY + 7, "focal length is 0; expected more than 0 pixels"),
        (replaced(BODY + 16, "-500.0"), BODY + 16, "focal length is -500"),
        (TEXT.encode().replace(b"\n", b"\n\xff", 4), 2, "'\\\\xff0' is not a number"),
        (TEXT.encode().replace(b" ", b"\x00", 1), 1, "expected three counts"),
    ],
)
def test_a_wrong_file_is_told_in_one_line(
    tmp_path: Path, data: str | bytes, line: int | None, words: str
) -> None:
    path = written(tmp_path, data)
    with pytest.raises(FormatError) as caught:
        read_bal(path)
    message = str(caught.value)
    assert message.startswith(f"{path}:{line}: " if line else f"{path}: "), message
    assert words in message
    assert "\n" not in message


def test_an_error_at_the_end_of_a_large_file_is_found_as_fast_as_the_file_is_read(tmp_path: Path) -> None:
    """Lines are counted once, not for every word: 3 MB and 300,000 words would take minutes."""
    rows = "".join(f"0 {k} 1.5 2.5\n" for k in range(150_000))
    text = f"1 150000 150000\n{rows}" + "0 0 0 0 0 0 500 0 0\n" + "0 0 1\n" * 149_999
    path = written(tmp_path, text + "0 0 x\n")
    begin = time.process_time()
    with pytest.raises(FormatError, match=r":300002: 'x' is not a number"):
        read_bal(path)
    path.write_text(text + "0 0\n")
    with pytest.raises(FormatError, match=r":300001: the file ends after|:300002: the file ends after"):
        read_bal(path)
    path.write_text((text + "0 0 1\n").replace("\n0 149999 ", "\n0 149998 "))
    assert read_bal(path).notes == (AGAIN,)
    assert time.process_time() - begin < 10.0  # measured: 1 s


AGAIN = "1 observation of a point that a camera sees twice left out: the first one is kept"


def test_a_point_seen_twice_is_counted_and_the_first_kept(tmp_path: Path) -> None:
    file = read_bal(written(tmp_path, replaced(4, "0 0 1.0 2.0")))
    assert file.notes == (AGAIN,)
    assert file.problem.sizes == (3, 5, len(samples.PAIRS) - 1)
    assert [1.0, -2.0] not in file.problem.seen.uv.tolist()


def test_lonely_points_and_idle_cameras_are_no_errors_of_the_reader(tmp_path: Path) -> None:
    lines = [line for line in LINES if not line.startswith(("0 4 ", "1 "))]
    lines[0] = f"3 5 {len(samples.PAIRS) - 4}"
    problem = read_bal(written(tmp_path, "\n".join(lines))).problem
    assert problem.sizes == (3, 5, len(samples.PAIRS) - 4)
    assert 1 not in problem.seen.view


def test_points_behind_a_camera_are_no_errors_of_the_reader(tmp_path: Path) -> None:
    at = len(LINES) - 3 * len(samples.POINTS) + 3  # z of the first point
    assert read_bal(written(tmp_path, replaced(at, "900.0"))).problem.sizes == (3, 5, 11)


def test_a_header_of_a_trillion_observations_costs_no_memory(tmp_path: Path) -> None:
    path = written(tmp_path, replaced(1, "3000000 1000000 1000000000000"))
    tracemalloc.start()
    try:
        with pytest.raises(FormatError, match="truncated, or a wrong count"):
            read_bal(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2**21


@pytest.mark.parametrize(("name", "pack"), [("bomb.txt.gz", gzip.compress), ("bomb.txt.bz2", bz2.compress)])
def test_an_archive_that_swells_stops_at_the_limit(
    tmp_path: Path, name: str, pack: Callable[[bytes], bytes]
) -> None:
    """A thousand members of a MiB each: a GiB of text from a file of at most a megabyte."""
    path = written(tmp_path, 1000 * pack(b"0 " * 2**19), name)
    tracemalloc.start()
    try:
        with pytest.raises(FormatError, match="more than 4194304 bytes unpacked"):
            read_bal(path, max_bytes=2**22)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 2**22 + 2**23  # the limit, one piece, and what the decompressor holds
    with pytest.raises(FormatError, match=f"more than {loading.SMALL} bytes unpacked; expected at most"):
        read_bal(path)


def test_the_limit_may_be_raised(tmp_path: Path) -> None:
    path = written(tmp_path, gzip.compress(TEXT.encode()), "a.txt.gz")
    with pytest.raises(FormatError, match="more than 100 bytes"):
        read_bal(path, max_bytes=100)
    assert read_bal(path, max_bytes=len(TEXT)).problem.sizes == (3, 5, 11)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.txt.bz2", bz2.compress(TEXT.encode())[:-20], "damaged bzip2 file"),
        ("a.txt.bz2", b"BZh9 nothing", "damaged bzip2 file"),
        ("a.txt.gz", gzip.compress(TEXT.encode())[:-12], "damaged gzip file"),
        ("a.txt.gz", TEXT.encode(), "damaged gzip file"),
    ],
)
def test_a_damaged_archive_is_refused(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    with pytest.raises(FormatError, match=words):
        read_bal(written(tmp_path, data, name))


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such file"):
        read_bal(tmp_path / "none.txt")
    with pytest.raises(FormatError, match="cannot be read"):
        read_bal(tmp_path)
