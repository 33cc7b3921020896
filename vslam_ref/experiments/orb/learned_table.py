"""What programs have in common that learn a table and write it as a module: their scenes, and their end."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from vslam_ref.features.levels import Bytes
from vslam_ref.support.files import write_text
from vslam_ref.worlds.rendered import scene

SCENES = ("desk", "corridor", "rotation", "building")


def rendered_pictures(seeds: Sequence[int], per_scene: int) -> Iterator[Bytes]:
    """Yield pictures (H, W) of all scenes with all seeds, evenly spaced along each path."""
    for name in SCENES:
        for seed in seeds:
            made = scene(name, seed)
            for k in range(per_scene):
                yield made.frame(k * (len(made.times) - 1) // per_scene)


def write_or_check(about: str, target: Path, table: Callable[[], str], arguments: list[str] | None) -> int:
    """Write the table, or with ``--check`` compare it with the one that is there; return the exit status."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing: exit status 1 if it differs")
    check = parser.parse_args(arguments).check
    text = table()
    if check:
        same = target.read_text() == text
        print(f"{target.name}: {'the same' if same else 'another table'}")
        return 0 if same else 1
    write_text(target, text)
    print(f"wrote {target.name}")
    return 0
