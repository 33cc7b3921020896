"""Scenes: the same bytes for a seed, exact tracks, corners that stay where they are projected, sane paths."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from vslam_ref.features import corners
from vslam_ref.features.levels import pyramid
from vslam_ref.geometry import se3
from vslam_ref.support.errors import InputError
from vslam_ref.worlds.rendered import (
    NAMES,
    Effects,
    RenderedScene,
    hall,
    motion,
    painting,
    pinhole,
    raster,
    scene,
    wide,
)
from vslam_ref.worlds.rendered.rotation import ARM

SMALL = (160, 120)


@pytest.fixture(scope="module")
def made() -> dict[str, RenderedScene]:
    """Every scene, with small pictures."""
    made = {name: scene(name, size=SMALL) for name in NAMES if name != "hall-ahead"}
    ahead = hall.path_ahead(np.random.default_rng(0))
    return made | {"hall-ahead": replace(made["hall"], name="hall-ahead", path=ahead)}


# --- bytes


def test_the_same_seed_gives_the_same_bytes_in_any_order(made: dict[str, RenderedScene]) -> None:
    effects = Effects(noise=3.0, exposure=0.3)
    once = scene("rotation", size=SMALL, frames=20, effects=effects)
    again = replace(made["rotation"], effects=effects)
    assert once.textures.texels.tobytes() == again.textures.texels.tobytes()
    pictures = {k: once.frame(k).tobytes() for k in (3, 19, 0)}
    assert all(again.frame(k).tobytes() == pictures[k] for k in (0, 3, 19))
    np.testing.assert_array_equal(once.T_cam_world, again.T_cam_world[:20])
    other = scene("rotation", 6, size=SMALL, frames=1)
    assert other.frame(0).tobytes() != made["rotation"].frame(0).tobytes()


def test_wrong_arguments_are_told() -> None:
    with pytest.raises(
        InputError, match=r"unknown scene 'desc' \(did you mean 'desk'\?\); known: desk, corridor"
    ):
        scene("desc")
    for wrong in ({"seed": -1}, {"size": (640, 8)}):
        with pytest.raises(ValueError, match="need a seed of at least 0, and at least 16 pixels"):
            scene("rotation", **wrong)  # type: ignore[arg-type]
    for frames in (0, 301):
        with pytest.raises(ValueError, match=f"{frames} pictures of rotation: need 1 to 300"):
            scene("rotation", frames=frames)


def test_a_picture_that_is_not_there(made: dict[str, RenderedScene]) -> None:
    for k in (-1, 300):
        with pytest.raises(IndexError, match=f"picture {k} of rotation: has 0 to 299"):
            made["rotation"].frame(k)


# --- paths


@pytest.mark.parametrize("name", NAMES)
def test_a_path_is_that_of_a_person_and_meets_nothing(made: dict[str, RenderedScene], name: str) -> None:
    """No step of more than 6 cm or 3 degrees at 30 Hz; nothing nearer than 15 cm, nothing missing."""
    s = made[name]
    T = s.T_cam_world
    R = T[:, :3, :3]
    np.testing.assert_allclose(np.swapaxes(R, 1, 2) @ R, np.broadcast_to(np.eye(3), R.shape), atol=1e-13)
    step = se3.log(T[1:] @ se3.inverse(T[:-1]))
    place = s.trajectory().t_world_body
    assert np.linalg.norm(np.diff(place, axis=0), axis=1).max() < 0.06
    assert np.degrees(np.linalg.norm(step[:, 3:], axis=1)).max() < 3.0
    np.testing.assert_allclose(s.times, np.arange(len(s)) / 30, rtol=1e-15)
    for k in range(0, len(s), len(s) // 12):
        depth = s.depth(k)
        assert np.isfinite(depth).all(), k
        assert depth.min() > 0.15, k


def test_what_the_paths_are_for(made: dict[str, RenderedScene]) -> None:
    place = {name: made[name].trajectory().t_world_body for name in NAMES}
    length = {name: np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for name, p in place.items()}
    heading = made["corridor"].trajectory().R_world_body[:, :, 2]
    assert len(made["desk"]) == 600
    assert 2.5 < length["desk"] < 6
    assert np.linalg.norm(place["desk"][-1] - place["desk"][0]) < 0.1  # back at the start
    assert 20 < length["corridor"] < 25
    turn = np.degrees(np.arctan2(heading[-30:, 1].mean(), heading[-30:, 0].mean()))
    assert 70 < turn < 110  # around one bend
    assert np.ptp(place["rotation"], axis=0).max() <= 2 * ARM
    looks = made["rotation"].trajectory().R_world_body[:, :, 2]
    assert np.degrees(np.arccos(np.clip(looks @ looks[0], -1, 1))).max() > 60
    around = np.linalg.norm(place["building"] - place["building"][0], axis=1)
    assert around[300:900].max() > 14
    assert around[1000:].min() < 0.15  # the loop is closed


def test_looking_puts_the_target_into_the_middle() -> None:
    rng = np.random.default_rng(0)
    eye, target = rng.normal(0, 1, (2, 20, 3))
    T = motion.looking(eye, target)
    ahead = se3.act(T, target)
    distance = np.linalg.norm(target - eye, axis=1)
    np.testing.assert_allclose(ahead, np.stack([0 * distance, 0 * distance, distance], -1), atol=1e-14)
    above = se3.act(T, target + [0.0, 0.0, 0.1])
    assert (above[:, 1] < ahead[:, 1]).all()
    np.testing.assert_allclose(above[:, 0], 0, atol=1e-14)  # upright


def test_a_tremor_has_the_size_that_was_asked_for() -> None:
    """Mean over 1000 s of sines of 0.4 to 4 Hz: ends of periods leave 1 / (2 pi 0.4 1000) of each."""
    shake = motion.tremor(np.random.default_rng(2), [0.01, 0.5])
    t = np.arange(0, 1000, 0.01)
    values = shake(t)
    assert values.shape == (len(t), 2)
    np.testing.assert_allclose(values.std(0), [0.01, 0.5], rtol=0.01)
    assert np.abs(values.mean(0) / [0.01, 0.5]).max() < 0.01


# --- truth against the pictures


@pytest.mark.parametrize("lens", ["pinhole", "fov"])
def test_tracks_agree_with_depths_and_surface(made: dict[str, RenderedScene], lens: str) -> None:
    """What a pixel sees is projected to it; a point is visible where its depth is that of the picture.

    A picture has the depths of pixels' centres, so points within 2 px of a border are left out.
    """
    s = made["desk"]
    s = replace(s, times=s.times[:120], camera=wide("desk", SMALL) if lens == "fov" else s.camera)
    rng = np.random.default_rng(0)
    uv = rng.uniform([0, 0], np.array(SMALL) - 1.0, (60, 2))
    X = s.surface(50, uv)
    tracks = s.tracks(X)
    assert tracks.uv.shape == (120, 60, 2)
    assert np.abs(tracks.uv[50] - uv).max() < 1e-9
    assert tracks.visible[50].all()
    checked = 0
    for k in (0, 80, 119):
        depth = s.depth(k)
        z = se3.act(s.T_cam_world[k], X)[:, 2]
        for n in range(60):
            u, v = tracks.uv[k, n]
            i, j = round(v), round(u)
            around = depth[max(i - 2, 0) : i + 3, max(j - 2, 0) : j + 3]
            if not (2 <= i < SMALL[1] - 2 and 2 <= j < SMALL[0] - 2) or np.ptp(around) > 0.05 * z[n]:
                continue
            assert tracks.visible[k, n] == (abs(depth[i, j] / z[n] - 1) < 0.05)
            checked += 1
        gone = (tracks.uv[k] < -0.5).any(-1) | (tracks.uv[k] >= np.array(SMALL) - 0.5).any(-1)
        assert not tracks.visible[k, gone].any()
    assert checked > 80


def test_a_point_behind_a_thing_is_hidden(made: dict[str, RenderedScene]) -> None:
    s = made["desk"]
    s = replace(s, times=s.times[:2])
    X = s.surface(0, np.array([[80.0, 60.0], [40.0, 80.0]]))
    centre = s.trajectory().t_world_body[0]
    behind = centre + 1.2 * (X - centre)
    before = centre + 0.8 * (X - centre)
    assert s.tracks(X).visible[0].all()
    assert not s.tracks(behind).visible[0].any()
    assert s.tracks(before).visible[0].all()


@pytest.mark.parametrize(
    ("name", "lens"), [("desk", "pinhole"), ("desk", "fov"), ("corridor", "pinhole"), ("hall", "pinhole")]
)
def test_corners_stay_where_their_points_are_projected(
    made: dict[str, RenderedScene], name: str, lens: str
) -> None:
    """OpenCV follows corners of picture 30 into pictures up to 6 later, from their exact projections.

    Patches of 15 x 15 pixels on planes: over so few pictures their shape changes by some percent, so the
    summit of the match stays within 0.1 px for most.  Aliasing moves corners by half a pixel, as does a shift
    of half a pixel anywhere between texels and pixels.
    """
    size = (320, 240)
    camera = wide(name, size) if lens == "fov" else pinhole(name, size)
    s = replace(made[name], size=size, camera=camera, times=made[name].times[:37])
    first = s.frame(30)
    at = raster.placed(s.quads, s.textures, s.T_cam_world[30], s.rays.span)
    quad, _ = raster.nearest(s.rays.xn, *at)
    found = cv2.goodFeaturesToTrack(first, 150, 0.02, 8).reshape(-1, 2).astype(np.float64)
    found = found[((found > 12) & (found < np.array(size) - 12)).all(1)]
    u, v = found.astype(int).T
    around = np.stack([quad[v + dv, u + du] for dv in (-6, 0, 7) for du in (-6, 0, 7)])
    found = found[np.ptp(around, axis=0) == 0]  # on one surface
    tracks = s.tracks(s.surface(30, found))
    errors = []
    for k in (31, 36):
        uv = tracks.uv[k]
        near = tracks.visible[k] & ((uv > 9) & (uv < np.array(size) - 9)).all(1)
        moved, status, _ = cv2.calcOpticalFlowPyrLK(
            first, s.frame(k), np.float32(found)[:, None].copy(), np.float32(uv)[:, None].copy(),
            winSize=(15, 15), maxLevel=0, flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )  # fmt: skip
        good = near & (status.ravel() == 1)
        errors.append((moved.reshape(-1, 2) - uv)[good])
        assert good.sum() > 25
    distance = np.linalg.norm(np.concatenate(errors), axis=1)
    assert np.median(distance) < 0.1
    assert np.quantile(distance, 0.9) < 0.4
    assert np.abs(np.median(np.concatenate(errors), axis=0)).max() < 0.05  # no shift of all


@pytest.mark.parametrize("name", NAMES)
def test_there_are_corners_at_every_level(made: dict[str, RenderedScene], name: str) -> None:
    """At 320 x 240 the four levels are 320 to 40 pixels wide: some in each, in each of several pictures."""
    s = replace(made[name], size=(320, 240), camera=pinhole(name, (320, 240)))
    for k in np.linspace(0, len(s) - 1, 4).astype(int):
        counts = [len(corners.detect(level, 10).xy) for level in pyramid(s.frame(int(k)))]
        assert np.all(np.array(counts) >= [60, 30, 8, 2]), (k, counts)


# --- effects


def test_effects_do_what_they_say(made: dict[str, RenderedScene]) -> None:
    """Noise: the standard deviation of 15,000 draws is known to 0.6 %, rounding adds 1/12; 5 deviations."""
    plain = made["desk"]
    sharp = plain.light(20)
    noisy = replace(plain, effects=Effects(noise=4.0))
    inner = (sharp > 30) & (sharp < 225)
    difference = (noisy.frame(20) - sharp)[inner]
    assert inner.sum() > 12_000
    assert difference.std() == pytest.approx(np.sqrt(16 + 1 / 12), rel=5 * 0.0065)
    assert abs(difference.mean()) < 5 * 4 / np.sqrt(inner.sum())
    bright = replace(plain, effects=Effects(exposure=0.3))
    assert bright.gain(52) == pytest.approx(1.3, abs=0.001)  # a quarter of 7 s
    np.testing.assert_allclose(bright.light(52), bright.gain(52) * plain.light(52), rtol=1e-12)
    assert bright.frame(52).max() == 255  # the sensor's limit


def test_a_shutter_takes_the_mean_along_the_path(made: dict[str, RenderedScene]) -> None:
    """Long open, it blurs: less contrast along the motion, the same mean."""
    plain = made["desk"]
    slow = replace(plain, effects=Effects(shutter=0.3, blur_samples=4))
    sharp, blurred = plain.light(30), slow.light(30)
    assert np.abs(np.diff(blurred)).mean() < 0.8 * np.abs(np.diff(sharp)).mean()
    assert blurred.mean() == pytest.approx(sharp.mean(), rel=0.02)
    still = replace(plain, effects=Effects(shutter=1e-9, blur_samples=2))
    assert np.abs(still.light(30) - sharp).max() < 0.01


# --- surfaces


@pytest.mark.parametrize(
    "paint",
    [
        *["wood", "page", "cover", "poster", "keys", "screen", "card", "spines", "door"],
        ("tiles", 20),
        ("speckled", 120.0, 40.0),
    ],
    ids=str,
)
@pytest.mark.parametrize("shape", [(64, 64), (64, 320), (320, 64), (256, 192)])
def test_every_surface_can_be_painted_in_every_shape(paint: Any, shape: tuple[int, int]) -> None:
    name, *more = (paint,) if isinstance(paint, str) else paint

    def draw() -> np.ndarray:
        drawn: np.ndarray = getattr(painting, name)(np.random.default_rng(0), shape, *more)
        return drawn

    drawn = draw()
    assert drawn.dtype == np.uint8
    assert drawn.shape == shape
    assert drawn.std() > 4
    np.testing.assert_array_equal(draw(), drawn)
