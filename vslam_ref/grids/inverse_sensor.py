"""What one observation of a cell says of S and of D, given what S said of it before.

The report gives no table; it says only when D is high.  This one is ours, argued in chapter 19.

========  ===========  ============  =================  ==========================================
S_{t-1}   observation  S             D, ``"free"``      D, ``"unknown"`` (the report's text)
========  ===========  ============  =================  ==========================================
free      hit          low           **high**           low
unknown   hit          **high**      low                **high**
occupied  hit          **high**      low                low
any       miss         low           low                low
free      graze        low           low                low
unknown   graze        half a miss   low                low
occupied  graze        nothing       low                low
========  ===========  ============  =================  ==========================================

To *graze* a cell is to cross it just before the beam's own end (``graze`` of the map's config, 0 for never).
A beam that meets a wall at a small angle runs through the wall's own cells first: such misses say little.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.grids.log_odds import FREE, OCCUPIED, UNKNOWN, log_odds
from vslam_ref.support.config import assume

Where = Literal["free", "unknown"]
WHERES: tuple[Where, ...] = ("free", "unknown")


class Steps(NamedTuple):
    """What an observation adds to a cell, in log-odds.

    Attributes
    ----------
    static, dynamic : ndarray, shape (3, 3)
        Row: S_{t-1} free, unknown or occupied; column: miss, hit, graze.
    """

    static: Array
    dynamic: Array


@dataclass(frozen=True)
class InverseSensor:
    """Probabilities of the table, dimensionless; every field says why it has its value.

    Raises
    ------
    ValueError
        If a high value is not in (0.5, 1) or a low one not in (0, 0.5).
    """

    s_high: float = assume(
        0.8, "", "two hits decide a cell of S (0.94 > 0.9), one does not: a single hit may be noise"
    )
    s_low: float = assume(0.3, "", "a hit on free floor: something moves there, so S stays free")
    s_miss: float = assume(
        0.3, "", "three misses free a cell (0.07 < 0.1); weaker than a hit, as beams graze walls"
    )
    s_graze: float = assume(
        0.4, "", "about half of a miss, in log-odds: at unknown cells a beam's last steps are mostly floor"
    )
    d_high: float = assume(
        0.95, "", "one hit decides a cell of D (0.95 > 0.9): a thing that moves is there once only"
    )
    d_low: float = assume(0.05, "", "a hit that S explains says as much as a miss: nothing moves there")
    d_miss: float = assume(0.05, "", "one miss takes a decided cell of D back (0.95 -> 0.5): it has left")

    def __post_init__(self) -> None:
        """Check that high is high and low is low."""
        for f in fields(self):
            value = getattr(self, f.name)
            low, high = (0.5, 1.0) if f.name.endswith("high") else (0.0, 0.5)
            if not low < value < high:
                raise ValueError(f"{f.name}={value!r}: must lie between {low:g} and {high:g}")

    def steps(self, d_high_where: Where = "free") -> Steps:
        """Return the table as log-odds.

        Raises
        ------
        ValueError
            If ``d_high_where`` is neither ``"free"`` nor ``"unknown"``.

        Examples
        --------
        >>> steps = InverseSensor().steps("free")
        >>> steps.static[FREE].round(2), steps.dynamic[FREE].round(2)  # (miss, hit, graze)
        (array([-0.85, -0.85, -0.85]), array([-2.94,  2.94, -2.94]))
        """
        if d_high_where not in WHERES:
            raise ValueError(f"d_high_where={d_high_where!r}: must be one of {', '.join(WHERES)}")
        static = np.empty((3, 3))
        static[:, 0] = self.s_miss
        static[[FREE, UNKNOWN, OCCUPIED], 2] = self.s_miss, self.s_graze, 0.5
        static[[UNKNOWN, OCCUPIED], 1] = self.s_high
        static[FREE, 1] = self.s_low
        dynamic = np.empty((3, 3))
        dynamic[:, [0, 2]] = self.d_miss
        dynamic[:, 1] = self.d_low
        dynamic[FREE if d_high_where == "free" else UNKNOWN, 1] = self.d_high
        return Steps(log_odds(static), log_odds(dynamic))
