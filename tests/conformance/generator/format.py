"""Trajectory files: texts with the numbers that stand in them, and texts that must be refused."""

from __future__ import annotations

from typing import Any

import numpy as np

from generator.building import Topic, tolerance
from generator.exact import floats, vector
from generator.groups import SE3, Array, shift, turn

TOPIC, CHAPTER = "format", 23
DEFINITION = "the numbers that the text was made from"

NOTES = {
    "file-order": (
        "you take the quaternion's four columns for w x y z; a TUM file has x y z w",
        "q = columns 5 6 7 8",
    ),
    "sign-changed": (
        "you change the quaternion's sign to make w positive; here the file's is asked for",
        "-q",
    ),
    "four-decimals": ("you write four decimals: half a tenth of a millimetre is lost", "%.4f"),
    "six-decimals": ("you write six decimals: small motions and angles are lost", "%.6f"),
    "single-precision": (
        "you keep times in single precision: a Unix time is off by up to a minute",
        "float32",
    ),
    "column-major": ("you read the numbers column by column", "transposed"),
    "inverted": ("you invert the poses: the file holds T_world_cam, and that is asked for", "T^-1"),
    "times-in-the-back": ("you write the time last", "tx ty tz qx qy qz qw time"),
    "writes-w-first": (
        "you write the quaternion as w x y z; a TUM file has x y z w",
        "time tx ty tz qw qx qy qz",
    ),
}


def build(rng: np.random.Generator) -> Topic:
    """Reading both formats, and writing one."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    exact = tolerance(2.3e-16, "a decimal number is read to the nearest double", float32=1e-6)
    for flag in ("plain", "comments", "spaces", "exponents", "unix_time"):
        cases = [_tum(rng, flag) for _ in range(4)]
        topic.group("format.tum", "eq-tum-line", DEFINITION, exact, cases, flags=(flag,))
    broken = [{"inputs": {"text": t}, "expected": {}, "result": "invalid"} for t in _broken_tum()]
    topic.group("format.tum", "eq-tum-line", "definition of the format", exact, broken, flags=("malformed",))
    for flag in ("plain", "spaces", "exponents"):
        cases = [_kitti(rng, flag) for _ in range(4)]
        topic.group("format.kitti", "eq-kitti-line", DEFINITION, exact, cases, flags=(flag,))
    broken = [{"inputs": {"text": t}, "expected": {}, "result": "invalid"} for t in _broken_kitti()]
    topic.group(
        "format.kitti", "eq-kitti-line", "definition of the format", exact, broken, flags=("malformed",)
    )
    for flag, first, allowed in (("seconds", 0.0, 1e-13), ("unix_time", 1.3e9, 5e-7)):
        reason = "every digit of a double is kept; the largest number is the time"
        rule = tolerance(0.0, reason, absolute=allowed)
        rule["float32"]["absolute"] = 1e-5 if first == 0.0 else 128.0
        cases = [_written(rng, first, small) for small in (False, False, True, True)]
        topic.group("format.write_tum", "eq-tum-line", DEFINITION, rule, cases, flags=(flag,))
    return topic


def _poses(rng: np.random.Generator, n: int, first: float) -> tuple[Array, Array, Array]:
    """Times, positions, quaternions w x y z; every second one with a negative w."""
    times = first + np.cumsum(rng.uniform(0.02, 0.1, n))
    phi = np.stack([turn(rng) for _ in range(n)])
    angle = np.linalg.norm(phi, axis=1, keepdims=True)
    q = np.concatenate([np.cos(angle / 2), np.sin(angle / 2) * phi / angle], 1)
    q[::2] *= -1
    return times, np.stack([shift(rng) for _ in range(n)]), q


def _tum(rng: np.random.Generator, flag: str) -> dict[str, Any]:
    times, t, q = _poses(rng, int(rng.integers(2, 5)), 1305031102.0 if flag == "unix_time" else 0.0)
    if flag == "unix_time":
        times = np.round(times, 4)
    form = "{:.17e}" if flag == "exponents" else "{!r}"
    rows = np.column_stack([times, t, q[:, [1, 2, 3, 0]]])
    gap = "   " if flag == "spaces" else " "
    lines = [gap.join(form.format(float(v)) for v in row) for row in rows]
    text = "\n".join(lines) + "\n"
    if flag == "comments":
        text = (
            "# ground truth\n# timestamp tx ty tz qx qy qz qw\n"
            + "\n".join(f"{line}\n# next" for line in lines)
            + "\n"
        )
    if flag == "spaces":
        text = "\n\n" + "\n\n".join(f"  {line}\t" for line in lines) + "\n\n"
    right = {"times": times, "t": t, "q": q}
    wrong = {
        "file-order": {**right, "q": q[:, [1, 2, 3, 0]]},
        "sign-changed": {**right, "q": q * np.sign(q[:, :1])},
    }
    if flag == "unix_time":
        wrong["single-precision"] = {**right, "times": times.astype(np.float32).astype(np.float64)}
    return {"inputs": {"text": text}, "expected": right, "mistakes": wrong}


GOOD = "1.5 0.1 0.2 0.3 0.0 0.0 0.0 1.0"


def _broken_tum() -> list[str]:
    return [
        "1.5 0.1 0.2 0.3 0.0 0.0 0.0\n",
        f"{GOOD} 7\n",
        GOOD.replace("0.2", "0.2m") + "\n",
        GOOD.replace("0.2", "nan") + "\n",
        GOOD.replace("0.2", "inf") + "\n",
        GOOD.replace("1.0", "0.5") + "\n",
        GOOD.replace("1.0", "0.0") + "\n",
        f"{GOOD}\n1.4 0.1 0.2 0.3 0.0 0.0 0.0 1.0\n",
        f"{GOOD}\n1.6 0.1 0.2\n",
        f"{GOOD}\n1.6,0.1,0.2,0.3,0.0,0.0,0.0,1.0\n",
        "",
        "# timestamp tx ty tz qx qy qz qw\n",
    ]


def _kitti(rng: np.random.Generator, flag: str) -> dict[str, Any]:
    T = np.stack([floats(SE3.exp(vector([*shift(rng), *turn(rng)]))) for _ in range(int(rng.integers(2, 4)))])
    form = "{:.17e}" if flag == "exponents" else "{!r}"
    gap = "  " if flag == "spaces" else " "
    lines = [gap.join(form.format(float(v)) for v in pose[:3].ravel()) for pose in T]
    ends = "\n\n" if flag == "spaces" else "\n"
    across = T.copy()
    across[:, :3] = T[:, :3].reshape(-1, 4, 3).transpose(0, 2, 1)
    back = T.copy()
    back[:, :3, :3] = np.swapaxes(T[:, :3, :3], 1, 2)
    back[:, :3, 3] = -np.einsum("kij,kj->ki", back[:, :3, :3], T[:, :3, 3])
    wrong = {"column-major": {"T": across}, "inverted": {"T": back}}
    return {"inputs": {"text": ends.join(lines) + "\n"}, "expected": {"T": T}, "mistakes": wrong}


def _broken_kitti() -> list[str]:
    eye = "1 0 0 0.5 0 1 0 0.6 0 0 1 0.7"
    return [
        "1 0 0 0.5 0 1 0 0.6 0 0 1\n",
        f"{eye} 0 0 0 1\n",
        eye.replace("0.6", "half") + "\n",
        eye.replace("0.6", "nan") + "\n",
        "2 0 0 0.5 0 2 0 0.6 0 0 2 0.7\n",
        "1 0 0 0.5 0 1 0 0.6 0 0 -1 0.7\n",
        "1 0.1 0 0.5 0 1 0 0.6 0 0 1 0.7\n",
        f"{eye}\n1 0 0 0.5\n",
        "",
    ]


def _written(rng: np.random.Generator, first: float, small: bool) -> dict[str, Any]:
    times, t, q = _poses(rng, 3, first)
    if small:  # a slow motion, which a few decimals would lose
        t = 1e-3 * t
    table = np.column_stack([times, t, q[:, [1, 2, 3, 0]]])

    def text(rows: Array, form: str = "{!r}") -> str:
        return "\n".join(" ".join(form.format(float(v)) for v in row) for row in rows) + "\n"

    wrong = {
        "four-decimals": text(table, "{:.4f}"),
        "six-decimals": text(table, "{:.6f}"),
        "writes-w-first": text(np.column_stack([times, t, q])),
        "times-in-the-back": text(np.roll(table, -1, axis=1)),
    }
    if first > 0:
        del wrong["six-decimals"]  # digits of the time that a double does not hold
    mistakes = {note: {"text": value} for note, value in wrong.items()}
    inputs = {"times": times, "t": t, "q": q}
    return {"inputs": inputs, "expected": {"text": text(table)}, "mistakes": mistakes}
