"""A camera: intrinsics as a frozen dataclass, and what can be asked of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry.cameras import projection
from vslam_ref.geometry.cameras.interface import (
    Lens,
    Projection,
    ProjectionJacobians,
    RayJacobians,
    Rays,
    WorldProjectionJacobians,
)


@dataclass(frozen=True)
class Camera:
    """What the models share; make one of them, such as :class:`~vslam_ref.geometry.cameras.fov.Fov`.

    Parameters
    ----------
    fx, fy : float
        Focal lengths, pixels, more than 0.
    cx, cy : float
        Principal point, pixels; (0, 0) is the centre of the top-left pixel.

    Raises
    ------
    ValueError
        On numbers that are not finite, or a focal length that is not positive.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    lens: ClassVar[Lens]

    def __post_init__(self) -> None:
        if not hasattr(self, "lens"):
            raise TypeError("Camera has no lens; make a Pinhole, Fov, Radtan, Rational or Fisheye")
        for name in self.names():
            value = getattr(self, name)
            if not math.isfinite(value):
                raise ValueError(f"{name}={value}: must be finite")
        if not (self.fx > 0 and self.fy > 0):
            raise ValueError(f"fx={self.fx}, fy={self.fy}: focal lengths must be more than 0")

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Names of the intrinsics in the order of ``params``."""
        return tuple(field.name for field in fields(cls))

    @property
    def params(self) -> Array:
        """All intrinsics, shape (n,): pixels, then the lens's parameters."""
        return np.array([getattr(self, name) for name in self.names()], dtype=np.float64)

    @classmethod
    def from_params(cls, params: ArrayLike) -> Self:
        """Camera from a vector (n,) in the order of ``names()``: pixels, then the lens's parameters."""
        values = as_array(f"params of {cls.__name__}", params, len(cls.names()))
        return cls(*values.tolist())

    @property
    def matrix(self) -> Array:
        """K, shape (3, 3), pixels."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def max_angle(self) -> float:
        """Angle off the axis, radians, at which the invertible field ends; a number, shape ()."""
        return self.lens.max_angle(self.params[4:])

    def project(self, X_cam: ArrayLike) -> Projection:
        """Pixels (..., 2) of points (..., 3) in the camera's frame; see :func:`.projection.project`."""
        return projection.project(self.params, X_cam, lens=self.lens)

    def project_with_jacobians(self, X_cam: ArrayLike) -> ProjectionJacobians:
        """:meth:`project` with Jacobians of pixels, (..., 2, 3) in the point, (..., 2, n) in ``params``."""
        return projection.project_with_jacobians(self.params, X_cam, lens=self.lens)

    def unproject(self, uv: ArrayLike) -> Rays:
        """Unit bearings of pixels (..., 2); see :func:`.projection.unproject`."""
        return projection.unproject(self.params, uv, lens=self.lens)

    def unproject_with_jacobians(self, uv: ArrayLike) -> RayJacobians:
        """:meth:`unproject` with the Jacobian (..., 3, 2) of the bearing in the pixel."""
        return projection.unproject_with_jacobians(self.params, uv, lens=self.lens)

    def pixel_from_world(self, T_cam_world: ArrayLike, X_world: ArrayLike) -> Projection:
        """Pixels (..., 2) of world points (..., 3); see :func:`.projection.pixel_from_world`."""
        return projection.pixel_from_world(self.params, T_cam_world, X_world, lens=self.lens)

    def pixel_from_world_with_jacobians(
        self, T_cam_world: ArrayLike, X_world: ArrayLike
    ) -> WorldProjectionJacobians:
        """:meth:`pixel_from_world` with Jacobians (..., 2, m) of pixels in pose, point and intrinsics."""
        return projection.pixel_from_world_with_jacobians(self.params, T_cam_world, X_world, lens=self.lens)
