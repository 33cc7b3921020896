"""The vocabulary that comes with the package, and what it was made of."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from vslam_ref.datasets.vocabulary_files.reading import read_vocabulary
from vslam_ref.features.vocabulary import Vocabulary

SHIPPED = Path(__file__).with_name("orb_words.npz")
PROVENANCE = SHIPPED.with_suffix(".json")


@cache
def shipped_vocabulary() -> Vocabulary:
    """Words of this library's ORB: trained by ``make vocabulary``."""
    return read_vocabulary(SHIPPED).vocabulary


def provenance() -> dict[str, Any]:
    """Pictures, their licences, seed, settings and digests of what the shipped vocabulary was trained on."""
    content: dict[str, Any] = json.loads(PROVENANCE.read_text(encoding="utf-8"))
    return content
