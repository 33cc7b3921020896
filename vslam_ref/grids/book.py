"""Static and dynamic grids in plain loops: one scan, one beam, one cell at a time.

This is A's chapter 4 as one would write it on a blackboard.  It is slow, and shares no code with the maps of
this room.  A test asserts that :class:`~vslam_ref.grids.StaticDynamicMap`, without its added rules, holds
the same numbers.

::

    for each scan o_t:
        what[m] = hit, miss or nothing               one observation per cell m, a hit wins
        for each cell m that the scan looks at:
            s      = free, unknown or occupied       what S_{t-1} says of m: L < -ln 9, between, or > ln 9
            L(S_t) = L(S | o_t, S_{t-1}) + L(S_{t-1})
            L(D_t) = L(D | o_t, S_{t-1}) + L(D_{t-1})        memory = "formula"
            L(D_t) = L(D | o_t, S_{t-1})                     memory = "text", and 0 in all other cells
"""

from __future__ import annotations

import math

Cell = tuple[int, int]
"""(column, row) on a floor without borders."""
Point = tuple[float, float]
Q = 4096
"""Parts of a cell to which the ends of beams are rounded: all that follows is whole numbers."""
LN9 = math.log(0.9 / 0.1)


def L(p: float) -> float:
    """Log-odds of a probability."""
    return math.log(p / (1 - p))  # eq-log-odds


def inverse_sensor(where: str) -> dict[tuple[str, str], tuple[float, float]]:
    """Table of P(S | o_t, S_{t-1}) and P(D | o_t, S_{t-1}), for (S_{t-1}, o_t).

    ``where`` is the state of S in which a hit makes D high: "free" (ours), or "unknown" (A's text).
    """
    table = {}
    for s in ("free", "unknown", "occupied"):
        table[s, "miss"] = (0.3, 0.05)
        table[s, "hit"] = (0.3 if s == "free" else 0.8, 0.95 if s == where else 0.05)
    return table


def cells_of_beam(start: Point, end: Point) -> list[Cell]:
    """Cells that a beam crosses in a part of positive length; ``start`` and ``end`` in cells."""
    p, q = ([round(v * Q) for v in point] for point in (start, end))
    sign = [1 if b >= a else -1 for a, b in zip(p, q, strict=True)]
    p = [s * a for s, a in zip(sign, p, strict=True)]  # mirrored: to the right and upwards
    d = [s * b - a for s, a, b in zip(sign, p, q, strict=True)]
    u, v = (0, 1) if d[0] >= d[1] else (1, 0)  # u is the axis on which it is longer
    first, inside = [a // Q for a in p], [a % Q for a in p]
    columns = max(-(-(inside[u] + d[u]) // Q), 1)
    top = max(-(-(inside[v] + d[v]) // Q), 1) - 1
    numerator, denominator = inside[v] * d[u] - inside[u] * d[v], Q * d[u]
    cells = []
    for k in range(columns):
        low, high = 0, top
        if k > 0:
            low = (numerator + k * Q * d[v]) // denominator  # eq-beam-height, rounded down
        if k < columns - 1:
            high = -(-(numerator + (k + 1) * Q * d[v]) // denominator) - 1  # eq-beam-height, rounded up
        for row in range(low, max(low, high) + 1):  # along a line: the cell above owns it
            at = [0, 0]
            at[u], at[v] = first[u] + k, first[v] + row
            x, y = (a if s > 0 else -1 - a for s, a in zip(sign, at, strict=True))
            cells.append((x, y))
    return cells


def observations(start: Point, beams: list[tuple[Point, bool]]) -> dict[Cell, str]:
    """What a scan says of each cell; ``beams`` are their ends, in cells, and whether something is there."""
    what: dict[Cell, str] = {}
    for end, _ in beams:
        for m in cells_of_beam(start, end):
            what[m] = "miss"
    for (x, y), something in beams:
        if something:
            what[round(x * Q) // Q, round(y * Q) // Q] = "hit"
    return what


class Book:
    """S and D of one robot whose poses are known.

    Parameters
    ----------
    memory : {"text", "formula"}
        Whether D forgets what it was (A's words) or keeps it (A's formula).
    where : {"free", "unknown"}
        As for :func:`inverse_sensor`.
    resolution : float
        Side of a cell, metres.

    Attributes
    ----------
    L_S, L_D : dict of (column, row) to float
        Log-odds of the cells that were looked at; all others are 0, unknown.
    """

    def __init__(self, memory: str = "text", where: str = "free", resolution: float = 0.1) -> None:
        self.table, self.memory, self.resolution = inverse_sensor(where), memory, resolution
        self.L_S: dict[Cell, float] = {}
        self.L_D: dict[Cell, float] = {}

    def scan(self, T_world_laser: tuple[float, float, float], beams: list[tuple[float, float, bool]]) -> None:
        """Take in one scan.

        Parameters
        ----------
        T_world_laser : tuple of three floats
            (x, y, theta), metres and radians.
        beams : list of (angle, range, hit)
            In the laser's frame, radians and metres.
        """
        x, y, theta = T_world_laser
        ends = []
        for angle, r, hit in beams:
            end = x + r * math.cos(theta + angle), y + r * math.sin(theta + angle)
            ends.append(((end[0] / self.resolution, end[1] / self.resolution), hit))
        what = observations((x / self.resolution, y / self.resolution), ends)
        before_S, before_D = self.L_S, self.L_D if self.memory == "formula" else {}
        self.L_S, self.L_D = dict(before_S), dict(before_D)
        for m, o in what.items():
            L_S, L_D = before_S.get(m, 0.0), before_D.get(m, 0.0)
            s = "occupied" if L_S > LN9 else "free" if L_S < -LN9 else "unknown"
            P_S, P_D = self.table[s, o]
            self.L_S[m] = bounded(L(P_S) + L_S, L(0.999))  # eq-static-recursion
            self.L_D[m] = bounded(L(P_D) + L_D, L(0.96))  # eq-dynamic-recursion, eq-dynamic-text


def bounded(value: float, most: float) -> float:
    """Keep log-odds within -most and most: no cell is so certain that it cannot learn otherwise."""
    return min(max(value, -most), most)
