"""From an id to its experiment.

Every ``Experiment(...)`` of a module ``vslam_ref/experiments/<family>/<name>.py``, alone in ``EXPERIMENT =``
or as a row of the tuple ``EXPERIMENTS =``, is found by reading the source; the module is imported only when
it is run.  So ``vslam-ref list`` imports neither SciPy nor matplotlib, and a new experiment needs no entry in
any table.
"""

from __future__ import annotations

import ast
import importlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from vslam_ref.support.errors import InputError, suggestion

if TYPE_CHECKING:
    from vslam_ref.experiments.framework.experiment import Experiment

PACKAGE = "vslam_ref.experiments"
NAMES = ("EXPERIMENT", "EXPERIMENTS")
_registered: dict[str, Experiment[Any]] = {}


class ExperimentSummary(NamedTuple):
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


def summaries() -> list[ExperimentSummary]:
    """Return all experiments, sorted by id, without importing them."""
    added = [ExperimentSummary(e.id, e.title, e.source) for e in _registered.values()]
    return sorted([*(summary for summary, _ in _modules().values()), *added])


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
    module = importlib.import_module(_modules()[id][1])
    rows = [
        *getattr(module, "EXPERIMENTS", ()),
        *([module.EXPERIMENT] if hasattr(module, "EXPERIMENT") else []),
    ]
    experiment: Experiment[Any] = next(row for row in rows if row.id == id)
    return experiment


@cache
def _modules() -> dict[str, tuple[ExperimentSummary, str]]:
    """Find the experiments of the package, and the modules they stand in, by reading the sources."""
    found: dict[str, tuple[ExperimentSummary, str]] = {}
    for path in sorted(Path(__file__).parent.glob("*/*.py")):
        for summary in read(path):
            if summary.id in found:
                raise ValueError(f"{path}: experiment id {summary.id!r} is already taken")
            found[summary.id] = summary, f"{PACKAGE}.{path.parent.name}.{path.stem}"
    return found


def read(path: Path) -> list[ExperimentSummary]:
    """Read id, title and source of a module's experiments from the literal arguments of their calls.

    Raises
    ------
    ValueError
        If one of the three is no literal, or the id does not begin with the name of the folder.
    """
    source = path.read_text(encoding="utf-8")
    if NAMES[0] not in source:
        return []
    return [
        _summary(path, call) for value in _assigned(ast.parse(source, str(path))) for call in _calls(value)
    ]


def _assigned(tree: ast.Module) -> Iterator[ast.expr]:
    """Values that are assigned to one of :data:`NAMES` at the top level."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        value = getattr(node, "value", None)
        if value is not None and any(isinstance(t, ast.Name) and t.id in NAMES for t in targets):
            yield value


def _calls(value: ast.expr) -> list[ast.Call]:
    """The call itself, or the calls that are rows of a tuple."""
    rows = value.elts if isinstance(value, ast.Tuple) else [value]
    return [row for row in rows if isinstance(row, ast.Call)]


def _summary(path: Path, call: ast.Call) -> ExperimentSummary:
    given = {k.arg: k.value.value for k in call.keywords if isinstance(k.value, ast.Constant)}
    missing = [name for name in ExperimentSummary._fields if not isinstance(given.get(name), str)]
    if missing:
        raise ValueError(f"{path}: EXPERIMENT must give {', '.join(missing)} as literal keyword strings")
    if not str(given["id"]).startswith(f"{path.parent.name}-"):
        raise ValueError(f"{path}: EXPERIMENT has id {given['id']!r}, which belongs in another folder")
    return ExperimentSummary(*(str(given[name]) for name in ExperimentSummary._fields))
