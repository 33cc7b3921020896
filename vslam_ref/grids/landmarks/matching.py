"""A scan against a map: the pose from which its beams end on what is static.

Two steps.  *Correlative*: try all poses of a small box around the prediction, and keep the best.  *Refining*:
Gauss-Newton on robust squared distances plus the prediction, which gives the most probable pose and the
information that the scan alone brings.

Where a distance stops to count is one number for the search (``search_cut``, wide: it must feel walls from
the corners of its box) and another for the refinement (``cut``, a cell: what lies farther from a wall is
something else).  Neither is the standard deviation ``sigma``, which weighs the scan against the prediction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.estimation.robust import Tukey
from vslam_ref.geometry import se2, so2
from vslam_ref.grids.landmarks.field import (
    DistanceField,
    pose_difference,
    sample,
    scan_residuals_with_jacobians,
)
from vslam_ref.support.config import assume

FINE = 1e-4
"""Steps below this (m, rad) end the refinement: a hundredth of what the map resolves."""
SHARES = (1.0, 0.5, 0.25, 0.125)
"""Shares of a step that are tried.  Distances have kinks on walls; where no share goes down is a minimum."""
Reason = Literal["converged", "too few points on the map", "no convergence"]


@dataclass(frozen=True)
class MatchConfig:
    """How a scan is matched; every field says why it has its value."""

    sigma: float = assume(0.05, "m", "a cell's half side, with the range noise far below it")
    cut: float = assume(0.1, "m", "a cell: what is farther off is something else; inf: nothing is")
    search_cut: float = assume(0.3, "m", "a step of the box: 7 cm, and 17 cm more at 5 m")
    window: float = assume(0.2, "m", "twice the worst step of the odometry")
    window_angle: float = assume(0.1, "rad", "four sigma of a step's turn")
    steps: int = assume(3, "", "tries on each side: 7 cm apart, inside the field's valley")
    least_points: int = assume(10, "", "three unknowns, and robust weights to judge")
    iterations: int = assume(20, "", "five suffice; more means no convergence")

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not (self.cut > 0 and self.search_cut > 0):
            raise ValueError(f"cut={self.cut}, search_cut={self.search_cut}: need metres > 0 (inf: no cut)")
        if not (self.sigma > 0 and self.window >= 0 and self.window_angle >= 0 and self.steps >= 0):
            raise ValueError("need sigma > 0 and window, window_angle, steps >= 0")
        if self.least_points < 3 or self.iterations < 1:
            raise ValueError("need least_points >= 3 and iterations >= 1")


class Match(NamedTuple):
    """What a scan says of the pose.

    Attributes
    ----------
    T_world_laser : ndarray, shape (3,)
        Most probable pose, prediction included.
    information : ndarray, shape (3, 3)
        J^T W J / sigma^2: of the scan alone; may be singular, as along a corridor.
    inliers : int
        Points with a weight above one half.
    iterations : int
    reason : {"converged", "too few points on the map", "no convergence"}
        With the second, ``T_world_laser`` is the prediction and ``information`` zero.
    """

    T_world_laser: Array
    information: Array
    inliers: int
    iterations: int
    reason: Reason


def thin(points: ArrayLike, side: float) -> Array:
    """Mean (k, 2) of the points (n, 2) in each square of the given side, metres.

    Readings that share a cell share its error.

    Examples
    --------
    >>> thin([[0.1, 0.1], [0.3, 0.1], [1.5, 0.0]], 1.0)
    array([[0.2, 0.1],
           [1.5, 0. ]])
    """
    p = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if len(p) == 0:
        return p
    _, which, count = np.unique(
        np.floor(p / side).astype(np.int64), axis=0, return_inverse=True, return_counts=True
    )
    total = np.zeros((len(count), 2))
    np.add.at(total, which.ravel(), p)
    thinned: Array = total / count[:, None]
    return thinned


class Objective(NamedTuple):
    """What a pose costs: robust squared distances, and the distance from the prediction.

    Attributes
    ----------
    field : DistanceField
    points : ndarray, shape (n, 2)
        Laser frame, metres.
    predicted : ndarray, shape (3,)
    prior : ndarray, shape (3, 3)
        Inverse of the prediction's covariance.
    sigma, cut : float
        Standard deviation of a distance, and where distances stop to count; metres.
    """

    field: DistanceField
    points: Array
    predicted: Array
    prior: Array
    sigma: float
    cut: float

    @property
    def loss(self) -> Tukey:
        """Tukey's, of distances in metres."""
        return Tukey(self.cut)

    def cost(self, poses: ArrayLike) -> Array:
        """Costs (k,) of poses (k, 3). Implements :eq:`eq-field-map`."""
        poses = np.asarray(poses, dtype=np.float64).reshape(-1, 3)
        world = se2.act(poses[:, None], self.points)
        d = sample(world, self.field)
        off = pose_difference(poses, self.predicted)
        misfit = self.loss.cost(d).sum(axis=1) / self.sigma**2
        total: Array = misfit + 0.5 * np.einsum("ki,ij,kj->k", off, self.prior, off)
        return total


def correlative(objective: Objective, config: MatchConfig) -> Array:
    """Cheapest pose (3,) of a box of poses around the prediction.

    The prediction itself wins ties, so that a scan without any information moves nothing.
    """
    c, around = config, objective.predicted
    if c.steps == 0 or len(objective.points) == 0:
        return around.copy()
    tries = np.arange(-c.steps, c.steps + 1) / c.steps
    box = np.stack(np.meshgrid(tries, tries, tries, indexing="ij"), -1).reshape(-1, 3)
    box = box[np.argsort((box**2).sum(axis=1), kind="stable")]
    poses = around + box * [c.window, c.window, c.window_angle]
    T_world_laser: Array = poses[int(np.argmin(objective.cost(poses)))]
    T_world_laser[2] = so2.wrap(T_world_laser[2])
    return T_world_laser


def match_scan(
    field: DistanceField,
    points: ArrayLike,
    predicted: ArrayLike,
    cov: ArrayLike,
    config: MatchConfig | None = None,
) -> Match:
    """Most probable pose, given the prediction N(predicted, cov) and a scan.

    Implements :eq:`eq-field-map`: sum of robust squared distances plus the squared distance from the
    prediction.

    Parameters
    ----------
    field : DistanceField
    points : array_like, shape (n, 2)
        Ends of the beams in the laser's frame, metres, thinned.
    predicted : array_like, shape (3,)
    cov : array_like, shape (3, 3)
        Positive definite.
    config : MatchConfig, optional

    Raises
    ------
    ValueError
        If prediction or covariance are not finite or of another shape.
    """
    c = MatchConfig() if config is None else config
    points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    predicted, cov = np.asarray(predicted, dtype=np.float64), np.asarray(cov, dtype=np.float64)
    shapes = predicted.shape, cov.shape
    if shapes != ((3,), (3, 3)) or not (np.isfinite(predicted).all() and np.isfinite(cov).all()):
        raise ValueError(f"prediction {shapes[0]} and covariance {shapes[1]}: need finite (3,) and (3, 3)")
    o = Objective(field, points, predicted, np.linalg.inv(cov), c.sigma, c.cut)
    T_world_laser = correlative(o._replace(cut=c.search_cut), c)
    now = float(o.cost(T_world_laser)[0])
    for iteration in range(1, c.iterations + 1):
        r = scan_residuals_with_jacobians(T_world_laser, points, field)
        d, J = r.value[:, 0], r.J_pose[:, 0]
        weight = o.loss.weight(d)
        inliers = int((weight > 0.5).sum())
        if inliers < c.least_points:
            return Match(predicted.copy(), np.zeros((3, 3)), inliers, iteration, "too few points on the map")
        information = (J * weight[:, None]).T @ J / c.sigma**2
        slope = J.T @ (weight * d) / c.sigma**2 + o.prior @ pose_difference(T_world_laser, predicted)
        step = -np.linalg.solve(information + o.prior, slope)
        for share in SHARES:
            tried = T_world_laser + share * step
            tried[2] = so2.wrap(tried[2])
            then = float(o.cost(tried)[0])
            if then < now:
                break
        if then >= now or np.abs(share * step).max() < FINE:
            return Match(T_world_laser, information, inliers, iteration, "converged")
        T_world_laser, now = tried, then
    return Match(T_world_laser, information, inliers, c.iterations, "no convergence")
