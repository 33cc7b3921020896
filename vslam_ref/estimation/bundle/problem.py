"""What bundle adjustment is given: cameras, points, who saw what where, and what may move.

A *view* is one image: a pose ``T_cam_world`` and the number of its set of intrinsics.  Many views may share
one set, as in a video, or each may have its own, as in photographs from the web::

    view i  ->  T_cam_world[i],  intrinsics[lens_of_view[i]]
    observation k:  point[k] was seen in view[k] at uv[k], with the covariance cov_uv[k]
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, BoolArray, IntArray
from vslam_ref.estimation.bundle.families import CameraModel, Families, directions, model_of_set, width


@dataclass(frozen=True)
class Scene:
    """What is estimated.

    Parameters
    ----------
    T_cam_world : array_like, shape (V, 4, 4)
        Pose of each view: rigid motion from the world to the camera.
    X_world : array_like, shape (N, 3)
        Points.
    intrinsics : array_like, shape (L, p)
        Sets of intrinsics, each in the order of the camera model's ``names()``; with lenses of several
        families, each in the block of its own (:mod:`.families`).
    """

    T_cam_world: Array
    X_world: Array
    intrinsics: Array

    def __post_init__(self) -> None:
        for name, tail in (("T_cam_world", (4, 4)), ("X_world", (3,)), ("intrinsics", None)):
            value = np.ascontiguousarray(getattr(self, name), dtype=np.float64)
            if value.ndim != (2 if tail is None else 1 + len(tail)) or (tail and value.shape[1:] != tail):
                wanted = {"T_cam_world": "(V, 4, 4)", "X_world": "(N, 3)", "intrinsics": "(L, p)"}[name]
                raise ValueError(f"{name} has shape {value.shape}: need {wanted}")
            _require_finite(name, value)
            object.__setattr__(self, name, value)


@dataclass(frozen=True)
class Observations:
    """Which point was seen in which view, and where.

    Parameters
    ----------
    view, point : array_like of int, shape (n,)
        Numbers of view and point, from 0.
    uv : array_like, shape (n, 2)
        Pixels; (0, 0) is the centre of the top-left pixel.
    cov_uv : array_like, shape (n, 2, 2), optional
        Covariance of each measurement, pixels squared; the identity by default.

    Raises
    ------
    ValueError
        On shapes that do not fit, numbers that are not finite, a covariance that is not positive definite.
    """

    view: IntArray
    point: IntArray
    uv: Array
    cov_uv: Array | None = None

    def __post_init__(self) -> None:
        uv = np.ascontiguousarray(self.uv, dtype=np.float64)
        if uv.ndim != 2 or uv.shape[1] != 2:
            raise ValueError(f"uv has shape {uv.shape}: need (n, 2)")
        _require_finite("uv", uv)
        object.__setattr__(self, "uv", uv)
        for name in ("view", "point"):
            object.__setattr__(self, name, _indices(name, getattr(self, name), len(uv)))
        if self.cov_uv is not None:
            cov = np.ascontiguousarray(self.cov_uv, dtype=np.float64)
            if cov.shape != (len(uv), 2, 2):
                raise ValueError(f"cov_uv has shape {cov.shape}: need ({len(uv)}, 2, 2)")
            _require_covariances(cov)
            object.__setattr__(self, "cov_uv", cov)

    def __len__(self) -> int:
        return len(self.uv)

    def only(self, keep: BoolArray) -> Self:
        """Return the observations of a mask (n,), in their order."""
        cov = None if self.cov_uv is None else self.cov_uv[keep]
        return replace(self, view=self.view[keep], point=self.point[keep], uv=self.uv[keep], cov_uv=cov)


@dataclass(frozen=True)
class Freedom:
    """What may move.

    Parameters
    ----------
    pose : array_like of bool, shape (V, 6)
        For each view, the coordinates of its tangent vector (rho, phi) that may move: a row of False fixes
        the view.
    point : array_like of bool, shape (N,)
        Points that may move.
    intrinsics : array_like, shape (p, q)
        Directions in which a set of intrinsics may move, one a column; q = 0 fixes all of them.  A
        column with ones at ``fx`` and ``fy`` is a focal length that both share.
    """

    pose: BoolArray
    point: BoolArray
    intrinsics: Array


@dataclass(frozen=True)
class BundleProblem:
    """A scene, the observations of it, and what may move.

    Parameters
    ----------
    model : type of Camera, or Families
        The camera model of all views, for example ``Pinhole``, or that of each set of intrinsics.
    scene : Scene
        Where to start.
    seen : Observations
    lens_of_view : array_like of int, shape (V,), optional
        Set of intrinsics of each view; by default view i has set i, or all have the only one.
    free : Freedom, optional
        By default poses and points move and intrinsics do not; see also :func:`freedom`.

    Raises
    ------
    ValueError
        If parts do not fit each other, an index is out of range, or one view sees a point twice.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> scene = Scene(np.eye(4)[None], [[0.0, 0.0, 2.0]], [[500.0, 500.0, 320.0, 240.0]])
    >>> BundleProblem(Pinhole, scene, Observations([0], [0], [[320.0, 240.0]])).sizes
    (1, 1, 1)
    >>> BundleProblem(Pinhole, scene, Observations([0], [7], [[320.0, 240.0]]))
    Traceback (most recent call last):
    ValueError: observation 0 names point 7: there are 1 (numbers 0 to 0)
    """

    model: CameraModel
    scene: Scene
    seen: Observations
    lens_of_view: IntArray = None  # type: ignore[assignment]
    free: Freedom = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        views, points, _ = self.sizes
        sets, parameters = self.scene.intrinsics.shape
        self._require_columns(sets, parameters)
        for number in range(sets):
            kind, own = model_of_set(self.model, number)
            try:
                kind.from_params(self.scene.intrinsics[number, own])
            except ValueError as error:
                raise ValueError(f"intrinsics[{number}] make no {kind.__name__}: {error}") from None
        self._require_range("view", self.seen.view, views)
        self._require_range("point", self.seen.point, points)
        self._require_once()
        given: object = self.lens_of_view
        if given is None:
            if sets not in (1, views):
                raise ValueError(f"{sets} sets of intrinsics for {views} views: say lens_of_view")
            numbers = np.arange(views) if sets == views else np.zeros(views, dtype=np.int64)
            object.__setattr__(self, "lens_of_view", numbers)
        lens = _indices("lens_of_view", self.lens_of_view, views)
        if len(lens) and not (lens.min() >= 0 and lens.max() < sets):
            raise ValueError(f"lens_of_view names set {lens.max()}: there are {sets} (from 0)")
        object.__setattr__(self, "lens_of_view", lens)
        told_free: object = self.free
        free = freedom(self.model, self.scene) if told_free is None else self.free
        object.__setattr__(self, "free", self._checked(free))

    @property
    def sizes(self) -> tuple[int, int, int]:
        """Number of views, points, observations."""
        return len(self.scene.T_cam_world), len(self.scene.X_world), len(self.seen)

    def at(self, scene: Scene) -> Self:
        """Return the same problem with another scene of the same size."""
        return replace(self, scene=scene)

    def _require_columns(self, sets: int, parameters: int) -> None:
        model = self.model
        if parameters != width(model):
            names = model.models if isinstance(model, Families) else (model,)
            needs = " and ".join(f"{kind.__name__} needs {', '.join(kind.names())}" for kind in names)
            raise ValueError(f"intrinsics have {parameters} columns: {needs}")
        if isinstance(model, Families):
            if len(model.of_set) != sets:
                raise ValueError(f"families of {len(model.of_set)} sets of intrinsics: there are {sets}")
            if self.scene.intrinsics[~model.own].any():
                raise ValueError("intrinsics: a set must be zero outside the block of its family")

    def _require_range(self, name: str, index: IntArray, count: int) -> None:
        bad = np.flatnonzero((index < 0) | (index >= count))
        if len(bad):
            k = int(bad[0])
            have = f"there are {count} (numbers 0 to {count - 1})" if count else "there are none"
            raise ValueError(f"observation {k} names {name} {index[k]}: {have}")

    def _require_once(self) -> None:
        key = self.seen.view * max(1, self.sizes[1]) + self.seen.point
        order = np.argsort(key, kind="stable")
        again = np.flatnonzero(np.diff(key[order]) == 0)
        if len(again):
            first, second = int(order[again[0]]), int(order[again[0] + 1])
            twice = f"view {self.seen.view[second]} sees point {self.seen.point[second]} twice"
            raise ValueError(f"{twice} (observations {first} and {second}): keep one, or merge them")

    def _checked(self, free: Freedom) -> Freedom:
        views, points, _ = self.sizes
        pose, point = np.asarray(free.pose, dtype=np.bool_), np.asarray(free.point, dtype=np.bool_)
        basis = np.asarray(free.intrinsics, dtype=np.float64)
        p = self.scene.intrinsics.shape[1]
        if pose.shape != (views, 6) or point.shape != (points,) or basis.ndim != 2 or len(basis) != p:
            given = f"pose {pose.shape}, point {point.shape}, intrinsics {basis.shape}"
            raise ValueError(f"freedom has {given}: need ({views}, 6), ({points},), ({p}, q)")
        if basis.shape[1] and np.linalg.matrix_rank(basis) < basis.shape[1]:
            raise ValueError("freedom of the intrinsics: its columns must be linearly independent")
        return Freedom(pose, point, basis)


def freedom(
    model: CameraModel,
    scene: Scene,
    *,
    fixed_views: ArrayLike = (),
    fixed_points: ArrayLike = (),
    intrinsics: tuple[str, ...] = (),
) -> Freedom:
    """Return the freedom of poses, points and named intrinsics.

    Parameters
    ----------
    model : type of Camera, or Families
    scene : Scene
    fixed_views, fixed_points : array_like of int
        Numbers of the views and points that stay where they are.
    intrinsics : tuple of str
        Names of the intrinsics that may move; ``f`` is one focal length, fx and fy changed alike.

    Raises
    ------
    ValueError
        On a name that the model does not have.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Pinhole
    >>> scene = Scene(np.eye(4)[None], np.zeros((5, 3)), [[500.0, 500.0, 320.0, 240.0]])
    >>> freedom(Pinhole, scene, fixed_views=[0], intrinsics=("f", "cx")).intrinsics.T
    array([[1., 1., 0., 0.],
           [0., 0., 1., 0.]])
    """
    basis = directions(model, intrinsics)
    pose = np.ones((len(scene.T_cam_world), 6), dtype=np.bool_)
    pose[np.asarray(fixed_views, dtype=np.int64)] = False
    point = np.ones(len(scene.X_world), dtype=np.bool_)
    point[np.asarray(fixed_points, dtype=np.int64)] = False
    return Freedom(pose, point, basis)


def _indices(name: str, index: ArrayLike, count: int) -> IntArray:
    numbers = np.asarray(index)
    if numbers.size == 0:
        numbers = numbers.astype(np.int64)
    if numbers.shape != (count,) or not np.issubdtype(numbers.dtype, np.integer):
        raise ValueError(
            f"{name}: need whole numbers of shape ({count},), got {numbers.dtype} {numbers.shape}"
        )
    return np.ascontiguousarray(numbers, dtype=np.int64)


def _require_finite(name: str, values: Array) -> None:
    if not np.isfinite(values).all():
        row = int(np.argwhere(~np.isfinite(values))[0][0])
        raise ValueError(f"{name}[{row}] is {values[row].tolist()}: every number must be finite")


def _require_covariances(cov: Array) -> None:
    symmetric = np.abs(cov[:, 0, 1] - cov[:, 1, 0]) <= 1e-12 * np.abs(cov).max((1, 2), initial=0.0)
    determinant = cov[:, 0, 0] * cov[:, 1, 1] - cov[:, 0, 1] * cov[:, 1, 0]
    good = np.isfinite(cov).all((1, 2)) & symmetric & (cov[:, 0, 0] > 0) & (determinant > 0)
    if not good.all():
        k = int(np.flatnonzero(~good)[0])
        raise ValueError(f"cov_uv[{k}] is {cov[k].tolist()}: need a symmetric positive definite matrix")
