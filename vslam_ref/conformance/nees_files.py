"""A filter's simulated runs, read from a CSV file or from ``.npz``.

CSV: a line for every step of every run, ``run, step, e1 ... ed, P11 ... Pdd`` (row by row); a first line of
names and lines that begin with ``#`` are passed over.  ``.npz``: arrays ``run`` (N,), ``step`` (N,),
``error`` (N, d) and ``covariance`` (N, d, d).  All runs have the same steps, in any order.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.datasets.text import is_number

LARGEST = 2**30
"""Bytes of a file, and of what it unpacks to."""
ARRAYS = ("run", "step", "error", "covariance")


class Runs(NamedTuple):
    """Errors and covariances of M runs of T steps.

    Attributes
    ----------
    steps : ndarray, shape (T,)
        Numbers or times of the steps, rising.
    error : ndarray, shape (M, T, d)
        Truth minus estimate, or the negative; angles wrapped.
    covariance : ndarray, shape (M, T, d, d)
        What the filter claims.
    """

    steps: Array
    error: Array
    covariance: Array


def read(path: Path, dof: int | None = None) -> Runs:
    """Read runs; the suffix ``.npz`` says the format.

    Parameters
    ----------
    path : Path
    dof : int, optional
        Length d of the error; from the file by default.

    Raises
    ------
    ValueError
        With one line that names the file, the place and what is right.
    """
    if dof is not None and dof < 1:
        raise ValueError(f"--dof {dof}: need the length of the error, 1 or more")
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError(f"{path}: {path.stat().st_size} bytes; at most {LARGEST} are read")
        table = _npz(path) if path.suffix == ".npz" else _csv(path, dof)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror or error}") from None
    d = table[2].shape[1]
    if dof is not None and d != dof:
        raise ValueError(f"{path}: errors of {d} numbers; --dof says {dof}")
    return _rectangle(path, *table)


# -- CSV -------------------------------------------------------------------------------------------


def _csv(path: Path, dof: int | None) -> tuple[Array, Array, Array, Array]:
    rows = list(_rows(path))
    if not rows:
        raise ValueError(f"{path}: no line of numbers")
    width = len(rows[0][1])
    d = (math.isqrt(4 * width - 7) - 1) // 2 if dof is None and width >= 4 else (dof or 0)
    if d < 1 or width != 2 + d + d * d:
        d = d if dof is not None else max(d, 1)
        raise ValueError(f"{path}:{rows[0][0]}: {width} columns; {_columns(d)}")
    for number, values in rows:
        if len(values) != width:
            raise ValueError(f"{path}:{number}: {len(values)} columns; {_columns(d)}")
    table = np.array([values for _, values in rows])
    return table[:, 0], table[:, 1], table[:, 2 : 2 + d], table[:, 2 + d :].reshape(-1, d, d)


def _columns(d: int) -> str:
    return f"need {2 + d + d * d}: run, step, {d} of the error and {d} x {d} of the covariance, row by row"


def _rows(path: Path) -> Iterator[tuple[int, list[float]]]:
    """Numbers of every line, with its number."""
    first = True
    with path.open(encoding="utf-8", errors="replace") as lines:
        for number, line in enumerate(lines, 1):
            words = [word.strip() for word in line.split(",")]
            if words == [""] or line.startswith("#"):
                continue
            if first and not is_number(words[0]):
                first = False  # the names of the columns
                continue
            if bad := [word for word in words if not is_number(word)]:
                raise ValueError(f"{path}:{number}: {bad[0][:40]!r} is not a number")
            values = [float(word) for word in words]
            if not all(map(math.isfinite, values)):
                raise ValueError(f"{path}:{number}: a number is not finite")
            first = False
            yield number, values


# -- npz -------------------------------------------------------------------------------------------


def _npz(path: Path) -> tuple[Array, Array, Array, Array]:
    try:
        with zipfile.ZipFile(path) as archive:
            missing = [name for name in ARRAYS if f"{name}.npy" not in archive.namelist()]
            if missing:
                raise ValueError(f"{path}: no array {missing[0]!r}; need {', '.join(ARRAYS)}")
            run, step, error, covariance = (_member(path, archive, name) for name in ARRAYS)
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError) as reason:
        raise ValueError(f"{path}: not an .npz file ({reason})") from None
    n = len(run) if run.ndim == 1 else -1
    d = error.shape[1] if error.ndim == 2 else -1
    if n < 1 or d < 1 or step.shape != (n,) or error.shape != (n, d) or covariance.shape != (n, d, d):
        arrays = zip(ARRAYS, (run, step, error, covariance), strict=True)
        shapes = ", ".join(f"{name} {a.shape}" for name, a in arrays)
        raise ValueError(f"{path}: {shapes}; need (N,), (N,), (N, d) and (N, d, d)")
    return run, step, error, covariance


def _member(path: Path, archive: zipfile.ZipFile, name: str) -> Array:
    """One array; what its header promises must be there before memory is allocated."""
    info = archive.getinfo(f"{name}.npy")
    if info.file_size > LARGEST:
        raise ValueError(f"{path}: array {name!r} has {info.file_size} bytes; at most {LARGEST} are read")
    content = archive.read(info)
    try:
        stream = io.BytesIO(content)
        version = np.lib.format.read_magic(stream)
        header = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, _, dtype = header(stream)
        if dtype.hasobject or dtype.kind not in "iuf" or math.prod(shape) * dtype.itemsize > len(content):
            raise ValueError(f"{math.prod(shape)} of {dtype} in {len(content)} bytes")
        values = np.load(io.BytesIO(content), allow_pickle=False).astype(np.float64)
    except ValueError as error:
        raise ValueError(f"{path}: array {name!r} is not an array of numbers ({str(error)[:80]})") from None
    if not np.isfinite(values).all():
        raise ValueError(f"{path}: array {name!r} has a number that is not finite")
    return np.asarray(values)


# -- both ------------------------------------------------------------------------------------------


def _rectangle(path: Path, run: Array, step: Array, error: Array, covariance: Array) -> Runs:
    """Sort into runs and steps; every run must have every step once."""
    runs, of_run = np.unique(run, return_inverse=True)
    steps, of_step = np.unique(step, return_inverse=True)
    count = np.zeros((len(runs), len(steps)), dtype=np.int64)
    np.add.at(count, (of_run, of_step), 1)
    if (count != 1).any():
        m, t = np.argwhere(count != 1)[0]
        word = "twice or more" if count[m, t] else "not there"
        raise ValueError(
            f"{path}: step {steps[t]:g} of run {runs[m]:g} is {word}; every run needs every step once"
        )
    order = np.lexsort((of_step, of_run))
    shape = len(runs), len(steps), error.shape[1]
    return Runs(steps, error[order].reshape(shape), covariance[order].reshape(*shape, shape[2]))
