"""What a verdict needs to know about one claim, computed for many claims in one pass over the draws."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.experiments.iekf import worlds
from vslam_ref.experiments.iekf.measures import StudyClock
from vslam_ref.experiments.iekf.rules import Rule
from vslam_ref.experiments.iekf.sentences import Sentence
from vslam_ref.experiments.iekf.worlds import Pick, Series
from vslam_ref.metrics import consistency

LEVEL = 0.95


@dataclass(frozen=True)
class ClaimEvaluation:
    """Everything that was computed for one claim; arrays run over drawn studies of B's size.

    Attributes
    ----------
    sentence : Sentence
    threshold : float
        The calibrated or declared bound of the statistic.
    own, population : float
        The statistic of B's own runs (the first ones) and of the whole population.
    own_naive : bool or None
        Naive reading on B's own runs.
    interval : (float, float)
        95 % whole-run bootstrap interval of ``population``.
    subsets : ndarray, shape (S,)
        The statistic of drawn studies.
    naive : ndarray of bool, shape (S,), or None
        Naive reading of drawn studies.
    share_interval : (float, float)
        95 % interval of the share over resampled populations.
    null_rate : float
        Share of studies of the null world in which the rule says yes.
    population_runs, study_runs : int
        Runs of the whole population, and of one study.
    """

    sentence: Sentence
    threshold: float
    own: float
    own_naive: bool | None
    population: float
    interval: tuple[float, float]
    subsets: Array
    naive: NDArray[np.bool_] | None
    share_interval: tuple[float, float]
    null_rate: float
    population_runs: int = 0
    study_runs: int = 0

    @property
    def holds(self) -> NDArray[np.bool_]:
        """Whether the claim holds, per drawn study."""
        return self.sentence.rule.holds(self.subsets, self.threshold)

    @property
    def share(self) -> float:
        """Share of drawn studies in which the claim holds."""
        return float(np.mean(self.holds))


@dataclass(frozen=True)
class _Null:
    """The statistic where the claim is false (``false``), and in the world that sets the threshold."""

    false: Array
    calm: Array | None


def evaluate_all(
    sentences: Sequence[Sentence], data: Series, control: Series, clock: StudyClock, rng: np.random.Generator
) -> list[ClaimEvaluation]:
    """Evaluate claims on the per-run arrays of a study.

    Parameters
    ----------
    sentences : sequence of Sentence
    data : mapping of str to ndarray, shape (M, T)
        The study's series by the names the rules use; rows are the same runs.
    control : mapping of str to ndarray, shape (C, T)
        The consistent control; may be empty if no rule needs it.
    clock : StudyClock
    rng : Generator
        Every purpose gets its own child, so a claim's numbers do not depend on which others are asked for.

    Returns
    -------
    list of ClaimEvaluation
    """
    if not sentences:
        return []
    rules = {s.id: s.rule for s in sentences}
    streams = dict(zip(("subsets", "bootstrap", "nested", "null"), rng.spawn(4), strict=True))
    whole = {name: x.mean(axis=0)[None] for name, x in data.items()}
    own = {name: x[: clock.runs].mean(axis=0)[None] for name, x in data.items()}
    drawn, naive = _both(rules, worlds.subsets(data, clock.runs, streams["subsets"]), clock)
    resampled = _collect(rules, worlds.bootstraps(data, streams["bootstrap"]), worlds.as_is, clock)
    nested = _collect(
        rules, worlds.resampled_subsets(data, clock.runs, streams["nested"]), worlds.as_is, clock
    )
    nulls = _nulls(rules, data, control, clock, streams["null"])
    evaluations = []
    for s in sentences:
        threshold = _threshold(s.rule, nulls[s.id].calm)
        shares = s.rule.holds(nested[s.id], threshold).reshape(worlds.OUTER, worlds.INNER).mean(axis=1)
        pointwise = s.rule.naive
        evaluations.append(
            ClaimEvaluation(
                sentence=s,
                threshold=threshold,
                own=float(s.rule.measure.compute(worlds.as_is(s.rule, own), clock)[0]),
                own_naive=bool(pointwise.holds(worlds.as_is(s.rule, own), clock)[0]) if pointwise else None,
                population=float(s.rule.measure.compute(worlds.as_is(s.rule, whole), clock)[0]),
                interval=consistency.percentile_interval(resampled[s.id], LEVEL),
                subsets=drawn[s.id],
                naive=naive[s.id],
                share_interval=consistency.percentile_interval(shares, LEVEL),
                null_rate=float(np.mean(s.rule.holds(nulls[s.id].false, threshold))),
                population_runs=len(next(iter(data.values()))),
                study_runs=clock.runs,
            )
        )
    return evaluations


def _threshold(rule: Rule, calm: Array | None) -> float:
    """Return the calibrated or the declared bound; of both, the larger."""
    bounds = [] if rule.effect is None else [rule.effect]
    if rule.calibrated and calm is not None:
        bounds.append(float(np.quantile(calm, LEVEL)))
    return max(bounds)


def _collect(
    rules: Mapping[str, Rule], draws: Iterable[Series], pick: Pick, clock: StudyClock
) -> dict[str, Array]:
    """Statistic of every rule over all draws of a pass."""
    parts: dict[str, list[Array]] = {i: [] for i in rules}
    for curves in draws:
        for i, rule in rules.items():
            parts[i].append(rule.measure.compute(pick(rule, curves), clock))
    return {i: np.concatenate(p) for i, p in parts.items()}


def _both(
    rules: Mapping[str, Rule], draws: Iterable[Series], clock: StudyClock
) -> tuple[dict[str, Array], dict[str, NDArray[np.bool_] | None]]:
    """Statistic and naive reading of every rule over all draws of the study."""
    values: dict[str, list[Array]] = {i: [] for i in rules}
    truths: dict[str, list[NDArray[np.bool_]]] = {i: [] for i in rules}
    for curves in draws:
        for i, rule in rules.items():
            picked = worlds.as_is(rule, curves)
            values[i].append(rule.measure.compute(picked, clock))
            if rule.naive is not None:
                truths[i].append(rule.naive.holds(picked, clock))
    naive = {i: np.concatenate(truths[i]) if truths[i] else None for i in rules}
    return {i: np.concatenate(values[i]) for i in rules}, naive


def _nulls(
    rules: Mapping[str, Rule], data: Series, control: Series, clock: StudyClock, rng: np.random.Generator
) -> dict[str, _Null]:
    """Null worlds of all rules.  What sets a threshold and what rates it are drawn apart."""
    swap_a, swap_b, control_a, control_b, scale = rng.spawn(5)
    size = clock.runs
    swap = {i: r for i, r in rules.items() if r.null == "swapped"}
    fixed = {i: r for i, r in rules.items() if r.null == "scaled"}
    rest = {i: r for i, r in rules.items() if r.null not in ("swapped", "scaled")}
    nulls: dict[str, _Null] = {}
    if swap:
        part = _only(data, swap)
        calm = _collect(swap, worlds.swaps(part, size, swap_a), worlds.swapped, clock)
        false = _collect(swap, worlds.swaps(part, size, swap_b), worlds.swapped, clock)
        nulls |= {i: _Null(false[i], calm[i]) for i in swap}
    if fixed:
        whole = {name: x.mean(axis=0)[None] for name, x in data.items()}
        pass_ = worlds.subsets(_only(data, fixed), size, scale)
        false = _collect(fixed, pass_, worlds.scaled(clock, whole), clock)
        nulls |= {i: _Null(false[i], None) for i in fixed}
    if rest:
        half = len(next(iter(control.values()))) // 2
        first = worlds.centred({name: x[:half] for name, x in control.items()})
        second = worlds.centred({name: x[half:] for name, x in control.items()})
        calm = _collect(rest, worlds.subsets(first, size, control_a), worlds.consistent, clock)
        false = _collect(rest, worlds.subsets(second, size, control_b), worlds.false_control(clock), clock)
        nulls |= {i: _Null(false[i], calm[i]) for i in rest}
    return nulls


def _only(data: Series, rules: Mapping[str, Rule]) -> dict[str, Array]:
    """Keep the series that these rules use."""
    used = {name for rule in rules.values() for name in rule.series}
    return {name: x for name, x in data.items() if name in used}
