"""The steps of a descent, as the commands print them while it runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vslam_ref.estimation.least_squares import Iteration


class StepTable:
    """Prints one line a step.

    Parameters
    ----------
    words : str
        What the cost is called.
    factor : float
        Times the cost, for what is called so.
    """

    def __init__(self, words: str = "cost", factor: float = 1.0) -> None:
        self.words, self.factor, self.count = words, factor, 0

    def __call__(self, step: Iteration) -> None:
        """Print a step, the first below the heads of the columns."""
        if self.count == 0:
            print(f"{'step':>4} {self.words:>16} {'decrease':>10} {'gradient':>9} {'damping':>8} {'gain':>7}")
        self.count += 1
        mark = "" if step.accepted else "  refused"
        print(
            f"{self.count:>4} {self.factor * step.cost:>16.6f} {self.factor * step.decrease:>10.3g} "
            f"{step.gradient_norm:>9.2g} {step.damping:>8.1g} {step.gain:>7.3f}{mark}",
            flush=True,
        )
