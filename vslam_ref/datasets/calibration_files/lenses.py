"""Lenses by the names that other programs give them, and what to do where we have none like it.

=========================================  ==================================================================
name                                       here
=========================================  ==================================================================
plumb_bob, radtan, radial-tangential       Radtan: k1 k2 p1 p2 [k3]
rational_polynomial                        Rational: k1 k2 p1 p2 k3 k4 k5 k6
equidistant, equi, KannalaBrandt8          Fisheye: k1 k2 k3 k4
fov                                        Fov: omega
none                                       Pinhole
thin prism and tilt (12 or 14 numbers)     Rational, where the numbers from the ninth on are zero
omni, ucm: x / (xi d + z)                  the lens behind it, where xi = 0
ds: two spheres, xi and alpha              Pinhole, where xi = 0 and alpha = 0
eucm: x / (alpha d + (1 - alpha) z)        Pinhole, where alpha = 0, or beta = 0
=========================================  ==================================================================

d is the distance of the point, in ``eucm`` sqrt(beta (x^2 + y^2) + z^2).  Everything else of the last four
is refused in a line with the nearest model: no camera here has such a lens exactly.
"""

from __future__ import annotations

from collections.abc import Sequence

from vslam_ref.arrays import Array
from vslam_ref.datasets.yaml_nodes import Node, build
from vslam_ref.geometry.cameras import MODELS, Camera

SYNONYMS = {
    "plumb_bob": "radtan",
    "radial-tangential": "radtan",
    "radial_tangential": "radtan",
    "brown_conrady": "radtan",
    "rational_polynomial": "rational",
    "equidistant": "fisheye",
    "equi": "fisheye",
    "kannala_brandt": "fisheye",
    "kannalabrandt": "fisheye",
    "kannala_brandt4": "fisheye",
    "kannalabrandt4": "fisheye",
    "kannalabrandt8": "fisheye",
    "atan": "fov",
    "none": "pinhole",
    "": "pinhole",
}
NAMES = {name: name for name in MODELS} | SYNONYMS
COUNTS = {"pinhole": (0,), "radtan": (4, 5), "rational": (8,), "fisheye": (4,), "fov": (1,)}
WIDE = ("omni", "ucm", "mei", "ds", "eucm", "scaramuzza", "ocam", "thin_prism_fisheye", "equirectangular")
NARROW = ("thin_prism", "radial_division", "division")
UNKNOWN = (*WIDE, *NARROW)
"""Lenses that no camera here has, of a wide or of a usual view."""


def nearest(model: str, numbers: str = "") -> str:
    """The rest of a refusal: a model that no camera here has, and what to do instead."""
    ours = "fisheye" if model in WIDE else "rational"
    known = "fisheye (equidistant; Kalibr's pinhole-equi)" if ours == "fisheye" else ours
    what = f"{model}{numbers}, a lens that no camera here has; the nearest supported model is {known}"
    return f"{what}: calibrate again with 'vslam-ref calibrate --model {ours}'"


def lens_name(node: Node) -> str:
    """Our name of the lens that a file names, or FormatError: the nearest one, or all that are known."""
    word = node.text().strip().lower()
    if word in UNKNOWN:
        raise node.error(f"{node.name} is {nearest(word)}")
    return node.choice(NAMES)


def numbers_of(node: Node) -> Array:
    """Coefficients: a list, a list of one row or one column, or a matrix."""
    if node.raw.id == "mapping":
        return node.matrix().ravel()
    elements = node.elements()
    if elements and elements[0].raw.id == "sequence":
        return node.matrix().ravel()
    return node.vector()


def lens_camera(node: Node, name: str | None, sensor: Sequence[float], given: Sequence[float]) -> Camera:
    """The camera of a sensor and coefficients in OpenCV's order, or FormatError at ``node``.

    Parameters
    ----------
    node : Node
        Where the coefficients stand.
    name : str or None
        Our name of the lens; None: OpenCV's rule, by the number of coefficients.
    sensor : sequence of four floats
        fx, fy, cx, cy, pixels.
    given : sequence of float
        Coefficients; zeros behind those that the lens has say nothing, and a rational one may leave its
        last three out.
    """
    k = list(given)
    if name is None or (name in ("radtan", "rational") and not 0 < len(k) <= 8):
        name = "pinhole" if not k else "radtan" if len(k) <= 5 else "rational"
    if name == "rational" and len(k) > 8:
        if any(k[8:]):
            kind = "tilted sensor" if any(k[12:]) else "thin prism"
            raise node.error(f"{node.name} has {len(k)} numbers, of {nearest(f'a {kind}')}")
        k = k[:8]
    if name == "rational" and len(k) in COUNTS["radtan"]:
        k += [0.0] * (8 - len(k))
    counts = COUNTS[name]
    if len(k) > counts[-1] and not any(k[counts[-1] :]):
        k = k[: counts[-1]]
    if len(k) not in counts:
        right = " or ".join(map(str, counts))
        raise node.error(f"{node.name}: {len(k)} coefficients for {name}; expected {right}")
    camera: Camera = build(node, MODELS[name], *sensor, *k)
    return camera


def wide_sensor(kind: str, node: Node) -> list[float]:
    """fx, fy, cx, cy of Kalibr's wide models, where these are a pinhole.

    Raises
    ------
    FormatError
        Where the numbers are not those of a pinhole; the line names the nearest model.
    """
    names = {"omni": ("xi",), "ds": ("xi", "alpha"), "eucm": ("alpha", "beta")}[kind]
    values = node.vector(4 + len(names)).tolist()
    first = dict(zip(names, values, strict=False))
    plain = {
        "omni": first.get("xi") == 0,
        "ds": first.get("xi") == first.get("alpha") == 0,
        "eucm": first.get("alpha") == 0 or first.get("beta") == 0,
    }[kind]
    if not plain:
        said = ", ".join(f"{name} = {value:g}" for name, value in first.items())
        raise node.error(f"camera_model is {nearest(kind, f' with {said}')}")
    sensor: list[float] = values[len(names) :]
    return sensor
