"""One small sequence and one run over it, shared by the tests."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

pytest.importorskip("cv2", reason="pictures and films need OpenCV")

from vslam_ref import cli

HERE = str(Path(__file__).parent)
if HERE not in sys.path:
    sys.path.insert(0, HERE)

COUNT = 12
QUICK = ["start.trails=300", "mapper.new_points=120", "tracker.fine_points=300"]
"""Settings with which a picture takes less time."""


def quick() -> list[str]:
    """Words that set ``QUICK``."""
    return [word for setting in QUICK for word in ("--set", setting)]


class Ran(NamedTuple):
    """Folder of the pictures, output folder, the JSON, and the words that set ``QUICK``."""

    source: Path
    out: Path
    numbers: dict[str, Any]
    words: list[str]


@pytest.fixture(scope="session")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of 12 pictures with camera, times and truth."""
    import small_world

    return small_world.write(tmp_path_factory.mktemp("small") / "boards", COUNT)


@pytest.fixture(scope="session")
def ran(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Ran:
    """A whole run with everything it writes."""
    folder = tmp_path_factory.mktemp("ran")
    words = ["run", "ptam", str(source), "--out", str(folder / "out"), "--json", str(folder / "numbers.json")]
    assert cli.main([*words, *quick()]) == 0
    return Ran(source, folder / "out", json.loads((folder / "numbers.json").read_text()), quick())


@pytest.fixture
def run() -> Callable[..., int]:
    """Run PTAM, quickly, with some words after its name."""
    return lambda *words: cli.main(["run", "ptam", *map(str, words), *quick()])
