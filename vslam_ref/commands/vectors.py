"""``vslam-ref vectors``: the conformance vectors themselves."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "list, check or generate the conformance vectors"
EPILOG = """\
list       functions, files, and numbers of cases
check      every file against the schema's rules, without asking a program
generate   make them anew (needs the extra 'test'); --check compares with those that are there

examples:
  vslam-ref vectors list
  vslam-ref vectors generate --out vectors/ --topic so3"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("action", choices=("list", "check", "generate"), metavar="ACTION", help="see below")
    parser.add_argument("--topic", metavar="T", action="append", help="only this topic; may be repeated")
    parser.add_argument("--out", metavar="DIR", help="where to generate (default: the package's own folder)")
    parser.add_argument("--check", action="store_true", help="write nothing; status 1 where a file differs")


def run(options: argparse.Namespace) -> int:
    """Do what was asked."""
    return {"list": _list, "check": _check, "generate": _generate}[options.action](options)


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
