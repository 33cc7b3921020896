"""Read a vocabulary of any form that is known here; its content says which, not its name."""

from __future__ import annotations

import zlib
from pathlib import Path

from vslam_ref.datasets.text import FormatError, decoded
from vslam_ref.datasets.vocabulary_files.nodes import MAX_BYTES, VocabularyFile
from vslam_ref.datasets.vocabulary_files.own import parse_own
from vslam_ref.datasets.vocabulary_files.storage import parse_storage
from vslam_ref.datasets.vocabulary_files.text import parse_text

GZIP, ZIP = b"\x1f\x8b", b"PK"
DIGITS = b"0123456789"


def read_vocabulary(path: Path | str) -> VocabularyFile:
    """Read a vocabulary.

    Parameters
    ----------
    path : Path or str
        DBoW2's or DBoW3's YAML, ORB-SLAM's text, each plain or packed by gzip; or a ``.npz`` of our own.

    Returns
    -------
    VocabularyFile

    Raises
    ------
    FormatError
        If it cannot be read: no file, cut off, another kind of file, numbers out of range, nodes that are no
        tree, words that are no leaves, or another weighting and score than tf-idf and L1.
    """
    path = Path(path)
    data = _unpacked(path)
    if data.startswith(ZIP):
        return parse_own(path, data)
    text = decoded(path, data)
    first = text.lstrip()[:1].encode()
    if first and first in DIGITS:
        return parse_text(path, text)
    if not first:
        raise FormatError(path, None, "empty; expected a vocabulary")
    return parse_storage(path, text.replace("\r\n", "\n"))


def _unpacked(path: Path) -> bytes:
    """Bytes of a file, unpacked where they are gzip's, whatever its name, up to a limit."""
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise FormatError(path, None, "no such file") from None
    except OSError as error:
        raise FormatError(path, None, f"cannot be read ({error.strerror}); expected a file") from None
    if data.startswith(GZIP):
        unpack = zlib.decompressobj(31)
        try:
            data = unpack.decompress(data, MAX_BYTES + 1)
        except zlib.error as error:
            raise FormatError(path, None, f"damaged gzip file ({error}); fetch it again") from None
        if len(data) <= MAX_BYTES and not unpack.eof:
            raise FormatError(path, None, "damaged gzip file (its end is missing); fetch it again")
    if len(data) > MAX_BYTES:
        raise FormatError(path, None, f"more than {MAX_BYTES} bytes; is this the right file?")
    return data
