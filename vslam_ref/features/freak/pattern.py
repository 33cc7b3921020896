"""Where the 43 receptive fields lie, how wide they are, and which 45 pairs tell the direction.

All lengths are pixels at scale 1.  What the paper fixes: 43 fields, sizes that grow exponentially outwards
and overlap, 45 pairs that are symmetric about the centre.  What it leaves open is chosen here:

* 43 = 7 rings of 6 fields and the middle, as its figure shows them;
* reach 22: the whole pattern stays within 22 pixels of the centre, a patch of 45 x 45;
* a field's box reaches half its ring's radius to each side, so that fields of one ring touch and those of two
  neighbouring rings overlap; the middle one is as wide as those of the innermost ring;
* ring radii have the ratio sqrt(2): the outermost is eight times the innermost;
* every second ring is turned by 30 degrees, so that its fields lie between those of the next;
* of the 45 pairs, 21 join opposite fields of one ring, and 24 join fields of the four outermost rings that
  are two steps apart: each set goes into itself when the pattern turns by 60 degrees.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array, IntArray

RINGS, ON_RING = 7, 6
REACH = 22.0
RATIO = np.sqrt(2.0)
WIDTH = 0.5
"""Half a side of a field's box over its ring's radius."""
WITH_OBLIQUE = 4
"""Rings, from the outermost, whose fields are also paired at two steps."""


def _fields() -> tuple[Array, Array]:
    """Centres (43, 2) and half sides (43,), pixels at scale 1, from the outermost ring to the middle."""
    radius = REACH / (1 + WIDTH) / RATIO ** np.arange(RINGS)
    turn = np.pi / ON_RING * (np.arange(RINGS) % 2)
    angle = turn[:, None] + 2 * np.pi / ON_RING * np.arange(ON_RING)  # (7, 6)
    ring = radius[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
    half = np.append(np.repeat(WIDTH * radius, ON_RING), WIDTH * radius[-1])
    return np.concatenate([ring.reshape(-1, 2), np.zeros((1, 2))]), half


def _symmetric() -> IntArray:
    """45 pairs (i, j) of fields of one ring."""
    found = []
    for first in range(0, RINGS * ON_RING, ON_RING):
        found += [(first + k, first + k + 3) for k in range(3)]
        if first < WITH_OBLIQUE * ON_RING:
            found += [(first + k, first + (k + 2) % ON_RING) for k in range(ON_RING)]
    return np.array(found, np.int64)


CENTRE, HALF = _fields()
"""Centres (43, 2), x to the right and y down, and half sides (43,) of the boxes, pixels at scale 1."""
SYMMETRIC = _symmetric()
"""Pairs (45, 2) of fields whose differences give the direction."""


def _weights() -> Array:
    """Weight (43, 2) of each field's mean in the direction: the sum over pairs, field by field."""
    apart = CENTRE[SYMMETRIC[:, 0]] - CENTRE[SYMMETRIC[:, 1]]
    unit = apart / np.linalg.norm(apart, axis=1, keepdims=True)
    weight = np.zeros_like(CENTRE)
    np.add.at(weight, SYMMETRIC[:, 0], unit / len(SYMMETRIC))
    np.add.at(weight, SYMMETRIC[:, 1], -unit / len(SYMMETRIC))
    return weight


WEIGHT = _weights()
