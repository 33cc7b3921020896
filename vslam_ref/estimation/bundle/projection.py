r"""Residuals and Jacobians of all observations at once.

One observation of point X in the view T with the intrinsics k::

    X_cam = R X + t          residual = h(k, X_cam) - uv          predicted minus measured
    J_view  (2, 6 + q)       in the pose, then in the q directions in which the intrinsics may move
    J_point (2, 3)

Residuals are in pixels; pose steps in radians and in the unit of the scene, usually metres.

The pinhole and the radial-tangential lens are written out here in columns, one array per quantity: it is what
a problem of a hundred thousand observations spends its time on.  In stacks of vectors and matrices,
linearising takes 1.6 to 2.9 times as long, an iteration a third more, and the goals BA-1 and BA-2 would be
missed.  All other lenses go through :mod:`vslam_ref.geometry.cameras.projection`.  Both forms agree with it
to rounding.

**Behind a camera there is no image.**  Such an observation is not ``valid``: its residual is zero and so are
its Jacobians; what it costs is the loss's business.  The polynomial is used beyond the field in which it can
be inverted, as it is by every bundle adjuster: it is smooth there, and a lens that is being estimated may
need to pass through such values.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vslam_ref._kernels import accelerated
from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.bundle.families import CameraModel, Families, FamilyPart
from vslam_ref.estimation.bundle.problem import BundleProblem
from vslam_ref.geometry.cameras import Pinhole, Radtan, pose_jacobian
from vslam_ref.geometry.cameras import projection as cameras
from vslam_ref.geometry.cameras.interface import MIN_DEPTH

POLYNOMIAL = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
"""Intrinsics of the lenses that are written out; the pinhole has the first four."""


class BundleState(NamedTuple):
    """What moves: rotations (V, 3, 3) and translations (V, 3) of the views, points (N, 3), lenses (L, p)."""

    R_cam_world: Array
    t_cam_world: Array
    X_world: Array
    intrinsics: Array


class Links(NamedTuple):
    """Who saw what, and where.

    Attributes
    ----------
    view, point, lens : ndarray of int, shape (n,)
        Number of the view, of the point and of the set of intrinsics of each observation.
    uv : ndarray, shape (n, 2)
        Pixels.
    """

    view: IntArray
    point: IntArray
    lens: IntArray
    uv: Array


class Residuals(NamedTuple):
    """Residuals (n, 2), predicted minus measured in pixels, and whether there is an image (n,)."""

    r: Array
    valid: BoolArray


class Linearised(NamedTuple):
    """Residuals and Jacobians: r (n, 2), valid (n,), J_view (n, 2, 6 + q), J_point (n, 2, 3)."""

    r: Array
    valid: BoolArray
    J_view: Array
    J_point: Array


def is_polynomial(model: CameraModel) -> bool:
    """Whether a camera model is one of those written out here."""
    return model in (Pinhole, Radtan)


def polynomial_params(intrinsics: Array) -> Array:
    """Intrinsics (L, 4) or (L, 9) as nine columns, distortion zero where there is none."""
    padded = np.zeros((len(intrinsics), len(POLYNOMIAL)))
    padded[:, : intrinsics.shape[1]] = intrinsics
    return padded


def divided(part: FamilyPart, state: BundleState, links: Links) -> tuple[BundleState, Links]:
    """What one family of lenses sees: the state with its block of intrinsics, and its observations."""
    own = np.ascontiguousarray(state.intrinsics[:, part.columns])
    rows = part.rows
    view, point, lens = links.view[rows], links.point[rows], links.lens[rows]
    return state._replace(intrinsics=own), Links(view, point, lens, links.uv[rows])


def residuals(model: CameraModel, state: BundleState, links: Links) -> Residuals:
    """Residuals of all observations.

    Implements :eq:`eq-ba-residual`.
    """
    if isinstance(model, Families):
        whole = Residuals(np.zeros(links.uv.shape), np.zeros(len(links.uv), dtype=np.bool_))
        for part in model.parts(links.lens):
            found = residuals(part.model, *divided(part, state, links))
            whole.r[part.rows], whole.valid[part.rows] = found
        return whole
    if is_polynomial(model):
        params = polynomial_params(state.intrinsics)
        moving = (state.R_cam_world, state.t_cam_world, state.X_world, params)
        return Residuals(*polynomial_residuals(*moving, *links))
    at = cameras.project(state.intrinsics[links.lens], _points_in_cameras(state, links), lens=model.lens)
    return Residuals(np.where(at.valid[:, None], at.uv - links.uv, 0.0), at.valid)


def reprojection(problem: BundleProblem) -> Residuals:
    """Residuals of a problem's scene, in the problem's order."""
    seen, T = problem.seen, problem.scene.T_cam_world
    state = BundleState(T[:, :3, :3], T[:, :3, 3], problem.scene.X_world, problem.scene.intrinsics)
    links = Links(seen.view, seen.point, problem.lens_of_view[seen.view], seen.uv)
    return residuals(problem.model, state, links)


@accelerated("bundle:polynomial_residuals")
def polynomial_residuals(
    R_cam_world: Array,
    t_cam_world: Array,
    X_world: Array,
    params: Array,
    view: IntArray,
    point: IntArray,
    lens: IntArray,
    uv: Array,
) -> tuple[Array, BoolArray]:
    """Residuals (n, 2) and validity (n,) for lenses with the nine intrinsics ``params`` (L, 9).

    Parameters as those of the same names of :func:`.normal.polynomial_normal`: ``R_cam_world (V, 3, 3)``,
    ``t_cam_world (V, 3)``, ``X_world (N, 3)``; ``view (n,)``, ``point (n,)``, ``lens (n,)``; ``uv (n, 2)``,
    pixels.
    """
    seen = _polynomial(BundleState(R_cam_world, t_cam_world, X_world, params), Links(view, point, lens, uv))
    return np.where(seen.front[:, None], seen.pixels() - uv, 0.0), seen.front


def linearise(model: CameraModel, state: BundleState, links: Links, basis: Array) -> Linearised:
    """Residuals and Jacobians of all observations.

    Implements :eq:`eq-ba-jacobians`.

    Parameters
    ----------
    model : type of Camera, or Families
    state : BundleState
    links : Links
    basis : ndarray, shape (p, q)
        Directions in which a set of intrinsics may move.
    """
    if isinstance(model, Families):
        n, q = len(links.uv), basis.shape[1]
        whole = Linearised(
            np.zeros((n, 2)), np.zeros(n, np.bool_), np.zeros((n, 2, 6 + q)), np.zeros((n, 2, 3))
        )
        for part in model.parts(links.lens):
            found = linearise(part.model, *divided(part, state, links), basis[part.columns])
            for all_rows, rows in zip(whole, found, strict=True):
                all_rows[part.rows] = rows
        return whole
    if is_polynomial(model):
        seen = _polynomial(state, links)
        return seen.linearised(links.uv, state.R_cam_world[links.view], basis)
    R = state.R_cam_world[links.view]
    X_cam = _points_in_cameras(state, links)
    at = cameras.project_with_jacobians(state.intrinsics[links.lens], X_cam, lens=model.lens)
    J_view = np.concatenate([pose_jacobian(at.J_point, X_cam), at.J_intrinsics @ basis], -1)
    r = np.where(at.valid[:, None], at.uv - links.uv, 0.0)
    return Linearised(r, at.valid, J_view, at.J_point @ R)


class _Polynomial(NamedTuple):
    """Columns (n,) of a radial-tangential projection: point, normalised position, radial factor, lens."""

    X: Array  # (3, n)
    front: BoolArray
    inverse_depth: Array
    x: Array
    y: Array
    q: Array
    G: Array
    k: Array  # (9, n)
    has_tangential: bool

    def distorted(self) -> tuple[Array, Array]:
        """Distorted normalised position: G xn + q p + 2 (p . xn) xn with p = (p2, p1)."""
        if not self.has_tangential:
            return self.G * self.x, self.G * self.y
        p1, p2 = self.k[6], self.k[7]
        factor = self.G + 2.0 * (p2 * self.x + p1 * self.y)
        return factor * self.x + self.q * p2, factor * self.y + self.q * p1

    def pixels(self) -> Array:
        """Pixels (n, 2)."""
        xd, yd = self.distorted()
        return np.stack([self.k[0] * xd + self.k[2], self.k[1] * yd + self.k[3]], -1)

    def linearised(self, uv: Array, R_cam_world: Array, basis: Array) -> Linearised:
        """Residuals and Jacobians."""
        n = len(self.x)
        J_X = self._point_jacobian()
        J_view = np.empty((n, 2, 6 + basis.shape[1]))
        J_view[:, :, :3] = J_X
        for row in range(2):
            a, b, c = J_X[:, row, 0], J_X[:, row, 1], J_X[:, row, 2]
            J_view[:, row, 3] = self.X[1] * c - self.X[2] * b
            J_view[:, row, 4] = self.X[2] * a - self.X[0] * c
            J_view[:, row, 5] = self.X[0] * b - self.X[1] * a
        self._lens_jacobian(basis, J_view[:, :, 6:])
        r = self.pixels() - uv
        if not self.front.all():
            behind = ~self.front
            r[behind], J_X[behind], J_view[behind] = 0.0, 0.0, 0.0
        return Linearised(r, self.front, J_view, J_X @ R_cam_world)

    def _point_jacobian(self) -> Array:
        """Jacobian in X_cam (n, 2, 3): diag(f) A [I, -xn] / z, A the derivative of the distortion."""
        fx, fy, _, _, k1, k2, p1, p2, k3 = self.k
        slope = 2.0 * (k1 + self.q * (2.0 * k2 + 3.0 * self.q * k3))
        x, y = self.x, self.y
        xx, xy, yy = self.G + slope * x * x, slope * x * y, self.G + slope * y * y
        if self.has_tangential:
            dot = 2.0 * (p2 * x + p1 * y)
            xx, yy, xy = xx + dot + 4.0 * p2 * x, yy + dot + 4.0 * p1 * y, xy + 2.0 * (p2 * y + p1 * x)
        fx, fy = fx * self.inverse_depth, fy * self.inverse_depth
        J = np.empty((len(x), 2, 3))
        J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1] = fx * xx, fx * xy, fy * xy, fy * yy
        J[:, :, 2] = -(J[:, :, 0] * x[:, None] + J[:, :, 1] * y[:, None])
        return J

    def _lens_jacobian(self, basis: Array, out: Array) -> None:
        """Jacobian in the free directions of the intrinsics, written into ``out`` (n, 2, q)."""
        out[...] = 0.0
        for parameter, direction in np.argwhere(basis):
            u, v = self._lens_column(int(parameter))
            out[:, 0, direction] += basis[parameter, direction] * u
            out[:, 1, direction] += basis[parameter, direction] * v

    def _lens_column(self, parameter: int) -> tuple[Array | float, Array | float]:
        """Derivative of (u, v) in one of the nine intrinsics."""
        x, y, q, fx, fy = self.x, self.y, self.q, self.k[0], self.k[1]
        name = POLYNOMIAL[parameter]
        if name in ("fx", "fy"):
            xd, yd = self.distorted()
            return (xd, 0.0) if name == "fx" else (0.0, yd)
        if name in ("cx", "cy"):
            return (1.0, 0.0) if name == "cx" else (0.0, 1.0)
        if name == "p1":
            return fx * (2.0 * x * y), fy * (q + 2.0 * y * y)
        if name == "p2":
            return fx * (q + 2.0 * x * x), fy * (2.0 * x * y)
        power = q ** (("k1", "k2", "k3").index(name) + 1)
        return fx * x * power, fy * y * power


def _polynomial(state: BundleState, links: Links) -> _Polynomial:
    """Points in their cameras, normalised, with radial factor and lens."""
    R, t, X_world = state.R_cam_world, state.t_cam_world, state.X_world
    world = [np.ascontiguousarray(X_world[:, axis])[links.point] for axis in range(3)]
    X = np.empty((3, len(links.view)))
    for row in range(3):
        X[row] = t[:, row][links.view]
        for axis in range(3):
            X[row] += R[:, row, axis][links.view] * world[axis]
    front = X[2] > MIN_DEPTH
    inverse_depth = 1.0 / np.where(front, X[2], 1.0)
    x, y = X[0] * inverse_depth, X[1] * inverse_depth
    q = x * x + y * y
    params = polynomial_params(state.intrinsics)
    k = np.ascontiguousarray(params.T)[:, links.lens]
    G = 1.0 + q * (k[4] + q * (k[5] + q * k[8]))
    return _Polynomial(X, front, inverse_depth, x, y, q, G, k, bool(params[:, 6:8].any()))


def _points_in_cameras(state: BundleState, links: Links) -> Array:
    """Point of each observation in the frame of its view, (n, 3)."""
    moved: Array = np.einsum("nij,nj->ni", state.R_cam_world[links.view], state.X_world[links.point])
    return moved + state.t_cam_world[links.view]
