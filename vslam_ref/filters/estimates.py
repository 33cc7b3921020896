"""What goes into every filter of this room and what comes out of it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, IntArray
from vslam_ref.filters.vehicle import Increment


class Innovation(NamedTuple):
    """What an update saw: innovation (B, k) = measured - predicted, and its covariance S (B, k, k)."""

    innovation: Array
    S: Array


def room_for_innovation(z: Array) -> Innovation:
    """Empty arrays for the innovation of measurements z (B, m, 2)."""
    B, m, _ = z.shape
    return Innovation(np.empty((B, 2 * m)), np.empty((B, 2 * m, 2 * m)))


class PoseEstimate(NamedTuple):
    """Mean (B, 3) of (x, y, theta) in the world and its covariance (B, 3, 3)."""

    mean: Array
    cov: Array


class MapEstimate(NamedTuple):
    """Identities (n,), means (B, n, 2) in the world and covariances (B, n, 2, 2) of the landmarks."""

    ids: IntArray
    mean: Array
    cov: Array


class SlamFilter(Protocol):
    """What all filters of this room do; B runs at once, the same landmark schedule in each."""

    def predict(self, increment: Increment) -> None:
        """Move by an increment."""

    def update(self, ids: ArrayLike, z: ArrayLike, cov_z: ArrayLike) -> Innovation | None:
        """Use relative measurements; add landmarks seen for the first time."""

    def pose(self) -> PoseEstimate:
        """Pose in the world."""

    def landmarks(self) -> MapEstimate:
        """Map in the world."""


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


def diagonal_blocks(P: Array, stride: int, size: int) -> Array:
    """Blocks of ``size`` states at every ``stride``-th diagonal place of P (B, M, M): (B, n, size, size)."""
    at = np.arange(0, P.shape[1], stride)[:, None] + np.arange(size)
    return P[:, at[:, :, None], at[:, None, :]]
