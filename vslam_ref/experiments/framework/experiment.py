"""The record that makes a module an experiment, and what its ``run`` is handed."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from vslam_ref.experiments.framework.claims import Claim
from vslam_ref.experiments.framework.results import Result
from vslam_ref.experiments.framework.scheduler import run_batches
from vslam_ref.support.config import apply_overrides, find_setting, replace_settings, settings
from vslam_ref.support.errors import InputError

if TYPE_CHECKING:
    from vslam_ref.plot.saving import Figure

C = TypeVar("C")
T = TypeVar("T")
R = TypeVar("R")


@dataclass(frozen=True)
class RunContext:
    """How to run, as opposed to what: none of it may change a number of the result.

    Parameters
    ----------
    jobs : int
        Worker processes; 1 stays in this process.
    scheduler : {"local", "dask"}
        Where batches go.
    dask_address : str or None
        ``tcp://host:port`` of a running Dask scheduler, for ``scheduler="dask"``.
    progress : bool
        Show a progress bar on stderr, if that is a terminal.
    """

    jobs: int = 1
    scheduler: str = "local"
    dask_address: str | None = None
    progress: bool = False
    _shared: dict[Hashable, Any] = field(default_factory=dict, repr=False, compare=False)

    def map(self, function: Callable[[T], R], batches: Sequence[T], label: str = "") -> list[R]:
        """Return ``[function(b) for b in batches]``, computed where this context says."""
        return run_batches(
            function,
            batches,
            jobs=self.jobs,
            scheduler=self.scheduler,
            dask_address=self.dask_address,
            progress=self.progress,
            label=label,
        )

    def shared(self, key: Hashable, compute: Callable[[], R]) -> R:
        """Return ``compute()``, run once per key however many experiments of one command ask for it."""
        if key not in self._shared:
            self._shared[key] = compute()
        return self._shared[key]  # type: ignore[no-any-return]


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


@dataclass(frozen=True)
class Experiment(Generic[C]):
    """One figure, table or claim that can be drawn again.

    Parameters
    ----------
    id : str
        Lower-case words joined by ``-``, or ``.`` in a number; the module has the same name with ``_``.
    title, source : str
        What it shows; the paper and the place in it.
    config_type : type
        Frozen dataclass, every field with ``metadata={"reason": ..., "unit": ...}``.
    run : callable
        ``run(config, context) -> Result``.  All randomness comes from ``config``'s seed.
    claims : callable
        ``claims(result) -> list[Claim]``.
    figure : callable
        ``figure(result) -> matplotlib.figure.Figure``.
    quick : callable
        ``quick(config) -> config``: a small version that takes seconds (``--quick``).
    defaults : mapping
        Dotted keys that differ from the defaults of ``config_type``.
    with_runs : callable
        ``with_runs(config, n) -> config`` (``--runs n``); :func:`scale_runs` unless told otherwise.
    """

    id: str
    title: str
    source: str
    config_type: type[C]
    run: Callable[[C, RunContext], Result]
    claims: Callable[[Result], list[Claim]]
    figure: Callable[[Result], Figure]
    quick: Callable[[C], C]
    defaults: Mapping[str, Any] = field(default_factory=dict)
    with_runs: Callable[[C, int], C] = scale_runs

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9]+([-.][a-z0-9]+)*", self.id):
            raise ValueError(f"experiment id {self.id!r}: use lower-case words joined by '-' or '.'")
        if not dataclasses.is_dataclass(self.config_type):
            raise ValueError(f"experiment {self.id!r}: config_type must be a dataclass")
        if not self.config_type.__dataclass_params__.frozen:  # type: ignore[attr-defined]
            raise ValueError(f"experiment {self.id!r}: config_type must be a frozen dataclass")

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
            config = self.quick(config) if quick else config
            config = self.with_runs(config, runs) if runs is not None else config
            if seed is not None:
                key = find_setting(config, "seed")
                if key is None:
                    raise InputError("this experiment draws no random numbers: leave --seed out")
                config = replace_settings(config, {key: seed})
            return apply_overrides(config, overrides)
        except ValueError as error:
            raise InputError(f"{self.id}: {error}") from error
