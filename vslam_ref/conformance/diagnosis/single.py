"""Why is an answer wrong?  First the mistakes that a case knows, then conventions that were not declared.

A case lists what well-known wrong formulas would answer; an answer that equals one of them names the mistake.
Failing that, the answer is turned as other conventions would: a sign, a transpose, an inverse, another order,
degrees, half a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.catalogue import functions
from vslam_ref.conformance.compare import Profile, compare, matches, numbers
from vslam_ref.conformance.conventions import ROTATION_FIRST, ROTATION_FIRST_SIM3
from vslam_ref.conformance.statistics import mistaken
from vslam_ref.conformance.vectors_format import Case, VectorFile


def _inverse(x: Array) -> Array:
    return np.asarray(np.linalg.inv(x))


def _transpose(x: Array) -> Array:
    return np.swapaxes(x, -1, -2)


TURNS: dict[str, tuple[tuple[str, ...], Callable[[Array], Array]]] = {
    "the sign is flipped": ((), lambda x: -x),
    "the matrix is transposed (or column by column)": (("matrix",), _transpose),
    "the transform is inverted": (("motion", "pose", "square"), _inverse),
    "rotation comes before translation": (("tangent",), lambda x: x[..., ROTATION_FIRST]),
    "rotation comes before translation, in columns": (("pose_jacobian",), lambda x: x[..., ROTATION_FIRST]),
    "rotation comes before translation, in rows and columns": (
        ("tangent_matrix", "pose_covariance"),
        lambda x: x[..., ROTATION_FIRST, :][..., ROTATION_FIRST],
    ),
    "rotation comes before translation, in Sim(3)": (
        ("tangent_sim3",),
        lambda x: x[..., ROTATION_FIRST_SIM3],
    ),
    "the quaternion has w last": (("quaternion",), lambda x: x[..., [3, 0, 1, 2]]),
    "degrees are given for radians": ((), np.radians),
    "radians are given for degrees": ((), np.degrees),
    "the pixel's origin is the image's corner (+0.5)": (("pixel",), lambda x: x - 0.5),
    "half a pixel is missing (-0.5)": (("pixel",), lambda x: x + 0.5),
    "a factor 2 is missing": ((), lambda x: 2.0 * x),
    "a factor 1/2 is missing": ((), lambda x: 0.5 * x),
}
"""Sentence -> kinds it can happen to (none: all), and what turns the wrong answer into the right one."""


def diagnose(file: VectorFile, case: Case, got: Any, profile: Profile = "float64") -> str:
    """Return a sentence that says what is probably wrong, or an empty one.

    Parameters
    ----------
    file : VectorFile
        For its notes.
    case : Case
    got : object
        Outputs of the program, in the house's convention.
    profile : {"float64", "float32"}
    """
    if not isinstance(got, dict):
        return ""
    if known := known_mistake(file, case, got, profile):
        return known
    function = functions()[case.function]
    if case.statistic is not None or len(function.outputs) > 2:
        return ""
    for sentence, (kinds, turn) in TURNS.items():
        if case.result == "convention" and not kinds:
            continue  # a sign, a unit, a factor is no convention that a program may have
        for name, kind in function.outputs.items():
            if "factor" in sentence and not _telling(got.get(name)):
                continue
            turned = _turned(got, name, kind, kinds, turn)
            if turned is not None and compare(case, turned, profile).right:
                return f"{name}: {sentence}"
    return ""


def known_mistake(file: VectorFile, case: Case, got: dict[str, Any], profile: Profile = "float64") -> str:
    """The note of the wrong formula that gives this answer, or an empty sentence."""
    found = mistaken(case, got)
    for note, answer in case.mistakes.items():
        found = found or (note if matches(answer, got, case, profile) else "")
    return f"{found}: {file.notes[found]['meaning']}" if found else ""


def _telling(value: Any) -> bool:
    """Whether a factor can be told from a power: more than one number."""
    try:
        return numbers(value).size > 1
    except ValueError:
        return False


def _turned(
    got: dict[str, Any], name: str, kind: str, kinds: tuple[str, ...], turn: Callable[[Array], Array]
) -> dict[str, Any] | None:
    """The answer with one output turned, or None where that makes no sense."""
    try:
        x = numbers(got[name])
        matrix = x.ndim >= 2 and x.shape[-1] == x.shape[-2]
        fits = not kinds or kind in kinds or ("matrix" in kinds and matrix) or ("square" in kinds and matrix)
        return {**got, name: turn(x).tolist()} if fits else None
    except (KeyError, ValueError, IndexError, np.linalg.LinAlgError):
        return None
