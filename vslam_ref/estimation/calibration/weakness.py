"""What the corners do not determine, or only weakly, and the likely cause, measured.

The covariance of the intrinsics decides, poses eliminated; two questions are asked of it:

* a focal length or principal point: its standard deviation in shares of the focal length;
* the lens: how uncertain the picture of a ray is, a rotation of the camera aside, RMS over the whole picture.

The cause is measured as well: angles between the boards, how far out corners lie, how many pictures and
numbers there are.  Where the sensor is open, the fit has wandered off, and its tilts say nothing: boards at
20 degrees look like boards at 0 under a lens that is far too long.  So tilts are taken from a second fit,
whose sensor is held at a usual one; angles between boards hardly depend on which.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.board import BoardCorners
from vslam_ref.estimation.calibration.board_directions import (
    ALIKE,
    SENSOR,
    BoardDirections,
    directions,
    why_flat,
)
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.geometry import so3
from vslam_ref.geometry.cameras import Camera

if TYPE_CHECKING:
    from vslam_ref.estimation.calibration.result import Calibration

LARGEST_SHARE = 0.05
"""A focal length whose standard deviation is more than this share of it counts as not determined; likewise a
principal point, in shares of the focal length."""
WEAK_SHARE, WEAK_PICTURE = 0.01, 0.02
"""Beyond these shares of the focal length the camera is told to be weak: standard deviation of the sensor,
and of the picture of a ray.  The 26 pictures of ``opencv_samples`` give 0.0009 and 0.003 by default."""
NEAR_CENTRE = 0.6
"""Boards whose corners reach less than this share of the way to the picture's corners leave the lens open."""
LEAST_FIELD = 0.5
"""Share of the picture for which the lens must have a ray, unless the boards reach far out."""
WEAKLY = "the pictures determine only weakly"
SPARE = 1.5
"""Numbers for each unknown, below which they are called few."""


def counts_as_one(boards: BoardDirections, corners: BoardCorners, free: Free) -> bool:
    """Whether all boards are parallel, and their two equations too few for the free sensor."""
    return boards.apart <= ALIKE and corners.views > 1 and sum(name in SENSOR for name in free.names) > 2


def sensor_causes(corners: BoardCorners, boards: BoardDirections, free: Free) -> list[str]:
    """Causes of an open sensor that can be measured."""
    return [cause for cause in (why_flat(boards), *_few(corners, free)) if cause]


def _few(corners: BoardCorners, free: Free) -> list[str]:
    """Few pictures, few numbers."""
    found = []
    if corners.views <= 2:
        found.append(f"there are {corners.views} pictures with a board: take 10 or more")
    unknowns, numbers = 6 * corners.views + len(free.names), 2 * len(corners.uv)
    if numbers < SPARE * unknowns:
        found.append(
            f"{len(corners.uv)} corners are {numbers} numbers for {unknowns} unknowns: take a finer board"
        )
    return found


class PictureUncertainty(NamedTuple):
    """How well the picture of a ray is known.

    Attributes
    ----------
    rms_px : float
        Standard deviation, RMS over all places of the picture that have a ray.
    field : float
        Share of the places that have one.
    by_parameter : ndarray, shape (n,)
        The same from each parameter alone, pixels.
    """

    rms_px: float
    field: float
    by_parameter: Array


def picture_uncertainty(camera: Camera, covariance: Array, size: tuple[int, int]) -> PictureUncertainty:
    """Standard deviation of the pixel of a fixed ray, a common small rotation of all rays aside.

    Implements :eq:`eq-picture-uncertainty`.

    Parameters
    ----------
    camera : Camera
    covariance : ndarray, shape (n, n)
        Of its parameters.
    size : (int, int)
        Width and height of the picture, pixels.
    """
    u, v = np.meshgrid(np.linspace(0, size[0] - 1, 17), np.linspace(0, size[1] - 1, 13))
    rays = camera.unproject(np.stack([u.ravel(), v.ravel()], axis=1))
    X = rays.bearing[rays.valid]
    n = len(camera.params)
    if len(X) < n:
        return PictureUncertainty(float("inf"), float(rays.valid.mean()), np.full(n, np.inf))
    seen = camera.project_with_jacobians(X)
    turn = (seen.J_point @ -so3.hat(X)).reshape(-1, 3)
    moved = seen.J_intrinsics.reshape(-1, n)
    moved = moved - turn @ np.linalg.lstsq(turn, moved, rcond=None)[0]
    gram = moved.T @ moved / len(X)  # eq-picture-uncertainty
    rms = float(np.sqrt(max(0.0, np.trace(covariance @ gram))))
    alone = np.sqrt(np.diag(covariance) * np.diag(gram))
    return PictureUncertainty(rms, float(rays.valid.mean()), alone)


def _reach(corners: BoardCorners, size: tuple[int, int]) -> float:
    """How far out the outermost corner lies: 0 in the picture's middle, 1 in its corners."""
    middle = (np.array(size) - 1.0) / 2
    return float(np.linalg.norm(corners.uv - middle, axis=1).max() / np.linalg.norm(middle))


def doubts(result: Calibration, size: tuple[int, int]) -> tuple[str, ...]:
    """Sentences on what the pictures determine only weakly; none where the camera can be trusted.

    Parameters
    ----------
    result : Calibration
        A camera that is determined.
    size : (int, int)
        Width and height of the pictures, pixels.
    """
    if result.covariance is None:
        return ()
    names, params = result.camera.names(), result.camera.params
    std, focal = np.sqrt(np.diag(result.covariance)), float(min(params[:2]))
    told = []
    weak = [i for i in range(4) if std[i] > WEAK_SHARE * focal]
    boards = directions(result.corners, (result.camera,))
    if not weak and counts_as_one(boards, result.corners, result.free):
        what = "the focal length rests on the bend of the lens alone"
        told.append(f"{what}: {_values(names, params, std, [0, 1])}; {why_flat(boards)}")
    if weak:
        causes = sensor_causes(result.corners, boards, result.free) or [_general(result)]
        told.append(f"{WEAKLY} {_values(names, params, std, weak)}; {'; '.join(causes)}")
    picture = picture_uncertainty(result.camera, result.covariance, size)
    far = _reach(result.corners, size)
    open_lens = picture.rms_px > WEAK_PICTURE * focal or (picture.field < LEAST_FIELD and far < NEAR_CENTRE)
    if open_lens and len(names) > 4:
        largest = picture.by_parameter[4:].max()
        loose = [i for i in range(4, len(names)) if picture.by_parameter[i] > 0.2 * largest]
        loose = loose if picture.by_parameter[4:].max() > picture.by_parameter[:4].max() else []
        if loose or not weak:
            what = _values(names, params, std, loose or [int(np.argmax(picture.by_parameter))])
            told.append(f"{WEAKLY} {what}; {_lens_cause(result, picture, far, focal)}")
    return tuple(told)


def _values(names: tuple[str, ...], params: Array, std: Array, which: list[int]) -> str:
    return ", ".join(f"{names[i]} = {params[i]:.6g} +- {std[i]:.3g}" for i in which)


def _lens_cause(result: Calibration, picture: PictureUncertainty, far: float, focal: float) -> str:
    """What an open lens means for the picture, and why."""
    means = f"the place of a ray is uncertain by {picture.rms_px:.3g} px (RMS over the picture)"
    if picture.rms_px <= WEAK_PICTURE * focal:
        means = f"the lens that was found has no ray for {100 * (1 - picture.field):.0f} % of the picture"
    causes = _few(result.corners, result.free)
    if far < NEAR_CENTRE:
        where = (
            f"no corner lies further out than {100 * far:.0f} % of the way from the picture's centre to its"
        )
        causes.insert(0, f"{where} corners: show the board there too, or fix a parameter, as --fix k3=0")
    return f"{means}; {'; '.join(causes) or _general(result)}"


def _general(result: Calibration) -> str:
    """What helps where no single cause stands out."""
    return (
        f"corners are uncertain by {result.sigma_px:.2g} px: take more pictures, with the board tilted by 30 "
        "to 45 degrees in different directions, and into all corners of the picture"
    )
