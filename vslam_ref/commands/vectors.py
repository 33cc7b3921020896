"""``vslam-ref vectors``: the conformance vectors themselves."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from vslam_ref.commands.options import add_json, at_least, json_target, write_json

if TYPE_CHECKING:
    from vslam_ref.conformance.mutation.child import Verdict
    from vslam_ref.conformance.mutation.sites import Mutant

HELP = "list, check or generate the conformance vectors"
EPILOG = """\
list       functions, files, and numbers of cases
check      every file against the schema's rules, without asking a program
generate   make them anew (needs the extra 'test'); --check compares with those that are there
mutants    put small mistakes into this library's formulas and count those that the vectors notice
           (minutes; not on Windows); status 1 where fewer than 95 % are noticed

examples:
  vslam-ref vectors list
  vslam-ref vectors generate --out vectors/ --topic so3"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument(
        "action", choices=("list", "check", "generate", "mutants"), metavar="ACTION", help="see below"
    )
    parser.add_argument("--topic", metavar="T", action="append", help="only this topic; may be repeated")
    parser.add_argument("--out", metavar="DIR", help="where to generate (default: the package's own folder)")
    parser.add_argument("--check", action="store_true", help="write nothing; status 1 where a file differs")
    parser.add_argument("--sample", metavar="N", type=at_least(1), default=200, help="mutants (default: 200)")
    parser.add_argument("--seed", metavar="S", type=at_least(0), default=0, help="of the sample (default: 0)")
    parser.add_argument("--jobs", metavar="J", type=at_least(1), default=2, help="side by side (default: 2)")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Do what was asked."""
    actions = {"list": _list, "check": _check, "generate": _generate, "mutants": _mutants}
    return actions[options.action](options)


def _list(options: argparse.Namespace) -> int:
    from vslam_ref.commands.tables import table
    from vslam_ref.conformance.catalogue import functions
    from vslam_ref.conformance.vectors_format import counted, load, names

    rows = [
        [f.name, " ".join(f.inputs), " ".join(f.outputs), f.text]
        for f in functions().values()
        if not options.topic or f.topic in options.topic
    ]
    print(table(["function", "inputs", "outputs", "what"], rows))
    found = [load(name) for name in names()]
    kept = [file for file in found if not options.topic or Path(file.name).stem in options.topic]
    print()
    print(
        table(
            ["file", "cases", "counted"], [[f.name, str(len(f.cases)), str(counted(f.cases))] for f in kept]
        )
    )
    print(f"{sum(counted(f.cases) for f in kept)} cases count, at most 20 of a regime")
    return 0


def _check(options: argparse.Namespace) -> int:
    from vslam_ref.conformance.vectors_format import lint, load, names

    wrong = 0
    for name in names():
        for sentence in lint(load(name)):
            print(f"{name}: {sentence}")
            wrong += 1
    print(f"{wrong} remarks")
    return 1 if wrong else 0


def _generate(options: argparse.Namespace) -> int:
    from vslam_ref.conformance.generator.writing import generate

    different = generate(
        Path(options.out) if options.out else None, options.topic or [], write=not options.check, told=print
    )
    return 1 if options.check and different else 0


def _mutants(options: argparse.Namespace) -> int:
    """Run a sample of mutants.  Nothing numeric may be imported here before the mutants are forked."""
    import os

    from vslam_ref.conformance.mutation.study import GOAL, study, why_equivalent

    if not hasattr(os, "fork"):
        raise ValueError("mutants need os.fork, which this system does not have")
    target = json_target(options)

    def told(mutant: Mutant, verdict: Verdict) -> None:
        if not verdict.killed:
            place = f"{mutant.module}.{mutant.function}, line {mutant.line}"
            why = why_equivalent(mutant)
            print(f"survives: {place}: {mutant.text}{f' ({why})' if why else ''}", flush=True)

    found = study(options.sample, options.seed, options.jobs, told)
    share = found.share
    run_by, unseen = len(found.functions), len(found.unseen)
    print(f"functions that cite an equation: {run_by} are run by the vectors, {unseen} are not")
    noticeable = len(found.sample) - found.equivalent
    noticed = f"{found.killed} of {noticeable} mutants noticed ({100 * share:.1f} %)"
    print(f"{found.equivalent} of the sample cannot be noticed, as mutation/equivalent.py explains")
    print(f"{noticed}, of {found.possible} possible; {found.unreached} stand in lines that no vector runs")
    write_json(target, found.numbers())
    return 0 if share >= GOAL else 1
