"""The record that makes a module an experiment: data and a few functions."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from vslam_ref.experiments.framework.claims import Claim
from vslam_ref.experiments.framework.driver import Study, Unit, child_seeds, gather, plan, run_plan
from vslam_ref.experiments.framework.kept import Kept
from vslam_ref.experiments.framework.scheduler import RunContext
from vslam_ref.support.config import apply_overrides, find_setting, replace_settings, settings
from vslam_ref.support.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vslam_ref.plot.saving import Figure

C = TypeVar("C")


def scale_runs(config: C, runs: int) -> C:
    """Set ``runs``, the size of the sample that is judged like the paper's, to ``runs``.

    A ``population`` behind the sample grows or shrinks in proportion, rounded up, so that shares
    over samples keep their meaning.  Both fields may lie in a config inside the config.

    Raises
    ------
    InputError
        If the config has no setting ``runs``.
    """
    key = find_setting(config, "runs")
    if key is None:
        raise InputError("this experiment has no setting 'runs': leave --runs out")
    old = {s.key: s.value for s in settings(config)}
    new = {key: runs}
    population = key.removesuffix("runs") + "population"
    if population in old:
        new[population] = math.ceil(old[population] * runs / old[key])
    return replace_settings(config, new)


def one_point(config: Any) -> Sequence[Any]:
    """Return the default design: one point, which needs no name."""
    return [None]


def nothing(config: Any) -> None:
    """Compute nothing beside the runs."""
    return None


def nothing_missing(config: Any) -> Sequence[str]:
    """Return no data set: the experiment makes its own inputs."""
    return ()


def _runs(study: Study[Any]) -> int | None:
    return study.runs


def fields_as_arrays(study: Study[Any]) -> dict[str, NDArray[Any]]:
    """Return every field of a study: by its name, or as ``field/point`` where the points have names."""
    if not isinstance(study.data, dict):
        return dict(study.data._asdict())
    return {f"{f}/{name}": a for name, part in study.data.items() for f, a in part._asdict().items()}


@dataclass(frozen=True)
class Experiment(Generic[C]):
    """One figure, table or claim that can be drawn again.

    Parameters
    ----------
    id : str
        Lower-case words joined by ``-``, or ``.`` in a number; its first word is the module's folder.
    title, source : str
        What it shows; the paper and the place in it.
    config_type : type
        Frozen dataclass, every field with ``metadata={"reason": ..., "unit": ...}``.
    simulate : callable
        ``simulate(config, point, unit) -> NamedTuple`` of arrays and numbers: one run, or a batch of runs, at
        one point of the design.  A function at the top level of a module, and a function of its arguments
        alone.  None where recorded data are looked at, once.
    series : callable
        ``series(study) -> mapping``: what the figure draws, for ``result.json``.
    claims : callable
        ``claims(study) -> list[Claim]``.
    figure : callable
        ``figure(study) -> matplotlib.figure.Figure``.
    about : mapping
        What each array of ``runs.npz`` is and what its axes are, by its key up to the first ``/``.
    quick : mapping
        Dotted keys and values of a small version that takes seconds (``--quick``).
    points : callable
        ``points(config) -> sequence``: densities, filters, ...; one point unless given.
    name : callable, optional
        ``name(point) -> str``, where points are distinguished by name and need not have equally many runs.
    seeds : callable
        ``seeds(config, point) -> sequence`` of units: one ``SeedSequence`` per run, a tuple of them per
        batch, the number of a recorded case, or None where nothing is drawn.
    once : callable
        ``once(config)``: what is computed beside the runs, in this process.
    sample : callable
        ``sample(study) -> int``: how many runs, or what stands for them, were judged; the setting ``runs``
        unless given.
    arrays : callable
        ``arrays(study) -> mapping`` for ``runs.npz``; all fields unless given.
    defaults : mapping
        Dotted keys that differ from the defaults of ``config_type``.
    with_runs : callable
        ``with_runs(config, n) -> config`` (``--runs n``); :func:`scale_runs` unless given.
    missing : callable
        ``missing(config) -> sequence of str``: names of the data sets without which it cannot be run on this
        machine; none unless given.
    """

    id: str
    title: str
    source: str
    config_type: type[C]
    simulate: Callable[[Any, Any, Any], Any] | None
    series: Callable[[Study[Any]], Mapping[str, Any]]
    claims: Callable[[Study[Any]], list[Claim]]
    figure: Callable[[Study[Any]], Figure]
    about: Mapping[str, str]
    quick: Mapping[str, Any] = field(default_factory=dict)
    points: Callable[[Any], Sequence[Any]] = one_point
    name: Callable[[Any], str] | None = None
    seeds: Callable[[Any, Any], Sequence[Unit]] = child_seeds
    once: Callable[[Any], Any] = nothing
    sample: Callable[[Study[Any]], int | None] = _runs
    arrays: Callable[[Study[Any]], Mapping[str, Any]] = fields_as_arrays
    defaults: Mapping[str, Any] = field(default_factory=dict)
    with_runs: Callable[[C, int], C] = scale_runs
    missing: Callable[[Any], Sequence[str]] = nothing_missing

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9]+([-.][a-z0-9]+)*", self.id):
            raise ValueError(f"experiment id {self.id!r}: use lower-case words joined by '-' or '.'")
        if not dataclasses.is_dataclass(self.config_type):
            raise ValueError(f"experiment {self.id!r}: config_type must be a dataclass")
        if not self.config_type.__dataclass_params__.frozen:  # type: ignore[attr-defined]
            raise ValueError(f"experiment {self.id!r}: config_type must be a frozen dataclass")

    def run(self, config: C, context: RunContext | None = None, kept: Kept | None = None) -> Study[Any]:
        """Simulate everything; results are the same bytes wherever and in however many parts it is run.

        Parameters
        ----------
        config : object
            See :meth:`configure`.
        context : RunContext, optional
            Where the runs are computed; in this process when left out.
        kept : Kept, optional
            Batches that an earlier, interrupted run has finished.
        """
        if self.simulate is None:
            return Study(config, None, self.once(config))
        points = self.points(config)
        work = plan(self.simulate, config, points, self.seeds)
        results = run_plan(work, context or RunContext(), kept or Kept(), self.id)
        return Study(config, gather(work, results, points, self.name), self.once(config))

    def judge(self, study: Study[Any], quick: bool = False) -> tuple[Claim, ...]:
        """Return the claims, with the number of runs they were judged on and whether it was a quick run."""
        sample = self.sample(study)
        return tuple(
            dataclasses.replace(c, quick=quick, runs=sample if c.runs is None and c.least_runs else c.runs)
            for c in self.claims(study)
        )

    def default(self) -> C:
        """Return the config used when nothing is asked for."""
        return replace_settings(self.config_type(), self.defaults)

    def configure(
        self,
        *,
        quick: bool = False,
        runs: int | None = None,
        seed: int | None = None,
        overrides: Sequence[str] = (),
    ) -> C:
        """Return the default config with quick, runs, seed and ``key=value`` applied in this order.

        Raises
        ------
        InputError
            One line that begins with the experiment's id.
        """
        try:
            config = self.default()
            config = replace_settings(config, self.quick) if quick else config
            config = self.with_runs(config, runs) if runs is not None else config
            if seed is not None:
                key = find_setting(config, "seed")
                if key is None:
                    raise InputError("this experiment draws no random numbers: leave --seed out")
                config = replace_settings(config, {key: seed})
            return apply_overrides(config, overrides)
        except ValueError as error:
            raise InputError(f"{self.id}: {error}") from error
