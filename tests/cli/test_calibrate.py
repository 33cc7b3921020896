"""``vslam-ref calibrate`` prints and writes the numbers of the library, and tells bad input in one line."""

from __future__ import annotations

import functools
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from vslam_ref import _kernels, cli
from vslam_ref.commands import calibrate as command
from vslam_ref.datasets import checkerboard, pictures
from vslam_ref.datasets.calibration_files import read_opencv
from vslam_ref.estimation.calibration import Board, calibrate
from vslam_ref.estimation.robust import LOSSES
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import MODELS, Radtan
from vslam_ref.worlds import boards

KEYS = [
    "model", "image_size", "images", "used", "skipped", "copies", "rms_px", "mean_px", "camera_matrix",
    "distortion", "parameters", "std", "per_image", "iterations", "reason", "seconds",
]  # fmt: skip
SIZE = (320, 240)
TRUTH = Radtan(250, 252, 161, 118, -0.2, 0.05, 1e-3, -5e-4)
BOARD = Board(6, 4, 0.05)


@functools.cache
def rays() -> np.ndarray:
    """Bearings (480, 640, 3) of four places in every pixel."""
    sub = np.array([-0.25, 0.25])
    v, u = np.meshgrid(
        (np.arange(240)[:, None] + sub).ravel(), (np.arange(320)[:, None] + sub).ravel(), indexing="ij"
    )
    return TRUTH.unproject(np.stack([u, v], -1)).bearing


def board_image(T_cam_board: np.ndarray) -> np.ndarray:
    """The board seen by ``TRUTH``: each pixel the mean of 4 rays to the plane."""
    T = np.linalg.inv(T_cam_board)
    d, o = rays() @ T[:3, :3].T, T[:3, 3]
    X = o + d * (-o[2] / d[..., 2])[..., None]
    square = np.floor(X[..., :2] / BOARD.square).astype(int)
    on = ((square >= -1) & (square < [6, 4])).all(-1)
    grey = np.where(on & (square.sum(-1) % 2 == 0), 30.0, 220.0)
    return grey.reshape(240, 2, 320, 2).mean(axis=(1, 3)).round().astype(np.uint8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight pictures of the board, one of nothing."""
    path = tmp_path_factory.mktemp("boards")
    T = boards.poses(BOARD, TRUTH, SIZE, 8, np.random.default_rng(3), tilt=(0.3, 0.7), fill=(0.45, 0.65))
    for i, pose in enumerate(T):
        cv2.imwrite(str(path / f"{i}.png"), board_image(pose))
    cv2.imwrite(str(path / "wall.png"), np.full((240, 320), 128, np.uint8))
    return path


def run(*words: object) -> int:
    return cli.main(["calibrate", *map(str, words)])


def test_printed_written_and_computed_numbers_are_the_same(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target, out = tmp_path / "numbers.json", tmp_path / "camera.yaml"
    assert run(folder, "--board", "6x4", "--square", "0.05", "--json", target, "--out", out) == 0
    shown = capsys.readouterr().out
    numbers = json.loads(target.read_text())
    assert numbers.pop("versions")["backend"] == _kernels.backend()
    assert numbers.pop("notes") == [f"{folder / 'wall.png'}: no board found, left out"]
    assert list(numbers) == KEYS
    assert (numbers["images"], numbers["used"]) == (9, 8)
    assert numbers["skipped"] == [str(folder / "wall.png")]
    assert f"note: {folder / 'wall.png'}: no board found, left out\n" in shown
    views = [
        (BOARD.points, checkerboard.find_corners(pictures.read_grey(folder / f"{i}.png"), 6, 4))
        for i in range(8)
    ]
    found = calibrate(views, SIZE)
    assert numbers["camera_matrix"] == found.camera.matrix.tolist()
    assert numbers["distortion"] == found.camera.params[4:].tolist()
    assert numbers["rms_px"] == found.rms_px
    assert numbers["mean_px"] == found.mean_px
    assert numbers["std"] == found.std
    assert [one["rms_px"] for one in numbers["per_image"]] == found.view_rms_px.tolist()
    assert [Path(one["file"]).name for one in numbers["per_image"]] == [f"{i}.png" for i in range(8)]
    assert numbers["image_size"] == [320, 240]
    assert (numbers["reason"], numbers["iterations"]) == (found.reason, found.iterations)
    assert f"rms {found.rms_px:.5f} px, mean {found.mean_px:.5f} px over 192 corners of 8 images" in shown
    for name, value in numbers["parameters"].items():
        assert re.search(rf"^{name} +{re.escape(f'{value:.6f}')} ", shown, re.MULTILINE), name
    read = read_opencv(out)
    assert read.camera == found.camera
    assert read.size == SIZE
    storage = cv2.FileStorage(str(out), cv2.FILE_STORAGE_READ)
    assert np.array_equal(storage.getNode("camera_matrix").mat(), found.camera.matrix)


def test_the_camera_is_the_one_that_drew_the_pictures(folder: Path, tmp_path: Path) -> None:
    """Nothing between: drawn with known numbers, found by the command. Corner noise from rounded grey values
    is estimated by the residuals; 5 deviations.
    """
    target = tmp_path / "numbers.json"
    assert run(folder, "--board", "6x4", "--json", target) == 0
    numbers = json.loads(target.read_text())
    assert numbers["rms_px"] < 0.2  # two samples a pixel place an edge to 0.5 / sqrt(12) = 0.14 px
    for name, value in zip(TRUTH.names(), TRUTH.params, strict=True):
        assert abs(numbers["parameters"][name] - value) < 5 * numbers["std"][name], name


@pytest.mark.parametrize("model", ["fov", "fisheye", "pinhole"])
def test_other_models(folder: Path, tmp_path: Path, model: str) -> None:
    out = tmp_path / "camera.yaml"
    assert run(folder, "--board", "6x4", "--model", model, "--out", out) == 0
    assert type(read_opencv(out).camera) is MODELS[model]


def test_fixed_parameters_and_a_robust_loss(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "numbers.json"
    more = ["--fix", "k3=0", "--fix", "cx=160.5", "--aspect", "1.008", "--loss", "tukey"]
    assert run(folder, "--board", "6x4", "--json", target, *more) == 0
    numbers = json.loads(target.read_text())
    assert numbers["parameters"]["k3"] == 0.0
    assert numbers["parameters"]["cx"] == 160.5
    assert abs(numbers["parameters"]["fy"] / numbers["parameters"]["fx"] - 1.008) < 1e-12
    assert re.search(r"^k3 +0\.000000 +fixed", capsys.readouterr().out, re.MULTILINE)


def test_the_choices_are_those_of_the_library() -> None:
    assert set(command.MODELS) == set(MODELS)
    assert set(command.LOSSES) <= set(LOSSES)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{}", "--board", "9by6"], "board '9by6': write 9x6, inner corners along a row"),
        (["{}", "--board", "6x4", "--square", "0"], "the side of a square must be a positive number"),
        (["{}", "--board", "6x4", "--square", "big"], "invalid float value: 'big'"),
        (["{}", "--board", "2x4"], "at least 3 inner corners"),
        (["{}", "--board", "8x7"], "5.png, 6.png, 7.png, wall.png; --board counts"),
        (["{}/wall.png", "--board", "6x4"], "no board of 6x4 inner corners in 1 image(s), wall.png"),
        (["{}/0.png", "--board", "6x4"], "1 view(s) of a flat board give 2 equations"),
        (
            ["{}/0.png", "{}/wall.png", "--board", "6x4"],
            "need at least 2 views (no board in 1 of 2: wall.png)",
        ),
        (["{}/none.png", "--board", "6x4"], "none.png: no such file or folder"),
        (["{}", "--board", "6x4", "--fix", "k3"], "--fix 'k3': expected NAME=VALUE, as k3=0"),
        (["{}", "--board", "6x4", "--fix", "k7=0"], "k7: Radtan has no such parameter; it has fx"),
        (["{}", "--board", "6x4", "--aspect", "-1"], "aspect=-1.0: fy / fx must be a positive number"),
        (["{}", "--board", "6x4", "--model", "omni"], "invalid choice: 'omni'"),
        (["{}", "--board", "6x4", "--out", "{}/no/camera.yaml"], "does not exist"),
        (["{}"], "the following arguments are required: --board"),
        (["--board", "6x4"], "the following arguments are required: IMAGES"),
    ],
)
def test_bad_input_is_one_line_and_status_2(
    folder: Path, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*[word.format(folder) for word in words]) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert message in told.err


def test_images_of_two_sizes_and_what_is_no_image(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((100, 50), np.uint8))
    assert run(folder / "0.png", tmp_path / "small.png", "--board", "6x4") == 2
    assert "small.png: 50x100 pixels; the images before have 320x240" in capsys.readouterr().err
    (tmp_path / "text.png").write_text("hello")
    assert run(folder / "0.png", tmp_path / "text.png", "--board", "6x4") == 2
    assert "text.png: no image that can be read" in capsys.readouterr().err


def test_boards_that_do_not_determine_the_camera_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All boards parallel to the image plane."""
    rng = np.random.default_rng(1)
    T = boards.poses(BOARD, TRUTH, SIZE, 3, rng, tilt=(0.0, 0.0), fill=(0.6, 0.8))
    for i, pose in enumerate(T):
        cv2.imwrite(str(tmp_path / f"{i}.png"), board_image(pose))
    out, target = tmp_path / "camera.yaml", tmp_path / "numbers.json"
    assert run(tmp_path, "--board", "6x4", "--fix", "k3=0", "--out", out, "--json", target) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "the images do not determine the camera: fx" in told
    assert "nearly parallel to the image plane" in told
    assert not out.exists()
    assert not target.exists()


def test_boards_that_are_parallel_and_tilted_are_told_their_tilt(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All tilted by 20 degrees about one axis: no tilt of 0, and the two focal lengths with a deviation."""
    rng = np.random.default_rng(5)
    middle = BOARD.points.mean(axis=0)
    for i in range(5):
        R = so3.exp([0.0, np.radians(20), 0.0])
        at = TRUTH.unproject(rng.uniform([120, 90], [200, 150])).bearing * rng.uniform(0.4, 0.5)
        cv2.imwrite(str(tmp_path / f"{i}.png"), board_image(se3.from_rt(R, at - R @ middle)))
    status = run(tmp_path, "--board", "6x4", "--model", "radtan", "--fix", "k3=0")
    told = capsys.readouterr()
    words = told.err + "".join(line for line in told.out.splitlines() if line.startswith("note:"))
    assert status in (0, 2)  # the bend of the lens says something about the focal length
    assert re.search(r"fx = \S+ \+- \S+, fy = \S+ \+- ", words)
    found = re.search(r"they stand at (\d+) degrees to the image plane.* (\S+) degrees apart", words)
    assert found is not None
    assert 14 < float(found[1]) < 30  # at an unknown focal length, tan(tilt) is known to its share
    assert float(found[2]) < 5


def test_copies_count_once(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same numbers as without them; one also saved anew as JPEG; and nothing but copies is refused."""
    alone, with_copies = tmp_path / "a.json", tmp_path / "b.json"
    assert run(folder, "--board", "6x4", "--json", alone) == 0
    image = cv2.imread(str(folder / "0.png"), cv2.IMREAD_GRAYSCALE)
    copies = tmp_path / "copies"
    copies.mkdir()
    cv2.imwrite(str(copies / "again.png"), image)
    cv2.imwrite(str(copies / "saved.jpg"), image, [cv2.IMWRITE_JPEG_QUALITY, 90])
    capsys.readouterr()
    assert run(folder, copies, "--board", "6x4", "--json", with_copies) == 0
    shown = capsys.readouterr().out
    one, two = (json.loads(path.read_text()) for path in (alone, with_copies))
    assert (one["parameters"], one["std"], one["used"]) == (two["parameters"], two["std"], two["used"])
    assert [Path(pair["file"]).name for pair in two["copies"]] == ["again.png", "saved.jpg"]
    note = "2 copies of one view left out, as they say nothing new: again.png, saved.jpg"
    assert f"note: {note}" in shown
    assert any(said.startswith(note) for said in two["notes"])
    assert run(folder / "0.png", copies, "--board", "6x4") == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "2 of 3 pictures are copies of another: again.png, saved.jpg" in told


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        run("--help")
    assert end.value.code == 0
    assert "vslam-ref calibrate left*.jpg --board 9x6" in capsys.readouterr().out
