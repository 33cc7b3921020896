"""The result of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Result:
    """What an experiment's ``run`` returns.

    Parameters
    ----------
    series : mapping
        What the figure draws: names -> lists, arrays or mappings of them, such as
        ``{"time": (T,), "nees": {"ekf/low": (T,)}}``.  Identical runs give identical bytes.
    seed, runs : int or None
        Root seed; size of the judged sample.  None where the experiment draws nothing.
    arrays : mapping of str to ndarray
        Per-run arrays for ``runs.npz``.  No object arrays.
    payload : object
        Whatever ``claims`` and ``figure`` need beyond that.  Not written.
    """

    series: Mapping[str, Any]
    seed: int | None = None
    runs: int | None = None
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    payload: Any = None
