"""How large a picture is, by its head alone: before memory of that size is taken.

A file of a hundred bytes may say that it holds a billion pixels, or a PNG that a part of it has two
gigabytes; decoders make room for both before they look further.
"""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import IO

from vslam_ref.datasets.text import FormatError

PNG = b"\x89PNG\r\n\x1a\n"
HEAD = 2**20
"""Bytes in which the size must stand; a JPEG may have notes before it."""


def picture_size(data: bytes) -> tuple[int, int] | None:
    r"""Width and height that the head of a picture states; None where it states none that is known here.

    PNG, JPEG, BMP, PNM (P1 to P6), WebP and TIFF are known.

    Examples
    --------
    >>> picture_size(b"P5\n# a comment\n640 480 255\n")
    (640, 480)
    """
    readers = {
        PNG: _png,
        b"\xff\xd8": _jpeg,
        b"BM": _bmp,
        b"RIFF": _webp,
        b"II*\0": _tiff,
        b"MM\0*": _tiff,
    }
    try:
        for magic, read in readers.items():
            if data.startswith(magic):
                return read(data)
    except (struct.error, IndexError):  # the head is cut off
        return None
    return _pnm(data)


def require_size(path: Path, limit: int) -> None:
    """Refuse a picture whose head states no pixel, or more than a limit, and a PNG that is cut off.

    Raises
    ------
    FormatError
        If so; pictures of other kinds pass.
    """
    with path.open("rb") as stream:
        head = stream.read(HEAD)
        if head.startswith(PNG):
            _require_chunks(path, stream)
    size = picture_size(head)
    if size is not None and not (min(size) >= 1 and size[0] * size[1] <= limit):
        raise FormatError(path, None, f"{size[0]}x{size[1]} pixels; at most {limit} are read, and at least 1")


def _require_chunks(path: Path, stream: IO[bytes]) -> None:
    """Every chunk, length and name and content and check sum, must lie inside the file."""
    end, at = stream.seek(0, 2), len(PNG)
    while at < end:
        stream.seek(at)
        head = stream.read(8)
        length, name = int.from_bytes(head[:4], "big"), head[4:]
        at += 12 + length
        if len(head) < 8 or at > end:
            shown = name.decode("ascii", "backslashreplace")
            what = f"chunk {shown!r} of {length} bytes goes {at - end} beyond the file"
            raise FormatError(path, None, f"{what}: the picture is cut off or damaged; fetch it again")
        if name == b"IEND":
            return


def _png(data: bytes) -> tuple[int, int]:
    width, height = struct.unpack_from(">2I", data, 16)
    return width, height


def _jpeg(data: bytes) -> tuple[int, int] | None:
    """Of the first frame; segments before it are passed over."""
    at = 2
    while data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF or 0xD0 <= marker <= 0xD8 or marker == 0x01:  # filling, or nothing follows
            at += 1 if marker == 0xFF else 2
            continue
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">2H", data, at + 5)
            return width, height
        at += 2 + max(2, struct.unpack_from(">H", data, at + 2)[0])
    return None


def _bmp(data: bytes) -> tuple[int, int]:
    if struct.unpack_from("<I", data, 14)[0] == 12:
        width, height = struct.unpack_from("<2H", data, 18)
        return width, height
    width, height = struct.unpack_from("<2i", data, 18)
    return width, abs(height)  # a negative one counts from the top


def _webp(data: bytes) -> tuple[int, int] | None:
    kind = data[12:16]
    if kind == b"VP8X":
        return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
    if kind == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    if kind == b"VP8 ":
        width, height = struct.unpack_from("<2H", data, 26)
        return width & 0x3FFF, height & 0x3FFF
    return None


def _tiff(data: bytes) -> tuple[int, int] | None:
    """Of the first picture; its numbers 256 and 257."""
    order = "<" if data[:2] == b"II" else ">"
    at = struct.unpack_from(f"{order}I", data, 4)[0]
    found = {}
    for k in range(struct.unpack_from(f"{order}H", data, at)[0]):
        tag, kind = struct.unpack_from(f"{order}2H", data, at + 2 + 12 * k)
        if tag in (256, 257):
            code = {3: "H", 4: "I"}.get(kind, "I")
            found[tag] = struct.unpack_from(f"{order}{code}", data, at + 10 + 12 * k)[0]
    return (found[256], found[257]) if len(found) == 2 else None


_BLANK = rb"(?:\s|#[^\n]*\n)+"


def pnm_largest(data: bytes) -> int | None:
    r"""The largest value of a binary PGM or PPM of 8 bits (P5, P6), as its head states it; None for others.

    OpenCV's decoder does not look at it.

    Examples
    --------
    >>> pnm_largest(b"P5\n640 480\n100\n"), pnm_largest(b"P2 1 1 100\n")
    (100, None)
    """
    found = re.match(rb"P[56]" + (_BLANK + rb"\d{1,18}") * 2 + _BLANK + rb"(\d{1,3})\s", data)
    return int(found[1]) if found and 0 < int(found[1]) <= 255 else None


def _pnm(data: bytes) -> tuple[int, int] | None:
    found = re.match(rb"P[1-6]" + _BLANK + rb"(\d{1,18})" + _BLANK + rb"(\d{1,18})(?=\s)", data)
    return (int(found[1]), int(found[2])) if found else None
