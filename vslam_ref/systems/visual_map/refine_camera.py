"""The camera from the pictures themselves: the last adjustment frees it as far as the motion determines it.

============  ======================================================================
given         freed
============  ======================================================================
pinhole       fx, fy, cx, cy, k1, k2, p1, p2: it becomes a radial-tangential camera
radtan        the same; k3 stays
rational      the same; k3 to k6 stay
fov           fx, fy, cx, cy, omega
fisheye       fx, fy, cx, cy, k1 to k4
============  ======================================================================

What is refused has the value that was given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.estimation.bundle import Options, Robust
from vslam_ref.estimation.bundle.self_calibration import Refused
from vslam_ref.geometry.cameras import Camera, Pinhole, Radtan
from vslam_ref.geometry.cameras.images import pixel_grid
from vslam_ref.support.config import assume
from vslam_ref.systems.visual_map.adjusting import adjust_with_camera
from vslam_ref.systems.visual_map.keyframe_map import KeyframeMap

LENS_TERMS = ("k1", "k2", "p1", "p2")


@dataclass(frozen=True)
class CameraSettings:
    """Self-calibration at the end; every field has its own unit, beside it."""

    refine: bool = assume(False, "", "the camera that was given is believed; the last adjustment may free it")
    most_shift: float = assume(
        5.0,
        "px",
        "an intrinsic whose standard deviation moves a pixel farther stays; a dozen times the floor of sigma",
    )
    steps: int = assume(100, "", "of an adjustment with the camera: along its valleys progress is slow")


class PixelShift(NamedTuple):
    """How far pixels lie apart by two cameras, over the picture: largest, and root mean square; pixels."""

    largest: float
    rms: float


class RefinedCamera(NamedTuple):
    """What self-calibration found.

    Attributes
    ----------
    given, camera : Camera
        Before and after; the same where there is a ``reason``.
    sigma : dict of str to float
        Standard deviation of each intrinsic that was changed, in its own unit.
    refused : dict of str to Refused
        Intrinsics that the motion does not determine.
    reason : str
        Empty, or why the camera is as it was given.
    shift : PixelShift
        Between both.
    T_kf_before : ndarray, shape (K, 4, 4)
        Keyframes as they were adjusted with the camera that was given.
    """

    given: Camera
    camera: Camera
    sigma: dict[str, float]
    refused: dict[str, Refused]
    reason: str
    shift: PixelShift
    T_kf_before: Array


def refine_camera(visual_map: KeyframeMap, loss: Robust, s: CameraSettings) -> RefinedCamera:
    """Adjust everything with the camera free; the map is changed in place."""
    given, before = visual_map.camera, visual_map.T_kf_world.copy()
    if len(visual_map.used_keyframes()) < 3:
        nothing = "two keyframes determine no camera"
        return RefinedCamera(given, given, {}, {}, nothing, PixelShift(0.0, 0.0), before)
    start, names = with_lens_terms(given), free_names(given)
    found = adjust_with_camera(
        visual_map, start, names, loss, most_shift_px=s.most_shift, options=options(s.steps)
    )
    camera = without_lens_terms(given, visual_map.camera, found.refused)
    if camera is not visual_map.camera:
        visual_map.change_camera(camera)  # a pinhole again
    height, width = visual_map.shape
    shift = pixel_shift(given, camera, (width, height))
    return RefinedCamera(given, camera, found.sigma, found.refused, found.reason, shift, before)


def options(steps: int) -> Options:
    """End later than an adjustment of poses does: a camera moves along flat valleys."""
    return Options(cost=1e-6, scale=1e-3, max_iterations=steps)


def free_names(camera: Camera) -> tuple[str, ...]:
    """Intrinsics of a camera that may be freed.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Fov
    >>> free_names(Pinhole(500.0, 500.0, 320.0, 240.0))
    ('fx', 'fy', 'cx', 'cy', 'k1', 'k2', 'p1', 'p2')
    >>> free_names(Fov(500.0, 500.0, 320.0, 240.0, 0.9))
    ('fx', 'fy', 'cx', 'cy', 'omega')
    """
    if isinstance(camera, Pinhole | Radtan):
        return ("fx", "fy", "cx", "cy", *LENS_TERMS)
    return camera.names()


def with_lens_terms(camera: Camera) -> Camera:
    """A pinhole as a radial-tangential camera whose terms are zero; others as they are."""
    return Radtan.from_params([*camera.params, *np.zeros(5)]) if isinstance(camera, Pinhole) else camera


def without_lens_terms(given: Camera, found: Camera, refused: dict[str, Refused]) -> Camera:
    """A pinhole again, where it was one and every term of the lens was refused."""
    if isinstance(given, Pinhole) and set(LENS_TERMS) <= set(refused):
        return Pinhole.from_params(found.params[:4])
    return found


def pixel_shift(given: Camera, refined: Camera, size: tuple[int, int]) -> PixelShift:
    """How far from a pixel the refined camera shows the ray that the given one has for it.

    Over all pixels of a picture of ``size`` (W, H) that both show.  A camera that only has another centre is
    shifted by as much everywhere, although a turn of the camera looks almost the same.
    """
    uv = pixel_grid(size).reshape(-1, 2)
    rays = given.unproject(uv)
    at = refined.project(rays.bearing)
    both = rays.valid & at.valid
    if not both.any():
        return PixelShift(float("inf"), float("inf"))
    away = np.linalg.norm(at.uv[both] - uv[both], axis=1)
    return PixelShift(float(away.max()), float(np.sqrt((away**2).mean())))
