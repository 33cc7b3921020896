"""Makes the toy experiment importable by its bare name, here and in worker processes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

HERE = str(Path(__file__).resolve().parents[1] / "experiments")
if HERE not in sys.path:
    sys.path.insert(0, HERE)


@pytest.fixture
def toy() -> Iterator[Any]:
    """The toy experiment, known to the registry for the length of a test."""
    from toy_experiment import TOY

    from vslam_ref.experiments.framework import register, unregister

    register(TOY)
    yield TOY
    unregister(TOY.id)
