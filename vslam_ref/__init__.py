"""vslam_ref: a pure-NumPy reference implementation and executable textbook of visual SLAM.

The rooms of the house stand on floors; each imports only from floors below::

    6  cli, commands, experiments, bench, conformance    what a person runs
    5  plot, datasets                                    pictures; foreign formats
    4  systems                                           whole methods on recorded data
    3  grids, worlds                                     maps of cells; simulators with exact truth
    2  estimation, filters, features, metrics            estimators; what is seen; how good they are
    1  geometry, interop                                 rotations, motions, cameras; other conventions
    0  _kernels, arrays, support, chapters               Numba twins of hot loops; what all rooms use

The NumPy function is the text and the truth.  ``VSLAM_REF_BACKEND=auto|numpy|numba`` chooses
whether a hot loop runs as its Numba twin.
"""

from __future__ import annotations

import importlib
from types import ModuleType

__version__ = "0.1.0"

_ROOMS = (
    *("geometry", "interop", "estimation", "filters", "features", "metrics", "grids", "worlds", "systems"),
    *("testing", "plot", "datasets", "experiments", "conformance"),
)

__all__ = ["__version__", *_ROOMS]


def __getattr__(name: str) -> ModuleType:
    """Import a room on first use, so that ``import vslam_ref`` stays as cheap as NumPy."""
    if name in _ROOMS:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}; rooms: {', '.join(_ROOMS)}")


def __dir__() -> list[str]:
    """Names a reader can complete on, rooms included."""
    return sorted(__all__)
