"""Makers of small inputs for the commands: worlds of the library, written in foreign formats.

A maker is ``make(folder, rng) -> Made``: it writes its files into a new folder.  The same generator gives the
same bytes.  What is true stands beside the files, in the format's own way where it has one, and in
``truth.json``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

KINDS = {
    "robot": "a vehicle log: odometry, sightings of landmarks, true poses (MRCLAM)",
    "laser": "a laser log in an office where people walk, true poses (CARMEN)",
    "bal": "a bundle adjustment problem and its true scene (BAL)",
    "colmap": "a reconstruction and its true scene (COLMAP, text)",
    "boards": "pictures of a checkerboard by a radtan and a FOV camera, and both cameras",
    "trajectory": "an estimated and a true trajectory (TUM)",
    "adapter": "a program that answers conformance vectors (Python), and others to start from",
    "video": "a rendered film of a desk, its camera and its true path (PNG, AVI, TUM)",
    "posegraph": "pose graphs of a robot's rounds, one with false loops, and their true poses (g2o)",
}
"""Name -> what it is.  The place in this table is part of a kind's seed: new kinds go to the end."""


class Made(NamedTuple):
    """What a maker says of its files.

    Attributes
    ----------
    readme : str
        Paragraphs: format, what is true.
    commands : tuple of str
        Command lines to try, where the folder of all samples is called ``samples``.
    truth : mapping
        True values, as JSON has them.
    """

    readme: str
    commands: tuple[str, ...]
    truth: Mapping[str, Any]
