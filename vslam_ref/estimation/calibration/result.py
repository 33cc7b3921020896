"""What a calibration returns, and whether the corners determine it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.calibration.arrow import reduce
from vslam_ref.estimation.calibration.board import BoardCorners
from vslam_ref.estimation.calibration.parameters import Free
from vslam_ref.estimation.calibration.problem import CalibrationIterate
from vslam_ref.estimation.calibration.start import Start
from vslam_ref.estimation.calibration.weakness import LARGEST_SHARE
from vslam_ref.estimation.least_squares import Iteration
from vslam_ref.estimation.least_squares.result import CONVERGED, Reason
from vslam_ref.estimation.robust import norm_scale
from vslam_ref.geometry.cameras import Camera

LEAST_EIGENVALUE = 1e-12
"""Of the reduced system, its diagonal scaled to 1: below, rounding of sums of thousands of terms decides."""


@dataclass(frozen=True)
class Calibration:
    """Result of :func:`~vslam_ref.estimation.calibration.solver.calibrate`.

    Attributes
    ----------
    camera : Camera
    T_cam_board : ndarray, shape (V, 4, 4)
        Pose of the board in each view, in the unit of the board.
    corners : BoardCorners
        What was given.
    residual : ndarray, shape (M, 2)
        Predicted minus measured, pixels.
    weights : ndarray, shape (M,)
        Of the robust loss; ones without.
    sigma_px : float
        Standard deviation of one coordinate of a corner, from the residuals.
    covariance : ndarray, shape (n, n), or None
        Of all intrinsics, zero for fixed ones; None where a combination of them is not measured.
    undetermined : str
        Empty, or what the corners do not determine, and why.
    free : Free
        Model, fixed parameters.
    start : Start
    reason, message, iterations, history
        As in :class:`~vslam_ref.estimation.least_squares.result.Solution`.
    """

    camera: Camera
    T_cam_board: Array
    corners: BoardCorners
    residual: Array
    weights: Array
    sigma_px: float
    covariance: Array | None
    undetermined: str
    free: Free
    start: Start
    reason: Reason
    message: str
    iterations: int
    history: tuple[Iteration, ...]

    @property
    def converged(self) -> bool:
        """Whether a stopping rule for a minimum ended the iteration."""
        return self.reason in CONVERGED

    @property
    def errors_px(self) -> Array:
        """Distance of each corner from its prediction, (M,)."""
        lengths: Array = np.linalg.norm(self.residual, axis=1)
        return lengths

    @property
    def rms_px(self) -> float:
        """Root of the mean *squared distance*, as OpenCV and PTAM report it."""
        return float(np.sqrt((self.errors_px**2).mean()))

    @property
    def mean_px(self) -> float:
        """Mean distance."""
        return float(self.errors_px.mean())

    @property
    def view_rms_px(self) -> Array:
        """:attr:`rms_px` of each view, (V,)."""
        counts = np.bincount(self.corners.view)
        rms: Array = np.sqrt(np.bincount(self.corners.view, self.errors_px**2) / counts)
        return rms

    @property
    def tilt(self) -> Array:
        """Angle between each board and the image plane, (V,), radians."""
        return tilt(self.T_cam_board)

    @property
    def std(self) -> dict[str, float]:
        """Standard deviation of each intrinsic by its name: 0 where fixed, infinite where not measured."""
        names = self.camera.names()
        if self.covariance is None:
            moved = np.abs(self.free.basis).sum(axis=1) > 0
            return {n: float("inf") if m else 0.0 for n, m in zip(names, moved, strict=True)}
        return dict(zip(names, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))


def tilt(T_cam_board: Array) -> Array:
    """Angle (V,) between boards and image plane, radians."""
    angles: Array = np.arccos(np.clip(np.abs(T_cam_board[:, 2, 2]), 0.0, 1.0))
    return angles


class Certainty(NamedTuple):
    """Noise, covariance of all intrinsics, and what is not determined.

    Attributes
    ----------
    sigma_px : float
        Standard deviation of a coordinate of a corner, pixels.
    covariance : ndarray, shape (n, n), or None
        Of the intrinsics, each in its unit; None where they are not determined.
    undetermined : str
        What the corners do not determine; empty where they determine all.
    """

    sigma_px: float
    covariance: Array | None
    undetermined: str


def certainty(point: CalibrationIterate, free: Free) -> Certainty:
    """Covariance of the intrinsics, the poses unknown, from the reduced system.

    Implements :eq:`eq-calibration-covariance`.

    Parameters
    ----------
    point : CalibrationIterate
        The solution.
    free : Free
        Its free parameters.

    Returns
    -------
    Certainty

    Notes
    -----
    To first order in the noise.  The noise is taken from the residuals: what the model cannot explain counts
    as noise, so with a lens model that does not fit, the deviations are too small.  With a robust loss the
    noise is that of the median, and the corners count by their weights.
    """
    views = len(point.state.T_cam_board)
    spare = 2 * len(point.residual) - 6 * views - len(free.names)
    if (point.weights == 1.0).all():
        sigma = float(np.sqrt((point.residual**2).sum() / spare)) if spare > 0 else float("inf")
    else:
        sigma = norm_scale(point.residual, parameters=6 * views + len(free.names)).sigma
    reduced = reduce(point.normal)
    if reduced is None:
        return Certainty(sigma, None, "a pose: the corners of one view do not determine it")
    scale = point.normal.lengths().free
    values, vectors = np.linalg.eigh(reduced.S / np.outer(scale, scale))
    if values[0] <= LEAST_EIGENVALUE:
        lost = [n for n, v in zip(free.names, vectors[:, 0], strict=True) if abs(v) > 0.1]
        what = f"{', '.join(lost)}: a combination is not measured (standard deviation: infinite)"
        return Certainty(sigma, None, what)
    if not np.isfinite(sigma):
        return Certainty(sigma, None, f"{2 * len(point.residual)} numbers for as many unknowns")
    root = vectors / np.sqrt(values)
    inverse = (root @ root.T) / np.outer(scale, scale)
    cov = sigma**2 * free.basis @ inverse @ free.basis.T
    return Certainty(sigma, cov, _vague(point, cov))


def _vague(point: CalibrationIterate, cov: Array) -> str:
    """Focal length or principal point with a large standard deviation."""
    deviation, focal = np.sqrt(np.diag(cov))[:4], point.state.params[:2]
    share = deviation / np.tile(focal, 2)
    lost = [i for i in range(4) if share[i] > LARGEST_SHARE]
    if not lost:
        return ""
    return ", ".join(
        f"{name} = {point.state.params[i]:.6g} +- {deviation[i]:.3g}"
        for i, name in enumerate(("fx", "fy", "cx", "cy"))
        if i in lost
    )
