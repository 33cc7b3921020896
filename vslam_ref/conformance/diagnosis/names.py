"""One name for each function that fails: the most particular guess that all its cases bear out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from vslam_ref.conformance.compare import Profile
from vslam_ref.conformance.diagnosis import places, sizes
from vslam_ref.conformance.diagnosis.changes import echoes, lost, undone
from vslam_ref.conformance.diagnosis.declared import declared
from vslam_ref.conformance.diagnosis.evidence import Ask, Evidence, Guess, Judged, gather, mostly, predicts, repairs
from vslam_ref.conformance.diagnosis.filters import added_noise, spoiled
from vslam_ref.conformance.diagnosis.formulas import formulas
from vslam_ref.conformance.diagnosis.notes import noted, random_note
from vslam_ref.conformance.diagnosis.one_change import one_change
from vslam_ref.conformance.diagnosis.turns import turns

NOTHING = "nothing that is known fits"


class Family(NamedTuple):
    """Guesses of one kind, and how they are tested."""

    guesses: Callable[[Evidence], Iterator[tuple[str, Guess]]]
    test: Callable[[Evidence, Guess], int]


FAMILIES = (
    Family(noted, predicts),
    Family(declared, mostly),
    Family(formulas, predicts),
    Family(spoiled, predicts),
    Family(echoes, predicts),
    Family(turns, repairs),
    Family(undone, repairs),
    Family(lost, predicts),
    Family(one_change, predicts),
)
"""In this order; the first name that fits is taken."""


def name_functions(outcomes: Iterable[Judged], ask: Ask, profile: Profile = "float64") -> dict[str, str]:
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
    if found := _searched(evidence):
        return found
    if odd := added_noise(evidence) or places.shape(evidence) or sizes.odd(evidence) or sizes.single(evidence):
        return odd
    place = places.where(evidence)
    if place and (found := _searched(evidence._replace(passed=[]))):
        return f"{place}: {found}"
    if found := sizes.digits(evidence):
        return found
    parts = [part for part in (place, places.entries(evidence)) if part]
    return ": ".join(parts)


def _searched(evidence: Evidence) -> str:
    """The guess that explains all failures, or else most, and against which no case speaks."""
    best, most = "", 0
    for family in FAMILIES:
        for sentence, guess in family.guesses(evidence):
            count = family.test(evidence, guess)
            if count > most:
                best, most = sentence, count
            if count == len(evidence.failed):
                return sentence
    left = len(evidence.failed) - most
    return f"{best} ({left} of {len(evidence.failed)} failures it does not explain)" if best else ""


def _unasked(evidence: Evidence) -> Iterator[str]:
    """What is said of questions without an answer, and of answers that did not come."""
    if evidence.not_refused:
        some = f"{len(evidence.not_refused)} of {len(evidence.not_refused) + len(evidence.refused)}"
        yield f"answers what must be refused ({some} such cases)"
    if evidence.errors:
        first = evidence.errors[0].cause.partition("\n")[0][:100]
        lost_cases = evidence._replace(failed=[_seen(o) for o in evidence.errors], passed=evidence.plain)
        place = places.where(lost_cases)
        yield f"no usable answer in {len(evidence.errors)} cases{f', {place}' if place else ''}: {first}"


def _seen(outcome: Judged):  # type: ignore[no-untyped-def]
    from vslam_ref.conformance.diagnosis.evidence import Seen

    return Seen(outcome.case, {})
