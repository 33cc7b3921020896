"""What a pixel of a ROS map says about its cell: the rule of ``map_server``, of ROS 1 and 2.

The mean of a pixel's colours is its grey g; it is occupied with p = (255 - g) / 255, or g / 255 with
``negate: 1``.  Then

========  ===============================================================================================
mode      a cell is
========  ===============================================================================================
trinary   occupied where p > occupied_thresh, free where p < free_thresh, else unknown; an opacity counts
          as one more colour
scale     unknown where the pixel is transparent, even a little; occupied and free as above; else occupied
          with (p - free_thresh) / (occupied_thresh - free_thresh), in whole per cent
raw       occupied with g per cent where g is at most 100, else unknown
========  ===============================================================================================

``map_saver`` writes 0 for occupied, 254 for free and 205 for unknown: p = 0.19608, which is unknown with its
free_thresh of 0.196, and free with 0.25.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.pictures import Channels
from vslam_ref.datasets.yaml_nodes import Node

MODES = {"trinary": "trinary", "scale": "scale", "raw": "raw"}
NO, YES = ("0", "false", "no", "off", "n"), ("1", "true", "yes", "on", "y")
NEGATE = dict.fromkeys(NO, False) | dict.fromkeys(YES, True)
SAVED_FREE, SAVED_UNKNOWN = 254, 205
"""Greys of map_saver."""


class MapRule(NamedTuple):
    """How pixels become cells: the mode, whether white is occupied, and the thresholds of p."""

    mode: str
    negate: bool
    occupied: float
    free: float


def read_rule(top: Node) -> MapRule:
    """The rule that a map's YAML states.

    Raises
    ------
    FormatError
        On a missing key or a wrong value; thresholds need not be there in the mode raw.
    """
    entries = top.items()
    mode = entries["mode"].choice(MODES) if "mode" in entries else "trinary"
    negate = top.get("negate").choice(NEGATE)
    if mode == "raw":
        return MapRule(mode, negate, 1.0, 0.0)
    occupied, free = _threshold(top.get("occupied_thresh")), _threshold(top.get("free_thresh"))
    if not free < occupied:
        what = f"free_thresh is {free:g}, occupied_thresh {occupied:g}; expected the first below the second"
        raise top.get("free_thresh").error(what)
    return MapRule(mode, negate, occupied, free)


def _threshold(node: Node) -> float:
    value = node.number()
    if 1 < value <= 100:
        raise node.error(f"{node.name} is {value:g}; expected a probability: {value / 100:g} for {value:g} %")
    if not 0 <= value <= 1:
        raise node.error(f"{node.name} is {value:g}; expected a probability, 0 to 1")
    return value


def cells_of(picture: Channels, rule: MapRule) -> tuple[Array, tuple[str, ...]]:
    """Probability of each pixel's cell (H, W), first row on top, and what is to be told.

    Parameters
    ----------
    picture : Channels
        Colours (H, W, n), 0 to 255, and opacity.
    rule : MapRule
        Thresholds are probabilities.
    """
    grey = picture.colours.mean(axis=-1)
    if rule.mode == "raw":
        return _raw_cells(grey, rule)
    if rule.mode == "trinary" and picture.opacity is not None:
        count = 3  # map_server sees three colours also where all are the same
        grey = (count * grey + picture.opacity) / (count + 1)
    p = grey / 255.0 if rule.negate else (255.0 - grey) / 255.0
    occupied, free = p > rule.occupied, p < rule.free
    share = np.rint(100.0 * (p - rule.free) / (rule.occupied - rule.free)) / 100.0
    between = share if rule.mode == "scale" else np.full(p.shape, 0.5)
    cells = np.where(occupied, 1.0, np.where(free, 0.0, between))
    if rule.mode == "scale" and picture.opacity is not None:
        cells = np.where(picture.opacity < 255.0, 0.5, cells)
    return cells, _saved_as_unknown(grey, free, rule)


def _raw_cells(grey: Array, rule: MapRule) -> tuple[Array, tuple[str, ...]]:
    """Greys are per cent; ROS 1 negates them first if it is asked to, ROS 2 does not look at it."""
    per_cent = np.rint(255.0 - grey if rule.negate else grey)
    told = "raw with negate: 1: read as 255 - grey, as in ROS 1; ROS 2 takes the grey itself"
    return np.where(per_cent <= 100, per_cent / 100.0, 0.5), (told,) if rule.negate else ()


def _saved_as_unknown(grey: Array, free: Array, rule: MapRule) -> tuple[str, ...]:
    """A note where the threshold makes map_saver's unknown cells free."""
    odd = free & (grey == SAVED_UNKNOWN)
    if rule.mode != "trinary" or not odd.any() or not (grey == SAVED_FREE).any():
        return ()
    what = f"{int(odd.sum())} pixels of grey 205, which map_saver writes for unknown, are free"
    return (f"{what} by free_thresh {rule.free:g}; 0.196 keeps them unknown",)


def graded_cells(picture: Channels, rule: MapRule) -> tuple[Array, tuple[str, ...]]:
    """Every grey as a probability, (H, W); colours 0 to 255."""
    grey = picture.colours.mean(axis=-1)
    return grey / 255.0 if rule.negate else (255.0 - grey) / 255.0, ()
