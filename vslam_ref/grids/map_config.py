"""Every number of S and D, with its reason; the rules behind them stand in :mod:`static_dynamic`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from vslam_ref.grids.inverse_sensor import InverseSensor, Where
from vslam_ref.grids.lattice import Lattice
from vslam_ref.support.config import assume

Memory = Literal["formula", "text"]
NoReturn = Literal["ignore", "free"]


@dataclass(frozen=True)
class MapConfig:
    """How S and D are made; metres, seconds, cells; every field says why it has its value."""

    resolution: float = assume(0.1, "m", "a leg is one or two cells")
    usable_range: float = assume(30.0, "m", "beams half a degree apart are then 0.26 m apart")
    no_return: NoReturn = assume("ignore", "", "glass and black things send nothing back, either")
    sensor: InverseSensor = field(default_factory=InverseSensor)
    d_memory: Memory = assume("text", "", "with A§4.3's memory a walker has left before D believes it")
    d_high_where: Where = assume(
        "free", "", "what moves shows itself where S was free; 'unknown' is A's text"
    )
    explained_by: int = assume(1, "cells", "range noise moves a wall by one cell")
    settle_seconds: float | None = assume(10.0, "s", "people seldom stand as still as that; None: never")
    settle_in_line: float | None = assume(
        None, "s", "as settle_seconds: with wrong poses a short time thickens walls"
    )
    graze: int = assume(0, "cells", "never; 3 protects walls met at 10 degrees (0.5 / tan 10 = 3)")
    d_lifetime: float = assume(1.0, "s", "at 1 m/s a person has left its cells by then")
    hit_gap: float = assume(1.0, "s", "beams miss thin things; a miss later than that ends a visit")
    s_most: float = assume(0.999, "", "S changes its mind after six misses")
    d_most: float = assume(0.96, "", "D lets go at the first miss")

    def __post_init__(self) -> None:
        """Check the numbers."""
        Lattice(self.resolution)
        self.sensor.steps(self.d_high_where)
        settle, in_line = self.settle_seconds, self.settle_in_line
        needs = {
            "usable_range": (0 < self.usable_range < math.inf, "positive and finite, m"),
            "no_return": (self.no_return in ("ignore", "free"), "'ignore' or 'free'"),
            "d_memory": (self.d_memory in ("formula", "text"), "'formula' or 'text'"),
            "explained_by": (0 <= self.explained_by <= 10, "between 0 and 10 cells"),
            "settle_seconds": (settle is None or settle > 0, "positive, s, or None for never"),
            "settle_in_line": (in_line is None or in_line >= 0, "0 s or more, or None"),
            "graze": (0 <= self.graze <= 100, "between 0 and 100 cells"),
            "d_lifetime": (self.d_lifetime > 0, "positive, s"),
            "hit_gap": (self.hit_gap > 0, "positive, s"),
            "s_most": (0.9 < self.s_most < 1, "between 0.9 and 1"),
            "d_most": (0.9 < self.d_most < 1, "between 0.9 and 1"),
        }
        for name, (met, need) in needs.items():
            if not met:
                raise ValueError(f"{name}={getattr(self, name)!r}: must be {need}")


AS_PRINTED = MapConfig(explained_by=0, settle_seconds=None)
"""The table of :mod:`inverse_sensor` and nothing else, but the lifetime of D."""
