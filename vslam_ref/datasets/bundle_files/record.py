"""What a bundle adjustment file says: the problem, and what else the format carries."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import IntArray
from vslam_ref.estimation.bundle.problem import BundleProblem, Scene


@dataclass(frozen=True)
class BundleFile:
    """A bundle adjustment problem and what its file says beside it.

    Parameters
    ----------
    problem : BundleProblem
        In this package's conventions: ``T_cam_world`` with z ahead and y down, whole pixels at centres.
    format : str
        "bal", "bundler", "libmv" or "colmap"; empty where there was no file.
    view_names : tuple of str, length V
        Names of the images; empty where the format has none.
    view_ids, point_ids : ndarray of int, shapes (V,) and (N,)
        Their numbers in the file; by default 0, 1, 2, …
    colours : ndarray of uint8, shape (N, 3), or None
        Red, green, blue of the points.
    image_sizes : ndarray of int, shape (L, 2), or None
        Width and height, pixels, of the images of each set of intrinsics.
    camera_models : tuple of str, length L
        COLMAP's names of the sets' models; empty elsewhere.
    notes : tuple of str
        What was left out or changed, a sentence each; empty if nothing was.
    """

    problem: BundleProblem
    format: str = ""
    view_names: tuple[str, ...] = ()
    view_ids: IntArray = None  # type: ignore[assignment]
    point_ids: IntArray = None  # type: ignore[assignment]
    colours: NDArray[np.uint8] | None = None
    image_sizes: IntArray | None = None
    camera_models: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        views, points, _ = self.problem.sizes
        sets = len(self.problem.scene.intrinsics)
        for name, count in (("view_ids", views), ("point_ids", points)):
            ids: object = getattr(self, name)
            numbers = np.arange(count) if ids is None else np.asarray(ids, dtype=np.int64)
            object.__setattr__(self, name, numbers)
        self._require_shape("view_ids", self.view_ids, (views,))
        self._require_shape("point_ids", self.point_ids, (points,))
        self._require_shape("colours", self.colours, (points, 3))
        self._require_shape("image_sizes", self.image_sizes, (sets, 2))
        for name, count in (("view_names", views), ("camera_models", sets)):
            if len(getattr(self, name)) not in (0, count):
                raise ValueError(f"{name} has {len(getattr(self, name))} entries: need {count}, or none")

    @staticmethod
    def _require_shape(name: str, value: NDArray[Any] | None, shape: tuple[int, ...]) -> None:
        if value is not None and value.shape != shape:
            raise ValueError(f"{name} has shape {value.shape}: need {shape}")

    def at(self, scene: Scene) -> Self:
        """Return the same file with another scene of the same size, for example after the adjustment."""
        return replace(self, problem=self.problem.at(scene))
