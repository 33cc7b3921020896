"""What goes into every filter of this room and what comes out of it.

Positions are in metres, headings in radians; covariances in the squares and products of these.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray, transpose
from vslam_ref.filters.vehicle import Increment

COVARIANCE_ROUNDING = 1e-12
"""Relative to its largest entry: how far a covariance may be from symmetric and from semi-definite."""


class SingularInnovation(np.linalg.LinAlgError, ValueError):
    """The covariance S of an innovation is singular: known exactly, or measured twice without noise."""


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
            On other shapes, identities that are no whole numbers from 0 on or stand there twice, numbers that
            are not finite, a covariance that is not symmetric positive semi-definite, or a gate that is not a
            number from 0 on; nothing is changed then.
        SingularInnovation
            A ValueError: if S of the known landmarks together is not positive definite to rounding in one of
            the runs; nothing is changed, in any run.
        """
        ids, z, cov_z = checked_measurement(ids, z, cov_z, self.runs)
        if not gate >= 0.0:
            raise ValueError(f"gate={gate}: must be 0 or more")
        columns = self._columns(ids)
        known = columns >= 0
        if len(ids) and known.all():  # the common case, without copies
            return self._use(columns, z, cov_z, gate)
        seen = None
        if known.any():
            seen = self._use(columns[known], z[:, known], cov_z[known], gate)
        if len(ids):
            self._augment(ids[~known], z[:, ~known], cov_z[~known])
        return seen

    def _use(self, columns: IntArray, z: Array, cov_z: Array, gate: float) -> Innovation:
        """:meth:`_update_known`, with a name for what NumPy calls not positive definite."""
        try:
            return self._update_known(columns, z, cov_z, gate)
        except np.linalg.LinAlgError:
            raise SingularInnovation(
                f"the covariance S of the innovation of {len(columns)} known landmark(s) is singular: what "
                "is measured is known exactly already; nothing was changed (a cov_z above zero avoids it)"
            ) from None

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
    if np.abs(P - P.swapaxes(1, 2)).max() > COVARIANCE_ROUNDING * scale or (
        np.linalg.eigvalsh(P).min() < -COVARIANCE_ROUNDING * scale
    ):
        raise ValueError("start covariance must be symmetric positive semi-definite")
    return x, P


def checked_measurement(
    ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike, batch: int
) -> tuple[IntArray, Array, Array]:
    """Landmark ids (m,), measurements (B, m, 2) and covariances (m, 2, 2), or a ValueError."""
    ids = identities(ids)
    z, cov_z = np.asarray(z, dtype=np.float64), np.asarray(cov_z, dtype=np.float64)
    if z.shape != (batch, len(ids), 2):
        raise ValueError(
            f"ids {ids.shape} and measurements {z.shape} of {batch} runs: need (m,) and ({batch}, m, 2)"
        )
    if cov_z.shape not in ((2, 2), (len(ids), 2, 2)):
        raise ValueError(f"measurement covariance {cov_z.shape}: need (2, 2) or ({len(ids)}, 2, 2)")
    if not np.isfinite(z).all():
        raise ValueError("measurements must be finite")
    for matrix in cov_z.tolist() if cov_z.ndim == 3 else [cov_z.tolist()]:
        require_covariance(matrix)
    return ids, z, cov_z if cov_z.ndim == 3 else np.broadcast_to(cov_z, (len(ids), 2, 2))


def identities(ids: ArrayLike) -> IntArray:
    """Landmark identities (m,) as integers, or a ValueError: whole numbers from 0 on, each once."""
    given: Any = np.asarray(ids)
    if given.dtype != np.int64 or not isinstance(ids, np.ndarray):  # the common case costs nothing
        given = _whole_numbers(ids, given)
    if given.ndim != 1:
        raise ValueError(f"landmark ids of shape {given.shape}: need (m,)")
    numbers = given.tolist()
    if len(set(numbers)) != len(numbers):
        raise ValueError(f"landmark ids {numbers}: each must appear once in one measurement")
    if numbers and min(numbers) < 0:
        raise ValueError(f"landmark id {min(numbers)}: identities are whole numbers from 0 on")
    return np.asarray(given, dtype=np.int64)


def _whole_numbers(ids: ArrayLike, given: Any) -> Any:
    """Identities of another type than int64; 3.0 is 3, but 3.7 and True are no identities."""
    truth = given.dtype.kind == "b" or (
        isinstance(ids, list | tuple) and any(isinstance(i, bool | np.bool_) for i in ids)
    )
    if given.size == 0:
        return np.zeros(given.shape, dtype=np.int64)
    if truth or given.dtype.kind not in "iuf":
        raise ValueError(f"landmark ids {given.tolist()}: identities are whole numbers, not {given.dtype}")
    if not (np.isfinite(given) & (given == np.floor(given)) & (np.abs(given) < 2.0**63)).all():
        raise ValueError(f"landmark ids {given.tolist()}: identities are whole numbers")
    return given.astype(np.int64)


def require_covariance(matrix: Sequence[Sequence[float]]) -> None:
    """Raise ValueError unless two rows of two numbers are symmetric and positive semi-definite.

    With the tolerance of :func:`as_batch`; of plain numbers, as it is asked at every sighting.
    """
    (a, b), (c, d) = matrix
    if b == c and a >= 0.0 and d >= 0.0 and a * d >= b * b and a + d < np.inf:
        return
    scale = max(abs(a), abs(b), abs(c), abs(d))
    if not scale < np.inf or a != a or b != b or c != c or d != d:
        raise ValueError(f"measurement covariance {matrix}: must be finite")
    if abs(b - c) > COVARIANCE_ROUNDING * scale:
        raise ValueError(f"measurement covariance {matrix}: must be symmetric")
    least = (a + d) / 2 - np.hypot((a - d) / 2, b)  # the smaller eigenvalue
    if least < -COVARIANCE_ROUNDING * scale:
        raise ValueError(f"measurement covariance {matrix}: must be positive semi-definite")


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
