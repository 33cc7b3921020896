"""What goes into every filter of this room and what comes out of it.

Positions are in metres, headings in radians; covariances in the squares and products of these.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray, transpose
from vslam_ref.filters.vehicle import Increment


class Innovation(NamedTuple):
    """What an update saw: innovation (B, k) = measured - predicted, and its covariance S (B, k, k)."""

    innovation: Array
    S: Array


class PoseEstimate(NamedTuple):
    """Mean (B, 3) of (x, y, theta) in the world and its covariance (B, 3, 3)."""

    mean: Array
    cov: Array


class MapEstimate(NamedTuple):
    """Identities (n,), means (B, n, 2) in the world and covariances (B, n, 2, 2) of the landmarks."""

    ids: IntArray
    mean: Array
    cov: Array


class SlamFilter(ABC):
    """What all filters of this room do; B runs at once, the same landmark schedule in each.

    A filter says how it moves, how it uses landmarks of its map, and how a new one enters.  Here stand the
    checks, and which landmark of a sighting is known and which is new.

    Attributes
    ----------
    runs : int
        Runs B of the batch.
    """

    runs: int

    @abstractmethod
    def predict(self, increment: Increment) -> None:
        """Move by an increment."""

    @abstractmethod
    def pose(self) -> PoseEstimate:
        """Pose in the world."""

    @abstractmethod
    def landmarks(self) -> MapEstimate:
        """Map in the world."""

    @abstractmethod
    def _columns(self, ids: IntArray) -> IntArray:
        """Place (m,) of each landmark in the map, -1 for one that is not in it."""

    @abstractmethod
    def _innovation(self, columns: IntArray, z: Array, cov_z: Array) -> Innovation:
        """Innovation of landmarks of the map; the estimate stays."""

    @abstractmethod
    def _update_known(self, columns: IntArray, z: Array, cov_z: Array, gate: float) -> Innovation:
        """Use measurements of landmarks of the map, in the runs whose innovation passes the gate."""

    @abstractmethod
    def _augment(self, ids: IntArray, z: Array, cov_z: Array) -> None:
        """Add landmarks to the map."""

    def update(
        self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike, gate: float = np.inf
    ) -> Innovation | None:
        """Update with landmarks already in the map, then add those seen for the first time.

        Parameters
        ----------
        ids : array_like of int, shape (m,)
            Identities (known association), each once.
        z : array_like, shape (B, m, 2)
            Relative Cartesian measurements, metres, vehicle frame.
        cov_z : array_like, shape (2, 2) or (m, 2, 2)
            Their covariance, m^2.
        gate : float
            Where the normalised innovation squared of the known landmarks together is larger, that run
            does not use them.

        Returns
        -------
        Innovation or None
            Of the known landmarks, used or not.  None when no landmark was known before.

        Raises
        ------
        ValueError
            On other shapes, an identity twice, or numbers that are not finite; nothing is changed then.
        """
        ids, z, cov_z = checked_measurement(ids, z, cov_z, self.runs)
        columns = self._columns(ids)
        known = columns >= 0
        if len(ids) and known.all():  # the common case, without copies
            return self._update_known(columns, z, cov_z, gate)
        seen = None
        if known.any():
            seen = self._update_known(columns[known], z[:, known], cov_z[known], gate)
        if len(ids):
            self._augment(ids[~known], z[:, ~known], cov_z[~known])
        return seen

    def innovation(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """Innovation and S that :meth:`update` would return; no estimate changes.

        For an association, or a gate that needs more than one number (:meth:`update` has one of its own).

        Parameters, errors and result as for :meth:`update`; landmarks that are not in the map are left out.
        """
        ids, z, cov_z = checked_measurement(ids, z, cov_z, self.runs)
        columns = self._columns(ids)
        known = columns >= 0
        return self._innovation(columns[known], z[:, known], cov_z[known]) if known.any() else None


def as_batch(mean: ArrayLike, cov: ArrayLike) -> tuple[Array, Array]:
    """Start mean (3,) or (B, 3) and covariance (3, 3) or (B, 3, 3) as arrays with a batch axis.

    Raises
    ------
    ValueError
        On other shapes, values that are not finite, or a covariance that is not symmetric positive
        semi-definite.
    """
    x = np.atleast_2d(np.asarray(mean, dtype=np.float64))
    P = np.asarray(cov, dtype=np.float64)
    if x.ndim != 2 or x.shape[1] != 3 or P.shape[-2:] != (3, 3) or P.ndim > 3:
        raise ValueError(
            f"start mean {np.shape(mean)} and covariance {P.shape}: need (B, 3) and (3, 3) or (B, 3, 3)"
        )
    P = np.broadcast_to(P, (len(x), 3, 3)).copy()
    if not (np.isfinite(x).all() and np.isfinite(P).all()):
        raise ValueError("start mean and covariance must be finite")
    scale = np.abs(P).max(initial=0.0)
    if np.abs(P - P.swapaxes(1, 2)).max() > 1e-12 * scale or np.linalg.eigvalsh(P).min() < -1e-12 * scale:
        raise ValueError("start covariance must be symmetric positive semi-definite")
    return x, P


def checked_measurement(
    ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike, batch: int
) -> tuple[IntArray, Array, Array]:
    """Landmark ids (m,), measurements (B, m, 2) and covariances (m, 2, 2), or a ValueError."""
    ids = np.asarray(ids, dtype=np.int64)
    z, cov_z = np.asarray(z, dtype=np.float64), np.asarray(cov_z, dtype=np.float64)
    if ids.ndim != 1 or z.shape != (batch, len(ids), 2):
        raise ValueError(
            f"ids {ids.shape} and measurements {z.shape} of {batch} runs: need (m,) and ({batch}, m, 2)"
        )
    if len(set(ids.tolist())) != len(ids):
        raise ValueError(f"landmark ids {ids.tolist()}: each must appear once in one measurement")
    if cov_z.shape not in ((2, 2), (len(ids), 2, 2)):
        raise ValueError(f"measurement covariance {cov_z.shape}: need (2, 2) or ({len(ids)}, 2, 2)")
    if not (np.isfinite(z).all() and np.isfinite(cov_z).all()):
        raise ValueError("measurements and their covariance must be finite")
    return ids, z, cov_z if cov_z.ndim == 3 else np.broadcast_to(cov_z, (len(ids), 2, 2))


def heading_vector_pose(mean: Array, cov: Array) -> PoseEstimate:
    """(x, y, atan2(sin, cos)) of states (x, y, sin, cos), shape (B, 4), to first order (B§4.1)."""
    x, y, s, c = mean.T
    J = np.zeros((len(mean), 3, 4))
    J[:, 0, 0] = J[:, 1, 1] = 1.0
    J[:, 2, 2], J[:, 2, 3] = c / (s * s + c * c), -s / (s * s + c * c)
    return PoseEstimate(np.stack([x, y, np.arctan2(s, c)], -1), J @ cov @ transpose(J))


def checked_moments(name: str, kind: str) -> str:
    """Return the way to take moments, "first_order" or "gaussian", or raise a ValueError with the choices."""
    if kind not in ("first_order", "gaussian"):
        raise ValueError(f"{name}={kind!r}: must be 'first_order' or 'gaussian'")
    return kind
