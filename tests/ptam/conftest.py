"""A desk seen by a camera in a hand, small, and what the system makes of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera
from vslam_ref.systems.ptam import Outcome, Ptam
from vslam_ref.worlds.rendered import scene

Bytes = NDArray[np.uint8]
FRAMES, EVERY = 45, 4


class Film(NamedTuple):
    """Pictures, the camera, true poses (K, 4, 4)."""

    pictures: list[Bytes]
    camera: Camera
    T_cam_world: Array


class Run(NamedTuple):
    """The system after a film, and what it said of each picture."""

    system: Ptam
    outcomes: list[Outcome]


def run(film: Film, pictures: list[Bytes] | None = None) -> Run:
    """Show pictures, by default the film's, one after the other."""
    system = Ptam(film.camera)
    outcomes = [system.step(k, grey) for k, grey in enumerate(pictures or film.pictures)]
    system.finish()
    return Run(system, outcomes)


@pytest.fixture(scope="session")
def film() -> Film:
    """Six seconds over a desk, every fourth picture, 320 x 240."""
    world = scene("desk", 3, size=(320, 240), frames=EVERY * FRAMES)
    numbers = range(0, EVERY * FRAMES, EVERY)
    return Film([world.frame(k) for k in numbers], world.camera, world.T_cam_world[::EVERY])


@pytest.fixture(scope="session")
def desk(film: Film) -> Run:
    """The run over it."""
    return run(film)
