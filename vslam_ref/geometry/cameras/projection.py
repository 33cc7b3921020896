"""From points to pixels and back, for any lens; camera parameters as arrays, so that batches of cameras work.

``params`` (..., 4 + k) is ``fx, fy, cx, cy`` and the lens's k parameters; it broadcasts against the points.
One camera for all points is ``(n,)``, one camera a point ``(N, n)``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras.interface import (
    Lens,
    Projection,
    ProjectionJacobians,
    RayJacobians,
    Rays,
    WorldProjectionJacobians,
)


def _split(params: ArrayLike, lens: Lens) -> tuple[Array, Array, Array]:
    """Focal lengths (..., 2), centre (..., 2) and lens parameters (..., k)."""
    params = as_array(f"params (fx, fy, cx, cy, {', '.join(lens.names)})", params, 4 + len(lens.names))
    return params[..., :2], params[..., 2:4], params[..., 4:]


def project(params: ArrayLike, X_cam: ArrayLike, *, lens: Lens) -> Projection:
    """Project points of the camera's frame to pixels.

    Implements :eq:`eq-a1-2` (A1.2), and :eq:`eq-a2-2` (A2.2) with the FOV lens.

    Parameters
    ----------
    params : array_like, shape (..., 4 + k)
        fx, fy, cx, cy in pixels, then the lens's parameters.
    X_cam : array_like, shape (..., 3)
        Points, x right, y down, z ahead; any unit.
    lens : Lens
        For example ``Fov.lens``.

    Returns
    -------
    Projection
        Where ``valid`` is False (behind the camera, outside the invertible field), ``uv`` is the principal
        point.

    Raises
    ------
    ValueError
        On wrong shapes.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> project([500, 500, 320, 240], [[0.1, 0, 1], [0.1, 0, -1]], lens=Pinhole.lens)
    Projection(uv=array([[370., 240.],
           [320., 240.]]), valid=array([ True, False]))
    """
    focal, centre, k = _split(params, lens)
    xd, valid = lens.distort(k, X_cam)
    uv = focal * np.where(valid[..., None], xd, 0.0) + centre
    return Projection(uv, np.broadcast_to(valid, uv.shape[:-1]))


def project_with_jacobians(params: ArrayLike, X_cam: ArrayLike, *, lens: Lens) -> ProjectionJacobians:
    """:func:`project` and its Jacobians of pixels in the point (..., 2, 3) and parameters (..., 2, 4 + k).

    Implements :eq:`eq-jacobian-point` and :eq:`eq-jacobian-intrinsics`.
    duv/dX = diag(f) dxd/dX; duv/d(fx, fy, cx, cy) = [[xd, 0, 1, 0], [0, yd, 0, 1]]; duv/dk = diag(f) dxd/dk.
    """
    focal, centre, k = _split(params, lens)
    xd, valid, J_X, J_k = lens.distort_with_jacobians(k, X_cam)
    xd = np.where(valid[..., None], xd, 0.0)
    seen = valid[..., None, None]
    uv = focal * xd + centre
    f = np.broadcast_to(focal, uv.shape)[..., None]
    J = np.zeros((*uv.shape, 4 + len(lens.names)))
    J[..., 0, 0], J[..., 1, 1] = xd[..., 0], xd[..., 1]
    J[..., 0, 2] = J[..., 1, 3] = 1.0
    J[..., 4:] = f * J_k
    valid = np.broadcast_to(valid, uv.shape[:-1])
    return ProjectionJacobians(uv, valid, np.where(seen, f * J_X, 0.0), np.where(seen, J, 0.0))


def unproject(params: ArrayLike, uv: ArrayLike, *, lens: Lens) -> Rays:
    """Ray of every point that appears at a pixel: the inverse of :func:`project` up to the depth.

    Parameters
    ----------
    params : array_like, shape (..., 4 + k)
        As for :func:`project`.
    uv : array_like, shape (..., 2)
        Pixels.
    lens : Lens
        The lens model.

    Returns
    -------
    Rays
        Unit bearings; the optical axis where ``valid`` is False.
    """
    focal, centre, k = _split(params, lens)
    return lens.undistort(k, (as_array("uv", uv, 2) - centre) / focal)


def unproject_with_jacobians(params: ArrayLike, uv: ArrayLike, *, lens: Lens) -> RayJacobians:
    """:func:`unproject` and the Jacobian (..., 3, 2) of the bearing in the pixel.

    Implements :eq:`eq-jacobian-ray`.
    The Jacobian J of the projection at the bearing b has J b = 0, since depth does not matter.  The
    bearing stays of length 1, b^T db = 0.  Both say that db/duv is the pseudo-inverse of J.
    """
    bearing, valid = unproject(params, uv, lens=lens)
    J = project_with_jacobians(params, bearing, lens=lens).J_point
    gram = np.where(valid[..., None, None], J @ np.swapaxes(J, -1, -2), np.eye(2))
    J_pixel = np.swapaxes(np.linalg.solve(gram, J), -1, -2)
    return RayJacobians(bearing, valid, np.where(valid[..., None, None], J_pixel, 0.0))


def pixel_from_world(
    params: ArrayLike, T_cam_world: ArrayLike, X_world: ArrayLike, *, lens: Lens
) -> Projection:
    """Pixel of a world point in a camera that stands somewhere: h(C, X).

    Implements :eq:`eq-a1-3` (A1.3).

    Parameters
    ----------
    params : array_like, shape (..., 4 + k)
        Intrinsics.
    T_cam_world : array_like, shape (..., 4, 4)
        Rigid motion from the world to the camera.
    X_world : array_like, shape (..., 3)
        Points.
    lens : Lens
        The lens model.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> T_cam_world = np.eye(4)
    >>> T_cam_world[2, 3] = 3.0  # the camera stands 3 behind the world's origin
    >>> pixel_from_world([500, 500, 320, 240], T_cam_world, [0.5, 0, 2], lens=Pinhole.lens).uv
    array([370., 240.])
    """
    return project(params, _cam_from_world(T_cam_world, X_world), lens=lens)


def pixel_from_world_with_jacobians(
    params: ArrayLike, T_cam_world: ArrayLike, X_world: ArrayLike, *, lens: Lens
) -> WorldProjectionJacobians:
    """:func:`pixel_from_world` and its Jacobians.

    In the pose (..., 2, 6), perturbed from the left by xi = (rho, phi) in metres and radians; in the world
    point (..., 2, 3); in the intrinsics (..., 2, 4 + k).  All are of pixels.
    """
    X_cam = _cam_from_world(T_cam_world, X_world)
    at = project_with_jacobians(params, X_cam, lens=lens)
    J_pose, J_world = pose_jacobian(at.J_point, X_cam), at.J_point @ se3.rotation(T_cam_world)
    return WorldProjectionJacobians(at.uv, at.valid, J_pose, J_world, at.J_intrinsics)


def pose_jacobian(J_point: ArrayLike, X_cam: ArrayLike) -> Array:
    """Jacobian in the pose from the Jacobian in the point, for T <- Exp(xi) T and xi = (rho, phi).

    Implements :eq:`eq-jacobian-pose`.
    The point moves by rho + phi x X_cam, so dX/dxi = [I, -hat(X_cam)], and row j of the second half is
    X_cam x J_j.

    Parameters
    ----------
    J_point : array_like, shape (..., m, 3)
        Jacobian of m quantities in X_cam.  Where the point is not valid it is zero, and so is the result.
    X_cam : array_like, shape (..., 3)
        Points in the camera's frame.

    Returns
    -------
    ndarray, shape (..., m, 6)
        Per metre (or the unit of X_cam) and per radian.

    Examples
    --------
    >>> pose_jacobian([[1.0, 0.0, 0.0]], [0.0, 0.0, 2.0])
    array([[1., 0., 0., 0., 2., 0.]])
    """
    J, X = np.asarray(J_point, dtype=np.float64), as_array("X_cam", X_cam, 3)
    X = np.where(np.isfinite(X), X, 0.0)  # such a point is not valid: its J is zero
    return np.concatenate([J, np.cross(np.broadcast_to(X[..., None, :], J.shape), J) + 0.0], -1)


def _cam_from_world(T_cam_world: ArrayLike, X_world: ArrayLike) -> Array:
    return se3.act(as_array("T_cam_world", T_cam_world, 4, 4), as_array("X_world", X_world, 3))
