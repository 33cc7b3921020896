"""MATLAB vectors: what SciPy writes is read alike, and what is no vector is refused."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from vslam_ref.datasets import matfile
from vslam_ref.datasets.text import FormatError

KINDS = ("f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8")


def written(tmp_path: Path, content: dict[str, Any], **options: Any) -> Path:
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, content, **options)
    return path


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_every_class_is_read_as_scipy_reads_it(tmp_path: Path, kind: str, packed: bool) -> None:
    values = np.array([0, 1, 100, 17, 5], dtype=kind)
    content = {"row": values[None], "column": values[:, None], "one": values[:1, None]}
    path = written(tmp_path, content, do_compression=packed)
    found = matfile.read_vectors(path, ("column", "row"))
    theirs = scipy.io.loadmat(path)
    for name in ("row", "column"):
        assert found[name].dtype == np.float64
        assert found[name].tolist() == theirs[name].ravel().astype(np.float64).tolist()
    assert matfile.read_vectors(path, ("one",))["one"].tolist() == [0.0]


def element(order: str, kind: int, content: bytes) -> bytes:
    """An element in the long form."""
    return struct.pack(f"{order}2I", kind, len(content)) + content + bytes(-len(content) % 8)


def matrix(order: str, stored: int, numbers: bytes, count: int, *, small_name: bool = True) -> bytes:
    """A column of doubles called x, its numbers stored in another type, as MATLAB does."""
    name = struct.pack(f"{order}I", 1 << 16 | 1) + b"x\0\0\0" if small_name else element(order, 1, b"x")
    parts = element(order, 6, struct.pack(f"{order}2I", 6, 0))
    parts += element(order, 5, struct.pack(f"{order}2i", count, 1)) + name + element(order, stored, numbers)
    return element(order, 14, parts)


def file(order: str, *elements: bytes, version: int = 0x0100) -> bytes:
    mark = {"<": b"IM", ">": b"MI"}[order]
    return b"MATLAB 5.0".ljust(124) + struct.pack(f"{order}H", version) + mark + b"".join(elements)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("small_name", [True, False])
def test_both_byte_orders_and_numbers_in_a_smaller_type(tmp_path: Path, order: str, small_name: bool) -> None:
    numbers = struct.pack(f"{order}3h", -2, 300, 7)
    path = tmp_path / "a.mat"
    path.write_bytes(file(order, matrix(order, 3, numbers, 3, small_name=small_name)))
    assert matfile.read_vectors(path, ("x",))["x"].tolist() == [-2.0, 300.0, 7.0]
    assert scipy.io.loadmat(path)["x"].ravel().tolist() == [-2.0, 300.0, 7.0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"x": "text"}, "x is 1x4 char; expected a vector"),
        ({"x": np.zeros((2, 2))}, "x is 2x2 double; expected a vector"),
        ({"x": np.array([[1 + 2j, 0]])}, "x is 1x2 complex double; expected a vector"),
        ({"x": {"a": 1.0}}, "x is 1x1 struct; expected a vector"),
        ({"x": np.zeros((0, 1))}, "x is 0x1 double; expected a vector"),
        ({"x": [[1.0, np.nan]]}, r"x\(2\) is nan; expected a finite number"),
        ({"y": [[1.0]]}, "no variable 'x'; found y"),
        ({}, "no variable 'x'; found none"),
    ],
)
def test_what_is_no_vector_of_finite_numbers_is_refused(
    tmp_path: Path, content: dict[str, Any], words: str
) -> None:
    with pytest.raises(FormatError, match=words):
        matfile.read_vectors(written(tmp_path, content), ("x",))


GOOD = matrix("<", 9, struct.pack("<2d", 1.0, 2.0), 2)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no head"),
        (file("<", GOOD, version=0x0200), "version 0x0200, expected 0x0100"),
        (file("<", GOOD[:-1]), f"an element of {len(GOOD) - 8} bytes where {len(GOOD) - 9} are left"),
        (file("<", GOOD + b"\1\2\3"), "truncated inside a tag"),
        (file("<", GOOD, GOOD), "variable 'x' comes 2 times"),
        (file("<", struct.pack("<2I", 14, 2**32 - 1)), "an element of 4294967295 bytes"),
        (file("<", matrix("<", 9, struct.pack("<2d", 1.0, 2.0), 3)), "16 bytes of type 9 for 3 numbers"),
        (file("<", matrix("<", 9, b"", 2**30)), "x is 1073741824x1 double"),
        (file("<", matrix("<", 77, bytes(16), 2)), "16 bytes of type 77"),
        (file("<", struct.pack("<2I", 15, 5) + b"\1\2\3\4\5"), "cannot be read"),
        (file("<", element("<", 15, zlib.compress(GOOD)[:-4])), "cut off"),
    ],
)
def test_a_damaged_file_is_told_in_one_line(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "a.mat"
    path.write_bytes(data)
    with pytest.raises(FormatError) as caught:
        matfile.read_vectors(path, ("x",))
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_packed_variable_stops_at_the_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(matfile, "MAX_BYTES", 2**16)
    packed = zlib.compress(bytes(2**24))
    path = tmp_path / "a.mat"
    path.write_bytes(file("<", struct.pack("<2I", 15, len(packed)) + packed))
    with pytest.raises(FormatError, match="has more than 65536 bytes"):
        matfile.read_vectors(path, ("x",))
