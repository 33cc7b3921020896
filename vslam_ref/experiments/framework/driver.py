"""From ``simulate(config, point, seed)`` to the arrays of a whole study.

::

    points(config)  x  seeds(config, point)  -->  tasks  --simulate-->  one NamedTuple per task
                                                                             |
                          Study: the same NamedTuple, its fields stacked <---+

A *unit* is what one task draws from: a ``SeedSequence`` for one run, a tuple of them for a batch of runs, the
number of a recorded case, or None where nothing is drawn.  Results of single runs are stacked, those of
batches joined; either way the runs come first.  Points with a name give a dictionary of such arrays by name;
points without are stacked in front of the runs, unless there is only the one default point.
"""

from __future__ import annotations

import typing
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from vslam_ref.experiments.framework.kept import Kept
from vslam_ref.experiments.framework.scheduler import RunContext
from vslam_ref.support.config import find_setting, settings

D = TypeVar("D")
Unit = Any
"""None, a number, a SeedSequence, or a tuple of them."""


@dataclass(frozen=True)
class Study(Generic[D]):
    """All runs of an experiment.

    Attributes
    ----------
    config : object
        The experiment's config.
    data : NamedTuple or dict of str to NamedTuple
        What ``simulate`` returned, stacked.
    once : object
        What the experiment's ``once`` returned.
    """

    config: Any
    data: D
    once: Any = None

    @property
    def seed(self) -> int | None:
        """Root of all randomness, or None."""
        return typing.cast("int | None", setting(self.config, "seed"))

    @property
    def runs(self) -> int | None:
        """Size of the judged sample, or None."""
        return typing.cast("int | None", setting(self.config, "runs"))

    def rng(self, *salt: int) -> np.random.Generator:
        """Return a generator for one purpose of the evaluation, such as one claim's intervals."""
        return np.random.default_rng([setting(self.config, "seed"), *salt])


class Task(NamedTuple):
    """What a worker is sent."""

    simulate: Callable[[Any, Any, Any], Any]
    config: Any
    point: Any
    unit: Unit


class Plan(NamedTuple):
    """The tasks of a study, the number of the point of each, and how many runs each holds."""

    tasks: list[Task]
    point: list[int]
    runs: list[int]


def setting(config: Any, name: str) -> Any:
    """Value of the setting called ``name``, wherever it lies in the config, or None."""
    key = find_setting(config, name)
    return None if key is None else next(s.value for s in settings(config) if s.key == key)


def child_seeds(config: Any, point: Any) -> list[Unit]:
    """Return one child of the config's seed per run, the same for every point: paired runs."""
    return list(np.random.SeedSequence(setting(config, "seed")).spawn(setting(config, "runs")))


def batches(seeds: Sequence[np.random.SeedSequence], size: int) -> list[Unit]:
    """Put seeds together in batches of a fixed size."""
    return [tuple(seeds[first : first + size]) for first in range(0, len(seeds), size)]


def carry_out(task: Task) -> Any:
    """Run one task: a function of its content alone."""
    return task.simulate(task.config, task.point, _fresh(task.unit))


def _fresh(unit: Unit) -> Unit:
    """Copy seeds, so that nothing depends on what was spawned from them before."""
    if isinstance(unit, tuple):
        return tuple(_fresh(seed) for seed in unit)
    if unit is None or isinstance(unit, int):
        return unit
    return np.random.SeedSequence(unit.entropy, spawn_key=unit.spawn_key)


def plan(
    simulate: Callable[[Any, Any, Any], Any],
    config: Any,
    points: Sequence[Any],
    seeds: Callable[[Any, Any], Sequence[Unit]],
) -> Plan:
    """List the tasks of a study, in a fixed order."""
    rows = [(number, point, unit) for number, point in enumerate(points) for unit in seeds(config, point)]
    return Plan(
        [Task(simulate, config, point, unit) for _, point, unit in rows],
        [number for number, _, _ in rows],
        [len(unit) if isinstance(unit, tuple) else 1 for _, _, unit in rows],
    )


def run_plan(work: Plan, context: RunContext, kept: Kept, label: str) -> list[Any]:
    """Carry out the tasks that no interrupted run has finished before; results in the order of the tasks."""
    record = typing.get_type_hints(work.tasks[0].simulate)["return"]
    done = {i: found for i in range(len(work.tasks)) if (found := kept.get(i, record)) is not None}
    open_tasks = [i for i in range(len(work.tasks)) if i not in done]

    def keep(number: int, result: Any) -> None:
        kept.put(open_tasks[number], result)

    new = context.map(
        carry_out,
        [work.tasks[i] for i in open_tasks],
        label,
        sizes=[work.runs[i] for i in open_tasks],
        already=sum(work.runs[i] for i in done),
        finished=keep,
    )
    done |= dict(zip(open_tasks, new, strict=True))
    return [done[i] for i in range(len(work.tasks))]


def stack(results: Sequence[Any], units: Sequence[Unit]) -> Any:
    """Put the runs of one point together, field by field."""
    join = np.concatenate if isinstance(units[0], tuple) else np.array
    return type(results[0])(*(join(column) for column in zip(*results, strict=True)))


def gather(
    work: Plan, results: Sequence[Any], points: Sequence[Any], name: Callable[[Any], str] | None
) -> Any:
    """Put all runs together: by the names of the points, or stacked."""
    parts = []
    for number in range(len(points)):
        mine = [i for i, p in enumerate(work.point) if p == number]
        parts.append(stack([results[i] for i in mine], [work.tasks[i].unit for i in mine]))
    if name is not None:
        return {name(point): part for point, part in zip(points, parts, strict=True)}
    if len(points) == 1 and points[0] is None:
        return parts[0]
    return type(parts[0])(*(np.stack(column) for column in zip(*parts, strict=True)))
