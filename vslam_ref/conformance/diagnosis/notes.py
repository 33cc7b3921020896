"""The mistakes that the vectors carry, tested on all cases that carry them."""

from __future__ import annotations

from collections.abc import Iterator

from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess
from vslam_ref.conformance.results import Outcome
from vslam_ref.conformance.statistics import mistaken
from vslam_ref.conformance.vectors_format import Case


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
            yield f"{note}: {evidence.file.notes[note]['meaning']}"
            return
    measures = sorted({str((o.case.statistic or {}).get("measure")) for o in bad})
    yield f"the distribution is off in {' and '.join(measures)}"


def _agreed(random: list[Outcome], note: str) -> bool:
    """Whether every case that carries a note has it, and one of them at least."""
    carry = [o for o in random if note in (o.case.statistic or {}).get("mistakes", {})]
    single = [o._replace(case=_only(o.case, note)) for o in carry]
    return bool(carry) and all(isinstance(o.got, dict) and mistaken(o.case, o.got) == note for o in single)


def _only(case: Case, note: str) -> Case:
    """The case with one mistake: bands of two may overlap."""
    rule = dict(case.statistic or {})
    return case._replace(statistic={**rule, "mistakes": {note: rule["mistakes"][note]}})
