"""The hall: its course, its camera, its landmarks, and every picture against a slow ray caster of its own."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from caster import cast, point_grey, texture

from vslam_ref.worlds.rendered import Effects, RenderedScene, hall, motion, people, scene

SAMPLED = (0, 245, 300, 450, 1100, 1926, 2120, 2386)
PEOPLE = 10


@pytest.fixture(scope="module")
def busy() -> RenderedScene:
    return scene("hall", passers_by=PEOPLE)


@pytest.fixture(scope="module")
def right(busy: RenderedScene) -> RenderedScene:
    """The same hall without people, so it need not be built again: a test below compares the two."""
    return replace(busy, movers=None)


@pytest.fixture(scope="module")
def ahead(right: RenderedScene) -> RenderedScene:
    return replace(right, name="hall-ahead", path=hall.path_ahead(np.random.default_rng(0)))


def some_pixels(seed: int, count: int) -> np.ndarray:
    return np.random.default_rng(seed).integers([4, 4], [636, 476], (count, 2))


@pytest.mark.parametrize("k", [0, 300, 1400])
def test_depth_and_movers_are_those_of_the_ray_caster(busy: RenderedScene, k: int) -> None:
    """Both solve 3 x 3 systems of metres with condition below 1e4."""
    uv = some_pixels(k, 300)
    met = cast(busy, k, uv)
    depth, moving = busy.depth(k), busy.moving(k)
    np.testing.assert_allclose(depth[uv[:, 1], uv[:, 0]], [m.depth for m in met], rtol=1e-9)
    np.testing.assert_array_equal(moving[uv[:, 1], uv[:, 0]], [m.quad >= len(busy.quads.corner) for m in met])
    if k == 1400:
        assert 0.05 < moving.mean() < 0.5  # somebody is there


@pytest.mark.parametrize("k", [0, 300, 700])
def test_grey_values_are_those_of_the_ray_caster(right: RenderedScene, k: int) -> None:
    """Where a pixel's square covers no more than a texel, the picture has the finest level's value.

    Elsewhere it is a mean with weights >= 0 over what lies within 3 pixels (two levels below twice the
    patch's side, a texel to each side), so it lies between the extremes there; each level rounds by 1/2.
    """
    rng = np.random.default_rng(k)
    light, uv = right.light(k), some_pixels(k + 1, 70)
    near = np.array([(du, dv) for du in (-3, -1, 0, 1, 3) for dv in (-3, -1, 0, 1, 3)])
    fine, spread = [], []
    for pixel in uv:
        around = cast(right, k, pixel + near)
        if len({m.quad for m in around}) > 1:
            continue  # a border: its rays are checked by the depth
        middle = around[12]
        image = texture(right, int(right.quads.texture[middle.quad]))
        J = (np.array([around[17].share, around[13].share]) - middle.share) * image.shape[::-1]
        grey, drawn = point_grey(right, middle), light[pixel[1], pixel[0]]
        if np.linalg.norm(J, 2) < 0.97:  # differences over a pixel are derivatives to 3 %
            fine.append(drawn - grey)
            continue
        inside = pixel + rng.uniform(-3, 3, (60, 2))
        values = [point_grey(right, m) for m in cast(right, k, inside) if m.quad == middle.quad]
        values += [point_grey(right, m) for m in around]
        assert min(values) - 4 < drawn < max(values) + 4, (pixel, grey, drawn)
        spread.append(drawn - np.mean(values))
    assert len(fine) + len(spread) > 25
    if fine:
        assert np.abs(fine).max() < 1e-6
    assert abs(np.mean(spread)) < 5 * np.std(spread) / np.sqrt(len(spread)) + 0.5


def test_near_a_wall_grey_values_are_those_of_the_finest_level(right: RenderedScene) -> None:
    """From 1.9 m a pixel is half a texel wide, so one bilinear look-up is all; some ten operations on 255."""
    pose = motion.looking([1.9, -12.1, 1.4], [1.8, -14.0, 1.5])
    made = replace(right, path=lambda t: np.broadcast_to(pose, (*t.shape, 4, 4)), times=right.times[:1])
    light, uv, checked = made.light(0), some_pixels(7, 300), 0
    met = [cast(made, 0, pixel + [[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]]) for pixel in uv]
    for (u, v), around in zip(uv, met, strict=True):
        if len({m.quad for m in around}) == 1 and around[0].depth < 3.0:
            assert light[v, u] == pytest.approx(point_grey(made, around[0]), abs=1e-6)
            checked += 1
    assert checked > 150


@pytest.mark.parametrize("k", [100, 1400])
def test_what_hides_a_landmark_hides_it_from_the_ray_caster(busy: RenderedScene, k: int) -> None:
    track = busy.landmark_track(k)
    some = np.random.default_rng(k).permutation(len(track.ids))[:150]
    met = cast(busy, k, track.uv[some])
    T = busy.T_cam_world[k]
    depth = (busy.landmarks[track.ids[some]] @ T[:3, :3].T + T[:3, 3])[:, 2]
    free = np.array([m.depth > z * (1 - 1e-6) for m, z in zip(met, depth, strict=True)])
    np.testing.assert_array_equal(track.visible[some], free)
    assert 20 < free.sum() < len(some) - 10


# --- the course


def test_the_course_is_that_of_the_paper() -> None:
    """2387 pictures at 30 Hz, a lap of 79.6 s, one speed, a square of 20 m, closed to rounding."""
    at = hall.vehicle_at(np.arange(2389) / 30)
    assert hall.FRAMES == 2387
    assert hall.steps_of_lap() == 2388
    np.testing.assert_allclose(at[2388], at[0], atol=2388 * 20 * np.finfo(float).eps)
    step = np.linalg.norm(np.diff(at[:, :2], axis=0), axis=1)
    np.testing.assert_allclose(step, step[0], rtol=1e-10)
    assert 30 * step[0] == pytest.approx((80 - (8 - 2 * np.pi) * 2.5) / 79.6, rel=2e-3)  # its rounded length
    np.testing.assert_allclose(np.ptp(at[:, :2], axis=0), 20.0, atol=step[0])
    assert at[:, 1].min() == pytest.approx(-10.0, abs=1e-9)
    turn = np.diff(np.unwrap(at[:, 2]))
    assert turn.sum() == pytest.approx(2 * np.pi, abs=1e-9)
    assert turn.min() > -1e-12
    assert turn.max() == pytest.approx(step[0] / 2.5, rel=0.02)


def test_between_two_steps_it_has_gone_a_part_of_the_way() -> None:
    before, middle, after = hall.vehicle_at(np.array([300.0, 300.5, 301.0]) / 30)
    np.testing.assert_allclose(middle, (before + after) / 2, atol=1e-12)  # straight, or a turn after the way
    np.testing.assert_allclose(hall.vehicle_at(-1 / 30), hall.vehicle_at(2387 / 30), atol=1e-10)


@pytest.mark.parametrize(("name", "looks"), [("right", [0.0, -1.0]), ("ahead", [1.0, 0.0])])
def test_the_camera_stands_on_the_axle(request: pytest.FixtureRequest, name: str, looks: list[float]) -> None:
    made: RenderedScene = request.getfixturevalue(name)
    path, at = made.trajectory(), hall.vehicle_at(made.times)
    assert len(made) == 2387
    np.testing.assert_allclose(path.t_world_body[:, :2], at[:, :2], atol=1e-12)
    np.testing.assert_allclose(path.t_world_body[:, 2], 1.2, atol=1e-12)
    c, s = np.cos(at[:, 2]), np.sin(at[:, 2])
    wanted = np.stack([c * looks[0] - s * looks[1], s * looks[0] + c * looks[1], 0 * c], -1)
    np.testing.assert_allclose(path.R_world_body[:, :, 2], wanted, atol=1e-12)
    np.testing.assert_allclose(path.R_world_body[:, :, 1], np.tile([0, 0, -1.0], (2387, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(path.R_world_body), 1.0, atol=1e-12)
    np.testing.assert_array_equal(
        made.camera.pixel_from_world(np.eye(4), np.array([[1.0, 0.0, 1.0]])).uv, [[525 + 319.5, 239.5]]
    )


def test_all_see_the_same_hall(busy: RenderedScene, ahead: RenderedScene) -> None:
    """Passers-by and the other camera change no texture, no thing and no landmark; a seed changes all."""
    made = scene("hall-ahead", frames=2)
    count = len(made.textures.texels)
    np.testing.assert_array_equal(made.textures.texels, busy.textures.texels[:count])
    assert len(busy.textures.texels) > count
    for a, b in zip(made.quads, busy.quads, strict=True):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(made.landmarks, busy.landmarks)
    np.testing.assert_array_equal(made.T_cam_world, ahead.T_cam_world[:2])
    assert made.frame(1).tobytes() == ahead.frame(1).tobytes()


# --- landmarks


@pytest.mark.parametrize("name", ["right", "ahead"])
@pytest.mark.parametrize("k", SAMPLED)
def test_forty_landmarks_are_in_view(request: pytest.FixtureRequest, name: str, k: int) -> None:
    made: RenderedScene = request.getfixturevalue(name)
    assert made.landmark_track(k).visible.sum() >= 40


@pytest.mark.slow
@pytest.mark.parametrize("name", ["right", "ahead"])
def test_forty_landmarks_are_in_every_picture(request: pytest.FixtureRequest, name: str) -> None:
    made: RenderedScene = request.getfixturevalue(name)
    assert min(made.landmark_track(k).visible.sum() for k in range(len(made))) >= 40


def test_landmarks_are_corners_of_the_pictures(right: RenderedScene) -> None:
    """OpenCV finds the corner near the projection: edges in the window meet there.

    Blur rounds a corner off towards its inside, which for all four corners of a rectangle cancels; the middle
    3 x 3 pixels, where it is, are left out.  Within 6 m the plain rims of 6 cm are wider than the window.
    Half a texel or pixel off anywhere would move all by 0.4 px.
    """
    errors = []
    for k in (0, 600, 1250):
        track, picture = right.landmark_track(k), right.frame(k)
        near = np.linalg.norm(right.landmarks[track.ids] - right.trajectory().t_world_body[k], axis=1)
        uv = track.uv[track.visible & (near < 6.0)]
        alone = np.sort(np.linalg.norm(uv[:, None] - track.uv, axis=-1), axis=1)[:, 1] > 16
        uv = uv[alone & ((uv > 12) & (uv < np.array([628, 468]))).all(1)]
        stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-3)
        found = cv2.cornerSubPix(picture, np.float32(uv)[:, None].copy(), (4, 4), (1, 1), stop)
        errors.append(found.reshape(-1, 2) - uv)
    error = np.concatenate(errors)
    assert len(error) > 60
    distance = np.linalg.norm(error, axis=1)
    assert np.median(distance) < 0.25
    assert np.abs(np.median(error, axis=0)).max() < 0.1


# --- options


def test_a_picture_alone_is_that_of_the_stream(busy: RenderedScene) -> None:
    """Another object, asked for one picture only; noise and passers-by are part of it."""
    effects = Effects(noise=2.0, exposure=0.2)
    stream = replace(busy, effects=effects)
    third = [stream.frame(k) for k in (1398, 1399, 1400)][-1]
    alone = replace(busy, effects=effects, times=busy.times[:1401]).frame(1400)
    assert alone.tobytes() == third.tobytes()


def test_passers_by_change_what_they_hide_only(right: RenderedScene, busy: RenderedScene) -> None:
    """Pixels at borders are means of finer rays, so what lies within a pixel of a mover may change, too."""
    np.testing.assert_array_equal(busy.textures.texels[: len(right.textures.texels)], right.textures.texels)
    np.testing.assert_array_equal(busy.landmarks, right.landmarks)
    plain, with_people, moving = right.frame(1400), busy.frame(1400), busy.moving(1400)
    near = cv2.dilate(moving.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    np.testing.assert_array_equal(plain[~near], with_people[~near])
    assert (plain[moving] != with_people[moving]).mean() > 0.8
    assert not right.moving(1400).any()


def test_people_walk_along_their_lanes(busy: RenderedScene) -> None:
    """At 12 times: where the middle of the quads is, how fast it moves, and that it moves ahead."""
    people_there, _ = people.walkers(np.random.default_rng(5), 12, 0)
    for t, walker in zip(np.linspace(0.0, 70.0, 12), people_there, strict=True):
        x, y, theta = people.place(walker, float(t))
        later = people.place(walker, float(t) + 1e-3)
        assert max(abs(x), abs(y)) == pytest.approx(walker.lane, abs=1e-9)
        way = (later[:2] - [x, y]) / 1e-3
        if later[2] == theta:  # no corner between
            ahead = np.array([np.cos(theta), np.sin(theta)])
            np.testing.assert_allclose(way, abs(walker.speed) * ahead, atol=1e-9)
        quads = people.crowd([walker])(float(t))
        corners = np.concatenate([quads.corner, quads.corner + quads.side.sum(1)])
        np.testing.assert_allclose((corners.min(0) + corners.max(0))[:2] / 2, [x, y], atol=1e-9)
        assert corners[:, 2].min() == 0.0
        assert corners[:, 2].max() == pytest.approx(1.76)
    assert busy.movers is not None
    for mine, theirs in zip(busy.things(3.5), busy.movers(3.5), strict=True):
        np.testing.assert_array_equal(mine[-len(theirs) :], theirs)
        assert len(theirs) == 15 * PEOPLE


def test_a_covered_lens_shows_nothing_and_the_rest_stays(right: RenderedScene) -> None:
    covered = replace(right, effects=Effects(covered=((1.0, 2.0), (50.0, 51.0))))
    for k, dark in ((29, False), (30, True), (59, True), (60, False), (1500, True), (1530, False)):
        assert covered.is_covered(k) == dark
    assert np.ptp(covered.frame(30)) == 0
    assert not covered.landmark_track(30).visible.any()
    assert covered.frame(29).tobytes() == right.frame(29).tobytes()
    np.testing.assert_array_equal(covered.landmark_track(60).visible, right.landmark_track(60).visible)


def test_light_and_blur_leave_the_truth_alone(busy: RenderedScene) -> None:
    worse = replace(busy, effects=Effects(noise=5.0, exposure=0.4, shutter=0.02))
    np.testing.assert_array_equal(worse.T_cam_world, busy.T_cam_world)
    np.testing.assert_array_equal(worse.depth(1400), busy.depth(1400))
    for a, b in zip(worse.landmark_track(1400), busy.landmark_track(1400), strict=True):
        np.testing.assert_array_equal(a, b)


def test_passers_by_are_refused_elsewhere() -> None:
    for name, count in (("desk", 1), ("hall", 100), ("hall", -1)):
        with pytest.raises(ValueError, match=f"{count} passers-by in {name}: need 0 to 99, in the hall"):
            scene(name, passers_by=count)
