"""Writing files so that no half file is ever seen: under another name first, then renamed."""

from __future__ import annotations

import bz2
import gzip
import os
import uuid
from pathlib import Path


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file in one step: whoever opens it sees the old content or the new.

    Parameters
    ----------
    path : Path
        Packed if it ends in ``.gz`` or ``.bz2``.
    data : bytes
    """
    if path.suffix == ".gz":
        data = gzip.compress(data, mtime=0)
    elif path.suffix == ".bz2":
        data = bz2.compress(data)
    beside = path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}")
    try:
        beside.write_bytes(data)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
