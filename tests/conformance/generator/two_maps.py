"""S and D of chapter 4 of A, cell by cell: one observation, histories, hits that a wall explains."""

from __future__ import annotations

from itertools import product
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator.building import Topic, tolerance

DEFINITION = "definition, 50 digits"

TABLE = {"s_high": 0.8, "s_low": 0.3, "s_miss": 0.35, "d_high": 0.95, "d_low": 0.1, "d_miss": 0.05}
MOST = {"s": 0.999, "d": 0.96}
S_BEFORE = {"free": -3.0, "unknown": 0.7, "occupied": 2.9}
OTHER = {"free": "unknown", "unknown": "free"}


def logit(p: Any) -> Any:
    """Log odds of a double, or of a 50-digit number."""
    p = mpf(p)
    return mpmath.log(p / (1 - p))


def two_maps(topic: Topic, rng: np.random.Generator) -> None:
    """One observation of a cell, in every reading of the report."""
    rule = tolerance(1e-14, "log odds of the table and a sum", absolute=1e-15)
    for memory, where in product(("formula", "text"), ("free", "unknown")):
        cases = []
        for state, seen in product(S_BEFORE, ("hit", "miss")):
            s = round(S_BEFORE[state] + rng.uniform(-0.6, 0.6), 3)
            cases.append(_cell(s, round(rng.uniform(-2, 2), 3), seen, memory, where))
        flags = (f"memory_{memory}", f"high_where_{where}")
        label = "eq-a4-3"
        topic.group("grid.static_dynamic", label, DEFINITION, rule, cases, flags=flags)
    cases = [
        _cell(s, d, seen, "formula", "free")
        for s, d, seen in ((6.5, 3.0, "hit"), (-6.8, -3.1, "miss"), (-6.8, 2.9, "hit"))
    ]
    topic.group("grid.static_dynamic", "eq-a4-2", DEFINITION, rule, cases, flags=("bounded",))
    edge = float(logit(mpf(9) / 10))
    cases = [
        _cell(sign * edge * factor, 0.5, "hit", "formula", "free")
        for sign, factor in product((-1, 1), (0.999999, 1.000001))
    ]
    topic.group("grid.static_dynamic", "eq-a4-2", DEFINITION, rule, cases, flags=("threshold",))


def both_maps(s: float, d: float, seen: str, memory: str, where: str, wrong: str = "") -> tuple[Any, Any]:
    """Log odds of S and D after an observation."""
    before = mpf(s)
    state = _state(before)
    of_s, of_d = _entries(state, seen, where if wrong != "d-high-elsewhere" else OTHER[where])
    if wrong == "s-ignores-state" and seen == "hit":
        of_s = "s_high"
    remembers = (memory == "formula") != (wrong in ("d-remembers", "d-forgets"))
    new_s = before + logit(TABLE[of_s])
    new_d = (mpf(d) if remembers else mpf(0)) + logit(TABLE[of_d])
    if wrong == "not-bounded":
        return new_s, new_d
    return _bounded(new_s, MOST["s"]), _bounded(new_d, MOST["d"])


def _state(s: Any) -> str:
    p = 1 / (1 + mpmath.exp(-s))
    return "occupied" if p > mpf(9) / 10 else "free" if p < mpf(1) / 10 else "unknown"


def _entries(state: str, seen: str, where: str) -> tuple[str, str]:
    if seen == "miss":
        return "s_miss", "d_miss"
    return "s_low" if state == "free" else "s_high", "d_high" if state == where else "d_low"


def _bounded(value: Any, most: float) -> Any:
    bound = logit(most)
    return max(-bound, min(bound, value))


def _cell(s: float, d: float, seen: str, memory: str, where: str) -> dict[str, Any]:
    right = both_maps(s, d, seen, memory, where)
    mistakes: dict[str, Any] = {}
    swap = "d-forgets" if memory == "formula" else "d-remembers"
    for name in (swap, "d-high-elsewhere", "s-ignores-state", "not-bounded"):
        wrong = both_maps(s, d, seen, memory, where, name)
        known = any(max(abs(a - b) for a, b in zip(wrong, other, strict=True)) < 1e-6 for other in [right])
        same = {"s": float(wrong[0]), "d": float(wrong[1])}
        if not known and same not in mistakes.values():
            mistakes[name] = same
    inputs: dict[str, Any] = {"s": s, "d": d, "observation": seen, "table": TABLE}
    inputs = {**inputs, "d_memory": memory, "d_high_where": where, "most": MOST}
    case: dict[str, Any] = {"inputs": inputs, "expected": {"s": float(right[0]), "d": float(right[1])}}
    return {**case, "mistakes": mistakes} if mistakes else case


def history(
    times: list[float], seen: list[str], memory: str, where: str, rules: dict[str, float], wrong: str = ""
) -> dict[str, list[float]]:
    """Log odds of S and D of one cell after each observation."""
    s, d, looked, last_hit = mpf(0), mpf(0), mpf("-inf"), mpf("-inf")
    since: Any = None  # when the stay that goes on began
    path: dict[str, list[float]] = {"s": [], "d": []}
    for now, what in zip(map(mpf, times), seen, strict=True):
        stale = now - looked > rules["d_lifetime"] and wrong != "d-never-stale"
        away = now - looked if now - looked > rules["hit_gap"] else mpf(0)
        if what == "hit":
            since = now if since is None else since + (0 if wrong == "unseen-time-counts" else away)
            if _state(s) == "free" and now - since >= rules["settle_seconds"] and wrong != "never-settles":
                s = mpf(0)
            last_hit = now
        elif since is not None and now - last_hit > rules["hit_gap"] and wrong != "stay-never-ends":
            since = None
        s, d = both_maps(s, mpf(0) if stale else d, what, memory, where)
        looked = now
        path["s"].append(float(s))
        path["d"].append(float(d))
    return path


def _scripted(k: int) -> tuple[list[float], list[str]]:
    """Free floor; then a thing that leaves and comes back, or one that nobody looks at for a while."""
    floor = ["miss"] * 6
    if k == 0:
        seen = [*floor, *["hit"] * 4, *["miss"] * 6, *["hit"] * 8]
        return [0.25 * n for n in range(1, len(seen) + 1)], seen
    seen = [*floor, *["hit"] * 12]
    return [0.25 * n + (1.5 if n > 11 else 0.0) for n in range(1, len(seen) + 1)], seen


def _drawn(rng: np.random.Generator) -> tuple[list[float], list[str]]:
    """Mostly misses, then mostly hits, at odd times."""
    times = np.cumsum(rng.choice([0.25, 0.5, 1.25], 22, p=[0.5, 0.4, 0.1]))
    chance = np.r_[np.full(6, 0.15), np.full(16, 0.9)]
    return times.tolist(), ["hit" if hit else "miss" for hit in rng.uniform(size=22) < chance]


def histories(topic: Topic, rng: np.random.Generator) -> None:
    """What a cell saw over time, and what S and D make of it."""
    rule = tolerance(1e-14, "a sum of a dozen log odds", absolute=1e-14)
    rules = {"d_lifetime": 1.0, "settle_seconds": 3.0, "hit_gap": 0.8}
    for memory in ("formula", "text"):
        cases = []
        for k in range(10):
            times, seen = _scripted(k) if k < 2 else _drawn(rng)
            where = ("free", "unknown")[k % 2]
            right = history(times, seen, memory, where, rules)
            inputs = {"times": times, "observations": seen, "table": TABLE, "most": MOST, **rules}
            mistakes: dict[str, Any] = {}
            for name in ("d-never-stale", "never-settles", "stay-never-ends", "unseen-time-counts"):
                wrong = history(times, seen, memory, where, rules, name)
                if wrong not in (right, *mistakes.values()):
                    mistakes[name] = wrong
            one: dict[str, Any] = {"inputs": {**inputs, "d_memory": memory, "d_high_where": where}}
            one["expected"] = right
            cases.append({**one, "mistakes": mistakes} if mistakes else one)
        topic.group("grid.history", "eq-a4-3", DEFINITION, rule, cases, flags=(f"memory_{memory}",))


def explained(topic: Topic, rng: np.random.Generator) -> None:
    """A wall somewhere near the middle of a free or unknown neighbourhood."""
    rule = tolerance(1e-14, "log odds of the table and a sum", absolute=1e-15)
    for reach in (1, 2):
        cases = []
        for k in range(9):
            around = np.round(rng.uniform(-4, 0, (5, 5)), 3)
            wall = [(1, 2), (2, 3), (1, 1), (3, 1), (0, 2), (4, 4), (2, 0), (3, 3), (4, 1)][k]
            around[wall] = 3.5
            d = round(rng.uniform(-2, 2), 3)
            away = [abs(i - 2) for i in wall]
            right = _beside(around[2, 2], d, near=max(away) <= reach)
            mistakes: dict[str, Any] = {}
            diagonal = sum(away) > reach  # four neighbours are as good as none there
            for name, near in [("no-diagonals", False)] if diagonal else [("not-explained", False)]:
                wrong = _beside(around[2, 2], d, near=near)
                if wrong not in (right, *mistakes.values()):
                    mistakes[name] = wrong
            inputs = {"s_around": around, "d": d, "table": TABLE, "most": MOST, "reach": reach}
            one: dict[str, Any] = {"inputs": inputs, "expected": right}
            cases.append({**one, "mistakes": mistakes} if mistakes else one)
        flags = (f"reach_{reach}",)
        topic.group("grid.explained", "eq-a4-3", DEFINITION, rule, cases, flags=flags)


def _beside(s: float, d: float, *, near: bool) -> dict[str, float]:
    """After a hit; beside a wall the state is occupied."""
    of_s, of_d = _entries("occupied" if near else _state(mpf(s)), "hit", "free")
    values = {"s": (mpf(s), of_s), "d": (mpf(d), of_d)}
    return {k: float(_bounded(v + logit(TABLE[entry]), MOST[k])) for k, (v, entry) in values.items()}
