"""Graphs for the tests of this folder."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from vslam_ref.estimation.posegraph import PoseGraph
from vslam_ref.estimation.posegraph.spaces import Space

sys.path.insert(0, str(Path(__file__).parent))

from small_graphs import SPACES, random_graph


@pytest.fixture(params=SPACES)
def space(request: pytest.FixtureRequest) -> Space:
    """Each of the three spaces."""
    found: Space = request.param
    return found


@pytest.fixture
def graph(space: Space) -> PoseGraph:
    """A random graph of the space."""
    return random_graph(space)
