"""What a program can be asked: the functions, their inputs and outputs, and what kind of quantity each is.

The list is ``functions.json`` beside this file, so that other languages can read it too.  A kind says how
a quantity changes with the convention of a program (:mod:`.conventions`): a ``tangent`` is permuted where
rotations come first, a ``quaternion`` where w is last, a ``pose`` inverted where it is ``T_world_cam``.
"""

from __future__ import annotations

import functools
import json
from importlib.resources import files
from typing import Any, NamedTuple


class Function(NamedTuple):
    """One thing that a program may be asked to compute.

    Attributes
    ----------
    name : str
        As ``so3.exp``: the part before the dot is the topic.
    chapter : int
        The chapter of the book that derives it.
    inputs, outputs : dict of str to str
        Name and kind of each.
    text : str
        One line that says what to compute.
    """

    name: str
    chapter: int
    inputs: dict[str, str]
    outputs: dict[str, str]
    text: str

    @property
    def topic(self) -> str:
        """Name of the file of vectors."""
        return self.name.partition(".")[0]


@functools.cache
def kinds() -> dict[str, str]:
    """Kinds of quantities, and what they are."""
    return dict(_content()["kinds"])


@functools.cache
def functions() -> dict[str, Function]:
    """All functions by name.

    >>> functions()["so3.exp"].inputs, functions()["so3.exp"].topic
    ({'phi': 'plain'}, 'so3')
    """
    table = [Function(**row) for row in _content()["functions"]]
    named = {function.name: function for function in table}
    used = {kind for f in table for kind in (*f.inputs.values(), *f.outputs.values())}
    if len(named) != len(table) or not used <= set(kinds()):
        raise ValueError(
            f"functions.json: a name stands twice, or unknown kinds {sorted(used - set(kinds()))}"
        )
    return named


@functools.cache
def _content() -> dict[str, Any]:
    content: dict[str, Any] = json.loads((files(__package__) / "functions.json").read_text(encoding="utf-8"))
    return content
