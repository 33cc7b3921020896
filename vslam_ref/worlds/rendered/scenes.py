"""The scenes by their names."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole
from vslam_ref.support.errors import InputError, suggestion
from vslam_ref.worlds.rendered import building, corridor, desk, hall, people, rotation
from vslam_ref.worlds.rendered.motion import Path
from vslam_ref.worlds.rendered.quads import Built
from vslam_ref.worlds.rendered.record import EXACT, Effects, RenderedScene
from vslam_ref.worlds.rendered.textures import pack

SIZE = (640, 480)
RATE = 30.0
"""Pictures a second."""


class Recipe(NamedTuple):
    """How a scene is made.

    Things, path, how long it is (seconds), and the focal length over the width; whose things they are, if
    another scene's; and for a vehicle that carries the camera, its poses (..., 3) at times (...), seconds.
    """

    build: Callable[[np.random.Generator], Built]
    path: Callable[[np.random.Generator], Path]
    seconds: float
    focal: float
    things_of: str = ""
    vehicle: Callable[[ArrayLike], Array] | None = None


RECIPES = {
    "desk": Recipe(desk.build, desk.path, desk.SECONDS, 0.8),
    "corridor": Recipe(corridor.build, corridor.path, corridor.SECONDS, 0.62),
    "rotation": Recipe(rotation.build, rotation.path, rotation.SECONDS, 0.8),
    "building": Recipe(building.build, building.path, building.SECONDS, 0.62),
    "hall": Recipe(hall.build, hall.path_right, hall.SECONDS, hall.FOCAL, "", hall.vehicle_at),
    "hall-ahead": Recipe(hall.build, hall.path_ahead, hall.SECONDS, hall.FOCAL, "hall", hall.vehicle_at),
}
NAMES = tuple(RECIPES)


def pinhole(name: str, size: tuple[int, int] = SIZE) -> Pinhole:
    """The scene's own camera for pictures of ``size`` (W, H), pixels: no lens, centre in the middle."""
    f = RECIPES[name].focal * size[0]
    return Pinhole(f, f, (size[0] - 1) / 2, (size[1] - 1) / 2)


def wide(name: str, size: tuple[int, int] = SIZE, omega: float = 0.9) -> Fov:
    """The scene's camera with an FOV lens of ``omega`` radians for pictures of ``size`` (W, H), pixels."""
    f = RECIPES[name].focal * size[0]
    return Fov(0.9 * f, 0.9 * f, (size[0] - 1) / 2, (size[1] - 1) / 2, omega)


def scene(
    name: str,
    seed: int = 1,
    *,
    camera: Camera | None = None,
    size: tuple[int, int] = SIZE,
    frames: int | None = None,
    effects: Effects = EXACT,
    passers_by: int = 0,
) -> RenderedScene:
    """Make a scene.

    Parameters
    ----------
    name : {"desk", "corridor", "rotation", "building", "hall", "hall-ahead"}
    seed : int
        Root of all randomness: textures, places of things, the path, noise.
    camera : Camera, optional
        By default the scene's own pinhole.
    size : (int, int)
        Width and height of the pictures, pixels.
    frames : int, optional
        Only the first pictures of the path; by default all, at 30 Hz.
    effects : Effects
        By default none: the pictures are exact.
    passers_by : int
        How many people walk through the hall, 0 to 99; nothing else changes with them.

    Raises
    ------
    InputError
        If there is no such scene.
    ValueError
        If a number is out of range, or the camera does not see ahead in every pixel.

    Examples
    --------
    >>> made = scene("rotation", frames=2, size=(64, 48))
    >>> made.frame(1).shape, made.T_cam_world.shape, made.times.round(4).tolist()
    ((48, 64), (2, 4, 4), [0.0, 0.0333])
    """
    if name not in RECIPES:
        raise InputError(f"unknown scene {name!r}{suggestion(name, NAMES)}; known: {', '.join(NAMES)}")
    if seed < 0 or min(size) < 16:
        raise ValueError(f"seed {seed}, size {size}: need a seed of at least 0, and at least 16 pixels")
    recipe = RECIPES[name]
    most = round(recipe.seconds * RATE)
    count = most if frames is None else frames
    if not 1 <= count <= most:
        raise ValueError(f"{count} pictures of {name}: need 1 to {most}")
    if not 0 <= passers_by <= (99 if recipe.vehicle else 0):
        raise ValueError(f"{passers_by} passers-by in {name}: need 0 to 99, in the hall, and 0 elsewhere")
    root = [seed, NAMES.index(recipe.things_of or name)]
    things, way, walk = (np.random.default_rng(s) for s in np.random.SeedSequence(root).spawn(3))
    quads, images, landmarks = recipe.build(things)
    walkers, cloth = people.walkers(walk, passers_by, len(images))
    return RenderedScene(
        name,
        quads,
        pack([*images, *cloth]),
        pinhole(name, size) if camera is None else camera,
        size,
        recipe.path(way),
        np.arange(count) / RATE,
        effects,
        seed,
        landmarks,
        people.crowd(walkers) if walkers else None,
        recipe.vehicle,
    )
