"""Numeric arrays from MATLAB files (version 5), and nothing else from them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vslam_ref.datasets.text import FormatError

NUMERIC = {"double", "single", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}
MAX_VALUES = 10_000_000


def read_vectors(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read the named variables, each a row or column of finite numbers, as float vectors (n,).

    The header is looked at first: a variable that is no plain numeric vector of bounded size is never
    loaded.

    Raises
    ------
    FormatError
        On a missing file, a file that cannot be parsed, a missing or wrong variable, a value that is
        not finite, or vectors of different lengths.
    """
    if not path.is_file():
        raise FormatError(path, None, "no such file")
    import scipy.io

    try:
        shapes = {name: (shape, kind) for name, shape, kind in scipy.io.whosmat(str(path))}
    except Exception as error:  # a damaged file makes SciPy raise almost anything
        raise FormatError(path, None, _unreadable(error)) from None
    for name in names:
        _check_header(path, name, shapes)
    try:
        content = scipy.io.loadmat(str(path), variable_names=list(names))
        vectors = {name: np.asarray(content[name], dtype=np.float64).ravel() for name in names}
    except Exception as error:
        raise FormatError(path, None, _unreadable(error)) from None
    for name, vector in vectors.items():
        bad = np.flatnonzero(~np.isfinite(vector))
        if len(bad):
            what = f"{name}({bad[0] + 1}) is {vector[bad[0]]}; expected a finite number"
            raise FormatError(path, None, what)
    lengths = {name: len(vector) for name, vector in vectors.items()}
    if len(set(lengths.values())) > 1:
        raise FormatError(path, None, f"lengths differ ({lengths}); expected equal ones")
    return vectors


def _check_header(path: Path, name: str, shapes: dict[str, tuple[tuple[int, ...], str]]) -> None:
    if name not in shapes:
        raise FormatError(path, None, f"no variable {name!r}; found {', '.join(shapes) or 'none'}")
    shape, kind = shapes[name]
    size = int(np.prod(shape, dtype=object))
    if kind not in NUMERIC or len(shape) != 2 or 1 not in shape or not 0 < size <= MAX_VALUES:
        what = f"{name} is {'x'.join(map(str, shape))} {kind}; expected a vector of 1 to {MAX_VALUES} numbers"
        raise FormatError(path, None, what)


def _unreadable(error: Exception) -> str:
    reason = " ".join(str(error).split())[:120] or type(error).__name__
    return f"cannot be read ({reason}); expected a MATLAB file, version 5"
