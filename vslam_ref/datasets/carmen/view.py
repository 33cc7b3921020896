r"""Where the beams of a laser look: by its message, the file's parameters, the user, or how many they are.

::

            ahead                   start angle s, field of view f, n beams
        \     |     /               step f / (n - 1): the first beam at s, the last at s + f
    s    \    |    /   s + f        step f / n:       the last one is a step short of s + f
          \   |   /                                   (the half circle of 180 beams, any full circle)
            laser

A message or a parameter table that tells its resolution decides between the two.  Without it the step that is
a whole part of a degree is taken (180 / 180 and not 180 / 179), and f / (n - 1) where both or neither are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from vslam_ref.grids.scan import LaserScanner

HALF_CIRCLE = (180, 181, 360, 361)
"""Numbers of beams that mean half a circle to everybody: steps of a whole or a half degree."""
LIKELY = {271: 270.0, 541: 270.0, 682: 240.0, 726: 240.0, 811: 270.0, 1080: 270.0, 1081: 270.0}
"""Number of beams -> field of view, degrees, of the scanners that have so many, if nothing else is known."""
CLOSE = 0.01
"""Degrees: what rounded digits, 3.14159 or 4.7124 rad, are off a whole degree."""
PARAMETER = re.compile(r"(?:laser|robot)_(?:front_?laser|laser1)_(?:laser_)?(fov|resolution|start_angle)$|"
                       r"laser_front_laser_(fov|resolution|start_angle)$")  # fmt: skip


class LaserView(NamedTuple):
    """Start angle, field of view and step as a file tells them: degrees; None for what it does not tell."""

    start: float | None
    field_of_view: float | None
    resolution: float | None


class ChosenScanner(NamedTuple):
    """A scanner, and sentences about what is odd in it."""

    scanner: LaserScanner
    notes: tuple[str, ...]


def degrees(value: float, most: float = 2 * np.pi + 1e-3) -> float:
    """An angle in degrees, given in radians or, if it is larger than a full turn in radians, in degrees.

    What is next to a whole degree is that degree.

    Examples
    --------
    >>> degrees(3.14159), degrees(270.0), degrees(-1.570796), round(degrees(2.2), 2)
    (180.0, 270.0, -90.0, 126.05)
    """
    angle = value if abs(value) > most else float(np.degrees(value))
    whole = round(angle)
    return float(whole) if abs(angle - whole) <= CLOSE else angle


def from_parameters(parameters: Mapping[str, str]) -> LaserView | None:
    """The view that lines such as ``PARAM laser_front_laser_fov 270`` tell; None where there is none."""
    told: dict[str, float] = {}
    for name, text in parameters.items():
        found = PARAMETER.match(name)
        try:
            value = float(text)
        except ValueError:
            continue
        if found and np.isfinite(value):
            told[found[1] or found[2]] = value
    field = told.get("fov", 0.0)
    if not 0 < degrees(field) <= 360:
        return None
    start, step = told.get("start_angle"), told.get("resolution", 0.0)
    return LaserView(
        None if start is None else degrees(start),
        degrees(field),
        step if step > 0 else None,  # CARMEN's table gives it in degrees
    )


def chosen(beams: int, view: LaserView, max_range: float, where: str) -> ChosenScanner:
    """The scanner of so many beams with a view whose field is known; ``where`` says who told it."""
    field, step = view.field_of_view or 180.0, view.resolution
    spans = (field / max(beams - 1, 1), field / beams)
    notes: tuple[str, ...] = ()
    if step is None or beams == 1:
        step = spans[1] if field >= 360 or (_simple(spans[1]) and not _simple(spans[0])) else spans[0]
    else:
        off = [abs(step - span) for span in spans]
        if min(off) <= 0.5 * step / beams:
            step = spans[int(np.argmin(off))]
        else:
            said = f"{field:g} degrees in steps of {step:g} are not {beams} beams"
            notes = (f"{where}: {said}; the field of view is used (--fov tells another)",)
            step = spans[0]
    start = -field / 2 if view.start is None else view.start
    return ChosenScanner(LaserScanner(beams, np.radians(start), np.radians(step), max_range), notes)


def by_count(beams: int, max_range: float) -> ChosenScanner:
    """The scanner that a number of beams stands for, with a note where it may stand for several.

    Examples
    --------
    >>> [by_count(n, 50.0).notes == () for n in (180, 361, 1081)]
    [True, True, False]
    """
    if beams in HALF_CIRCLE:
        return ChosenScanner(half_circle(beams, max_range), ())
    field = LIKELY.get(beams, 180.0)
    taken = (
        half_circle(beams, max_range)
        if field == 180.0
        else chosen(beams, LaserView(None, field, None), max_range, "").scanner
    )
    others = [f for f in (100, 180, 190, 240, 270, 360) if f != field and _simple(f / max(beams - 1, 1))]
    may = f", it may be {' or '.join(map(str, others))}" if others else ""
    return ChosenScanner(
        taken,
        (
            f"the file does not tell the field of view of its {beams} beams: {field:g} degrees are taken"
            f"{may}; --fov DEGREES tells it",
        ),
    )


def half_circle(beams: int, max_range: float) -> LaserScanner:
    """Half a circle from -90 degrees on: the step is 180 degrees over n for even n, over n - 1 for odd n."""
    return LaserScanner(beams, -np.pi / 2, np.pi / max(beams - beams % 2, 1), max_range)


def _simple(step: float) -> bool:
    """Whether a step is a whole number of twentieths, a third or a sixth of a degree."""
    return any(abs(step * k - round(step * k)) < 1e-6 and round(step * k) > 0 for k in (20, 6, 8))
