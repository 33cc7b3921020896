"""Numeric vectors from MATLAB files (version 5), and nothing else from them.

A file is 128 bytes of head and then elements, each a tag of 8 bytes (type, size) and its content, padded::

    head       116 bytes of text, 8 of other use, version 0x0100, 'IM' or 'MI': little or big endian
    matrix     flags with the class, dimensions, name, numbers: four elements inside one
    compressed a matrix packed by zlib

An element of at most 4 bytes may stand in its own tag: size and type in two bytes each, then the content.
Numbers may be stored in a smaller type than that of their class.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.datasets.text import FormatError, read_bytes

MAX_BYTES = 128 * 2**20
"""Of the file, and of each variable unpacked: room for ``MAX_VALUES`` doubles."""
MAX_VALUES = 10_000_000

HEAD = 128
MATRIX, COMPRESSED = 14, 15
STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
"""Types of numbers."""
NUMERIC = {6: "double", 7: "single", 8: "int8", 9: "uint8", 10: "int16", 11: "uint16", 12: "int32"}
NUMERIC |= {13: "uint32", 14: "int64", 15: "uint64"}
OTHER = {1: "cell", 2: "struct", 3: "object", 4: "char", 5: "sparse"}
"""Classes of matrices."""
COMPLEX = 0x0800


class _DamagedError(Exception):
    """Not a MATLAB file; the text says why."""


class _Variable(NamedTuple):
    """One matrix: its name, dimensions, class, and its numbers as they are stored."""

    name: str
    shape: tuple[int, ...]
    kind: str
    stored: int
    content: bytes


def read_vectors(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    """Read the named variables, each a row or column of finite numbers, as float vectors (n,).

    The head is looked at first: a variable that is not a plain numeric vector of bounded size is never
    made into numbers.

    Raises
    ------
    FormatError
        On a missing file, a file that cannot be parsed, a missing or wrong variable, a value that is
        not finite, or vectors of different lengths.
    """
    data = read_bytes(path, MAX_BYTES)
    try:
        order = _order(data)
        found = list(_variables(data, order))
    except _DamagedError as error:
        raise FormatError(path, None, _unreadable(str(error))) from None
    vectors = {}
    for name in names:
        mine = [variable for variable in found if variable.name == name]
        if len(mine) != 1:
            shown = ", ".join(variable.name for variable in found) or "none"
            what = f"variable {name!r} comes {len(mine)} times" if mine else f"no variable {name!r}"
            raise FormatError(path, None, f"{what}; found {shown}")
        vectors[name] = _vector(path, mine[0], order)
    lengths = {name: len(vector) for name, vector in vectors.items()}
    if len(set(lengths.values())) > 1:
        raise FormatError(path, None, f"lengths differ ({lengths}); expected equal ones")
    return vectors


def _unreadable(reason: str) -> str:
    return f"cannot be read ({reason}); expected a MATLAB file, version 5"


def _order(data: bytes) -> str:
    """Byte order, as NumPy and struct write it."""
    order = {b"IM": "<", b"MI": ">"}.get(data[126:HEAD])
    if order is None:
        raise _DamagedError("no head with 'IM' or 'MI' at byte 126")
    version = struct.unpack_from(f"{order}H", data, 124)[0]
    if version != 0x0100:
        raise _DamagedError(f"version {version:#06x}, expected 0x0100")
    return order


def _element(data: bytes, at: int, order: str) -> tuple[int, bytes, int]:
    """Type and content of the element at a byte, and the byte of the next."""
    if at + 8 > len(data):
        raise _DamagedError("truncated inside a tag")
    word, size = struct.unpack_from(f"{order}2I", data, at)
    if word >> 16:  # the small form
        kind, size = word & 0xFFFF, word >> 16
        if size > 4:
            raise _DamagedError(f"{size} bytes in a small element, which has 4")
        return kind, data[at + 4 : at + 4 + size], at + 8
    end = at + 8 + size
    if end > len(data):
        raise _DamagedError(f"an element of {size} bytes where {len(data) - at - 8} are left")
    return word, data[at + 8 : end], end if word == COMPRESSED else at + 8 + -(-size // 8) * 8


def _variables(data: bytes, order: str) -> Iterator[_Variable]:
    """All matrices of the file."""
    at = HEAD
    while at < len(data):
        kind, content, at = _element(data, at, order)
        if kind == COMPRESSED:
            kind, content, _ = _element(_unpacked(content), 0, order)
        if kind == MATRIX:
            yield _variable(content, order)


def _unpacked(content: bytes) -> bytes:
    unpacker = zlib.decompressobj()
    try:
        data = unpacker.decompress(content, MAX_BYTES)
    except zlib.error as error:
        raise _DamagedError(str(error)) from None
    if not unpacker.eof:
        raise _DamagedError(f"a packed variable is cut off, or has more than {MAX_BYTES} bytes")
    return data


def _variable(content: bytes, order: str) -> _Variable:
    """One matrix."""
    _, flags, at = _element(content, 0, order)
    stored, dimensions, at = _element(content, at, order)
    _, name, at = _element(content, at, order)
    if len(flags) < 4 or STORED.get(stored) != "i4" or len(dimensions) % 4:
        raise _DamagedError("a matrix without flags or dimensions")
    flag = struct.unpack_from(f"{order}I", flags)[0]
    code = flag & 0xFF
    shape = tuple(np.frombuffer(dimensions, f"{order}i4").tolist())
    kind = NUMERIC.get(code) or OTHER.get(code, f"class {code}")
    if flag & COMPLEX:
        kind = f"complex {kind}"
    shown = name.decode("ascii", "backslashreplace")
    if code not in NUMERIC:
        return _Variable(shown, shape, kind, 0, b"")
    stored, numbers, _ = _element(content, at, order)
    return _Variable(shown, shape, kind, stored, numbers)


def _vector(path: Path, variable: _Variable, order: str) -> NDArray[np.float64]:
    """Numbers of a variable, if it is a vector of finite ones."""
    name, shape, kind, stored, content = variable
    size = math.prod(shape) if min(shape, default=-1) >= 0 else -1
    if kind not in NUMERIC.values() or len(shape) != 2 or 1 not in shape or not 0 < size <= MAX_VALUES:
        what = f"{name} is {'x'.join(map(str, shape))} {kind}; expected a vector of 1 to {MAX_VALUES} numbers"
        raise FormatError(path, None, what)
    code = STORED.get(stored)
    if code is None or len(content) != size * np.dtype(code).itemsize:
        shown = f"{name} has {len(content)} bytes of type {stored} for {size} numbers"
        raise FormatError(path, None, _unreadable(shown))
    with np.errstate(invalid="ignore"):  # a signalling NaN; it is refused below
        vector = np.frombuffer(content, order + code).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(vector))
    if len(bad):
        what = f"{name}({bad[0] + 1}) is {vector[bad[0]]}; expected a finite number"
        raise FormatError(path, None, what)
    return vector
