"""Angles of every size, and what formulas in common use lose at small ones and near a half turn.

The grid is log-spaced, so that a threshold stands between two of its angles wherever a program has put it::

    1e-15 ... 1e-8 ............................. 1 ... 3.1 | pi | ... 2 pi | ... 1e5
    zero     series, with a threshold somewhere      generic    beyond       many turns
"""

from __future__ import annotations

from typing import Any

import numpy as np

from generator.building import lost_digits
from generator.draws import digits
from vslam_ref.arrays import Array

GRID = [
    *(1e-15, 1e-12, 3e-10),
    *(10.0 ** (-8 + 0.4 * k) for k in range(20)),
    *(0.6, 0.9, 1.2, np.pi / 2, 1.8, 2.1, 2.4, 2.7, 2.95, 3.05, 3.1, 3.13),
]
"""Angles in (0, pi): five in two decades from 1e-8 on."""
BEYOND = [3.2, 3.8, 4.4, 3 * np.pi / 2, 5.0, 5.6, 6.0, 6.2]
MANY_TURNS = [2 * np.pi + 0.1, 9.0, 4 * np.pi + 0.3, 30.0, 300.0, 4000.0, 5e4, 1e6]
AXES = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0], [2 / 3, -1 / 3, 2 / 3], [-3 / 13, 4 / 13, 12 / 13]])
EPS, EPS32 = 2.0**-52, 2.0**-23
MOST, MOST32 = 1e-5, 1e-2
"""Fewer digits than five, or two in single precision, are not lost: that answer is wrong."""
FIRST_ORDER = 0.1
"""Share of a term of first order that may be lost."""


def angle_grid(angles: list[float]) -> list[float]:
    """Angles of 12 digits, of both signs in turn."""
    return [float(digits((-1) ** k * a)) for k, a in enumerate(angles)]


def vector_grid(angles: list[float], start: int = 0) -> list[Array]:
    """Rotation vectors (3,) of these angles; the axes of coordinates and others in turn."""
    return [digits(a * AXES[(k + start) % len(AXES)]) for k, a in enumerate(angles)]


def losing(
    rule: dict[str, Any], distance: float, power: int, reason: str, *, zero: bool = False
) -> dict[str, Any]:
    """Tolerance of a case whose common formula loses 4 eps over a power of a distance from a special value.

    Parameters
    ----------
    rule : dict
        Of :func:`.building.tolerance`.
    distance : float
        Of the angle, from zero or from pi.
    power : int
        1 or 2.
    reason : str
        The formula.
    zero : bool
        The distance is from zero, and the answer has a term of first order in it.  A branch that leaves this
        term out, or has another sign there, is a mistake: in double precision no more than a tenth of it
        counts as lost digits.
    """
    most = min(MOST, FIRST_ORDER * distance) if zero else MOST
    wide, wide32 = (_loss(eps, distance, power, m) for eps, m in ((EPS, most), (EPS32, MOST32)))
    single, out = rule["float32"], dict(rule)
    if wide > rule["relative"] + rule["absolute"]:
        out["lost_digits"] = lost_digits(wide, reason, absolute=rule["absolute"])
    if wide32 > single["relative"] + single["absolute"]:
        wider = lost_digits(wide32, reason, absolute=single["absolute"])
        out["float32"] = {**single, "lost_digits": wider}
    return out


def _loss(eps: float, distance: float, power: int, most: float) -> float:
    """What is lost, one digit of it, at most ``most``."""
    lost = 4 * eps / distance**power if distance > 0 else most
    return float(f"{min(lost, most):.1e}")
