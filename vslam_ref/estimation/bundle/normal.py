"""The normal equations, in blocks: what all observations say about a step of all views and points.

With weighted rows r, J_view, J_point of each observation, summed over the observations of a view or a point::

    B  = sum J_view^T J_view     g_view  = sum J_view^T r       per view   (V, d, d), (V, d)
    C  = sum J_point^T J_point   g_point = sum J_point^T r      per point  (N, 3, 3), (N, 3)
    W  = J_view^T J_point                                       per observation (n, d, 3)

Rows are in pixels, or in standard deviations where covariances are given; so every block has the unit of
a squared row over those of the coordinates: radians, and the unit of the scene.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, IntArray
from vslam_ref.estimation.bundle.families import CameraModel, Families, FamilyPart
from vslam_ref.estimation.bundle.projection import (
    BundleState,
    Linearised,
    Links,
    divided,
    is_polynomial,
    linearise,
    polynomial_params,
)
from vslam_ref.estimation.bundle.structure import Structure
from vslam_ref.geometry.cameras import Camera, Radtan


class Normal(NamedTuple):
    """Blocks of the normal equations; see the module.

    Attributes
    ----------
    B, g_view : ndarray, shapes (V, d, d), (V, d)
    C, g_point : ndarray, shapes (N, 3, 3), (N, 3)
    W : ndarray, shape (n, d, 3)
    """

    B: Array
    g_view: Array
    C: Array
    g_point: Array
    W: Array


def normal_equations(
    model: CameraModel, state: BundleState, table: Structure, weights: Array, basis: Array
) -> Normal:
    """Linearise at a state and add up.

    Implements :eq:`eq-ba-blocks`.

    Parameters
    ----------
    model : type of Camera, or Families
    state : BundleState
    table : Structure
    weights : ndarray, shape (n,)
        Of each observation, from the robust loss; 0 leaves it out.
    basis : ndarray, shape (p, q)
        Free directions of the intrinsics.
    """
    links, root = table.links, np.sqrt(weights)
    U = table.whitener * root[:, None, None]
    orders = _Orders(table.offsets, table.view_order, table.view_offsets)
    if not isinstance(model, Families):
        return _of_one_model(model, state, links, U, basis, orders)
    whole = _zeros(len(table.view_offsets) - 1, len(table.offsets) - 1, len(links.uv), 6 + basis.shape[1])
    for part in model.parts(links.lens):
        own = (part.model, *divided(part, state, links), U[part.rows], basis[part.columns])
        found = _of_one_model(*own, orders.only(part))
        for name in ("B", "g_view", "C", "g_point"):
            np.add(getattr(whole, name), getattr(found, name), out=getattr(whole, name))
        whole.W[part.rows] = found.W
    return whole


class _Orders(NamedTuple):
    """Where the observations of each point begin, and those of each view, as in ``Structure``."""

    offsets: IntArray
    view_order: IntArray
    view_offsets: IntArray

    def only(self, part: FamilyPart) -> _Orders:
        """The same for some of the observations, renumbered."""
        kept = np.zeros(len(self.view_order), dtype=np.int64)
        kept[part.rows] = 1
        before = np.concatenate([[0], np.cumsum(kept)])
        by_view = kept[self.view_order]
        before_in_views = np.concatenate([[0], np.cumsum(by_view)])
        order = before[self.view_order[by_view > 0]]
        return _Orders(before[self.offsets], order, before_in_views[self.view_offsets])


def _zeros(views: int, points: int, n: int, d: int) -> Normal:
    per_view, per_point = (np.zeros((views, d, d)), np.zeros((views, d))), (np.zeros((points, 3, 3)),)
    return Normal(*per_view, *per_point, np.zeros((points, 3)), np.zeros((n, d, 3)))


def _of_one_model(
    model: type[Camera], state: BundleState, links: Links, U: Array, basis: Array, orders: _Orders
) -> Normal:
    """Linearise observations whose lenses are of one model, and add up."""
    if is_polynomial(model):
        padded = np.zeros((9, basis.shape[1]))
        padded[: len(basis)] = basis
        params = polynomial_params(state.intrinsics)
        moving = (state.R_cam_world, state.t_cam_world, state.X_world, params)
        return Normal(*polynomial_normal(*moving, *links, U, padded, *orders))
    return Normal(*_blocks(linearise(model, state, links, basis), U, links, *orders))


@accelerated("bundle:polynomial_normal")
def polynomial_normal(
    R_cam_world: Array,
    t_cam_world: Array,
    X_world: Array,
    params: Array,
    view: IntArray,
    point: IntArray,
    lens: IntArray,
    uv: Array,
    U: Array,
    basis: Array,
    offsets: IntArray,
    view_order: IntArray,
    view_offsets: IntArray,
) -> tuple[Array, Array, Array, Array, Array]:
    """Blocks (B, g_view, C, g_point, W) for pinhole and radial-tangential lenses.

    Parameters
    ----------
    R_cam_world, t_cam_world, X_world : ndarray, shapes (V, 3, 3), (V, 3), (N, 3)
    params : ndarray, shape (L, 9)
        fx, fy, cx, cy, k1, k2, p1, p2, k3.
    view, point, lens : ndarray of int, shape (n,)
        Sorted by point.
    uv : ndarray, shape (n, 2)
        Pixels.
    U : ndarray, shape (n, 2, 2)
        What rows are multiplied by: whitening times the root of the weight.
    basis : ndarray, shape (9, q)
        Free directions of the intrinsics.
    offsets, view_order, view_offsets : ndarray of int, shapes (N + 1,), (n,), (V + 1,)
        As in :class:`~vslam_ref.estimation.bundle.structure.Structure`.
    """
    links = Links(view, point, lens, uv)
    state = BundleState(R_cam_world, t_cam_world, X_world, params)
    return _blocks(linearise(Radtan, state, links, basis), U, links, offsets, view_order, view_offsets)


def _blocks(
    at: Linearised, U: Array, links: Links, offsets: IntArray, view_order: IntArray, view_offsets: IntArray
) -> tuple[Array, Array, Array, Array, Array]:
    """Add up weighted rows."""
    r, J_view, J_point = _weighted(at, U)
    views, d = len(view_offsets) - 1, J_view.shape[2]
    W = np.matmul(np.swapaxes(J_view, 1, 2), J_point)
    rows, errors = J_view[view_order], r[view_order]
    B, g_view = np.empty((views, d, d)), np.empty((views, d))
    for i in range(views):  # one product a view: a product an observation takes 5 to 10 times as long
        part = slice(view_offsets[i], view_offsets[i + 1])
        J = rows[part].reshape(-1, d)
        B[i], g_view[i] = J.T @ J, J.T @ errors[part].ravel()
    pairs = np.matmul(np.swapaxes(J_point, 1, 2), np.concatenate([J_point, r[:, :, None]], 2))
    sums = sum_by_point(pairs.reshape(-1, 12), offsets).reshape(-1, 3, 4)
    return B, g_view, np.ascontiguousarray(sums[:, :, :3]), np.ascontiguousarray(sums[:, :, 3]), W


def _weighted(at: Linearised, U: Array) -> tuple[Array, Array, Array]:
    """Rows multiplied by U, (2, 2) each; a multiple of the identity is quicker."""
    root = U[:, 0, 0]
    if U.strides[0] == 0 or not (U[:, 0, 1].any() or U[:, 1, 0].any() or (root != U[:, 1, 1]).any()):
        if (root == 1.0).all():
            return at.r, at.J_view, at.J_point
        scale = root[:, None, None]
        return at.r * root[:, None], at.J_view * scale, at.J_point * scale
    return np.einsum("nab,nb->na", U, at.r), U @ at.J_view, U @ at.J_point


def sum_by_point(rows: Array, offsets: IntArray) -> Array:
    """Sum rows (n, m) of any unit for each point, (N, m): a product with a matrix of zeros and ones."""
    from scipy.sparse import csr_array

    n, points = len(rows), len(offsets) - 1
    selection = csr_array((np.ones(n), np.arange(n), offsets), shape=(points, n))
    return np.asarray(selection @ rows)
