"""Cameras: from points in the camera's frame to pixels and back, with every derivative.

==========================  ==============================================================================
module                      lens
==========================  ==============================================================================
``pinhole``                 none
``fov``                     one angle omega (PTAM, TUM-mono)
``radtan``                  radial and tangential polynomial (OpenCV, Kalibr, EuRoC), and its rational form
``fisheye``                 equidistant with four coefficients
==========================  ==============================================================================

A camera is a frozen dataclass of its intrinsics; ``camera.project``, ``camera.unproject`` and their forms
with Jacobians answer with a flag ``valid`` and never with NaN.  ``projection`` holds the same
functions for arrays of parameters, ``images`` takes the distortion out of images.
"""

from vslam_ref.geometry.cameras.camera import Camera
from vslam_ref.geometry.cameras.fisheye import Fisheye
from vslam_ref.geometry.cameras.fov import Fov
from vslam_ref.geometry.cameras.images import (
    ImageMap,
    Samples,
    pixel_grid,
    sample_bilinear,
    undistortion_map,
)
from vslam_ref.geometry.cameras.interface import (
    Lens,
    Projection,
    ProjectionJacobians,
    RayJacobians,
    Rays,
    WorldProjectionJacobians,
)
from vslam_ref.geometry.cameras.pinhole import Pinhole
from vslam_ref.geometry.cameras.projection import pose_jacobian
from vslam_ref.geometry.cameras.radtan import Radtan, Rational

MODELS: dict[str, type[Camera]] = {
    "pinhole": Pinhole,
    "fov": Fov,
    "radtan": Radtan,
    "rational": Rational,
    "fisheye": Fisheye,
}
"""The models by the names that files and commands use."""

__all__ = [
    "MODELS",
    "Camera",
    "Fisheye",
    "Fov",
    "ImageMap",
    "Lens",
    "Pinhole",
    "Projection",
    "ProjectionJacobians",
    "Radtan",
    "Rational",
    "RayJacobians",
    "Rays",
    "Samples",
    "WorldProjectionJacobians",
    "pixel_grid",
    "pose_jacobian",
    "sample_bilinear",
    "undistortion_map",
]
