r"""From quads to pixels: which one each pixel sees, at which depth, and what grey value.

A quad with corner o and sides g_1, g_2 per texel, in the camera's frame, meets the ray (x, y, 1) where

.. math:: z\,(x, y, 1)^T = a\, g_1 + b\, g_2 + o = M\,(a, b, 1)^T .

So :math:`M^{-1} (x, y, 1)^T = (a, b, 1)^T / z`: its last row is the inverse depth, which is linear in the
ray.  The largest one wins, and the texture coordinates a and b cost one division for each pixel, not for
each quad.

*Culling.*  A quad can only be seen by rays inside the rectangle around its outline in the plane z = 1, cut
off at ``NEAR``.  There every lens has straight edges, so the rectangle is right with distortion, too; which
rows and columns of the image have rays in it is looked up in the table of rays.  Most quads of a large scene
lie behind the camera or beside all of its rays, and are left out before that.

*Borders.*  Pixels beside one that sees another quad are the mean of ``FINE`` x ``FINE`` rays.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.geometry import se3
from vslam_ref.geometry.cameras import Camera, pixel_grid
from vslam_ref.worlds.rendered.quads import Quads, taken
from vslam_ref.worlds.rendered.textures import PROBES, Bytes, Textures, footprint, sample

NEAR = 0.01
"""Metres from the camera at which things are cut off."""
FINE = 2
"""Rays along each side of a pixel at a border."""
BACKGROUND = 96.0
"""Grey value where there is nothing."""
BLOCK = 8192
"""Rays that NumPy paints at once."""


class RayTable(NamedTuple):
    """The rays of all pixels of an image, on the plane z = 1 of the camera.

    Attributes
    ----------
    xn : ndarray, shape (H, W, 2)
        Ray of each pixel's centre, normalised.
    spread : ndarray, shape (H, W, 2, 2)
        Its derivative in the pixel: columns for u and v, normalised per pixel.
    span : tuple of four ndarray, shapes (W,), (W,), (H,), (H,)
        Least and largest x of each column, least and largest y of each row.
    """

    xn: Array
    spread: Array
    span: tuple[Array, Array, Array, Array]


def ray_table(camera: Camera, size: tuple[int, int]) -> RayTable:
    """Invert the lens at every pixel of an image of ``size`` (W, H), once for all images.

    Raises
    ------
    ValueError
        If the camera has no ray for some pixel, or one that does not go forwards.
    """
    width, height = size
    around = camera.unproject(pixel_grid((width + 2, height + 2)) - 1.0)
    if not (around.valid & (around.bearing[..., 2] > 1e-3)).all():
        raise ValueError(f"{camera} has no ray ahead for every pixel of a {width}x{height} image")
    ring = around.bearing[..., :2] / around.bearing[..., 2:]
    xn = np.ascontiguousarray(ring[1:-1, 1:-1])
    spread = np.stack([ring[1:-1, 2:] - ring[1:-1, :-2], ring[2:, 1:-1] - ring[:-2, 1:-1]], -1) / 2
    x, y = xn[..., 0], xn[..., 1]
    # half a pixel more, for the finer rays at borders
    more_x, more_y = np.abs(spread[..., 0, :]).sum(-1) / 2, np.abs(spread[..., 1, :]).sum(-1) / 2
    span = (x - more_x).min(0), (x + more_x).max(0), (y - more_y).min(1), (y + more_y).max(1)
    return RayTable(xn, spread, span)


class PlacedQuads(NamedTuple):
    """Quads before one camera.

    Attributes
    ----------
    homography : ndarray, shape (Q, 3, 3)
        M^-1: (a, b, 1) / z from (x, y, 1); texels and metres.
    extent : ndarray, shape (Q, 2)
        Largest a and b, texels.
    box : ndarray of int, shape (Q, 4)
        First and last + 1 column, first and last + 1 row that may see it.
    """

    homography: Array
    extent: Array
    box: IntArray


def in_view(quads: Quads, T_cam_world: Array, span: tuple[Array, ...]) -> IntArray:
    """Numbers of the quads that are not all behind the camera, or all beside the rays.

    ``T_cam_world`` (4, 4), metres; ``span`` is that of :class:`RayTable`, four arrays (W,), (W,), (H,), (H,).

    Rays have x >= x_min z: a quad whose corners have x < x_min z meets none.  1e-9 is far above rounding.
    """
    low_x, high_x, low_y, high_y = span
    rays = ((0, low_x.min(), 1), (0, high_x.max(), -1), (1, low_y.min(), 1), (1, high_y.max(), -1))
    points = _outline(se3.act(T_cam_world, quads.corner), quads.side @ se3.rotation(T_cam_world).T)
    out = (points[..., 2] < NEAR).all(1)
    for axis, bound, sign in rays:
        out |= (sign * (points[..., axis] - bound * points[..., 2]) < -1e-9).all(1)
    return np.flatnonzero(~out)


def _outline(corner: Array, side: Array) -> Array:
    """Corners (Q, 4, 3) of quads, in their order around."""
    return np.asarray(corner[:, None] + np.stack([0 * side[:, 0], side[:, 0], side.sum(1), side[:, 1]], 1))


def placed(quads: Quads, textures: Textures, T_cam_world: Array, span: tuple[Array, ...]) -> PlacedQuads:
    """Put quads before a camera at ``T_cam_world`` (4, 4), metres; ``span`` is of its :class:`RayTable`."""
    extent = np.ascontiguousarray(textures.extent[quads.texture])
    R = se3.rotation(T_cam_world)
    corner = se3.act(T_cam_world, quads.corner)
    side = quads.side @ R.T
    M = np.stack([side[:, 0] / extent[:, :1], side[:, 1] / extent[:, 1:], corner], -1)
    flat = np.abs(np.linalg.det(M)) < 1e-15  # seen exactly from the edge: nothing
    inverse = np.linalg.inv(np.where(flat[:, None, None], np.eye(3), M))
    return PlacedQuads(inverse, extent, np.where(flat[:, None], 0, _boxes(_outline(corner, side), span)))


def _boxes(outline: Array, span: tuple[Array, ...]) -> IntArray:
    """Columns and rows (Q, 4) that may see polygons (Q, 4, 3) in the camera's frame, metres."""
    ahead, behind = outline, np.roll(outline, -1, 1)
    step = behind[..., 2] - ahead[..., 2]
    cross = (ahead[..., 2] - NEAR) * (behind[..., 2] - NEAR) < 0
    share = np.where(cross, (NEAR - ahead[..., 2]) / np.where(step == 0, 1.0, step), 0.0)
    cut = ahead + share[..., None] * (behind - ahead)  # where an edge passes NEAR
    points = np.concatenate([ahead, cut], 1)
    seen = np.concatenate([ahead[..., 2] >= NEAR, cross], 1)
    depth = np.where(seen, points[..., 2], 1.0)
    box = np.zeros((len(outline), 4), np.int64)
    for axis in (0, 1):
        low, high = span[2 * axis], span[2 * axis + 1]
        at = points[..., axis] / np.maximum(depth, NEAR)
        least, most = (f(np.where(seen, at, end), axis=1) for f, end in ((np.min, np.inf), (np.max, -np.inf)))
        inside = (high >= least[:, None]) & (low <= most[:, None])
        box[:, 2 * axis] = np.argmax(inside, 1)
        box[:, 2 * axis + 1] = np.where(inside.any(1), inside.shape[1] - np.argmax(inside[:, ::-1], 1), 0)
    return box


@accelerated("rendered:nearest")
def nearest(xn: Array, homography: Array, extent: Array, box: IntArray) -> tuple[NDArray[np.int32], Array]:
    """Which quad every pixel sees, -1 for none, and its inverse depth, 1/m; arrays (H, W).

    Parameters
    ----------
    xn : ndarray, shape (H, W, 2)
        Rays, normalised.
    homography, extent, box : ndarray, shapes (Q, 3, 3), (Q, 2), (Q, 4)
        Of :class:`PlacedQuads`.
    """
    quad = np.full(xn.shape[:2], -1, np.int32)
    inverse_depth = np.zeros(xn.shape[:2])
    for q in range(len(homography)):
        left, right, top, bottom = box[q]
        x, y = xn[top:bottom, left:right, 0], xn[top:bottom, left:right, 1]
        a, b, w = (row[0] * x + row[1] * y + row[2] for row in homography[q])
        before = inverse_depth[top:bottom, left:right]
        wins = (w > before) & (w < 1 / NEAR) & (a >= 0) & (a <= extent[q, 0] * w)
        wins &= (b >= 0) & (b <= extent[q, 1] * w)
        before[wins] = w[wins]
        quad[top:bottom, left:right][wins] = q
    return quad, inverse_depth


@accelerated("rendered:nearest_of")
def nearest_of(
    xn: Array, column: IntArray, row: IntArray, homography: Array, extent: Array, box: IntArray
) -> tuple[NDArray[np.int32], Array]:
    """Which quad single rays meet first, -1 for none, and the inverse depth there, 1/m; arrays (N,).

    Parameters
    ----------
    xn : ndarray, shape (N, 2)
        Rays, normalised.
    column, row : ndarray of int, shape (N,)
        Pixels that they belong to.
    homography, extent, box : ndarray, shapes (Q, 3, 3), (Q, 2), (Q, 4)
        Of :class:`PlacedQuads`.
    """
    quad = np.full(len(xn), -1, np.int32)
    inverse_depth = np.zeros(len(xn))
    for q in range(len(homography)):
        left, right, top, bottom = box[q]
        near = np.flatnonzero((column >= left) & (column < right) & (row >= top) & (row < bottom))
        x, y = xn[near, 0], xn[near, 1]
        a, b, w = (line[0] * x + line[1] * y + line[2] for line in homography[q])
        wins = (w > inverse_depth[near]) & (w < 1 / NEAR) & (a >= 0) & (a <= extent[q, 0] * w)
        wins &= (b >= 0) & (b <= extent[q, 1] * w)
        inverse_depth[near[wins]] = w[wins]
        quad[near[wins]] = q
    return quad, inverse_depth


@accelerated("rendered:shade")
def shade(
    xn: Array,
    spread: Array,
    quad: NDArray[np.int32],
    homography: Array,
    texture: IntArray,
    light: Array,
    texels: Bytes,
    table: IntArray,
) -> Array:
    """Grey values (N,), 0 to 255 and not rounded, of what rays meet.

    Parameters
    ----------
    xn, spread : ndarray, shapes (N, 2), (N, 2, 2)
        Rays and their derivatives in the pixel, normalised.
    quad : ndarray of int, shape (N,)
        What each ray meets; -1 is the background.
    homography : ndarray, shape (Q, 3, 3)
    texture, light : ndarray, shape (Q,)
        Number of the texture, and the share of its grey values.
    texels, table : ndarray, shapes (n,), (T, LEVELS, 3)
        Of :class:`.Textures`.
    """
    grey = np.full(len(xn), BACKGROUND)
    met = np.flatnonzero(quad >= 0)
    for first in range(0, len(met), BLOCK):  # what belongs to a block stays in the processor's cache
        some = met[first : first + BLOCK]
        q = quad[some]
        J, a, b = _on_surface(homography[q], xn[some], spread[some])
        seen = footprint(J)
        total = np.zeros(len(some))
        for k in range(PROBES):
            more = np.flatnonzero(seen.probes > k)
            shift = (k + 0.5) / seen.probes[more] - 0.5
            at_a, at_b = a[more] + shift * seen.axis[0, more], b[more] + shift * seen.axis[1, more]
            which = texture[q[more]]
            total[more] += sample(Textures(texels, table), which, at_a, at_b, seen.level[more])
        grey[some] = light[q] * total / seen.probes
    return grey


def _on_surface(H: Array, xn: Array, spread: Array) -> tuple[Array, Array, Array]:
    """Derivative (2, 2, N) of texels in the pixel, and texels a, b (N,) that rays (N, 2) meet."""
    x, y = xn[:, 0], xn[:, 1]
    h0, h1, w = (H[:, i, 0] * x + H[:, i, 1] * y + H[:, i, 2] for i in range(3))
    z = 1.0 / w
    a, b = h0 * z, h1 * z
    J_ray = [[(H[:, i, j] - at * H[:, 2, j]) * z for j in (0, 1)] for i, at in ((0, a), (1, b))]
    J = [[row[0] * spread[:, 0, k] + row[1] * spread[:, 1, k] for k in (0, 1)] for row in J_ray]
    return np.array(J), a, b


def render(quads: Quads, textures: Textures, rays: RayTable, T_cam_world: Array) -> Array:
    """Grey values (H, W), 0 to 255 and not rounded, that a camera at ``T_cam_world`` (4, 4), metres, sees."""
    some = taken(quads, in_view(quads, T_cam_world, rays.span))
    at = placed(some, textures, T_cam_world, rays.span)
    height, width = rays.xn.shape[:2]
    quad, _ = nearest(rays.xn, *at)
    painted = at.homography, some.texture, some.light, textures.texels, textures.table
    xn, spread = rays.xn.reshape(-1, 2), rays.spread.reshape(-1, 2, 2)
    border = borders(quad)
    once = quad.reshape(-1)
    once[border] = -1  # these are painted below
    grey = shade(xn, spread, once, *painted)
    row, column = np.repeat(border // width, FINE * FINE), np.repeat(border % width, FINE * FINE)
    spreads = np.repeat(spread[border], FINE * FINE, 0)
    finer = _finer(xn[border], spread[border])
    first, _ = nearest_of(finer, column, row, *at)
    grey[border] = shade(finer, spreads, first, *painted).reshape(-1, FINE * FINE).mean(1)
    return grey.reshape(height, width)


def _finer(xn: Array, spread: Array) -> Array:
    """Rays (FINE^2 N, 2) inside pixels with rays xn (N, 2) and their derivatives (N, 2, 2)."""
    offset = (np.arange(FINE) - (FINE - 1) / 2) / FINE  # pixels
    along_u, along_v = np.ascontiguousarray(spread[..., 0]), np.ascontiguousarray(spread[..., 1])
    finer = np.empty((len(xn), FINE * FINE, 2))
    for k, (dv, du) in enumerate(np.stack(np.meshgrid(offset, offset, indexing="ij"), -1).reshape(-1, 2)):
        finer[:, k] = xn + du * along_u + dv * along_v
    return finer.reshape(-1, 2)


def borders(quad: NDArray[np.int32]) -> IntArray:
    """Pixels, as places in the flattened image, beside one that sees another quad (H, W)."""
    border = np.zeros(quad.shape, np.bool_)
    for a, b in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        other = quad[a] != quad[b]
        border[a] |= other
        border[b] |= other
    return np.flatnonzero(border)
