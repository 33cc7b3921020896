# ruff: noqa: E501
"""One name for each function that fails: the most particular guess that all its cases bear out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import NamedTuple

from vslam_ref.conformance.compare import Profile
from vslam_ref.conformance.diagnosis import places, sizes
from vslam_ref.conformance.diagnosis.changes import echoes, lost, undone
from vslam_ref.conformance.diagnosis.declared import declared
from vslam_ref.conformance.diagnosis.evidence import (
    AnsweredCase,
    Ask,
    Evidence,
    Guess,
    Test,
    agrees,
    array,
    carried,
    gather,
    mostly,
    predicts,
    repairs,
)
from vslam_ref.conformance.diagnosis.filters import added_noise, spoiled
from vslam_ref.conformance.diagnosis.formulas import formulas
from vslam_ref.conformance.diagnosis.notes import noted, random_note
from vslam_ref.conformance.diagnosis.one_change import lines_of, one_change
from vslam_ref.conformance.diagnosis.shifts import shifted
from vslam_ref.conformance.diagnosis.turns import forward, scaled, turns
from vslam_ref.conformance.results import NOTHING, Outcome

FEW_PASS = 0.25
"""Where fewer pass, for each that fails, the place of the failures says little: what passes is trivial."""

FEWEST_TRIES, MOST_TRIES = 20, 1000
"""Guesses of a family that are tried where many functions are wrong: the fewer, the more are."""
TRIED_LINES = 300_000
"""Lines of the library that they may run together, for one case."""


class Family(NamedTuple):
    """Guesses of one kind, and how they are tested."""

    guesses: Callable[[Evidence], Iterator[tuple[str, Guess]]]
    test: Callable[[Evidence, Guess], Test]


FAMILIES = (
    Family(noted, carried),
    Family(declared, mostly),
    Family(formulas, predicts),
    Family(spoiled, predicts),
    Family(echoes, predicts),
    Family(turns, repairs),
    Family(forward, predicts),
    Family(scaled, repairs),
    Family(undone, repairs),
    Family(lost, predicts),
    Family(shifted, predicts),
    Family(one_change, predicts),
)
"""In this order; the first name that fits is taken."""


def name_functions(outcomes: Iterable[Outcome], ask: Ask, profile: Profile = "float64") -> dict[str, str]:
    """A sentence for every function of which something went wrong.

    Parameters
    ----------
    outcomes : iterable of Outcome
        All of a run.
    ask : callable
        Asks the program again: (function, inputs in the house's convention) -> outputs, or None.
    profile : {"float64", "float32"}

    Returns
    -------
    dict of str to str
        Function -> its name, or :data:`NOTHING`.
    """
    return {evidence.function.name: name(evidence) for evidence in gather(outcomes, ask, profile)}


def name(evidence: Evidence) -> str:
    """The name of one function's failures."""
    others = [*random_note(evidence), *_unasked(evidence)]
    main = _main(evidence) if evidence.failed else ""
    said = [sentence for sentence in (main, *others) if sentence]
    return "; ".join(said) or NOTHING


def _main(evidence: Evidence) -> str:
    """What explains the answers that can be compared."""
    if (strange := places.shape(evidence)) and not any(
        array(value) is not None for seen in evidence.failed for value in seen.got.values()
    ):
        return strange  # no numbers at all: no formula makes them
    if last := sizes.rounding(evidence):
        return last
    if all(agrees(seen.case, seen.got) for seen in evidence.failed):
        return sizes.digits(evidence) or NOTHING  # digits alone: no formula is wrong
    whole, part = _searched(evidence)
    if whole:
        return whole
    if (
        odd := added_noise(evidence)
        or places.shape(evidence)
        or sizes.odd(evidence)
        or sizes.single(evidence)
    ):
        return odd
    if part:
        return part
    if found := sizes.digits(evidence):
        return found
    place, entry = places.where(evidence), places.entries(evidence)
    if place and len(evidence.passed) < FEW_PASS * len(evidence.failed) and not entry:
        return f"{NOTHING}; wrong: {place}"
    return ": ".join(part for part in (place, entry) if part)


def _searched(evidence: Evidence) -> tuple[str, str]:
    """The guess that explains all failures, or else most; and one that explains all, though some cases escape it."""
    best, most, partly = "", 0, ""
    tries = _tries(evidence)
    for family in FAMILIES:
        for sentence, guess in islice(family.guesses(evidence), tries):
            count, against = family.test(evidence, guess)
            if against:
                if family.guesses is not declared:  # a convention holds in all cases, or it is none
                    partly = partly or _part(evidence, sentence, count, against)
                continue
            if count > most:
                best, most = sentence, count
            if count and count >= len(evidence.failed):
                return sentence, ""
    left = len(evidence.failed) - most
    return (f"{best} ({left} of {len(evidence.failed)} failures it does not explain)" if best else ""), partly


def _tries(evidence: Evidence) -> int | None:
    """How many guesses of a family are tried; all where few functions are wrong."""
    if evidence.effort == 1.0:
        return None
    lines = max(1, lines_of(evidence, evidence.failed[0].case))
    return FEWEST_TRIES + int(evidence.effort * min(MOST_TRIES, TRIED_LINES // lines))


def _part(evidence: Evidence, sentence: str, count: int, against: list[AnsweredCase]) -> str:
    """A guess that holds in the failed cases only: where that is, if there is a word for it."""
    if count < len(evidence.failed) or count < places.FEWEST:
        return ""
    place = places.where(evidence, against)
    return (
        f"{place}: {sentence}" if place else f"in {count} of {count + len(evidence.passed)} cases {sentence}"
    )


def _unasked(evidence: Evidence) -> Iterator[str]:
    """What is said of questions without an answer, and of answers that did not come."""
    if evidence.not_refused:
        some = f"{len(evidence.not_refused)} of {len(evidence.not_refused) + len(evidence.refused)}"
        yield f"answers what must be refused ({some} such cases)"
    if evidence.errors:
        first = evidence.errors[0].cause.partition("\n")[0][:100]
        lost_cases = evidence._replace(
            failed=[AnsweredCase(o.case, {}) for o in evidence.errors], passed=evidence.plain
        )
        place = places.where(lost_cases)
        yield f"no usable answer in {len(evidence.errors)} cases{f', {place}' if place else ''}: {first}"
