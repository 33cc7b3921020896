"""``vslam-ref bench``: time this machine, against the peers that are installed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from typing import Any

from vslam_ref.commands.options import add_json, json_target, print_backend, write_json

HELP = "time the library on this machine, against the peers that are installed"
EPILOG = "example: vslam-ref bench --quick --json bench.json"

SUITES = {
    "filters": "vslam_ref.bench.filters",
    "bundle": "vslam_ref.bench.bundle",
    "posegraph": "vslam_ref.bench.posegraph",
    "grids": "vslam_ref.bench.grids",
    "features": "vslam_ref.bench.features",
    "ptam": "vslam_ref.bench.ptam",
    "hall": "vslam_ref.bench.hall",
}
"""Name -> module with ``run(quick) -> dict``; its ``rows``, a list of flat dicts, is printed as a table."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("suites", nargs="*", metavar="SUITE", help=f"{', '.join(SUITES)} (default: all)")
    parser.add_argument("--quick", action="store_true", help="few repetitions; numbers scatter more")
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Run the suites one after the other and print their numbers."""
    import importlib

    from vslam_ref.support.errors import InputError, suggestion

    for name in options.suites:
        if name not in SUITES:
            raise InputError(f"unknown suite {name!r}{suggestion(name, SUITES)}; known: {', '.join(SUITES)}")
    target = json_target(options)
    results: dict[str, Any] = {}
    for name in dict.fromkeys(options.suites or SUITES):
        print(f"measuring {name} ...", file=sys.stderr, flush=True)
        results[name] = importlib.import_module(SUITES[name]).run(quick=options.quick)
        print(f"{name}\n{report(results[name])}", flush=True)
    print_backend()
    write_json(target, results)
    return 0


def report(result: Mapping[str, Any]) -> str:
    """Return a suite's numbers as text: ``rows`` as a table, all else as ``key  value`` lines."""
    from vslam_ref.commands.tables import table

    rows = result.get("rows", [])
    heads = list(dict.fromkeys(key for row in rows for key in row))
    parts = [table(heads, [[_show(row.get(head)) for head in heads] for row in rows])] if rows else []
    others = [[key, _show(value)] for key, value in _flat({k: v for k, v in result.items() if k != "rows"})]
    return "\n\n".join(parts + ([table(["what", "value"], others)] if others else []))


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _show(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
