"""Put small mistakes into the library's formulas and count those that the vectors notice (minutes).

    python tests/conformance/mutants.py [--sample 200] [--seed 0] [--jobs 2] [--json FILE]
    python tests/conformance/mutants.py --regimes [--chapter 02 ...]    # branches, series, special values

Status 1 where fewer than 95 % are noticed.  Needs ``os.fork``, which Windows does not have.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

from mutation.child import Verdict
from mutation.sites import Mutant
from mutation.study import GOAL, study, why_equivalent


def show(mutant: Mutant, verdict: Verdict) -> None:
    """Print a survivor."""
    if not verdict.killed:
        place = f"{mutant.module}.{mutant.function}, line {mutant.line}"
        why = why_equivalent(mutant)
        print(f"survives: {place}: {mutant.text}{f' ({why})' if why else ''}", flush=True)


def main(arguments: list[str] | None = None) -> int:
    """Run a sample of mutants.  Nothing numeric may be imported here before the mutants are forked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sample", metavar="N", type=int, default=200)
    parser.add_argument("--seed", metavar="S", type=int, default=0)
    parser.add_argument("--jobs", metavar="J", type=int, default=2)
    parser.add_argument("--json", metavar="FILE", type=Path)
    parser.add_argument("--regimes", action="store_true", help="change branches for operators")
    parser.add_argument("--inside", metavar="M", action="append", default=[], help="only these modules")
    parser.add_argument("--chapter", metavar="NN", action="append", default=[], help="only this; may repeat")
    options = parser.parse_args(arguments)
    if not hasattr(os, "fork"):
        print("mutants: this system has no os.fork", file=sys.stderr)
        return 2
    inside = options.inside or ["vslam_ref"]
    chapters = [f"{int(c):02d}" for c in options.chapter]
    found = study(
        options.sample,
        options.seed,
        options.jobs,
        show,
        regimes=options.regimes,
        chapters=chapters,
        inside=inside,
    )
    run_by, unseen = len(found.functions), len(found.unseen)
    print(f"functions that cite an equation: {run_by} are run by the vectors, {unseen} are not")
    noticeable = len(found.sample) - found.equivalent
    print(f"{found.equivalent} of the sample cannot be noticed, as mutation/equivalent.py explains")
    noticed = f"{found.killed} of {noticeable} mutants noticed ({100 * found.share:.1f} %)"
    print(f"{noticed}, of {found.possible} possible; {found.unreached} stand in lines that no vector runs")
    if options.json:
        options.json.write_text(json.dumps(found.numbers(), indent=2), encoding="utf-8")
    return 0 if found.share >= GOAL else 1


if __name__ == "__main__":
    sys.exit(main())
