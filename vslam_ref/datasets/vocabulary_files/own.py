"""Our own form of a vocabulary: a ``.npz`` of few arrays, read without pickle, nothing larger than it says.

==============  ========================================================================
array           holds
==============  ========================================================================
``children``    how many children each node has, level by level (n,), as in the tree
``descriptor``  bytes of each node but the root (n - 1, 32)
``weight``      of each word (W,)
``node``        of each word (W,), only where words stand in another order than leaves
==============  ========================================================================
"""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vslam_ref.datasets.text import FormatError
from vslam_ref.datasets.vocabulary_files.nodes import HEAVIEST, MAX_BYTES, VocabularyFile
from vslam_ref.features.vocabulary import Vocabulary
from vslam_ref.features.vocabulary.tree import BYTES
from vslam_ref.support.files import write_bytes

TYPES = {"children": "<u2", "descriptor": "|u1", "weight": "<f8", "node": "<u4"}
NEEDED = ("children", "descriptor", "weight")
EPOCH = (1980, 1, 1, 0, 0, 0)
DAMAGED = (ValueError, KeyError, EOFError, OSError, RuntimeError, NotImplementedError, SyntaxError, TypeError)
"""What unpacking and the header of an array answer to bytes that are none of theirs."""


def parse_own(path: Path, data: bytes) -> VocabularyFile:
    """Read a vocabulary from the bytes of a ``.npz``.

    Raises
    ------
    FormatError
        If the archive or an array is damaged or too large, or they are no vocabulary.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            arrays = _arrays(path, archive)
    except FormatError:
        raise
    except (zipfile.BadZipFile, zlib.error, *DAMAGED) as error:
        what = f"damaged archive ({' '.join(str(error).split())[:100]}); expected a .npz of a vocabulary"
        raise FormatError(path, None, what) from None
    children, descriptor = arrays["children"].astype(np.int64), arrays["descriptor"]
    if descriptor.shape != (len(children) - 1, BYTES):
        right = f"expected {len(children) - 1} x {BYTES}, the nodes without the root"
        raise FormatError(path, None, f"descriptor has shape {descriptor.shape}; {right}")
    whole = np.concatenate([np.zeros((1, BYTES), np.uint8), descriptor])
    weight = arrays["weight"].astype(np.float64)
    node = arrays["node"].astype(np.int64) if "node" in arrays else None
    try:
        made = Vocabulary(children, whole, weight, node)  # type: ignore[arg-type]
    except ValueError as error:
        raise FormatError(path, None, str(error)) from None
    if (weight > HEAVIEST).any():
        raise FormatError(path, None, f"weight {weight.max():g}; expected logarithms of counts")
    return VocabularyFile(made, path, "own", made.branching, made.levels)


def _arrays(path: Path, archive: zipfile.ZipFile) -> dict[str, NDArray[Any]]:
    """The arrays of an archive, each with its own name and type, none twice."""
    found: dict[str, NDArray[Any]] = {}
    left = MAX_BYTES
    for member in archive.infolist():
        name = member.filename.removesuffix(".npy")
        if name not in TYPES or name in found:
            raise FormatError(path, None, f"array {name!r}; expected each of {', '.join(TYPES)} once")
        left -= member.file_size
        if left < 0:
            raise FormatError(path, None, f"more than {MAX_BYTES} bytes unpacked; is this the right file?")
        with archive.open(member) as stream:
            content = stream.read(member.file_size + 1)
        found[name] = _array(path, name, content)
    missing = [name for name in NEEDED if name not in found]
    if missing:
        raise FormatError(path, None, f"no array {', '.join(missing)}; expected a .npz of a vocabulary")
    return found


def _array(path: Path, name: str, content: bytes) -> NDArray[Any]:
    """One array: its header must say its type and just as many numbers as follow."""
    stream = io.BytesIO(content)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError(f"{name} has another version")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    right = (
        dtype == np.dtype(TYPES[name]) and not fortran and len(shape) == (2 if name == "descriptor" else 1)
    )
    if not right:
        raise FormatError(path, None, f"{name} is {dtype} {shape}; expected {TYPES[name]} in rows")
    numbers = content[stream.tell() :]
    count = 1
    for n in shape:
        count *= int(n)
    if len(numbers) != count * dtype.itemsize or min(shape) < 0:
        raise FormatError(path, None, f"{name} of shape {shape} has {len(numbers)} bytes; it is cut off")
    return np.frombuffer(numbers, dtype).reshape(shape)


def packed(vocabulary: Vocabulary) -> bytes:
    """Bytes of a vocabulary: the same for the same vocabulary.

    Raises
    ------
    ValueError
        If a node has 65536 children or more.
    """
    v = vocabulary
    if v.branching >= 2**16:
        raise ValueError(f"{v.branching} children of one node: need fewer than 65536")
    arrays = {"children": v.children, "descriptor": v.descriptor[1:], "weight": v.weight}
    if (np.diff(v.node) < 0).any():
        arrays["node"] = v.node
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            plain = np.ascontiguousarray(array, np.dtype(TYPES[name]))
            np.lib.format.write_array(member, plain, version=(1, 0), allow_pickle=False)
            at = zipfile.ZipInfo(f"{name}.npy", EPOCH)
            at.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(at, member.getvalue())
    return out.getvalue()


def write_vocabulary(path: Path, vocabulary: Vocabulary) -> None:
    """Write a vocabulary in our own form."""
    write_bytes(path, packed(vocabulary))
