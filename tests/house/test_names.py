"""Names: a module and a function do not share one, nor do two ideas."""

from __future__ import annotations

import ast
import importlib
import pkgutil
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import vslam_ref

PACKAGE = Path(vslam_ref.__file__).parent

STILL_TWICE = {
    "vslam_ref.estimation.bundle.covariance",
    "vslam_ref.estimation.calibration.homography",
    "vslam_ref.estimation.least_squares.descend",
    "vslam_ref.estimation.robust.efficiency",
    "vslam_ref.grids.landmarks.map_corners",
    "vslam_ref.metrics.consistency.nees",
}
"""Modules of one function, which their package gives out under the same name.  May only shrink."""

NAMED_TWICE = {
    "Arrow": "the blocks of calibration's normal equations, in the book and in the fast module",
    "Gates": "of the curve search, in the book of mapping and in the fast module",
    "Belief": "mean and covariance of a filter, in the books of the EKF and of the improved EKF",
    "Options": "thresholds of a solver, written with the solver's module: least squares, bundle adjustment",
    "Match": "of a scan with a map; of a patch with a picture, in the book of tracking",
    "Point": "of a path in an experiment; of a map, in the books of tracking and of mapping",
    "Run": "what one run of an experiment gave; no module sees two of them",
    **dict.fromkeys(
        ("Settings", *(f"{part}Settings" for part in ("Feature", "Start", "Tracker", "Keyframe", "Mapper"))),
        "of PTAM, and the same parts of ORB-SLAM: no module sees both but by the name of the system",
    ),
    "Side": "one keyframe of two, in the book of mapping and in the fast module",
    "State": "a filter's means and blocks; how a patch's refinement ended",
    "Step": "of a descent, in the book of features and in least squares",
    "Tracker": "of a camera, in PTAM; of moving things, in the grids",
}
"""Class names that stand in two modules or more -> why they may.  Another one needs a better name."""


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


def test_a_class_name_stands_for_one_thing() -> None:
    """A reader who meets a name on a page finds one class of that name; the exceptions have a reason."""
    places = defaultdict(set)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].add(str(path.relative_to(PACKAGE)))
    twice = {name: sorted(files) for name, files in places.items() if len(files) > 1}
    assert set(twice) == set(NAMED_TWICE), {name: twice.get(name) for name in set(twice) ^ set(NAMED_TWICE)}
