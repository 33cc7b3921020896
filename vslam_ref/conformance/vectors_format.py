"""Files of vectors: what stands in them, read and checked.

A file is one topic.  It holds groups, one for each function and regime, and a group holds cases.  The JSON
Schema of a file is ``vectors/schema.json``; what a schema cannot say is checked by :func:`lint`.

Numbers that are not finite are the words "nan", "inf", "-inf".  Every other number has up to 17 digits and
reads back to the same double.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

from vslam_ref.conformance.catalogue import functions

MOST_COUNTED = 20
"""Cases of one regime (a function, an equation and a set of flags) that count."""

CONVENTION = {
    "transform": "T_a_b maps coordinates in b to coordinates in a; a pose is T_cam_world",
    "perturbation": "left: T <- Exp(xi) T",
    "tangent_order": "translation first: (rho, phi); Sim(3): (rho, phi, log s)",
    "quaternion_order": "w x y z",
    "pixel_origin": "(0, 0) is the centre of the top-left pixel",
    "residual": "predicted minus measured; an innovation is measured minus predicted",
    "angle_wrap": "(-pi, pi]",
    "matrices": "lists of rows",
    "units": "radians, metres, pixels, seconds",
}
"""The convention block of every file."""


class Case(NamedTuple):
    """One question and its answer.

    Attributes
    ----------
    id : str
        Stable for ever, as ``so3.exp/near_pi-03``.
    function, equation, oracle : str
        What is asked; the equation's label; where the expected value comes from.
    flags : tuple of str
        The regime.
    inputs, expected : dict
    accept : list of dict
        Other answers that are as right.
    mistakes : dict of str to dict
        Note's id -> what the wrong formula would answer.
    result : str
        ``valid``, ``invalid`` (the program must refuse) or ``convention``.
    tolerance : dict
        ``relative`` (to the largest entry of an output) and ``absolute``, ``reason``; in ``float32`` the same
        for single precision.  Where digits may be lost without being wrong, ``lost_digits``: see
        :mod:`.compare`.
    statistic : dict or None
        How a random answer is judged.
    topic : str
    """

    id: str
    function: str
    equation: str
    oracle: str
    flags: tuple[str, ...]
    inputs: dict[str, Any]
    expected: dict[str, Any]
    accept: list[dict[str, Any]]
    mistakes: dict[str, dict[str, Any]]
    result: str
    tolerance: dict[str, Any]
    statistic: dict[str, Any] | None
    topic: str

    @property
    def regime(self) -> tuple[str, str, tuple[str, ...]]:
        """Function, equation and flags."""
        return self.function, self.equation, self.flags


class VectorFile(NamedTuple):
    """One topic: its cases, and notes by id (``meaning``, ``formula``)."""

    name: str
    chapter: int
    version: str
    notes: dict[str, dict[str, str]]
    cases: list[Case]


def folder() -> Traversable:
    """The folder of the vectors that come with the package."""
    return files("vslam_ref.conformance") / "vectors"


def names() -> list[str]:
    """Names of all files, ``chapter/topic.json``, in order."""
    found = [
        f"{chapter.name}/{file.name}"
        for chapter in folder().iterdir()
        if chapter.is_dir()
        for file in chapter.iterdir()
        if file.name.endswith(".json")
    ]
    return sorted(found)


def load(name: str) -> VectorFile:
    """Read one of the package's files, or a file on disk by its path.

    Raises
    ------
    ValueError
        If it is not JSON of this format; one line with the file's name.
    """
    place = folder() / name if name in names() else Path(name)
    try:
        content = json.loads(place.read_text(encoding="utf-8"))
        return parse(name, content)
    except (json.JSONDecodeError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{name}: not a file of vectors ({type(error).__name__}: {error})") from None


def parse(name: str, content: dict[str, Any]) -> VectorFile:
    """Make cases of a file's content: what a group says holds for each of its cases."""
    cases = []
    for group in content["groups"]:
        shared = {**group, "flags": tuple(group["flags"]), "topic": content["topic"]}
        for row in group["cases"]:
            fields = {"accept": [], "mistakes": {}, "result": "valid", "statistic": None} | shared | row
            cases.append(Case(**{field: fields[field] for field in Case._fields}))
    return VectorFile(name, int(content["chapter"]), content["version"], content["notes"], cases)


def counted(cases: list[Case]) -> int:
    """Number of cases, at most :data:`MOST_COUNTED` of a regime."""
    return sum(min(MOST_COUNTED, count) for count in Counter(case.regime for case in cases).values())


def lint(file: VectorFile) -> Iterator[str]:
    """Yield a sentence for everything that is wrong with a file beyond its schema."""
    known = functions()
    seen: set[str] = set()
    for case in file.cases:
        if case.id in seen:
            yield f"{case.id}: this id stands twice"
        seen.add(case.id)
        function = known.get(case.function)
        if function is None:
            yield f"{case.id}: {case.function} is not in the catalogue"
            continue
        if function.chapter != file.chapter or function.topic != case.topic:
            yield f"{case.id}: {case.function} belongs to chapter {function.chapter}, topic {function.topic}"
        if set(case.inputs) != set(function.inputs):
            yield f"{case.id}: inputs {sorted(case.inputs)}; the catalogue says {sorted(function.inputs)}"
        answers = [case.expected, *case.accept, *case.mistakes.values()]
        if case.result != "invalid" and any(set(a) != set(function.outputs) for a in answers):
            yield f"{case.id}: outputs differ from the catalogue's {sorted(function.outputs)}"
        for note in (*case.mistakes, *(case.statistic or {}).get("mistakes", {})):
            if note not in file.notes:
                yield f"{case.id}: note {note!r} is not explained"
        if not case.tolerance.get("reason"):
            yield f"{case.id}: the tolerance has no reason"
        for rule in (case.tolerance, case.tolerance.get("float32", {})):
            lost = rule.get("lost_digits")
            if lost and (lost["relative"] < rule["relative"] or lost["absolute"] < rule["absolute"]):
                yield f"{case.id}: lost_digits is narrower than the tolerance"
