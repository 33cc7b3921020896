"""Every number of S and D, with its reason; the rules behind them are told in :mod:`static_dynamic`."""

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
    """How S and D are made; every field says why it has its value."""

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
        if not (self.usable_range > 0 and math.isfinite(self.usable_range)):
            raise ValueError(f"usable_range={self.usable_range!r} m: must be positive and finite")
        if self.no_return not in ("ignore", "free"):
            raise ValueError(f"no_return={self.no_return!r}: must be 'ignore' or 'free'")
        if self.d_memory not in ("formula", "text"):
            raise ValueError(f"d_memory={self.d_memory!r}: must be 'formula' or 'text'")
        self.sensor.steps(self.d_high_where)
        if not 0 <= self.explained_by <= 10:
            raise ValueError(f"explained_by={self.explained_by!r} cells: must be between 0 and 10")
        if self.settle_seconds is not None and not self.settle_seconds > 0:
            raise ValueError(f"settle_seconds={self.settle_seconds!r}: must be positive, or None for never")
        if self.settle_in_line is not None and not self.settle_in_line >= 0:
            raise ValueError(f"settle_in_line={self.settle_in_line!r}: must be 0 s or more, or None")
        if not 0 <= self.graze <= 100:
            raise ValueError(f"graze={self.graze!r} cells: must be between 0 and 100")
        for name in ("d_lifetime", "hit_gap"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name}={getattr(self, name)!r} s: must be positive")
        for name, least in (("s_most", 0.9), ("d_most", 0.9)):
            if not least < getattr(self, name) < 1:
                raise ValueError(f"{name}={getattr(self, name)!r}: must lie between {least:g} and 1")


AS_PRINTED = MapConfig(explained_by=0, settle_seconds=None)
"""The table of :mod:`inverse_sensor` and nothing else, but the lifetime of D."""
