r"""Points that two keyframes share, and how far a similarity sends them from where both keyframes saw them.

::

      X_a ------- S_b_a ------> S X_a        X_a, X_b: one point as each keyframe has it, in its own
       |                          |          frame and its own unit
       | h                        | h        u_a, u_b: where each saw it, with sigma_a, sigma_b pixels
       v                          v
      u_a <-- h(S^-1 X_b)        u_b

A match has two errors, each in standard deviations of a pixel of the octave in which the feature was found:

.. math:: r_b = \frac{h(S_{ba} X_a) - u_b}{\sigma_b}, \qquad r_a = \frac{h(S_{ba}^{-1} X_b) - u_a}{\sigma_a} .

Depths are the worst known numbers of a point that was triangulated from a short baseline.  An error in depth
hardly moves a projection, while it moves the distance :math:`\lVert S X_a - X_b \rVert` by all of it.

Images alone do not know the scale where the two cameras stand at one place, as they may when a loop closes:
:math:`h(s R X + t)` is that of R X for t = 0, whatever s is.  There the distances have to tell it, as a third
error of each match, with a standard deviation that is found from the matches:

.. math:: d = \log \frac{\lVert S_{ba} X_a \rVert}{\lVert X_b \rVert} .

A turn of camera b changes no distance from it, so what is badly known about distances never pulls at the
rotation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array, BoolArray, as_array, blocks
from vslam_ref.geometry import sim3, so3
from vslam_ref.geometry.cameras import Camera

LIMIT = 9.210340371976184
"""What chi-square of two degrees of freedom stays below with probability 0.99: of one of both errors."""


@dataclass(frozen=True)
class PointMatches:
    """Points that two keyframes are thought to share.

    Parameters
    ----------
    camera : Camera
        Of both keyframes, any lens.
    X_a, X_b : ndarray, shape (N, 3)
        Points in the frames of the two keyframes, each in its own unit.
    uv_a, uv_b : ndarray, shape (N, 2)
        Where each keyframe saw them, pixels.
    sigma_a, sigma_b : ndarray, broadcast to (N,)
        Standard deviation of one coordinate, pixels: that of the feature's octave.

    Raises
    ------
    ValueError
        On shapes that do not fit, numbers that are not finite, or a standard deviation that is not positive.
    """

    camera: Camera
    X_a: Array
    X_b: Array
    uv_a: Array
    uv_b: Array
    sigma_a: Array
    sigma_b: Array

    def __post_init__(self) -> None:
        n = len(as_array("X_a", self.X_a, 3))
        for name, tail in (("X_a", (3,)), ("X_b", (3,)), ("uv_a", (2,)), ("uv_b", (2,))):
            value = as_array(name, getattr(self, name), *tail)
            if value.shape != (n, *tail):
                raise ValueError(f"{name} has shape {value.shape}: need {(n, *tail)}, as many as X_a")
            bad = np.flatnonzero(~np.isfinite(value).all(-1))
            if len(bad):
                raise ValueError(f"{name}[{bad[0]}] is {value[bad[0]].tolist()}: must be finite")
            object.__setattr__(self, name, value)
        for name in ("sigma_a", "sigma_b"):
            sigma = np.broadcast_to(np.asarray(getattr(self, name), dtype=np.float64), (n,))
            if not (np.isfinite(sigma) & (sigma > 0)).all():
                raise ValueError(f"{name} must be finite and more than 0")
            object.__setattr__(self, name, sigma)

    def __len__(self) -> int:
        return len(self.X_a)

    @property
    def sigma(self) -> Array:
        """Standard deviations of the four errors of each match, (N, 4), pixels: twice in b, twice in a."""
        return np.stack([self.sigma_b, self.sigma_b, self.sigma_a, self.sigma_a], -1)

    def only(self, rows: NDArray[np.generic]) -> Self:
        """Return some of the matches: their numbers, or a mask (N,)."""
        return type(self)(
            self.camera,
            self.X_a[rows],
            self.X_b[rows],
            self.uv_a[rows],
            self.uv_b[rows],
            self.sigma_a[rows],
            self.sigma_b[rows],
        )


class BothImages(NamedTuple):
    """Images of a match, and their Jacobian in the similarity.

    Attributes
    ----------
    uv : ndarray, shape (..., 4)
        Pixels: a's point in b, then b's point in a; NaN where a point has no image.
    J_S : ndarray, shape (..., 4, 7)
        For S_b_a <- Exp(xi) S_b_a with xi = (rho, phi, sigma): metres, radians, log-scale.
    """

    uv: Array
    J_S: Array


def both_images(S_b_a: Array, X_a: Array, X_b: Array, *, camera: Camera) -> Array:
    """Where each keyframe would see the other's point, pixels (..., 4): a's point in b, then b's in a.

    Similarity ``S_b_a (..., 4, 4)``, points ``X_a (..., 3)``, ``X_b (..., 3)`` in the keyframes' own units.
    NaN where a point has no image.
    """
    there = camera.project(sim3.act(S_b_a, X_a))
    back = camera.project(sim3.act(sim3.inverse(S_b_a), X_b))
    images = [np.where(at.valid[..., None], at.uv, np.nan) for at in (there, back)]
    return np.concatenate(images, -1)


def both_images_with_jacobians(S_b_a: Array, X_a: Array, X_b: Array, *, camera: Camera) -> BothImages:
    """Where each keyframe would see the other's point, and the Jacobian in a left perturbation.

    Implements the chain rule through A1.1.  The way back is S^-1 Exp(-xi) X_b: its Jacobian is that of the
    way there, at X_b, turned by S^-1, with the sign changed.

    Parameters
    ----------
    S_b_a : ndarray, shape (..., 4, 4)
    X_a, X_b : ndarray, shape (..., 3)
        Points in the frames and units of the keyframes.
    camera : Camera

    Returns
    -------
    BothImages
    """
    S_a_b = sim3.inverse(S_b_a)
    at_b = sim3.act_with_jacobians(S_b_a, X_a)
    J_b = camera.project_with_jacobians(at_b.value).J_point @ at_b.J_pose
    moved = blocks([[np.eye(3), -so3.hat(X_b), X_b[..., None]]])
    J_a = -camera.project_with_jacobians(sim3.act(S_a_b, X_b)).J_point @ S_a_b[..., :3, :3] @ moved
    return BothImages(both_images(S_b_a, X_a, X_b, camera=camera), np.concatenate([J_b, J_a], -2))


class DistanceRatio(NamedTuple):
    """``value (..., 1)``, log-ratio of distances, and ``J_S (..., 1, 7)`` in a left perturbation of S_b_a."""

    value: Array
    J_S: Array


def distance_ratio(S_b_a: Array, X_a: Array, X_b: Array) -> Array:
    """Logarithm (..., 1) of how much farther from b a's point is than b's: a ratio, no unit.

    Similarity ``S_b_a (..., 4, 4)``, points ``X_a (..., 3)``, ``X_b (..., 3)`` in the keyframes' own units.
    """
    there = np.linalg.norm(sim3.act(S_b_a, X_a), axis=-1, keepdims=True)
    return np.asarray(np.log(there / np.linalg.norm(X_b, axis=-1, keepdims=True)))  # eq-distance-ratio


def distance_ratio_with_jacobians(S_b_a: Array, X_a: Array, X_b: Array) -> DistanceRatio:
    """Logarithm of the ratio of distances, and its Jacobian: Y / |Y|^2, nothing for the rotation, and 1.

    Implements the chain rule through A1.1; arguments as for :func:`distance_ratio`, units too.
    """
    Y = sim3.act(S_b_a, X_a)
    shift = Y / np.sum(Y * Y, -1, keepdims=True)
    one = np.ones_like(Y[..., :1])
    J_S = np.concatenate([shift, np.zeros_like(Y), one], -1)[..., None, :]
    return DistanceRatio(distance_ratio(S_b_a, X_a, X_b), J_S)


def whitened(images: Array, matches: PointMatches) -> Array:
    """Errors (..., N, 4) of images (..., N, 4) in sigmas: in b first, then in a."""
    uv = np.concatenate([matches.uv_b, matches.uv_a], -1)
    return np.asarray((images - uv) / matches.sigma)  # eq-both-images


def squared(S_b_a: Array, matches: PointMatches) -> Array:
    """Squared lengths of both errors, (..., N, 2), in sigma^2; infinite where a point has no image.

    Of ``S_b_a (..., 4, 4)``: in b first, then in a.
    """
    S = np.asarray(S_b_a, dtype=np.float64)[..., None, :, :]
    r = whitened(both_images(S, matches.X_a, matches.X_b, camera=matches.camera), matches)
    both = np.sum((r * r).reshape(*r.shape[:-1], 2, 2), -1)
    return np.where(np.isfinite(both), both, np.inf)


def agreeing(S_b_a: Array, matches: PointMatches, limit: float = LIMIT) -> BoolArray:
    """Matches (N,) of which both squared errors are below a limit, in sigma^2; ``S_b_a (4, 4)``."""
    return np.asarray((squared(S_b_a, matches) <= limit).all(-1))
