"""Rendered scenes as sequences: ``desk``, or ``desk:7`` with the seed 7."""

from __future__ import annotations

import re

from vslam_ref.worlds.rendered import NAMES, RenderedScene, scene

SEED = 1
"""Where none is given."""
_SOURCE = re.compile(rf"({'|'.join(NAMES)})(?::([0-9]{{1,9}}))?")


def is_scene(source: str) -> bool:
    """Whether a source is the name of a scene, with or without a seed."""
    return _SOURCE.fullmatch(source) is not None


def open_scene(source: str) -> RenderedScene:
    """Return the scene of that name and seed.

    Raises
    ------
    ValueError
        If the source is no such name.
    """
    match = _SOURCE.fullmatch(source)
    if match is None:
        raise ValueError(f"source {source!r}: need {', '.join(NAMES)}, with or without a seed, as desk:7")
    return scene(match[1], SEED if match[2] is None else int(match[2]))
