"""camodocal's camera file, which VINS-Fusion and its kin use: one camera, in OpenCV's storage.

::

    model_type: PINHOLE           or KANNALA_BRANDT, MEI
    image_width: 752
    image_height: 480
    distortion_parameters:        k1 k2 p1 p2, of PINHOLE and MEI
    projection_parameters:        fx fy cx cy; of KANNALA_BRANDT k2 k3 k4 k5 mu mv u0 v0: its first lens
                                  coefficient is 1, the next four are our k1 to k4; of MEI gamma1 gamma2 u0 v0
    mirror_parameters:            xi, of MEI

Pixel (0, 0) is the centre of the top-left pixel.  MEI with xi = 0 is the pinhole with its distortion; with
another xi no camera here has it, and SCARAMUZZA's polynomials none at all.
"""

from __future__ import annotations

from vslam_ref.datasets.calibration_files.lenses import nearest
from vslam_ref.datasets.calibration_files.record import CameraFile
from vslam_ref.datasets.yaml_nodes import Node, build
from vslam_ref.geometry.cameras import Camera, Fisheye, Radtan

FISHEYE = ("k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0")
SENSORS = {"pinhole": ("fx", "fy", "cx", "cy"), "mei": ("gamma1", "gamma2", "u0", "v0")}


def from_camodocal(top: Node) -> CameraFile:
    """The camera of a file that has been parsed.

    Raises
    ------
    FormatError
        Where the file is not as the module says, or no camera here has such a lens.
    """
    kind = top.get("model_type")
    word = kind.text().strip().lower()
    size = top.get("image_width").integer(), top.get("image_height").integer()
    name = top.get("camera_name").text() if "camera_name" in top.items() else ""
    if word == "kannala_brandt":
        *k, fx, fy, cx, cy = _numbers(top, "projection_parameters", FISHEYE)
        camera: Camera = build(kind, Fisheye, fx, fy, cx, cy, *k)
        return CameraFile(camera, size, name=name)
    if word == "scaramuzza":
        raise kind.error(f"model_type is {nearest(word)}")
    if word not in SENSORS:
        what = f"model_type is {kind.text()!r}"
        raise kind.error(f"{what}; expected PINHOLE, KANNALA_BRANDT, or MEI with xi = 0")
    if word == "mei" and (xi := _numbers(top, "mirror_parameters", ("xi",))[0]) != 0:
        raise kind.error(f"model_type is {nearest(word, f' with xi = {xi:g}')}")
    sensor = _numbers(top, "projection_parameters", SENSORS[word])
    k = _numbers(top, "distortion_parameters", ("k1", "k2", "p1", "p2"))
    return CameraFile(build(kind, Radtan, *sensor, *k), size, name=name)


def _numbers(top: Node, group: str, names: tuple[str, ...]) -> list[float]:
    entries = top.get(group)
    return [entries.get(name).number() for name in names]
