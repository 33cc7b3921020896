"""Which intrinsics are free: fixed ones, and a fixed ratio of the focal lengths, as a basis of steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.geometry.cameras import Camera


@dataclass(frozen=True)
class Free:
    """What the calibration may change of a camera.

    Parameters
    ----------
    model : type
        A model of :data:`~vslam_ref.geometry.cameras.MODELS`.
    fixed : mapping of str to float
        Intrinsics that keep a value, as ``{"k3": 0.0}``.
    aspect : float, optional
        fy / fx, where it is known; then fy follows fx.

    Raises
    ------
    ValueError
        On a name that the model has not, a value that is not finite, a ratio that is not positive, a ratio
        beside a fixed focal length, or nothing left to estimate but poses.

    Examples
    --------
    >>> from vslam_ref.geometry.cameras import Radtan
    >>> Free(Radtan, {"k3": 0.0, "p1": 0.0, "p2": 0.0}, aspect=1.0).basis.T.astype(int).tolist()
    [[1, 1, 0, 0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0, 0, 0, 0], [0, 0, 0, 1, 0, 0, 0, 0, 0],
     [0, 0, 0, 0, 1, 0, 0, 0, 0], [0, 0, 0, 0, 0, 1, 0, 0, 0]]
    """

    model: type[Camera]
    fixed: Mapping[str, float] = field(default_factory=dict)
    aspect: float | None = None

    def __post_init__(self) -> None:
        names = self.model.names()
        for name, value in self.fixed.items():
            if name not in names:
                raise ValueError(
                    f"{name}: {self.model.__name__} has no such parameter; it has {', '.join(names)}"
                )
            if not np.isfinite(value):
                raise ValueError(f"{name}={value}: a fixed parameter must be finite")
        if self.aspect is not None:
            if not (np.isfinite(self.aspect) and self.aspect > 0):
                raise ValueError(f"aspect={self.aspect}: fy / fx must be a positive number")
            if "fx" in self.fixed or "fy" in self.fixed:
                raise ValueError("a focal length is fixed, and so is the ratio: fix fx and fy instead")
        if not self.names:
            raise ValueError("every intrinsic is fixed: nothing is left to calibrate")

    @property
    def names(self) -> tuple[str, ...]:
        """Free intrinsics, one for each column of :attr:`basis`."""
        tied = ("fy",) if self.aspect is not None else ()
        return tuple(n for n in self.model.names() if n not in self.fixed and n not in tied)

    @property
    def basis(self) -> Array:
        """Change of all n intrinsics for a step of the m free ones, shape (n, m)."""
        names = self.model.names()
        E = np.zeros((len(names), len(self.names)))
        for column, name in enumerate(self.names):
            E[names.index(name), column] = 1.0
        if self.aspect is not None:
            E[1, self.names.index("fx")] = self.aspect
        return E

    def apply(self, params: Array) -> Array:
        """Intrinsics with the fixed values and the ratio put in."""
        out = np.array(params, dtype=np.float64)
        for name, value in self.fixed.items():
            out[self.model.names().index(name)] = value
        if self.aspect is not None:
            out[1] = self.aspect * out[0]
        return out
