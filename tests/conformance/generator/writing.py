"""Making files of vectors, or comparing them with those that are there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from generator import topics
from vslam_ref.conformance import vectors_format

SEED = 20260


def generate(
    folder: Path | None, only: Sequence[str], *, write: bool, told: Callable[[str], None] = lambda _: None
) -> list[str]:
    """Make the topics' files.

    Parameters
    ----------
    folder : Path, optional
        Where; the package's own folder by default.
    only : sequence of str
        Topics; all if empty.
    write : bool
        Otherwise only compare.
    told : callable
        Takes a line for every file.

    Returns
    -------
    list of str
        Names of the files that are new or different.

    Raises
    ------
    ValueError
        If there is no such topic.
    """
    modules = topics()
    unknown = set(only) - {module.TOPIC for module in modules.values()}
    if unknown:
        raise ValueError(
            f"no topic {sorted(unknown)[0]!r}; known: {', '.join(m.TOPIC for m in modules.values())}"
        )
    root = Path(str(vectors_format.folder())) if folder is None else folder
    different = []
    for name, module in modules.items():
        if only and module.TOPIC not in only:
            continue
        text = module.build(np.random.default_rng([SEED, module.CHAPTER, *module.TOPIC.encode()])).text()
        path = root / name
        same = path.is_file() and path.read_text(encoding="utf-8") == text
        if not same:
            different.append(name)
            if write:
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
        told(f"{name}: {'the same' if same else 'written' if write else 'different'}")
    return different
