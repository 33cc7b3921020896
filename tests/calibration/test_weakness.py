"""What corners leave open or weak is named with its deviation and its cause; good ones raise nothing."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.estimation.calibration import Board, BoardView, calibrate, doubts, picture_uncertainty, stack
from vslam_ref.estimation.calibration.board_directions import directions
from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole, Radtan
from vslam_ref.worlds import boards

SIZE = (640, 480)
BOARD = Board(9, 6, 0.03)
BENT = Radtan(500, 505, 322, 238, -0.25, 0.06, 1e-3, -5e-4)
STRAIGHT = Radtan(500, 505, 322, 238, 0.0, 0.0, 0.0, 0.0)


def placed(
    camera: Camera, R: np.ndarray, at: np.ndarray, fill: float, sigma: float, rng: np.random.Generator
):
    """A board turned by R whose middle is seen at a pixel, and whose width fills a share of the picture."""
    middle = BOARD.points.mean(axis=0)
    distance = camera.fx * np.ptp(BOARD.points[:, 0]) / (fill * SIZE[0])
    T = se3.from_rt(R, distance * camera.unproject(at).bearing - R @ middle)
    return boards.views(BOARD, camera, T[None], sigma, rng)[0]


def parallel(camera: Camera, degrees: float, sigma: float, seed: int, count: int = 8) -> list[BoardView]:
    """Boards that are parallel to each other, spun in their own plane, here and there."""
    rng, found = np.random.default_rng(seed), []
    around = rng.uniform(0, 2 * np.pi)
    tilt = so3.exp(np.radians(degrees) * np.array([np.cos(around), np.sin(around), 0.0]))
    for _ in range(count):
        R = tilt @ so3.exp([0.0, 0.0, rng.uniform(-0.3, 0.3)])
        at = np.array([319.5, 239.5]) + rng.uniform([-90, -60], [90, 60])
        found.append(placed(camera, R, at, rng.uniform(0.25, 0.45), sigma, rng))
    return found


def in_the_middle(fill: float, sigma: float) -> list[BoardView]:
    rng, found = np.random.default_rng(1), []
    for _ in range(12):
        around = rng.uniform(-np.pi, np.pi)
        R = so3.exp(rng.uniform(0.2, 0.8) * np.array([np.cos(around), np.sin(around), 0.0]))
        found.append(placed(BENT, R, np.array([319.5, 239.5]) + rng.uniform(-20, 20, 2), fill, sigma, rng))
    return found


def good(camera: Camera, sigma: float, seed: int, count: int = 10) -> list[BoardView]:
    rng = np.random.default_rng(seed)
    return boards.views(BOARD, camera, boards.poses(BOARD, camera, SIZE, count, rng), sigma, rng)


@pytest.mark.parametrize(("seed", "sigma"), [(0, 0.05), (1, 0.2)])
@pytest.mark.parametrize("model", ["radtan", "pinhole"])
@pytest.mark.parametrize("degrees", [0.0, 20.0, 40.0])
def test_parallel_boards_under_a_straight_lens(degrees: float, model: str, sigma: float, seed: int) -> None:
    """Two equations for four unknowns, whatever the tilt; the tilt that is told is theirs, not the fit's.

    At an assumed focal length of 640 instead of 500 px, tan(tilt) is 1.28 times too large.
    """
    found = calibrate(parallel(STRAIGHT, degrees, sigma, seed), SIZE, model)
    assert "fx" in found.undetermined
    if degrees == 0.0:
        assert "parallel to the image plane (largest tilt" in found.undetermined
        return
    assert "nearly parallel to each other, and count as one view" in found.undetermined
    told = float(found.undetermined.split("they stand at ")[1].split()[0])
    assert abs(told - np.degrees(np.arctan(1.28 * np.tan(np.radians(degrees))))) < 6
    assert not found.converged or "+-" in found.undetermined or "infinite" in found.undetermined


@pytest.mark.parametrize("model", ["radtan", "fov"])
@pytest.mark.parametrize("degrees", [20.0, 40.0])
def test_parallel_boards_under_a_bent_lens(degrees: float, model: str) -> None:
    """The bend says where the centre is, and so something of the focal length: at least a note says so."""
    camera = BENT if model == "radtan" else Fov(500, 505, 322, 238, 0.9)
    found = calibrate(parallel(camera, degrees, 0.05, 1), SIZE, model)
    told = found.undetermined or doubts(found, SIZE)[0]
    assert "nearly parallel to each other" in told
    assert "fx = " in told
    assert "+-" in told


@pytest.mark.parametrize(("fill", "reached"), [(0.4, 46), (0.2, 26)])
def test_corners_in_the_middle_only(fill: float, reached: int) -> None:
    views = in_the_middle(fill, 0.05)
    found = calibrate(views, SIZE)
    assert found.undetermined == ""
    (told,) = doubts(found, SIZE)
    assert "k2 = " in told
    assert f"k3 = {found.camera.params[8]:.6g} +- {found.std['k3']:.3g}" in told
    share = int(told.split("further out than ")[1].split()[0])
    distance = np.linalg.norm(np.concatenate([v.uv for v in views]) - [319.5, 239.5], axis=1).max()
    assert share == round(100 * distance / np.hypot(319.5, 239.5))
    assert abs(share - reached) < 5
    assert doubts(calibrate(views, SIZE, "fov"), SIZE) == ()  # one angle is known from the middle


@pytest.mark.parametrize(("seed", "sigma"), [(0, 0.05), (1, 0.2)])
@pytest.mark.parametrize("model", ["radtan", "fov", "fisheye"])
def test_good_pictures_raise_nothing(model: str, sigma: float, seed: int) -> None:
    camera = BENT if model == "radtan" else Fov(400, 402, 322, 238, 0.9)
    found = calibrate(good(camera, sigma, seed), SIZE, model)
    assert found.undetermined == ""
    assert doubts(found, SIZE) == ()


def test_few_pictures_and_few_corners_are_the_cause() -> None:
    found = calibrate(good(BENT, 0.3, 4, count=2), SIZE)
    assert "there are 2 pictures with a board" in doubts(found, SIZE)[0]
    small = Board(3, 3, 0.06)
    rng = np.random.default_rng(1)
    views = boards.views(small, BENT, boards.poses(small, BENT, SIZE, 2, rng), 0.3, rng)
    few = calibrate(views, SIZE, fixed={"k3": 0.0, "p1": 1e-3, "p2": -5e-4})
    assert "18 corners are 36 numbers for 18 unknowns" not in "".join(doubts(few, SIZE))  # twice as many
    many = calibrate(views, SIZE)
    told = many.undetermined + "".join(doubts(many, SIZE))
    assert "18 corners are 36 numbers for 21 unknowns" not in told  # 1.7 times as many


def test_one_tilted_view_for_one_focal_length_is_no_doubt() -> None:
    """Two free sensor numbers at most: the two equations of parallel boards are enough."""
    fixed = {"cx": 322.0, "cy": 238.0, "p1": 1e-3, "p2": -5e-4, "k3": 0.0}
    found = calibrate(parallel(BENT, 35.0, 0.05, 3), SIZE, fixed=fixed, aspect=1.01)
    assert found.undetermined == ""
    assert not any("rests on" in told for told in doubts(found, SIZE))


def test_directions_do_not_depend_on_the_focal_length() -> None:
    """Exact corners: parallel boards are parallel under every pinhole, its centre wrong too."""
    corners = stack(parallel(STRAIGHT, 30.0, 0.0, 2))
    for focal in (100.0, 505.0, 5000.0):
        stand = directions(corners, (Pinhole(focal, focal * 1.01, 300.0, 200.0),))
        assert stand.apart < 1e-5
    right = directions(corners, (Pinhole(500.0, 505.0, 322.0, 238.0),))
    assert abs(np.degrees(right.tilt) - 30.0) < 1e-5
    spread = directions(stack(good(STRAIGHT, 0.0, 3)), (Pinhole(500.0, 505.0, 322.0, 238.0),))
    assert np.degrees(spread.apart) > 20


def test_the_uncertainty_of_a_picture_is_what_repeated_calibrations_show() -> None:
    """Draw cameras from the covariance, turn each to fit best, and measure how far the pixels are off."""
    found = calibrate(good(BENT, 0.2, 7), SIZE)
    assert found.covariance is not None
    told = picture_uncertainty(found.camera, found.covariance, SIZE)
    u, v = np.meshgrid(np.linspace(0, 639, 17), np.linspace(0, 479, 13))
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    X = found.camera.unproject(uv).bearing
    rng, squares = np.random.default_rng(0), []
    L = np.linalg.cholesky(found.covariance + 1e-30 * np.eye(9))
    for _ in range(200):
        # a tenth of the deviation: the formula is that of small changes
        other = Radtan.from_params(found.camera.params + 0.1 * L @ rng.standard_normal(9))
        turn = np.zeros(3)
        for _ in range(3):
            turned = X @ so3.exp(turn).T
            seen = other.project_with_jacobians(turned)
            J = (seen.J_point @ -so3.hat(turned)).reshape(-1, 3)
            turn = turn - np.linalg.lstsq(J, (seen.uv - uv).ravel(), rcond=None)[0]
        off = other.project(X @ so3.exp(turn).T).uv - uv
        squares.append((off**2).sum(axis=1).mean())
    ratio = np.sqrt(np.mean(squares)) / (0.1 * told.rms_px)
    assert abs(ratio - 1) < 0.2  # 200 draws, two directions dominate: 1 / sqrt(400) is 0.05; four of these
    assert told.field == 1.0
