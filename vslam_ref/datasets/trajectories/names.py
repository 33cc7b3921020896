"""What the columns of a table are called: a header tells which of them are a pose.

::

    #timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], ...
    timestamp,tx,ty,tz,qx,qy,qz,qw
    # timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12 ...
    %time,field.header.stamp,field.pose.position.x, ... ,field.pose.orientation.w
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

UNITS = {"s": 0, "ms": 3, "us": 6, "ns": 9}
"""Unit of time -> how many decimal places it lies below the second."""
UNIT_NAMES = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
_SPELT = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisec", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "usec", "usecs", "µs", "micros", "microsec", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanoseconds"), "ns"),
}
_BRACKET = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]")
_TIME = re.compile(r"(.*_)?([a-z]*time|[a-z]*stamp)s?|t|ts")
_METRES = ("m", "meter", "meters", "metre", "metres")
_POSITION = frozenset(["t", "p", "pos", "position", "trans", "translation", "loc", "location"])
_QUATERNION = frozenset(["q", "quat", "quaternion", "orientation", "rot", "rotation"])
_OTHER = frozenset(
    [
        *("v", "vel", "velocity", "twist", "linear", "angular", "a", "acc", "accel", "acceleration", "w"),
        *("gyro", "omega", "b", "bg", "ba", "bias", "cov", "covariance", "sigma", "std", "euler", "rpy"),
        *("g", "gravity"),
    ]
)
POSE = ("tx", "ty", "tz", "qw", "qx", "qy", "qz")


class Layout(NamedTuple):
    """Where a pose stands in a line.

    Attributes
    ----------
    time : tuple of int
        Column of the time; two where seconds and nanoseconds have one each.
    pose : tuple of int
        Columns of tx, ty, tz, qw, qx, qy, qz.
    unit : str or None
        Unit of the time, one of ``UNITS``, where the header says it.
    """

    time: tuple[int, ...]
    pose: tuple[int, ...]
    unit: str | None = None


def split_header(text: str) -> list[str]:
    """Names of a header, parted by commas or semicolons if it has any, else by blanks.

    Examples
    --------
    >>> split_header("timestamp [ns] tx ty")
    ['timestamp[ns]', 'tx', 'ty']
    >>> split_header('"position x [m]", "position y [m]",')
    ['position x[m]', 'position y[m]']
    """
    text = re.sub(r"\s+(?=[\[(])", "", text.strip())
    for mark in ";,":
        if mark in text:
            names = [name.strip().strip("\"'") for name in text.split(mark)]
            return names[:-1] if names[-1] == "" else names
    return [name.strip("\"'") for name in text.split()]


def layout(names: Sequence[str]) -> Layout | str:
    """Find a pose's columns by their names; where that fails, say what is missing.

    Examples
    --------
    >>> layout("stamp_ns x y z qx qy qz qw id".split())
    Layout(time=(0,), pose=(1, 2, 3, 7, 4, 5, 6), unit='ns')
    >>> layout("time,x,y,z,roll,pitch,yaw".split(","))
    'no column qw, qx, qy, qz'
    """
    found: dict[str, list[int]] = {}
    for k, name in enumerate(names):
        found.setdefault(role(name), []).append(k)
    times = [(k, *_stem(names[k])) for k in found.get("time", [])]
    missing = [one for one in POSE if one not in found]
    if not times or missing:
        return f"no column {', '.join((['time'] if not times else []) + missing)}"
    for one in POSE:
        if len(found[one]) > 1:
            a, b = (names[k] for k in found[one][:2])
            return f"two columns could be {one}: {a} and {b}"
    which, unit = _time(times)
    return Layout(which, tuple(found[one][0] for one in POSE), unit)


def _time(times: list[tuple[int, str, str | None]]) -> tuple[tuple[int, ...], str | None]:
    """The column of the time: a message's stamp before a recorder's time; seconds with nanoseconds as two."""
    stamps = [row for row in times if row[1].endswith("stamp")] or times
    column, stem, unit = stamps[0]
    for other, its_stem, its_unit in stamps[1:]:
        if its_stem == stem and (unit, its_unit) == ("s", "ns"):
            return (column, other), "s"
    return (column,), unit


def _stem(name: str) -> tuple[str, str | None]:
    """A name in small letters without its unit, words parted by ``_``; and the unit, if it is one of time."""
    name = name.lower()
    unit = next((_SPELT[word] for word in _BRACKET.findall(name) if word in _SPELT), None)
    words = [word for word in re.split(r"[^a-z0-9µ]+", _BRACKET.sub("", name)) if word]
    if len(words) > 1 and words[-1] in _SPELT:
        unit, words = unit or _SPELT[words[-1]], words[:-1]
    if len(words) > 1 and words[-1] in _METRES:
        words = words[:-1]
    return "_".join(words), unit


def role(name: str) -> str:
    """Return what a column is: "time", one of ``POSE``, or "" for anything else.

    Examples
    --------
    >>> [role(name) for name in ("p_RS_R_x [m]", "v_RS_R_x", "orientation.w", "stamp_ns")]
    ['tx', '', 'qw', 'time']
    """
    stem, _ = _stem(name)
    if _TIME.fullmatch(stem):
        return "time"
    *before, last = stem.split("_")
    short = re.fullmatch(r"(t|p|pos|q|quat)?([wxyz])", last)
    if not short:
        return ""
    kind = next((word for word in before if word in _POSITION | _QUATERNION | _OTHER), short[1])
    if kind in _OTHER:
        return ""
    axis = short[2]
    if kind in _QUATERNION or short[1] in ("q", "quat") or axis == "w":
        return f"q{axis}"
    return f"t{axis}"
