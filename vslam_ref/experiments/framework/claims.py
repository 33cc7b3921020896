"""A claim: one sentence of a paper, the rule that judges it, what was measured, the verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any, Literal, get_args

Verdict = Literal["reproduced", "not reproduced", "not testable"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
"""All verdicts, the good one first."""
WORST_FIRST: tuple[Verdict, ...] = ("not reproduced", "not testable", "reproduced")


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
        Computed from the rule, never written by hand.

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
    measured: dict[str, Any]
    ci: list[float] | None
    null_rate: float | None
    share: float | None
    verdict: Verdict

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

    def to_dict(self) -> dict[str, Any]:
        """Return the claim as the JSON object of ``result.json``, keys in their written order."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


def check_distinct(claims: Iterable[Claim]) -> None:
    """Raise ``ValueError`` if two claims of one experiment share an id."""
    seen: set[str] = set()
    for claim in claims:
        if claim.id in seen:
            raise ValueError(f"two claims are called {claim.id!r}: give each its own id")
        seen.add(claim.id)
