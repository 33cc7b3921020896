"""Making the vectors: seeded, and never with the code that they test.

Each module is one topic and has ``TOPIC``, ``CHAPTER`` and ``build(rng) -> Topic``.  Expected values come
from oracles: 50-digit arithmetic from the definition (:mod:`.exact`), sympy, SciPy, published files.  An
import contract keeps the library's own geometry, estimation, filters and grids out of this package.
"""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

HELPERS = (
    "angles",
    "ekf_others",
    "ekf_sizes",
    "edges",
    "lens_grid",
    "solver_runs",
    "exact",
    "building",
    "curve_matches",
    "draws",
    "writing",
    "exact_arrays",
    "exact_ekf",
    "exact_lift",
    "exact_moments",
    "exact_quantiles",
    "exact_rays",
    "random_answers",
    "world",
    "groups",
    "lenses",
    "lens_slopes",
    "pairs",
    "normal",
    "resecting",
    "similarity",
    "two_maps",
    "two_views_costs",
    "views",
)


def topics() -> dict[str, ModuleType]:
    """Modules of all topics, by the name of their file, ``chapter/topic.json``."""
    found = {}
    for info in pkgutil.iter_modules(__path__):
        if info.name not in HELPERS:
            module = importlib.import_module(f"{__name__}.{info.name}")
            found[f"{module.CHAPTER:02d}/{module.TOPIC}.json"] = module
    return dict(sorted(found.items()))
