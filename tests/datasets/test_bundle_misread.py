"""BAL and Bundler files of another convention are told, and right ones are not, however bad their start."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.bundle_files import BundleFile, read_bal
from vslam_ref.datasets.bundle_files.misread import likely_misread, other_readings, typical_error
from vslam_ref.estimation.bundle import BundleProblem, BundleResult, Options, Scene, bundle_adjust
from vslam_ref.estimation.bundle.projection import reprojection
from vslam_ref.geometry import se3

FLIP = np.diag([1.0, -1.0, -1.0])
CENTRE = np.array([320.0, 240.0])
LENS = np.array([500.0, -0.05, 0.01])


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(8)


def bal(
    folder: Path,
    rng: np.random.Generator,
    *,
    views: int = 4,
    points: int = 24,
    noise: float = 0.2,
    moved: float = 0.02,
    v_down: bool = False,
    corner: bool = False,
    ahead: bool = False,
) -> BundleFile:
    """A BAL file written out by the format's definition, or by another convention."""
    X = rng.uniform(-1, 1, (points, 3))
    rows, cameras = [], []
    for i, angle in enumerate(np.linspace(-0.3, 0.3, views)):
        R = Rotation.from_rotvec([0.1 * np.sin(3 * angle), angle, 0.05 * i]).as_matrix()
        t = np.array([0.1 * i, -0.1, -5 - 0.2 * i])
        P = X @ R.T + t
        p = -P[:, :2] / P[:, 2:]
        q = (p * p).sum(1)
        uv = (LENS[0] * (1 + LENS[1] * q + LENS[2] * q * q))[:, None] * p
        uv = (uv + rng.normal(0, noise, uv.shape)) * [1, -1 if v_down else 1] + CENTRE * corner
        rows += [f"{i} {j} {u!r} {v!r}" for j, (u, v) in enumerate(uv.tolist())]
        R, t = (FLIP @ R, FLIP @ t) if ahead else (R, t)
        off = rng.normal(0, moved, 6)
        cameras += [*(Rotation.from_matrix(R).as_rotvec() + off[:3]), *(t + off[3:]), *LENS]
    X = X + rng.normal(0, moved, X.shape)
    numbers = [repr(float(value)) for value in [*cameras, *X.ravel()]]
    path = folder / "problem.txt"
    path.write_text("\n".join([f"{views} {points} {len(rows)}", *rows, *numbers]) + "\n")
    return read_bal(path)


class Adjuster:
    """The adjustment of the command, which counts how often it is asked."""

    def __init__(self, options: Options | None = None) -> None:
        self.options, self.asked = options, 0

    def __call__(self, problem: BundleProblem) -> BundleResult:
        self.asked += 1
        return bundle_adjust(problem, None, self.options)


def told(file: BundleFile, adjust: Adjuster | None = None) -> str:
    adjust = adjust or Adjuster()
    return likely_misread(file, bundle_adjust(file.problem, None, adjust.options), adjust)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"v_down": True}, ["v counts downwards"]),
        ({"corner": True}, ["counted from a corner"]),
        ({"v_down": True, "corner": True}, ["v counts downwards", "counted from a corner"]),
        ({"ahead": True, "v_down": True}, ["look along +z", "v counts downwards"]),
        ({"ahead": True, "v_down": True, "corner": True}, ["look along +z", "downwards", "from a corner"]),
    ],
)
def test_another_convention_is_named(
    tmp_path: Path, rng: np.random.Generator, wrong: dict[str, bool], words: list[str]
) -> None:
    said = told(bal(tmp_path, rng, **wrong))  # type: ignore[arg-type]
    assert all(word in said for word in words), said
    others = {"v counts downwards", "counted from a corner", "look along +z"}
    assert sum(word in said for word in others) == len(words)
    assert "\n" not in said


@pytest.mark.parametrize("views", [3, 8])
@pytest.mark.parametrize("noise", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("moved", [1e-3, 0.1])
def test_v_downwards_is_told_and_a_right_file_is_not(
    tmp_path: Path, rng: np.random.Generator, views: int, noise: float, moved: float
) -> None:
    given = {"views": views, "noise": noise, "moved": moved}
    assert "v counts downwards" in told(bal(tmp_path, rng, v_down=True, **given))  # type: ignore[arg-type]
    assert told(bal(tmp_path, rng, **given)) == ""  # type: ignore[arg-type]


def test_a_right_file_is_not_adjusted_twice(tmp_path: Path, rng: np.random.Generator) -> None:
    file, adjust = bal(tmp_path, rng), Adjuster()
    assert told(file, adjust) == ""
    assert adjust.asked == 0


def test_not_converged_alone_is_no_reason(tmp_path: Path, rng: np.random.Generator) -> None:
    file, adjust = bal(tmp_path, rng, moved=0.3), Adjuster(Options(max_iterations=1))
    assert told(file, adjust) == ""
    few = bal(tmp_path, rng, v_down=True)
    seen = few.problem.seen
    few = replace(few, problem=replace(few.problem, seen=seen.only(np.arange(len(seen)) < 30)))
    assert told(few) == ""  # 30 observations fit many a reading


def test_other_formats_have_one_reading(tmp_path: Path, rng: np.random.Generator) -> None:
    file = replace(bal(tmp_path, rng, v_down=True), format="colmap")
    assert list(other_readings(file)) == []
    assert told(file) == ""


@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
def test_public_problems_are_right_however_bad_the_start(share: float) -> None:
    """Poses and points moved by up to the size of the scene: no other reading starts at half the error."""
    folder = catalogue.find("bal")
    if folder is None:
        pytest.skip("no BAL data")
    file = read_bal(folder / "problem-16-22106-pre.txt.bz2")
    scene, rng = file.problem.scene, np.random.default_rng(4)
    size = share * float(np.median(np.linalg.norm(scene.X_world - np.median(scene.X_world, 0), axis=1)))
    steps = np.hstack([size * rng.standard_normal((16, 3)), share * rng.standard_normal((16, 3))])
    X = scene.X_world + size * rng.standard_normal(scene.X_world.shape)
    moved = Scene(se3.perturb(scene.T_cam_world, steps), X, scene.intrinsics)
    file = replace(file, problem=file.problem.at(moved))
    start = typical_error(*reprojection(file.problem))
    others = [typical_error(*reprojection(other.problem)) for other in other_readings(file)]
    assert min(others) > 0.6 * start
    if share == 0.0:
        assert min(others) > 10 * start
