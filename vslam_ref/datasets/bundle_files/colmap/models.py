"""COLMAP's camera models and ours."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, Rational

SENSOR = ("fx", "fy", "cx", "cy")
PARAMETERS: dict[str, tuple[str, ...]] = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": SENSOR,
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": (*SENSOR, "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": (*SENSOR, "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV_FISHEYE": (*SENSOR, "k1", "k2", "k3", "k4"),
    "FOV": (*SENSOR, "omega"),
}
"""Parameters in the order of the file, by our names; ``f`` is fx and fy."""

POLYNOMIAL = (Pinhole, Radtan, Rational)
"""Each can say all that those before it say."""

SMALLEST: dict[str, type[Camera]] = {
    "SIMPLE_PINHOLE": Pinhole,
    "PINHOLE": Pinhole,
    "SIMPLE_RADIAL": Radtan,
    "RADIAL": Radtan,
    "OPENCV": Radtan,
    "FULL_OPENCV": Rational,
    "SIMPLE_RADIAL_FISHEYE": Fisheye,
    "RADIAL_FISHEYE": Fisheye,
    "OPENCV_FISHEYE": Fisheye,
    "FOV": Fov,
}
"""Our smallest model for each."""

HALF = 0.5
"""COLMAP's pixel coordinates are larger by this."""


def common_model(names: Iterable[str]) -> type[Camera] | None:
    """Our smallest model that can say all of COLMAP's; None if none can."""
    wanted = {SMALLEST[name] for name in names}
    if wanted <= set(POLYNOMIAL):
        return max(wanted, key=POLYNOMIAL.index)
    return wanted.pop() if len(wanted) == 1 else None


def params_from_colmap(name: str, values: Iterable[float], model: type[Camera]) -> Array:
    """Intrinsics in the order of ``model``, the centre moved by half a pixel.

    Examples
    --------
    >>> params_from_colmap("SIMPLE_RADIAL", [500, 320, 240, -0.1], Radtan).tolist()
    [500.0, 500.0, 319.5, 239.5, -0.1, 0.0, 0.0, 0.0, 0.0]
    """
    told = dict(zip(PARAMETERS[name], map(float, values), strict=True))
    if "f" in told:
        told["fx"] = told["fy"] = told["f"]
    told["cx"], told["cy"] = told["cx"] - HALF, told["cy"] - HALF
    return np.array([told.get(parameter, 0.0) for parameter in model.names()])


def params_to_colmap(model: type[Camera], params: Array, told: str = "") -> tuple[str, list[float]]:
    """COLMAP's smallest model that can say a set of intrinsics, and its parameters.

    Parameters
    ----------
    model : type of Camera
    params : ndarray, shape (p,)
    told : str
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
    able = [name for name, kind in SMALLEST.items() if kind in family and _can_say(name, ours)]
    if not able:
        raise ValueError(f"COLMAP has no camera model for {model.__name__}")
    name = told if told in able else min(able, key=lambda name: len(PARAMETERS[name]))
    return name, [ours.get(parameter, 0.0) for parameter in PARAMETERS[name]]


def _can_say(name: str, ours: dict[str, float]) -> bool:
    """Whether the model has all parameters that are not 0."""
    has = set(PARAMETERS[name])
    focal = "f" in ours if "f" in has else True
    rest = {parameter for parameter, value in ours.items() if value != 0} - {"fx", "fy", "f", "cx", "cy"}
    return focal and rest <= has
