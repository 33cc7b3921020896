"""Makes the toy experiment importable by its bare name, here and in worker processes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from vslam_ref.cli import main

HERE = str(Path(__file__).resolve().parents[1] / "experiments")
if HERE not in sys.path:
    sys.path.insert(0, HERE)


@pytest.fixture(scope="session")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a sample of every kind, seed 1: it stands in for data sets.  Not to be written to."""
    folder = tmp_path_factory.mktemp("made") / "samples"
    assert main(["sample", "all", "--out", str(folder)]) == 0
    return folder


@pytest.fixture
def toy() -> Iterator[Any]:
    """The toy experiment, known to the registry for the length of a test."""
    from toy_experiment import TOY

    from vslam_ref.experiments.framework import register, unregister

    register(TOY)
    yield TOY
    unregister(TOY.id)
