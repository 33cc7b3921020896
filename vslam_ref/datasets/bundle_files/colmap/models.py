"""COLMAP's camera models and ours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, Rational

SENSOR, SIMPLE = ("fx", "fy", "cx", "cy"), ("f", "cx", "cy")


class Model(NamedTuple):
    """Our smallest camera for a model of COLMAP's, and its parameters in the file's order by our names."""

    ours: type[Camera]
    parameters: tuple[str, ...]


MODELS = {
    "SIMPLE_PINHOLE": Model(Pinhole, SIMPLE),
    "PINHOLE": Model(Pinhole, SENSOR),
    "SIMPLE_RADIAL": Model(Radtan, (*SIMPLE, "k1")),
    "RADIAL": Model(Radtan, (*SIMPLE, "k1", "k2")),
    "OPENCV": Model(Radtan, (*SENSOR, "k1", "k2", "p1", "p2")),
    "FULL_OPENCV": Model(Rational, (*SENSOR, "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
    "SIMPLE_RADIAL_FISHEYE": Model(Fisheye, (*SIMPLE, "k1")),
    "RADIAL_FISHEYE": Model(Fisheye, (*SIMPLE, "k1", "k2")),
    "OPENCV_FISHEYE": Model(Fisheye, (*SENSOR, "k1", "k2", "k3", "k4")),
    "FOV": Model(Fov, (*SENSOR, "omega")),
    "SIMPLE_FISHEYE": Model(Fisheye, SIMPLE),
    "FISHEYE": Model(Fisheye, SENSOR),
}
"""By COLMAP's names; the parameter ``f`` is fx and fy."""

NEW = ("SIMPLE_FISHEYE", "FISHEYE")
"""Of COLMAP 4: what older versions cannot read is written only where it was read."""

FOREIGN = {
    "THIN_PRISM_FISHEYE": 12,
    "RAD_TAN_THIN_PRISM_FISHEYE": 16,
    "SIMPLE_DIVISION": 4,
    "DIVISION": 5,
    "EUCM": 6,
    "EQUIRECTANGULAR": 2,
}
"""COLMAP's models that no camera here can say, and how many parameters each has."""

NEAREST = {
    "THIN_PRISM_FISHEYE": "OPENCV_FISHEYE",
    "RAD_TAN_THIN_PRISM_FISHEYE": "OPENCV_FISHEYE",
    "SIMPLE_DIVISION": "SIMPLE_RADIAL",
    "DIVISION": "OPENCV",
    "EUCM": "OPENCV_FISHEYE",
}
"""The supported model that comes closest to it."""

BY_NUMBER = (
    *(
        "SIMPLE_PINHOLE",
        "PINHOLE",
        "SIMPLE_RADIAL",
        "RADIAL",
        "OPENCV",
        "OPENCV_FISHEYE",
        "FULL_OPENCV",
        "FOV",
    ),
    *("SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "THIN_PRISM_FISHEYE", "RAD_TAN_THIN_PRISM_FISHEYE"),
    *("SIMPLE_DIVISION", "DIVISION", "SIMPLE_FISHEYE", "FISHEYE", "EUCM", "EQUIRECTANGULAR"),
)
"""The binary form's MODEL_ID is the place in this list."""

POLYNOMIAL = (Pinhole, Radtan, Rational)
"""Each can say all that those before it say."""

HALF = 0.5
"""COLMAP's pixel coordinates are larger by this."""


def common_model(names: Iterable[str]) -> type[Camera] | None:
    """Our smallest model that can say all of COLMAP's; None if none can."""
    wanted = {MODELS[name].ours for name in names}
    if wanted <= set(POLYNOMIAL):
        return max(wanted, key=POLYNOMIAL.index)
    return wanted.pop() if len(wanted) == 1 else None


def count_of_params(name: str) -> int:
    """How many parameters a model of COLMAP's has.

    Examples
    --------
    >>> count_of_params("OPENCV"), count_of_params("DIVISION")
    (8, 5)
    """
    return len(MODELS[name].parameters) if name in MODELS else FOREIGN[name]


def params_from_colmap(name: str, values: Iterable[float], model: type[Camera]) -> Array:
    """Intrinsics in the order of ``model``, the centre moved by half a pixel.

    Examples
    --------
    >>> params_from_colmap("SIMPLE_RADIAL", [500, 320, 240, -0.1], Radtan).tolist()
    [500.0, 500.0, 319.5, 239.5, -0.1, 0.0, 0.0, 0.0, 0.0]
    """
    given = dict(zip(MODELS[name].parameters, map(float, values), strict=True))
    if "f" in given:
        given["fx"] = given["fy"] = given["f"]
    given["cx"], given["cy"] = given["cx"] - HALF, given["cy"] - HALF
    return np.array([given.get(parameter, 0.0) for parameter in model.names()])


def params_to_colmap(model: type[Camera], params: Array, preferred: str = "") -> tuple[str, list[float]]:
    """COLMAP's smallest model that can say a set of intrinsics, and its parameters.

    Parameters
    ----------
    model : type of Camera
    params : ndarray, shape (p,)
    preferred : str
        COLMAP's model that is taken if it can say them.

    Examples
    --------
    >>> params_to_colmap(Radtan, np.array([500.0, 500, 319.5, 239.5, -0.1, 0, 0, 0, 0]))
    ('SIMPLE_RADIAL', [500.0, 320.0, 240.0, -0.1])
    """
    ours = dict(zip(model.names(), params.tolist(), strict=True))
    if ours["fx"] == ours["fy"]:
        ours["f"] = ours["fx"]
    ours["cx"], ours["cy"] = ours["cx"] + HALF, ours["cy"] + HALF
    family = POLYNOMIAL if model in POLYNOMIAL else (model,)
    names = [name for name in MODELS if name not in NEW or name == preferred]
    able = [name for name in names if MODELS[name].ours in family and _can_say(name, ours)]
    if not able:
        raise ValueError(f"COLMAP has no camera model for {model.__name__}")
    name = preferred if preferred in able else min(able, key=lambda name: len(MODELS[name].parameters))
    return name, [ours.get(parameter, 0.0) for parameter in MODELS[name].parameters]


def _can_say(name: str, ours: dict[str, float]) -> bool:
    """Whether the model has all parameters that are not 0."""
    has = set(MODELS[name].parameters)
    focal = "f" in ours if "f" in has else True
    rest = {parameter for parameter, value in ours.items() if value != 0} - {"fx", "fy", "f", "cx", "cy"}
    return focal and rest <= has
