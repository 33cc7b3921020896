"""What corners cannot tell is named; what is no calibration is refused in one line."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.estimation.calibration import Board, Free, Start, calibrate, stack
from vslam_ref.geometry.cameras import Pinhole, Radtan
from vslam_ref.worlds import boards

SIZE = (640, 480)
BOARD = Board(8, 6, 0.03)
CAMERA = Radtan(500, 505, 322, 238, -0.25, 0.06, 1e-3, -5e-4)


def flat_views(tilt: float, sigma: float, seed: int = 0) -> list:
    rng = np.random.default_rng(seed)
    T = boards.poses(BOARD, CAMERA, SIZE, 10, rng, tilt=(tilt, tilt))
    return boards.views(BOARD, CAMERA, T, sigma, rng)


@pytest.mark.parametrize("sigma", [0.0, 0.3])
@pytest.mark.parametrize("model", ["radtan", "pinhole"])
def test_boards_parallel_to_the_image_plane(sigma: float, model: str) -> None:
    found = calibrate(flat_views(0.0, sigma), SIZE, model)
    assert "fx" in found.undetermined
    assert "parallel to the image plane" in found.undetermined
    assert np.degrees(found.tilt.max()) < 5
    assert np.isfinite(found.camera.params).all()
    assert found.covariance is None or found.std["fx"] > 0.05 * found.camera.fx


def test_one_view_many_times_counts_as_one() -> None:
    rng = np.random.default_rng(2)
    T = boards.poses(BOARD, CAMERA, SIZE, 1, rng, tilt=(0.5, 0.5))
    found = calibrate(boards.views(BOARD, CAMERA, np.repeat(T, 6, axis=0), 0.3, rng), SIZE)
    assert "nearly parallel to each other, and count as one view" in found.undetermined


def test_a_tilt_of_half_a_radian_determines_it() -> None:
    found = calibrate(flat_views(0.5, 0.3), SIZE)
    assert found.undetermined == ""
    assert abs(np.median(found.tilt) - 0.5) < 0.02


def test_the_deviation_of_the_focal_length_falls_with_the_tilt() -> None:
    """Only foreshortening tells a longer f from a greater distance, by tan^2(tilt): twice the tilt, a
    quarter of the deviation; a third at most here, where noise and poses differ.
    """
    std = [calibrate(flat_views(tilt, 0.3), SIZE).std["fx"] for tilt in (0.1, 0.2, 0.4)]
    assert std[0] > 3 * std[1] > 9 * std[2] * 0.7


@pytest.mark.parametrize("views", [1])
def test_too_few_views(views: int) -> None:
    with pytest.raises(ValueError, match=r"1 view\(s\) of a flat board give 2 equations for 4 unknowns"):
        calibrate(flat_views(0.5, 0.0)[:views], SIZE)


def test_one_tilted_view_is_enough_for_one_focal_length() -> None:
    fixed = {"cx": 322.0, "cy": 238.0, "p1": 1e-3, "p2": -5e-4, "k3": 0.0}
    found = calibrate(flat_views(0.6, 0.0)[:1], SIZE, fixed=fixed, aspect=1.01)
    assert found.converged
    assert abs(found.camera.fx - 500) < 1e-4


@pytest.mark.parametrize("model", ["radtan", "fov"])
def test_corners_in_another_order_are_no_board(model: str) -> None:
    """Shuffled, or rows and columns exchanged, as with 6x8 for 8x6: no camera sees that as a plane."""
    views, rng = flat_views(0.5, 0.2), np.random.default_rng(0)
    shuffled = [(X, uv[rng.permutation(48)]) for X, uv in views]
    exchanged = [(Board(6, 8, 0.03).points, uv) for _, uv in views]
    for wrong in (shuffled, exchanged):
        with pytest.raises(ValueError, match="are the corners in the order of the board"):
            calibrate(wrong, SIZE, model)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: {"views": []}, "no view"),
        (lambda v: {"model": "omni"}, "model='omni': must be one of pinhole, fov"),
        (lambda v: {"size": (0, 480)}, "need .width, height."),
        (lambda v: {"fixed": {"k9": 0.0}}, "k9: Radtan has no such parameter; it has fx"),
        (lambda v: {"fixed": {"k3": np.nan}}, "must be finite"),
        (lambda v: {"aspect": -1.0}, "must be a positive number"),
        (lambda v: {"aspect": 1.0, "fixed": {"fx": 500.0}}, "fix fx and fy instead"),
        (lambda v: {"fixed": dict.fromkeys(Radtan.names(), 1.0)}, "nothing is left to calibrate"),
        (
            lambda v: {"start": Start(Pinhole(1, 1, 0, 0), np.zeros((10, 4, 4)), 0)},
            "is a Pinhole, not a Radtan",
        ),
        (lambda v: {"start": Start(CAMERA, np.zeros((3, 4, 4)), 0)}, "need .10, 4, 4."),
        (
            lambda v: {"start": Start(CAMERA, np.broadcast_to(np.diag([1, 1, -1, 1.0]), (10, 4, 4)), 0)},
            "does not see every corner",
        ),
        (lambda v: {"views": [(X[:3], uv[:3]) for X, uv in v]}, "view 0: 3 corners"),
        (lambda v: {"views": [(X, uv[:-1]) for X, uv in v]}, "view 0: X_board has shape"),
        (lambda v: {"views": [(X, np.where(uv > 300, np.nan, uv)) for X, uv in v]}, "not finite"),
        (lambda v: {"views": [(X + [0, 0, 1], uv) for X, uv in v]}, "z of the board's corners"),
        (lambda v: {"views": [(X[:8], uv[:8]) for X, uv in v]}, "on one line of the board"),
        (lambda v: {"views": [(X, uv[:, :1] * [1, 0] + [0, 7]) for X, uv in v]}, "on one line of the image"),
    ],
)
def test_bad_input_is_refused(change: object, message: str) -> None:
    views = flat_views(0.5, 0.1)
    arguments = {"views": views, "size": SIZE} | change(views)  # type: ignore[operator]
    with pytest.raises(ValueError, match=message) as told:
        calibrate(**arguments)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("text", ["9by6", "9x", "x6", "9x6x2", "", "-9x6", "9.0x6", "1x6", "9999x6"])
def test_bad_board_words(text: str) -> None:
    with pytest.raises(ValueError, match="board"):
        Board.from_text(text)


def test_boards() -> None:
    assert Board.from_text(" 9X6 ", 0.025) == Board(9, 6, 0.025)
    points = Board(3, 2, 2.0).points
    assert points.tolist() == [[0, 0, 0], [2, 0, 0], [4, 0, 0], [0, 2, 0], [2, 2, 0], [4, 2, 0]]
    with pytest.raises(ValueError, match="side of a square"):
        Board(9, 6, 0.0)


def test_simulated_boards_refuse_what_they_cannot_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(boards, "TRIES", 50)
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="needs a random generator"):
        boards.views(BOARD, CAMERA, np.eye(4)[None], 0.1)
    with pytest.raises(ValueError, match="behind the camera"):
        boards.views(BOARD, CAMERA, np.eye(4)[None])
    with pytest.raises(ValueError, match="only 0 of 2 poses"):
        boards.poses(BOARD, CAMERA, SIZE, 2, rng, fill=(3.0, 3.0))


def test_basis_of_free_parameters() -> None:
    free = Free(Radtan, {"k3": 0.5}, aspect=1.1)
    step = free.basis @ np.arange(1.0, 8.0)
    assert np.allclose(step, [1, 1.1, 2, 3, 4, 5, 6, 7, 0])
    assert free.apply(np.ones(9)).tolist() == [1, 1.1, 1, 1, 1, 1, 1, 1, 0.5]


def test_stacked_views_come_apart_again() -> None:
    views = flat_views(0.5, 0.1)
    corners = stack(views)
    assert corners.views == 10
    assert np.array_equal(corners.of(3).uv, views[3].uv)
