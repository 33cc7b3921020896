"""``vslam-ref run``: a system over recorded data.  Each family of systems has a module of its own."""

from __future__ import annotations

import argparse

from vslam_ref.commands import run_log, run_orbslam, run_ptam

HELP = "run a system over recorded data and compare it with the truth"
FAMILIES = (run_log, run_ptam, run_orbslam)
"""Modules with ``SYSTEMS``, ``EPILOG``, ``add_arguments`` and ``run``, as a command has them."""
SYSTEMS = {name: what for family in FAMILIES for name, what in family.SYSTEMS.items()}
EPILOG = "\n\n".join(
    [
        "'vslam-ref run SYSTEM --help' shows the options of a system;\n"
        "all have --out DIR, --json FILE and --set KEY=VALUE.\n\nsystems:\n"
        + "\n".join(f"  {name:<12}{what}" for name, what in SYSTEMS.items()),
        *(family.EXAMPLES for family in FAMILIES),
    ]
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the systems, each with its own arguments."""
    systems = parser.add_subparsers(metavar="SYSTEM", dest="system", required=True, help="see below")
    for family in FAMILIES:
        for name, what in family.SYSTEMS.items():
            one = systems.add_parser(
                name,
                description=what,
                epilog=f"{family.EPILOG}\n\n{family.EXAMPLES}",
                formatter_class=argparse.RawDescriptionHelpFormatter,
            )
            family.add_arguments(one)


def run(options: argparse.Namespace) -> int:
    """Hand over to the family of the system."""
    family = next(family for family in FAMILIES if options.system in family.SYSTEMS)
    status: int = family.run(options)
    return status
