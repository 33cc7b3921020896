"""Rendered scenes as sequences: ``desk``, or ``desk:7`` with the seed 7."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import NamedTuple

from vslam_ref.arrays import Array
from vslam_ref.datasets.pictures import Picture
from vslam_ref.geometry.cameras import Camera
from vslam_ref.metrics.trajectory import Trajectory

NAMES: tuple[str, ...] = ()


class SceneSource(NamedTuple):
    """What a sequence needs of a scene."""

    size: tuple[int, int]
    times: Array
    camera: Camera
    truth: Trajectory
    picture: Callable[[int], Picture]


def is_scene(source: str) -> bool:
    """Whether a source is the name of a scene, with or without a seed."""
    return re.fullmatch(rf"({'|'.join(NAMES)})(:[0-9]{{1,9}})?", source) is not None if NAMES else False


def open_scene(source: str) -> SceneSource:
    """Return the scene of that name and seed."""
    raise NotImplementedError
