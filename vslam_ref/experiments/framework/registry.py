"""From an id to its experiment.

Every module of ``vslam_ref.experiments`` with a top-level ``EXPERIMENT = Experiment(...)`` is found
by reading its source; it is imported only when it is run.  So ``vslam-ref list`` imports neither
SciPy nor matplotlib, and a new experiment needs no entry in any table.
"""

from __future__ import annotations

import ast
import importlib
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from vslam_ref.experiments.framework.experiment import Experiment
from vslam_ref.support.errors import InputError, suggestion

PACKAGE = "vslam_ref.experiments"
_registered: dict[str, Experiment[Any]] = {}


class Summary(NamedTuple):
    """What a listing shows of an experiment."""

    id: str
    title: str
    source: str


def register(experiment: Experiment[Any]) -> None:
    """Make an experiment defined outside the package known under its id.

    Raises
    ------
    ValueError
        If the id is taken.
    """
    if experiment.id in _registered or experiment.id in _modules():
        raise ValueError(f"experiment id {experiment.id!r} is already taken")
    _registered[experiment.id] = experiment


def unregister(id: str) -> None:
    """Forget an experiment added by :func:`register`."""
    del _registered[id]


def summaries() -> list[Summary]:
    """Return all experiments, sorted by id, without importing them."""
    added = [Summary(e.id, e.title, e.source) for e in _registered.values()]
    return sorted([*_modules().values(), *added])


def load(id: str) -> Experiment[Any]:
    """Import and return the experiment called ``id``.

    Raises
    ------
    InputError
        If there is none, with the nearest id and all ids.
    """
    if id in _registered:
        return _registered[id]
    if id not in _modules():
        known = [s.id for s in summaries()]
        raise InputError(
            f"unknown experiment {id!r}{suggestion(id, known)}; known: {', '.join(known) or 'none'}"
        )
    module = importlib.import_module(f"{PACKAGE}.{module_name(id)}")
    experiment: Experiment[Any] = module.EXPERIMENT
    return experiment


def module_name(id: str) -> str:
    """Name of the module of an experiment.

    >>> module_name("multiview-fig1.1")
    'multiview_fig1_1'
    """
    return id.replace("-", "_").replace(".", "_")


@cache
def _modules() -> dict[str, Summary]:
    """Find the experiment modules of the package by reading their sources."""
    found = (_read(path) for path in sorted(Path(__file__).parent.parent.glob("*.py")))
    return {summary.id: summary for summary in found if summary}


def _read(path: Path) -> Summary | None:
    """Read id, title and source from the literal arguments of ``EXPERIMENT = Experiment(...)``."""
    source = path.read_text(encoding="utf-8")
    if "EXPERIMENT" not in source:
        return None
    for node in ast.parse(source, str(path)).body:
        if isinstance(node, ast.AnnAssign):
            targets: list[ast.expr] = [node.target]
        elif isinstance(node, ast.Assign):
            targets = node.targets
        else:
            continue
        if any(isinstance(t, ast.Name) and t.id == "EXPERIMENT" for t in targets):
            return _summary(path, node.value)
    return None


def _summary(path: Path, call: ast.expr | None) -> Summary:
    keywords = call.keywords if isinstance(call, ast.Call) else []
    given = {k.arg: k.value.value for k in keywords if isinstance(k.value, ast.Constant)}
    missing = [name for name in Summary._fields if not isinstance(given.get(name), str)]
    if missing:
        raise ValueError(f"{path}: EXPERIMENT must give {', '.join(missing)} as literal keyword strings")
    if module_name(str(given["id"])) != path.stem:
        raise ValueError(f"{path}: EXPERIMENT has id {given['id']!r}, which belongs in another file")
    return Summary(*(str(given[name]) for name in Summary._fields))
