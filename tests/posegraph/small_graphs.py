"""Small pose graphs of every space."""

from __future__ import annotations

import numpy as np

from vslam_ref.estimation.posegraph import PoseGraph
from vslam_ref.estimation.posegraph.spaces import GROUPS, Space, tangent_size

SPACES: tuple[Space, ...] = ("se2", "se3", "sim3")


def random_graph(space: Space, seed: int = 0, n: int = 12, loops: int = 8, noise: float = 0.05) -> PoseGraph:
    """A chain with loops, full information matrices, and a start that is off by a little.

    No two edges join the same nodes in the same direction; one loop runs backwards.
    """
    rng, group, d = np.random.default_rng(seed), GROUPS[space], tangent_size(space)
    true = group.random(rng, (n,), spread=2.0)
    pairs = [(i, j) for i in range(n) for j in range(i + 2, n)]
    chosen = [pairs[k] for k in rng.choice(len(pairs), loops, replace=False)]
    ends = np.array([(i, i + 1) for i in range(n - 1)] + chosen)
    ends[-1] = ends[-1][::-1]
    tail, head = ends.T
    exact = group.between(true[tail], true[head])
    measured = group.compose(exact, group.exp(noise * rng.standard_normal((len(ends), d))))
    A = rng.standard_normal((len(ends), d, d))
    information = A @ np.swapaxes(A, 1, 2) + 0.5 * np.eye(d)
    start = group.compose(true, group.exp(noise * rng.standard_normal((n, d))))
    return PoseGraph(space, start, tail, head, measured, information)
