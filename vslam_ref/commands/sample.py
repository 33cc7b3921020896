"""``vslam-ref sample``: small inputs for every command, made by the library's own worlds."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vslam_ref.commands.options import add_json, at_least, json_target, write_json
from vslam_ref.commands.samples import KINDS

if TYPE_CHECKING:
    from vslam_ref.commands.samples import Made

HELP = "make small inputs of every kind, with their truth, to try the commands on"
EPILOG = (
    "kinds:\n"
    + "\n".join(f"  {name:<12}{what}" for name, what in {**KINDS, "all": "all of these"}.items())
    + """

Each kind is a folder in DIR with a README.txt: the format, what is true, a command to try. The same seed
gives the same bytes. DIR is new, empty, or holds samples; kinds that are not asked for stay in it.

examples:
  vslam-ref sample all --out samples
  vslam-ref sample robot boards --out samples --seed 7 --json samples.json"""
)

MAKERS = {
    "robot": "robot:make",
    "laser": "laser:make",
    "bal": "bundles:make_bal",
    "colmap": "bundles:make_colmap",
    "boards": "boards:make",
    "trajectory": "trajectory:make",
    "adapter": "adapter:make",
    "video": "video:make",
    "posegraph": "posegraph:make",
}
"""Kind -> module and function in ``commands.samples``."""
LIST = "sample.json"
"""What DIR holds: seed, files and truth of each kind.  It marks a folder that may be written over."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    parser.add_argument("kinds", nargs="+", metavar="KIND", choices=[*KINDS, "all"], help="see below")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder of the samples")
    parser.add_argument(
        "--seed", type=at_least(0), default=1, metavar="N", help="root of all randomness (default: 1)"
    )
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Make the samples, then put them in place in one step."""
    import shutil

    from vslam_ref.commands.tables import table
    from vslam_ref.support import files
    from vslam_ref.support.json_text import to_json

    target = json_target(options)
    out, before = _earlier(options.out)
    asked = [kind for kind in KINDS if kind in options.kinds or "all" in options.kinds]
    with files.new_folder(out) as folder:
        kept = {kind: told for kind, told in before.items() if kind not in asked}
        for kind in kept:
            shutil.copytree(out / kind, folder / kind)
        made = kept | {kind: make(kind, folder / kind, options.seed) for kind in asked}
        content = {"samples": {kind: made[kind] for kind in KINDS if kind in made}}
        files.write_text(folder / LIST, to_json(content))
    rows = [[kind, str(len(made[kind]["files"])), str(made[kind]["bytes"]), KINDS[kind]] for kind in asked]
    print(table(["kind", "files", "bytes", "what"], rows))
    print(f"seed {options.seed}; each folder in {out} has a README.txt with commands to try")
    numbers: dict[str, Any] = {"seed": options.seed, "out": str(out)}
    numbers["samples"] = {kind: made[kind] for kind in asked}
    write_json(target, numbers)
    return 0


def make(kind: str, folder: Path, seed: int) -> dict[str, Any]:
    """Make one kind in a new folder.

    Returns
    -------
    dict
        ``seed``, ``files`` (name -> bytes), ``bytes`` in all, ``commands``, ``truth``.
    """
    import importlib

    import numpy as np

    from vslam_ref.support import files
    from vslam_ref.support.json_text import to_json

    module, _, function = MAKERS[kind].partition(":")
    maker = getattr(importlib.import_module(f"vslam_ref.commands.samples.{module}"), function)
    sequence = np.random.SeedSequence(seed, spawn_key=(list(KINDS).index(kind),))
    folder.mkdir()
    made: Made = maker(folder, np.random.default_rng(sequence))
    files.write_text(folder / "truth.json", to_json(made.truth))
    lines = "\n".join(f"  {line}" for line in made.commands)
    files.write_text(folder / "README.txt", f"{made.readme}\n\ntry:\n{lines}\n")
    sizes = {p.relative_to(folder).as_posix(): p.stat().st_size for p in folder.rglob("*") if p.is_file()}
    return {
        "seed": seed,
        "files": dict(sorted(sizes.items())),
        "bytes": sum(sizes.values()),
        "commands": list(made.commands),
        "truth": made.truth,
    }


def _earlier(out: str) -> tuple[Path, dict[str, Any]]:
    """The checked folder, and what it lists from before: ``InputError`` if it holds anything else."""
    from vslam_ref.support import files
    from vslam_ref.support.errors import InputError

    path = files.require_new_folder(out, LIST)
    if not (path / LIST).is_file():
        return path, {}
    try:
        before = json.loads((path / LIST).read_text(encoding="utf-8"))["samples"]
        known = {LIST, *(f"{kind}/{name}" for kind in before for name in before[kind]["files"])}
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path / LIST} is not the list of samples: give a new or empty folder") from None
    there = {p.relative_to(path).as_posix() for p in path.rglob("*") if p.is_file() and _counts(p)}
    if there - known:
        what = f"output folder {out!r} holds {sorted(there - known)[0]}, which is no sample"
        raise InputError(f"{what}: move it, or give a new folder")
    return path, {kind: told for kind, told in before.items() if kind in KINDS and (path / kind).is_dir()}


def _counts(path: Path) -> bool:
    """Whether a file is a user's: neither hidden nor Python's cache."""
    return not path.name.startswith(".") and path.parent.name != "__pycache__"
