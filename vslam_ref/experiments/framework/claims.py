"""A claim: one sentence of a paper, the rule that judges it, what was measured, the verdict in words."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

Verdict = Literal["reproduced", "not reproduced", "not testable"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""All verdicts, the good one first."""
WORST_FIRST: tuple[Verdict, ...] = ("not reproduced", "not testable", "reproduced")

LEAST_FOR_INTERVAL = 6
"""Runs from which a bootstrap interval of a mean is used: with fewer, its nominal 2.5 % exceed 7 %."""
LEAST_FOR_EVERY_RUN = 5
"""Runs from which "in every run" means something: of what holds in half of all runs, 3 % pass by chance."""
LEAST_FOR_SHARE = 20
"""Runs from which a share of 95 % can be seen at all."""


def verdict(holds: bool | None) -> Verdict:
    """Turn the outcome of a rule into a verdict; ``None`` means that nothing could be tested.

    Examples
    --------
    >>> verdict(True), verdict(False), verdict(None)
    ('reproduced', 'not reproduced', 'not testable')
    """
    if holds is None:
        return "not testable"
    return "reproduced" if holds else "not reproduced"


@dataclass(frozen=True)
class Claim:
    """One judged sentence.

    Parameters
    ----------
    id : str
        Short name, unique within its experiment.
    source : str
        Paper and place.
    text : str
        What the paper says, in our words.
    rule : str
        Statistic and threshold, fixed before the run.
    measured : dict
        Name -> number, as measured.
    ci : list of two floats, or None
        Interval of the deciding statistic over whole runs.
    null_rate : float or None
        How often the rule would say "reproduced" where the claim is false, in [0, 1].
    share : float or None
        Share of repetitions in which the sentence holds, in [0, 1].
    verdict : {"reproduced", "not reproduced", "not testable"}
        Computed from the rule, never written by hand; see :func:`judged`.
    sentence : str
        What was found, in plain words made from the numbers; ends with the verdict.
    runs, least_runs : int or None
        Runs that were judged, and the least number that the rule asks for; None where nothing is drawn.
    quick : bool
        Whether the runs are those of a small version of the experiment.

    Raises
    ------
    ValueError
        If the verdict is none of the three, the interval is not two numbers in order, or a rate
        lies outside [0, 1].
    """

    id: str
    source: str
    text: str
    rule: str
    measured: Mapping[str, Any]
    ci: Sequence[float] | None
    null_rate: float | None
    share: float | None
    verdict: Verdict
    sentence: str = ""
    runs: int | None = None
    least_runs: int | None = None
    quick: bool = False

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(
                f"claim {self.id!r}: verdict {self.verdict!r} must be one of {', '.join(VERDICTS)}"
            )
        if self.ci is not None and (len(self.ci) != 2 or self.ci[0] > self.ci[1]):
            raise ValueError(f"claim {self.id!r}: ci {self.ci!r} must be two numbers, lower first")
        for name in ("null_rate", "share"):
            rate = getattr(self, name)
            if rate is not None and not math.isnan(rate) and not 0.0 <= rate <= 1.0:
                raise ValueError(f"claim {self.id!r}: {name} {rate!r} must lie in [0, 1]")

    @property
    def small_sample(self) -> bool:
        """Whether fewer runs were judged than the rule asks for."""
        return self.least_runs is not None and self.runs is not None and self.runs < self.least_runs

    def to_dict(self) -> dict[str, Any]:
        """Return the claim as the JSON object of ``result.json``, keys in their written order."""
        own = {field.name: getattr(self, field.name) for field in fields(self)}
        return own | {"small_sample": self.small_sample}


def judged(
    id: str,
    source: str,
    text: str,
    rule: str,
    holds: bool | None,
    found: str,
    measured: Mapping[str, Any],
    *,
    ci: Sequence[float] | None = None,
    null_rate: float | None = None,
    share: float | None = None,
    runs: int | None = None,
    least_runs: int | None = None,
) -> Claim:
    """Return a claim with the verdict of its rule, and the sentence that says so.

    Unless it says otherwise, a rule that rests on an interval asks for LEAST_FOR_INTERVAL runs, and one that
    rests on the runs in which something holds for LEAST_FOR_EVERY_RUN.

    Parameters
    ----------
    id, source, text, rule, measured, ci, null_rate, share, runs, least_runs
        See :class:`Claim`.
    holds : bool or None
        What the rule says; None where nothing could be tested.
    found : str
        What was found, in plain words with numbers, without the verdict and the full stop.
    """
    outcome = verdict(None if holds is None else bool(holds))
    sentence = re.sub(r"(?<=\d)%", " %", f"{found}: {outcome}.")
    interval = None if ci is None else [float(end) for end in ci]
    if least_runs is None and (ci is not None or share is not None):
        least_runs = LEAST_FOR_EVERY_RUN if ci is None else LEAST_FOR_INTERVAL
    return Claim(
        id, source, text, rule, measured, interval, null_rate, share, outcome, sentence, runs, least_runs
    )


def small_sample_note(claim: Mapping[str, Any]) -> str:
    """Return in words that a claim, as in ``result.json``, rests on too few runs; empty if it does not.

    Examples
    --------
    >>> small_sample_note({"small_sample": True, "runs": 10, "least_runs": 50})
    'small sample: 10 runs, the rule asks for 50'
    """
    if not claim.get("small_sample"):
        return ""
    return f"small sample: {claim.get('runs')} runs, the rule asks for {claim.get('least_runs')}"


def between(ends: Sequence[float], digits: int = 3) -> str:
    """Return an interval in words.

    >>> between([0.123456, 2.0])
    'between 0.123 and 2'
    """
    return f"between {ends[0]:.{digits}g} and {ends[1]:.{digits}g}"


def check_distinct(claims: Iterable[Claim]) -> None:
    """Raise ``ValueError`` if two claims of one experiment share an id."""
    seen: set[str] = set()
    for claim in claims:
        if claim.id in seen:
            raise ValueError(f"two claims are called {claim.id!r}: give each its own id")
        seen.add(claim.id)
