"""Small files of a vocabulary in every form, and what a right record of one is."""

from __future__ import annotations

import gzip
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from vslam_ref.datasets.vocabulary_files import VocabularyFile, write_storage, write_text
from vslam_ref.datasets.vocabulary_files.own import packed
from vslam_ref.features.vocabulary import Vocabulary, words

CHILDREN = np.array([3, 2, 0, 2, 0, 0, 0, 0])


def small(shuffled: bool = False) -> Vocabulary:
    """Five words on two levels; one weighs nothing."""
    rng = np.random.default_rng(8)
    descriptor = rng.integers(0, 256, (len(CHILDREN), 32), dtype=np.uint8)
    descriptor[0] = 0
    node = np.array([2, 4, 5, 6, 7])
    return Vocabulary(
        CHILDREN,
        descriptor,
        np.array([0.5, 1.25, 0.0, 2.0, 0.1]),
        node[[3, 0, 4, 1, 2]] if shuffled else node,
    )


def _written(write: Callable[[Path], None]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "words"
        write(path)
        return path.read_bytes()


DBOW2 = _written(lambda path: write_storage(path, small(shuffled=True)))
DBOW3 = _written(lambda path: write_storage(path, small(), typed=True))
TEXT = _written(lambda path: write_text(path, small()))
FILES = {
    "dbow2.yml": DBOW2,
    "dbow3.yml": DBOW3,
    "orb.txt": TEXT,
    "dbow2.yml.gz": gzip.compress(DBOW2, mtime=0),
    "own.npz": packed(small()),
    "shuffled.npz": packed(small(shuffled=True)),
}


def vocabulary_wrong(file: VocabularyFile) -> str:
    """Weights are weights, and every descriptor has a word."""
    v = file.vocabulary
    if not (np.isfinite(v.weight).all() and (v.weight >= 0).all()):
        return "a weight is none"
    found = words(v, v.descriptor)
    return (
        "" if ((found >= 0) & (found < v.words)).all() and len(np.unique(v.node)) == v.words else "no words"
    )
