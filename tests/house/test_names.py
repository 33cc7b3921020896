"""Names: what a package gives out is one thing, a module or what stands in it."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from types import ModuleType

import vslam_ref

STILL_TWICE = {
    "vslam_ref.estimation.bundle.covariance",
    "vslam_ref.estimation.calibration.homography",
    "vslam_ref.estimation.least_squares.descend",
    "vslam_ref.estimation.robust.efficiency",
    "vslam_ref.grids.landmarks.map_corners",
    "vslam_ref.metrics.consistency.nees",
}
"""Modules of one function, which their package gives out under the same name.  May only shrink."""


def packages() -> Iterator[ModuleType]:
    """All packages of the library that can be imported here."""
    for found in pkgutil.walk_packages(vslam_ref.__path__, "vslam_ref."):
        if found.ispkg and ".adapters.python" not in found.name:
            yield importlib.import_module(found.name)


def test_no_package_hides_a_module_behind_a_function() -> None:
    """``from package import name`` would give the function where a reader expects the module."""
    hidden = {
        f"{package.__name__}.{module.name}"
        for package in packages()
        for module in pkgutil.iter_modules(package.__path__)
        if not isinstance(getattr(package, module.name, package), ModuleType)
    }
    assert hidden == STILL_TWICE
