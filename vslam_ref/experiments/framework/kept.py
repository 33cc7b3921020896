"""Finished batches of a long run, kept until it ends, so that an interrupted one goes on where it stopped.

They lie in a hidden folder beside ``--out``.  Its name holds the experiment and a digest of everything that
a number depends on: experiment, config with its seed, backend, and the sources of the package.  So a run with
another config, or of changed code, never takes them for its own.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
import zipfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vslam_ref.experiments.framework.writer import write_npz
from vslam_ref.support.json_text import to_json
from vslam_ref.support.provenance import PACKAGE

DAYS = 14.0
"""Age from which batches of another config or of other sources are removed."""


class Kept:
    """Batches in a folder; with no folder, nothing is kept.

    Parameters
    ----------
    folder : Path or None
        Made with the first batch.
    about : dict
        What the batches belong to, written beside them for a person who finds the folder.
    """

    def __init__(self, folder: Path | None = None, about: dict[str, Any] | None = None) -> None:
        self.folder, self.about = folder, about or {}

    def get(self, number: int, record: type) -> Any | None:
        """Return a finished batch as the NamedTuple ``record``, or None."""
        if self.folder is None:
            return None
        try:
            with np.load(self.folder / f"{number:06d}.npz", allow_pickle=False) as found:
                return record(*(found[name] for name in record._fields))  # type: ignore[attr-defined]
        except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile):
            return None  # not there, or not whole

    def put(self, number: int, result: Any) -> None:
        """Keep a finished batch; where that cannot be written, the run goes on without."""
        if self.folder is None:
            return
        temporary = self.folder / f"{number:06d}.{os.getpid()}.tmp"
        try:
            if not self.folder.exists():
                self.folder.mkdir()
                (self.folder / "about.json").write_text(to_json(self.about), encoding="utf-8")
            write_npz(temporary, {name: np.asarray(value) for name, value in result._asdict().items()})
            os.replace(temporary, self.folder / f"{number:06d}.npz")
        except OSError:
            self.folder = None

    def remove(self) -> None:
        """Remove the folder: the run has ended."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


def kept_beside(out: Path, experiment: str, config: Any, backend: str) -> Kept:
    """Return the batches of one experiment, in a folder beside ``out``; stale ones of others are removed.

    Parameters
    ----------
    out : Path
        Where results go.
    experiment : str
        Its id.
    config : dict
        Dotted key -> value.
    backend : str
    """
    about = {"experiment": experiment, "config": config, "backend": backend, "sources": sources_digest()}
    out = out.resolve()
    start = f".{out.name}.{experiment}-unfinished-"
    folder = out.with_name(start + hashlib.sha256(to_json(about).encode()).hexdigest()[:16])
    for other in out.parent.glob(f"{start}*"):
        if other != folder and time.time() - other.stat().st_mtime > 86400.0 * DAYS:
            shutil.rmtree(other, ignore_errors=True)
    return Kept(folder, about)


@cache
def sources_digest() -> str:
    """Digest of all sources of the package."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()
