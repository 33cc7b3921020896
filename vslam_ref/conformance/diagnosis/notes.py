"""The mistakes that the vectors carry, tested on all cases that carry them."""

from __future__ import annotations

from collections.abc import Iterator

from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess
from vslam_ref.conformance.results import Outcome
from vslam_ref.conformance.statistics import mistaken
from vslam_ref.conformance.vectors_format import Case

MEASURES = 2
"""Different measures of a distribution that a name needs: many wrong ones share one."""


def noted(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Notes of the failed cases, those that most of them carry first."""
    counts: dict[str, int] = {}
    for seen in evidence.failed:
        for note in seen.case.mistakes:
            counts[note] = counts.get(note, 0) + 1
    for note in sorted(counts, key=lambda n: -counts[n]):
        yield f"{note}: {evidence.file.notes[note]['meaning']}", _of(note)


def _of(note: str) -> Guess:
    """What a case says that this mistake answers; where it does not know, nothing speaks for or against."""

    def guess(case: Case, got: Answer) -> Answer | None:
        return case.mistakes.get(note)

    return guess


def random_note(evidence: Evidence) -> Iterator[str]:
    """The wrong distribution that all statistical cases agree on, or which measures are off."""
    bad = [o for o in evidence.random if o.status == "failed"]
    if not bad:
        return
    notes = {note for o in evidence.random for note in (o.case.statistic or {}).get("mistakes", {})}
    for note in sorted(notes):
        if _agreed(evidence.random, note):
            yield _worded(evidence, note)
            return
    measures = sorted({str((o.case.statistic or {}).get("measure")) for o in bad})
    yield f"the distribution is off in {' and '.join(measures)}"


def _worded(evidence: Evidence, note: str) -> str:
    """A name where two measures agree; of one it can only be said that this mistake gives it, too."""
    told = f"{note}: {evidence.file.notes[note]['meaning']}"
    rules = [o.case.statistic or {} for o in evidence.random]
    measures = {str(rule["measure"]) for rule in rules if note in rule.get("mistakes", {})}
    if len(measures) >= MEASURES:
        return told
    return f"the distribution is off in {measures.pop()}, as by this mistake, or another: {told}"


def _agreed(random: list[Outcome], note: str) -> bool:
    """Whether every case that carries a note has it, and one of them at least."""
    carry = [o for o in random if note in (o.case.statistic or {}).get("mistakes", {})]
    single = [o._replace(case=_only(o.case, note)) for o in carry]
    return bool(carry) and all(isinstance(o.got, dict) and mistaken(o.case, o.got) == note for o in single)


def _only(case: Case, note: str) -> Case:
    """The case with one mistake: bands of two may overlap."""
    rule = dict(case.statistic or {})
    return case._replace(statistic={**rule, "mistakes": {note: rule["mistakes"][note]}})
