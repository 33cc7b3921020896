"""How a file of vectors is put together."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vslam_ref.conformance.vectors_format import CONVENTION

VERSION = "0.1.0"
CHANGED = {
    **{"format": "0.1.1", "trajectory": "0.1.2", "two_views": "0.1.1"},  # inputs of 12 digits; more notes
    **dict.fromkeys(
        (
            *("multiview", "quaternion", "se2", "se3", "sim3", "so2", "so3", "camera", "loss"),
            *("least_squares", "bundle", "vehicle", "ekf", "range_bearing", "consistency", "grid"),
        ),
        "0.2.0",  # regimes filled: every size, special values, sizes of maps; digits that may be lost
    ),
    **dict.fromkeys(("se2", "camera", "bundle", "vehicle", "grid"), "0.2.1"),  # a few regimes and notes more
}
"""Topic -> its version, where its numbers have changed since VERSION."""
FORMAT = 1


def tolerance(
    relative: float,
    reason: str,
    *,
    absolute: float = 0.0,
    float32: float | None = None,
    lost: dict[str, Any] | None = None,
    lost32: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Tolerance of a group.

    Parameters
    ----------
    relative : float
        To the largest entry of the output.
    reason : str
        Why so much: operations times eps, condition, order of a series.
    absolute : float
        Added to it, for outputs that may be zero.
    float32 : float, optional
        The relative one in single precision; by default 2^29 times the double one, the ratio of the epsilons,
        at most 0.01.
    lost, lost32 : dict, optional
        Of :func:`lost_digits`, in double and in single precision.
    """
    ratio = 2.0**29
    single: dict[str, Any] = {
        "relative": min(0.01, relative * ratio) if float32 is None else float32,
        "absolute": absolute * ratio,
    }
    if lost32 is not None:
        single["lost_digits"] = lost32
    rule = {"relative": relative, "absolute": absolute, "reason": reason}
    return {**rule, **({} if lost is None else {"lost_digits": lost}), "float32": single}


def lost_digits(relative: float, reason: str, *, absolute: float = 0.0) -> dict[str, Any]:
    """Width within which digits are lost and nothing is wrong: what the formula in the reason loses."""
    return {"relative": relative, "absolute": absolute, "reason": reason}


def not_in_single(rule: dict[str, Any]) -> dict[str, Any]:
    """Tolerance of cases whose inputs single precision cannot hold: they are not asked there."""
    return {**rule, "float32": {**rule["float32"], "asked": False}}


@dataclass
class Topic:
    """A file in the making.

    Parameters
    ----------
    chapter : int
    topic : str
    notes : mapping
        Mistake -> what a program does that gives its value, and the wrong formula.
    """

    chapter: int
    topic: str
    notes: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    groups: list[dict[str, Any]] = field(default_factory=list)

    def group(
        self,
        function: str,
        equation: str,
        oracle: str,
        tolerance: dict[str, Any],
        cases: list[dict[str, Any]],
        *,
        flags: str | tuple[str, ...] = (),
        statistic: dict[str, Any] | None = None,
    ) -> None:
        """Add cases of one regime.

        Parameters
        ----------
        function, equation, oracle
            What is asked, the label of its equation, and where the expected values come from.
        tolerance : dict
            Of :func:`tolerance`.
        cases : list of dict
            ``inputs`` and ``expected``; where needed ``accept``, ``mistakes``, ``result``.
        flags : str or tuple of str
            The regime, as ``near_pi``; empty for the generic one.
        statistic : dict, optional
            How random answers are judged.
        """
        flags = tuple(flag for flag in ([flags] if isinstance(flags, str) else flags) if flag)
        regime = "-".join(flags) or "generic"
        stem = f"{function}/{regime}"
        taken = sum(len(g["cases"]) for g in self.groups if g["stem"] == stem)
        rows = [{"id": f"{stem}-{taken + k:02d}", **case} for k, case in enumerate(cases, 1)]
        rows = [{k: v for k, v in row.items() if k != "tolerance" or v != tolerance} for row in rows]
        group = {
            "stem": stem,
            "function": function,
            "equation": equation,
            "oracle": oracle,
            "flags": list(flags),
            "tolerance": tolerance,
            "cases": rows,
        }
        if statistic is not None:
            group["statistic"] = statistic
        head = {key: value for key, value in group.items() if key != "cases"}
        same = [g for g in self.groups if {key: v for key, v in g.items() if key != "cases"} == head]
        if same:
            same[0]["cases"] += rows
        else:
            self.groups.append(group)

    def text(self) -> str:
        """The file, one case a line."""
        used = sorted({group["equation"] for group in self.groups})
        head = {
            "format": FORMAT,
            "version": CHANGED.get(self.topic, VERSION),
            "chapter": self.chapter,
            "topic": self.topic,
            "equations": used,
            "convention": CONVENTION,
            "notes": {key: {"meaning": m, "formula": f} for key, (m, f) in self.notes.items()},
        }
        lines = [json.dumps(head, indent=1)[:-2] + ","]
        lines.append(' "groups": [')
        for g, group in enumerate(self.groups):
            about = {key: value for key, value in group.items() if key not in ("stem", "cases")}
            lines.append("  " + json.dumps(plain(about))[:-1] + ', "cases": [')
            rows = [json.dumps(plain(case)) for case in group["cases"]]
            lines += [f"   {row}," for row in rows[:-1]] + [f"   {rows[-1]}"]
            lines.append("  ]}" + ("," if g < len(self.groups) - 1 else ""))
        return "\n".join([*lines, " ]", "}"]) + "\n"


def plain(value: Any) -> Any:
    """Nested lists, words for numbers that are not finite, and no minus zero."""
    if isinstance(value, dict):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        if math.isnan(value):
            return "nan"
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
        return value + 0.0
    return value
