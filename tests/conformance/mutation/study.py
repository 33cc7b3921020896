"""A seeded sample of mutants under the vectors.

The parent of all mutants must not have imported what they change, so everything here imports late.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from mutation.child import ROOT, Verdict, executed, run_mutant, source_of
from mutation.equivalent import EQUIVALENT
from mutation.regimes import regime_mutants, with_regime
from mutation.sites import Mutant, mutants, mutated

ROOMS = ("geometry", "estimation", "filters", "features", "grids")
NOT_ASKED = {
    "vslam_ref.geometry.multiview.resection tilted_twin": "a second valley, told beside the answer",
}
"""Functions that vectors run on the way to an answer which does not depend on them, and what they are for."""

NOT_ASKED_PAIRS = [tuple(key.split()) for key in NOT_ASKED]

GOAL = 0.95
"""Share of mutants that the vectors should notice."""

LONGEST = 40.0
"""Seconds after which a mutant does not end."""


class Study(NamedTuple):
    """Mutants and what became of them.

    Attributes
    ----------
    functions : list of str
        Equation-bearing functions that the vectors run, ``module.function``.
    unseen : list of str
        Equation-bearing functions of the rooms that no vector runs, or that none asks for.
    possible : int
        Number of mutants in lines that the vectors run.
    unreached : int
        Number of mutants in other lines of the same functions: variants that no vector asks for.
    sample : list of (Mutant, Verdict)
    seconds : float
    """

    functions: list[str]
    unseen: list[str]
    possible: int
    unreached: int
    sample: list[tuple[Mutant, Verdict]]
    seconds: float

    @property
    def equivalent(self) -> int:
        """Number of survivors that no program could tell from the library."""
        return sum(bool(why_equivalent(mutant)) for mutant, verdict in self.sample if not verdict.killed)

    @property
    def share(self) -> float:
        """Share of mutants noticed, of those that can be."""
        return self.killed / max(1, len(self.sample) - self.equivalent)

    @property
    def killed(self) -> int:
        """Number of mutants that the vectors noticed."""
        return sum(verdict.killed for _, verdict in self.sample)

    def numbers(self) -> dict[str, Any]:
        """Content of ``--json``."""
        survivors = [m._asdict() | {"equivalent": why_equivalent(m)} for m, v in self.sample if not v.killed]
        return {
            "functions": self.functions,
            "unseen": self.unseen,
            "possible": self.possible,
            "unreached": self.unreached,
            "not_asked": NOT_ASKED,
            "sample": len(self.sample),
            "killed": self.killed,
            "equivalent": self.equivalent,
            "share": self.share,
            "survivors": survivors,
            "seconds": self.seconds,
        }


def why_equivalent(mutant: Mutant) -> str:
    """Why a mutant cannot be noticed, or nothing."""
    line = source_of(mutant.module)[0].splitlines()[mutant.line - 1].strip()
    name = f"{mutant.module.removeprefix('vslam_ref.')}.{mutant.function}"
    return EQUIVALENT.get((name, line, mutant.text), "")


def modules() -> list[str]:
    """Modules of the rooms, without importing any."""
    files = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*.py"))]
    names = [".".join(("vslam_ref", *path.relative_to(ROOT).with_suffix("").parts)) for path in files]
    return [name.removesuffix(".__init__") for name in names]


def study(
    sample: int,
    seed: int,
    jobs: int,
    told: Callable[[Mutant, Verdict], None] = lambda m, v: None,
    *,
    regimes: bool = False,
    chapters: Sequence[str] = (),
    inside: Sequence[str] = ("vslam_ref",),
) -> Study:
    """Run a sample of mutants.

    Parameters
    ----------
    sample : int
        How many; all if there are fewer.
    seed : int
    jobs : int
        Mutants side by side.
    told : callable
        Called with each verdict.
    regimes : bool
        Change branches, series and special values, in all functions, for operators in those that cite.
    chapters : sequence of str
        Only the vectors of these, as "02", and what they run; all if empty.
    inside : sequence of str
        Only modules whose names begin so.
    """
    import random

    began = time.monotonic()
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import numpy  # noqa: F401 - imported once, before the forks

    names = [name for name in _names() if not chapters or name[:2] in chapters]
    found, change = (regime_mutants, with_regime) if regimes else (mutants, mutated)
    those = [module for module in modules() if module.startswith(tuple(inside))]
    everything = [m for module in those for m in found(module, source_of(module)[0])]
    run = executed(names)
    bearing = {(m.module, m.function) for m in everything}
    reached = [m for m in everything if (m.module, m.line) in run]
    seen = {(m.module, m.function) for m in reached} - set(NOT_ASKED_PAIRS)
    usable = [m for m in reached if (m.module, m.function) in seen]
    within = [m for m in everything if (m.module, m.function) in seen]
    chosen = random.Random(seed).sample(usable, min(sample, len(usable)))

    def judge(mutant: Mutant) -> tuple[Mutant, Verdict]:
        verdict = run_mutant(mutant, names, LONGEST, change)
        told(mutant, verdict)
        return mutant, verdict

    with ThreadPoolExecutor(jobs) as pool:
        results = list(pool.map(judge, chosen))
    return Study(
        functions=sorted(f"{m}.{f}" for m, f in seen),
        unseen=sorted(f"{m}.{f}" for m, f in bearing - seen),
        possible=len(usable),
        unreached=len(within) - len(usable),
        sample=results,
        seconds=time.monotonic() - began,
    )


def _names() -> list[str]:
    """Names of the vectors' files; importing their module brings no numeric room along."""
    from vslam_ref.conformance.vectors_format import names

    return names()
