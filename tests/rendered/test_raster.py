"""The renderer: depths of planes, outlines of quads, what hides what, and no aliasing."""

from __future__ import annotations

import numpy as np
import pytest

from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.cameras import Camera, Fov, Pinhole, pixel_grid
from vslam_ref.worlds.rendered import motion, raster, textures
from vslam_ref.worlds.rendered.quads import Quads, box, joined, quad, taken

SIZE = (96, 72)
CAMERAS: dict[str, Camera] = {
    "pinhole": Pinhole(80.0, 82.0, 46.3, 36.9),
    "fov": Fov(75.0, 74.0, 48.1, 34.4, 0.9),
}
WHITE = np.full((64, 64), 255, np.uint8)


@pytest.fixture(params=CAMERAS)
def camera(request: pytest.FixtureRequest) -> Camera:
    return CAMERAS[request.param]


def seen(
    things: Quads, camera: Camera, T: np.ndarray, images: list[np.ndarray] | None = None
) -> tuple[np.ndarray, ...]:
    """Quad and inverse depth of every pixel, and the grey values."""
    packed = textures.pack(images or [WHITE])
    rays = raster.ray_table(camera, SIZE)
    at = raster.placed(things, packed, T, rays.span)
    return (*raster.nearest(rays.xn, *at), raster.render(things, packed, rays, T))


def random_pose(seed: int) -> np.ndarray:
    """2 m before the origin, looking about there, rolled."""
    rng = np.random.default_rng(seed)
    looks = motion.looking([0.3, -2.0, 0.4] + rng.uniform(-0.3, 0.3, 3), rng.uniform(-0.2, 0.2, 3))
    return se3.exp([0, 0, 0, 0, 0, rng.uniform(-1, 1)]) @ looks


# --- rays


def test_rays_are_the_inverse_of_the_projection(camera: Camera) -> None:
    """Both are closed forms of some ten operations; pixels reach 100, so eps * 100 * cond < 1e-10."""
    rays = raster.ray_table(camera, SIZE)
    points = np.concatenate([rays.xn, np.ones((*rays.xn.shape[:2], 1))], -1)
    assert np.abs(camera.project(points).uv - pixel_grid(SIZE)).max() < 1e-10


def test_spread_is_the_derivative_of_the_rays(camera: Camera) -> None:
    """Central differences over 1 px against those over 1e-3 px: the third derivative is below 0.02 / f^3."""
    rays, uv = raster.ray_table(camera, SIZE), pixel_grid(SIZE)
    for k, step in enumerate(np.eye(2) * 1e-3):
        ahead, behind = (camera.unproject(uv + sign * step).xn for sign in (1, -1))
        assert np.abs(rays.spread[..., k] - (ahead - behind) / 2e-3).max() < 2e-5


def test_a_camera_that_does_not_see_ahead_is_refused() -> None:
    with pytest.raises(ValueError, match="has no ray ahead for every pixel of a 96x72 image"):
        raster.ray_table(Fov(20.0, 20.0, 48.0, 36.0, 1.4), SIZE)


# --- depth and outlines


@pytest.mark.parametrize("seed", range(4))
def test_depth_is_that_of_a_plane(camera: Camera, seed: int) -> None:
    """n . (z x) = d in closed form; about 30 operations and the inverse of M, condition below 1e3."""
    T = random_pose(seed)
    wall = quad([-9, 0.1, 9], [18, 1.5, 0.3], [0.2, 0.8, -18], 0)
    _, inverse, _ = seen(wall, camera, T)
    normal = so3.act(se3.rotation(T), np.cross(wall.side[0, 0], wall.side[0, 1]))
    offset = normal @ se3.act(T, wall.corner[0])
    rays = raster.ray_table(camera, SIZE).xn
    wanted = (rays @ normal[:2] + normal[2]) / offset
    assert (inverse > 0).all()
    np.testing.assert_allclose(inverse, wanted, rtol=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_the_outline_is_where_the_corners_are_projected(seed: int) -> None:
    """Every pixel's centre is on the side of the four projected edges that it should be on."""
    T, camera = random_pose(seed), CAMERAS["pinhole"]
    card = quad([-0.5, 0.0, 0.4], [1.0, 0.1, 0.1], [0.1, 0.0, -0.8], 0)
    corners = card.corner[0] + np.stack(
        [0 * card.side[0, 0], card.side[0, 0], card.side[0].sum(0), card.side[0, 1]]
    )
    outline = camera.pixel_from_world(T, corners).uv
    which, _, grey = seen(card, camera, T)
    edges = np.roll(outline, -1, 0) - outline
    away = pixel_grid(SIZE)[..., None, :] - outline
    distance = (edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0]) / np.hypot(*edges.T)
    inside = np.minimum(distance.min(-1), np.inf) if (distance.min(-1) > 0).any() else -distance.max(-1)
    clear = np.abs(inside) > 1e-9
    assert (inside > 0).sum() > 300
    np.testing.assert_array_equal((which == 0)[clear], (inside > 0)[clear])
    np.testing.assert_array_equal(grey[inside > 0.8], 255.0)
    np.testing.assert_array_equal(grey[inside < -0.8], raster.BACKGROUND)
    # softened borders keep the area: 2 x 2 rays place an edge to 1/4 px at worst, at random along the outline
    x, y = outline.T
    area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    share = (grey - raster.BACKGROUND) / (255.0 - raster.BACKGROUND)
    assert abs(share.sum() - area) < 0.25 * np.sqrt(np.hypot(*edges.T).sum())


def test_culling_changes_nothing(camera: Camera) -> None:
    """Quads around the camera, some of them through it, against all pixels of the image for all quads."""
    rng = np.random.default_rng(1)
    packed, rays = textures.pack([WHITE]), raster.ray_table(camera, SIZE)
    for _ in range(10):
        things = joined([quad(*rng.normal(0, 1, (3, 3)), 0) for _ in range(30)])
        at = raster.placed(things, packed, se3.random(rng), rays.span)
        whole = at._replace(box=np.tile(np.array([0, SIZE[0], 0, SIZE[1]]), (30, 1)))
        for a, b in zip(raster.nearest(rays.xn, *at), raster.nearest(rays.xn, *whole), strict=True):
            np.testing.assert_array_equal(a, b)
        boxes = (at.box[:, 1] - at.box[:, 0]) * (at.box[:, 3] - at.box[:, 2])
        assert boxes.sum() < 0.6 * 30 * SIZE[0] * SIZE[1]  # and saves work


def test_what_is_left_out_is_seen_by_no_ray(camera: Camera) -> None:
    """Quads around the camera, of all sizes: with and without those that are not in view."""
    rng = np.random.default_rng(4)
    packed, rays = textures.pack([WHITE]), raster.ray_table(camera, SIZE)
    left_out = 0
    for _ in range(10):
        parts = rng.normal(0, 1, (60, 3, 3)) * np.exp(rng.uniform(-2, 1, (60, 1, 1)))
        things, T = joined([quad(*part, 0) for part in parts]), se3.random(rng)
        some = raster.in_view(things, T, rays.span)
        quad_of_all, depth_of_all = raster.nearest(rays.xn, *raster.placed(things, packed, T, rays.span))
        which, depth = raster.nearest(rays.xn, *raster.placed(taken(things, some), packed, T, rays.span))
        np.testing.assert_array_equal(np.append(some, -1)[which], quad_of_all)
        np.testing.assert_array_equal(depth, depth_of_all)
        left_out += 60 - len(some)
    assert left_out > 200


def test_the_nearest_hides_the_others_whatever_their_order(camera: Camera) -> None:
    near = quad([-0.3, -0.5, 0.3], [0.6, 0, 0], [0, 0, -0.6], 0, 1.0)
    far = quad([-5.0, 0.5, 5.0], [10.0, 0, 0], [0, 0, -10.0], 0, 0.5)
    T = motion.looking([0, -2.0, 0], [0, 0, 0])
    for things, nearer in ((joined([near, far]), 0), (joined([far, near]), 1)):
        which, inverse, grey = seen(things, camera, T)
        middle = (SIZE[1] // 2, SIZE[0] // 2)
        assert which[middle] == nearer
        assert inverse[middle] == pytest.approx(1 / 1.5, rel=1e-12)
        assert (grey[middle], grey[0, 0]) == (255.0, 127.5)
        assert (which >= 0).all()


def test_a_box_shows_its_near_faces(camera: Camera) -> None:
    """From in front and above: the top and the front wall, no wall behind."""
    things = box((0.0, 0.0), (0.5, 0.2, 0.4), 0.0, (0, 0, 0))
    T = motion.looking([0.0, -2.0, 0.9], [0.0, 0.0, 0.2])
    which, _, _ = seen(things, camera, T)
    assert set(np.unique(which)) == {-1, 0, 1}
    level, _, _ = seen(things, camera, motion.looking([0.0, -2.0, 0.2], [0.0, 0.0, 0.2]))
    assert set(np.unique(level)) == {-1, 1}


# --- textures


def test_levels_are_means_and_sizes_are_checked() -> None:
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (64, 128)).astype(np.uint8)
    packed = textures.pack([WHITE, image])
    np.testing.assert_array_equal(packed.extent, [[64, 64], [128, 64]])
    begin, height, width = packed.table[1, 6]
    assert (height, width) == (1, 2)
    blocks = image.reshape(64, 2, 64).mean((0, 2))
    assert np.abs(packed.texels[begin : begin + 2] - blocks).max() <= 0.5 * 6  # each level rounds once
    with pytest.raises(ValueError, match=r"texture 0 is \(64, 65\): need multiples of 64 texels"):
        textures.pack([np.zeros((64, 65), np.uint8)])


def test_a_footprint_has_the_singular_values_of_its_matrix() -> None:
    """Against LAPACK: level and probes by the rule in the docstring; eps and squares give 1e-7 of lengths."""
    rng = np.random.default_rng(0)
    J = rng.normal(0, 1, (200, 2, 2)) * np.exp(rng.uniform(-2, 3, (200, 1, 1)))
    found = textures.footprint(np.moveaxis(J, 0, -1))
    U, s, _ = np.linalg.svd(J)
    small = s[:, 0] <= 1
    probes = np.where(small, 1, np.clip(np.floor(s[:, 0] / s[:, 1] + 0.5), 1, textures.PROBES))
    np.testing.assert_array_equal(found.probes, probes)
    level = np.log2(np.maximum(np.maximum(s[:, 0] / probes, s[:, 1]), 1.0))
    np.testing.assert_allclose(found.level, np.where(small, 0.0, np.minimum(level, 6)), atol=1e-7)
    several = probes > 1
    longer = U[:, :, 0] * s[:, :1]
    along = np.abs(np.einsum("ni,in->n", longer, found.axis))
    np.testing.assert_allclose(along[several], s[several, 0] ** 2, rtol=1e-7)
    assert (found.axis[:, ~several] == 0).all()
    assert {1, 2, 3, 4} <= set(probes.astype(int))


def test_a_ramp_is_sampled_where_it_is() -> None:
    """Grey values 2 c of column c: at the coordinate a it is 2 (a - 1/2), at every level."""
    ramp = np.tile(2 * np.arange(64, dtype=np.uint8), (64, 1))
    packed = textures.pack([ramp])
    a = np.linspace(20, 44, 50)
    which = np.zeros(50, np.int64)
    for level in (0.0, 0.4, 1.0, 1.5, 2.0):
        grey = textures.sample(packed, which, a, np.full(50, 30.0), np.full(50, level))
        assert np.abs(grey - 2 * (a - 0.5)).max() <= 0.5 * np.ceil(level) + 1e-12  # each level rounds once


def test_fine_stripes_from_afar_are_grey_and_do_not_alias(camera: Camera) -> None:
    """Stripes of 1 texel are far below a pixel: their mean is 127.5.  The finest level alone flickers."""
    stripes = np.tile(np.array([0, 255], np.uint8), (512, 256))
    wall = quad([-3, 0, 3], [6, 0.5, 0], [0, 0, -6], 0)
    T = motion.looking([0.2, -4.0, 0.3], [0.0, 0.0, 0.0])
    which, _, grey = seen(wall, camera, T, [stripes])
    inner = np.ones(which.shape, bool)
    inner.flat[raster.borders(which)] = False
    inner &= which == 0
    assert inner.sum() > 2000
    assert np.abs(grey[inner] - 127.5).max() < 2.0
    packed, rays = textures.pack([stripes]), raster.ray_table(camera, SIZE)
    packed.table[:, 1:] = packed.table[:, :1]  # no level but the finest: what happens without
    assert raster.render(wall, packed, rays, T)[inner].std() > 20.0


def test_a_slanted_floor_stays_sharp_across(camera: Camera) -> None:
    """Stripes along the view keep their contrast where a level for the longer side alone would blur them."""
    stripes = np.tile(np.repeat(np.array([40, 220], np.uint8), 16), (1024, 8))
    floor = quad([-1.0, 8.0, 0.0], [2.0, 0, 0], [0, -10.0, 0], 0)
    T = motion.looking([0.0, -2.0, 0.5], [0.0, 2.0, 0.0])
    _, inverse, grey = seen(floor, camera, T, [stripes])
    row = int(np.argmin(np.abs(1 / inverse[:, SIZE[0] // 2] - 3.0)))  # 3 m ahead: 1 px is 4 cm, a stripe 12.5
    line = grey[row][inverse[row] > 0]
    assert line.max() - line.min() > 150
