"""Pictures on which one part of PTAM matters each: a turned view, a mover, a lamp, and wallpaper.

========= ================================================================ =======================
input     what makes it hard                                               part that should help
========= ================================================================ =======================
turned    the camera rolls by 150 degrees while it moves                    warp of the templates
mover     a textured thing slides through a quarter of the picture          Tukey's loss
lamp      the exposure goes from 0.4 to 1.6 times the usual one             relative limit of a score
wallpaper a room papered with one small pattern, over and over              search back
========= ================================================================ =======================
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.datasets.pictures import Picture
from vslam_ref.datasets.sequences import Sequence
from vslam_ref.geometry import se3
from vslam_ref.worlds.rendered import Effects, RenderedScene, motion, painting, scene
from vslam_ref.worlds.rendered.corridor import add_level
from vslam_ref.worlds.rendered.desk import Builder
from vslam_ref.worlds.rendered.quads import joined, quad
from vslam_ref.worlds.rendered.textures import Bytes, pack

RATE = 30.0
QUIET = 60
"""Pictures before the trouble begins: there is a map by then."""
ROLL, ROLLING = 120.0, 24
"""Degrees, and the pictures in which the camera rolls by them: a quick turn of the wrist."""
LAMP = -0.85
"""Share by which the exposure changes: first down to a seventh, then up."""
MOVER = (240, 320)
"""Height and width, pixels: a quarter of the picture."""
PATTERN = 24
"""Texels: side of the wallpaper's pattern."""


def turned(seed: int, pictures: int, noise: float) -> RenderedScene:
    """Over the desk; from the third second on the camera also rolls."""
    made = scene("desk", seed, frames=pictures, effects=Effects(noise=noise))
    own, begin, end = made.path, QUIET / RATE, (QUIET + ROLLING) / RATE

    def path(t: Array) -> Array:
        s = np.clip((np.asarray(t) - begin) / (end - begin), 0.0, 1.0)
        turn = np.zeros((*np.shape(s), 6))
        turn[..., 5] = np.radians(ROLL) * s**2 * (3 - 2 * s)
        return se3.exp(turn) @ own(t)

    return replace(made, path=path)


def lamp(seed: int, pictures: int, noise: float) -> RenderedScene:
    """Over the desk, while the exposure changes much."""
    return scene("desk", seed, frames=pictures, effects=Effects(noise=noise, exposure=LAMP))


def wallpaper(seed: int, pictures: int, noise: float) -> RenderedScene:
    """A corner papered with one pattern, with a few pictures on the walls, and a walk along it."""
    rng = np.random.default_rng(seed)
    b = Builder(rng)
    tile = painting.shapes(rng, (PATTERN, PATTERN), 14, (3.0, 12.0), (40.0, 220.0), 130.0)

    def paper(r: np.random.Generator, shape: tuple[int, int]) -> Bytes:
        times = (shape[0] // PATTERN + 1, shape[1] // PATTERN + 1)
        return painting.finished(np.tile(tile, times)[: shape[0], : shape[1]])

    image = b.texture(paper, 4.0, 2.6, 0.0035)
    b.parts.append(quad([-2.0, 2.0, 2.6], [4.0, 0, 0], [0, 0, -2.6], image, 0.95))
    b.parts.append(quad([-2.0, -2.0, 2.6], [0, 4.0, 0], [0, 0, -2.6], image, 0.8))
    for x, z in ((-1.2, 1.9), (0.1, 1.2), (1.1, 1.8)):
        poster = b.texture(painting.poster, 0.4, 0.3, 0.002)
        b.parts.append(quad([x, 1.99, z], [0.4, 0, 0], [0, 0, -0.3], poster, 0.95))
    add_level(b, [-2.0, -2.0], [4.0, 4.0])
    model = scene("rotation", seed, frames=pictures, effects=Effects(noise=noise))
    shake = motion.tremor(rng, [0.004, 0.004, 0.004, 0.006, 0.006, 0.006])
    seconds = pictures / RATE
    first, last = np.array([0.6, -0.4, 1.4]), np.array([-0.1, 0.1, 1.5])

    def smooth(t: Array) -> Array:
        place = first + (np.asarray(t)[..., None] / seconds) * (last - first)
        return motion.looking(place, place + np.array([-0.6, 0.9, -0.05]))

    return replace(model, quads=joined(b.parts), textures=pack(b.images), path=motion.held(smooth, shake))


def slid_over(made: RenderedScene, seed: int) -> Callable[[int], NDArray[np.uint8]]:
    """Pictures of a scene, over which a piece of another picture slides to and fro."""
    height, width = MOVER
    piece = scene("desk", seed + 1, frames=1).frame(0)[120 : 120 + height, 160 : 160 + width]

    def frame(k: int) -> NDArray[np.uint8]:
        grey = made.frame(k)
        if k >= QUIET:
            x = round(160 + 150 * np.sin(2 * np.pi * (k - QUIET) / 70.0))
            y = round(120 + 80 * np.sin(2 * np.pi * (k - QUIET) / 90.0))
            grey[y : y + height, x : x + width] = piece
        return grey

    return frame


INPUTS = ("turned", "mover", "lamp", "wallpaper")


def pictures_of(name: str, seed: int, pictures: int, noise: float) -> Sequence:
    """One input as a sequence with camera and truth."""
    makers = {"turned": turned, "lamp": lamp, "wallpaper": wallpaper}
    if name == "mover":
        made = scene("desk", seed, frames=pictures, effects=Effects(noise=noise))
        frame = slid_over(made, seed)
    else:
        made = makers[name](seed, pictures, noise)
        frame = made.frame
    return replace(as_sequence(name, made), picture=lambda k: Picture(frame(k)))


def as_sequence(name: str, made: RenderedScene) -> Sequence:
    """A scene as a sequence with camera and truth."""
    return Sequence(
        name=name,
        layout="rendered",
        size=made.size,
        times=made.times,
        numbers=np.arange(len(made)),
        picture=lambda k: Picture(made.frame(k)),
        camera=made.camera,
        truth=made.trajectory(),
    )
