# ruff: noqa: E501
"""Answers multiplied or divided by a number of the question: a size, a length, an angle, a count."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.diagnosis.evidence import Answer, Evidence, Guess, array, spread
from vslam_ref.conformance.diagnosis.turns import both
from vslam_ref.conformance.vectors_format import Case

POWERS = {1.0: "multiplied by {}", -1.0: "divided by {}", 2.0: "multiplied by {}^2", -2.0: "divided by {}^2", 0.5: "multiplied by the root of {}", -0.5: "divided by the root of {}"}  # fmt: skip


def scaled(evidence: Evidence) -> Iterator[tuple[str, Guess]]:
    """Repairs: an output divided or multiplied by a number of the inputs, or by how many there are."""
    rows = [dict(numbers_of(seen.case)) for seen in spread(evidence.failed, 12)]
    for name in evidence.function.outputs:
        head = f"{name}: " if len(evidence.function.outputs) > 1 else ""
        pairs = both(evidence, name)
        ratios = np.array([np.vdot(w, h) / np.vdot(w, w) if np.vdot(w, w) > 0 else np.nan for w, h in pairs])
        if (
            len(pairs) != len(rows)
            or len(pairs) < 3
            or not np.isfinite(ratios).all()
            or np.ptp(ratios) < 1e-9
        ):
            continue
        for feature in rows[0]:
            values = np.array([row.get(feature, np.nan) for row in rows])
            for power, words in POWERS.items():
                with np.errstate(all="ignore"):
                    expected = np.sign(values) * np.abs(values) ** power
                if np.isfinite(expected).all() and np.allclose(ratios, expected, rtol=1e-6, atol=0.0):
                    yield head + words.format(feature), on_case(name, feature, power)


def on_case(name: str, feature: str, power: float) -> Guess:
    """The repair that undoes a factor of the inputs."""

    def repair(case: Case, got: Answer) -> Answer | None:
        x, value = array(got.get(name)), dict(numbers_of(case)).get(feature, 0.0)
        if x is None or value == 0.0:
            return None
        return {**got, name: (x / (np.sign(value) * abs(value) ** power)).tolist()}

    return repair


def numbers_of(case: Case) -> Iterator[tuple[str, float]]:
    """Numbers that tell a case from others: counts, sizes, angles, and single numbers of its inputs."""
    for name, value in case.inputs.items():
        x = array(value)
        if x is None or not np.isfinite(x).all():
            if isinstance(value, list):
                yield f"the number of {name}", float(len(value))
            continue
        if x.ndim:
            yield f"the number of rows of {name}", float(len(x))
        if x.ndim >= 2 and x.shape[-2:] in ((3, 3), (4, 4)):
            yield f"the angle of {name}", _angle(x.reshape(-1, *x.shape[-2:])[0])
        if x.ndim == 0:
            yield f"|{name}|", abs(float(x))
            yield name, float(x)
        elif x.ndim == 1:
            yield f"the length of {name}", float(np.linalg.norm(x))
            yield from ((f"|{name}[{k}]|", abs(float(v))) for k, v in enumerate(x[:6]))
            yield from ((f"{name}[{k}]", float(v)) for k, v in enumerate(x[:6]))
            if x.size in (6, 7):
                yield f"the angle of {name}", float(np.linalg.norm(x[3:6]))


def _angle(M: Array) -> float:
    R = M[:3, :3]
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return float(np.arctan2(np.linalg.norm(sine), (np.trace(R) - 1) / 2))
