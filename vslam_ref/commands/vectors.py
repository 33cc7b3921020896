"""``vslam-ref vectors``: the conformance vectors themselves."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from vslam_ref.commands.options import add_json, json_target, write_json

if TYPE_CHECKING:
    from vslam_ref.conformance.catalogue import Function

HELP = "list or check the conformance vectors"
EPILOG = """\
list       functions, files, and numbers of cases
check      every file against the schema's rules, without asking a program

In a clone, 'make vectors' generates the files anew and 'make mutants' measures how many mistakes they notice.

example: vslam-ref vectors list --topic so3"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("action", choices=("list", "check"), metavar="ACTION", help="see below")
    parser.add_argument("--topic", metavar="T", action="append", help="only this topic; may be repeated")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Do what was asked."""
    return {"list": _list, "check": _check}[options.action](options)


def _list(options: argparse.Namespace) -> int:
    from vslam_ref.commands.tables import table
    from vslam_ref.conformance.catalogue import functions
    from vslam_ref.conformance.vectors_format import counted, load, names

    target = json_target(options)
    asked = [f for f in functions().values() if not options.topic or f.topic in options.topic]
    print(table(["function", "inputs", "outputs", "what"], [_row(f) for f in asked]))
    found = [load(name) for name in names()]
    kept = [file for file in found if not options.topic or Path(file.name).stem in options.topic]
    sizes = [{"file": f.name, "cases": len(f.cases), "counted": counted(f.cases)} for f in kept]
    print("\n" + table(["file", "cases", "counted"], [[str(v) for v in size.values()] for size in sizes]))
    total = sum(counted(f.cases) for f in kept)
    print(f"{total} cases count, at most 20 of a regime")
    write_json(target, {"functions": [f._asdict() for f in asked], "files": sizes, "counted": total})
    return 0


def _row(function: Function) -> list[str]:
    return [function.name, " ".join(function.inputs), " ".join(function.outputs), function.text]


def _check(options: argparse.Namespace) -> int:
    from vslam_ref.conformance.vectors_format import lint, load, names

    target = json_target(options)
    remarks = [f"{name}: {sentence}" for name in names() for sentence in lint(load(name))]
    for remark in remarks:
        print(remark)
    print(f"{len(remarks)} remarks")
    write_json(target, {"remarks": remarks})
    return 1 if remarks else 0
