"""V views of one world: a camera and a pose each, and all their rays and pixels at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry import camera_pose
from vslam_ref.geometry.cameras import Camera, Projection, Rays, WorldProjectionJacobians


@dataclass(frozen=True)
class Views:
    """Cameras at their places.

    Parameters
    ----------
    cameras : Camera or sequence of V Camera
        One for all views, or one a view; the models may differ.
    T_cam_world : array_like, shape (V, 4, 4)
        Poses, rigid motions from the world to each camera.

    Raises
    ------
    ValueError
        If the counts disagree, or a pose is not finite.

    Examples
    --------
    >>> from vslam_ref.geometry import se3
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> views = Views(Pinhole(500, 500, 320, 240), [se3.identity(), se3.exp([-1.0, 0, 0, 0, 0, 0])])
    >>> views.project([[0.0, 0.0, 5.0]]).uv.tolist()
    [[[320.0, 240.0], [220.0, 240.0]]]
    """

    cameras: Camera | Sequence[Camera]
    T_cam_world: Array

    def __post_init__(self) -> None:
        """Check counts and numbers once."""
        T = as_array("T_cam_world", self.T_cam_world, 4, 4)
        if T.ndim != 3:
            raise ValueError(f"T_cam_world has shape {T.shape}: need (V, 4, 4)")
        if not isinstance(self.cameras, Camera) and len(self.cameras) != len(T):
            raise ValueError(f"{len(self.cameras)} cameras for {len(T)} poses: need one for all, or one each")
        bad = np.flatnonzero(~np.isfinite(T).all(axis=(1, 2)))
        if len(bad):
            raise ValueError(f"pose {bad[0]} is not finite")
        object.__setattr__(self, "T_cam_world", T)

    def __len__(self) -> int:
        """Count the views."""
        return len(self.T_cam_world)

    @property
    def each(self) -> list[Camera]:
        """One camera a view."""
        return [self.cameras] * len(self) if isinstance(self.cameras, Camera) else list(self.cameras)

    @property
    def centres(self) -> Array:
        """Camera centres in the world, (V, 3)."""
        return camera_pose.centre_from_pose(self.T_cam_world)

    def only(self, keep: ArrayLike) -> Views:
        """Some of the views, by indices or by a mask (V,)."""
        index = np.arange(len(self))[np.asarray(keep)]
        return Views([self.each[i] for i in index], self.T_cam_world[index])

    def rays(self, uv: ArrayLike) -> Rays:
        """Unit bearings (N, V, 3) of pixels (N, V, 2), each in its camera's frame."""
        uv = self.pixels(uv)
        if isinstance(self.cameras, Camera):
            return self.cameras.unproject(uv)
        found = [camera.unproject(uv[:, i]) for i, camera in enumerate(self.each)]
        return Rays(np.stack([r.bearing for r in found], 1), np.stack([r.valid for r in found], 1))

    def project(self, X_world: ArrayLike) -> Projection:
        """Pixels (N, V, 2) of world points (N, 3) in every view."""
        seen = self.project_with_jacobians(X_world)
        return Projection(seen.uv, seen.valid)

    def project_with_jacobians(self, X_world: ArrayLike) -> WorldProjectionJacobians:
        """:meth:`project` with Jacobians (N, V, 2, 6) in the poses and (N, V, 2, 3) in the points.

        ``J_intrinsics`` is that of the camera if there is one for all, and empty if the models differ.
        """
        X = as_array("X_world", X_world, 3)
        if isinstance(self.cameras, Camera):
            return self.cameras.pixel_from_world_with_jacobians(self.T_cam_world, X[:, None])
        found = [
            c.pixel_from_world_with_jacobians(T, X) for c, T in zip(self.each, self.T_cam_world, strict=True)
        ]
        uv = np.stack([f.uv for f in found], 1)
        return WorldProjectionJacobians(
            uv,
            np.stack([f.valid for f in found], 1),
            np.stack([f.J_pose for f in found], 1),
            np.stack([f.J_point for f in found], 1),
            np.zeros((*uv.shape, 0)),
        )

    def pixels(self, uv: ArrayLike) -> Array:
        """Pixels (N, V, 2) as an array.

        Raises
        ------
        ValueError
            If there is not one pixel a view.
        """
        pixels = as_array("uv", uv, 2)
        if pixels.ndim != 3 or pixels.shape[1] != len(self):
            raise ValueError(f"uv has shape {pixels.shape}: need (N, {len(self)}, 2), one pixel a view")
        return pixels
