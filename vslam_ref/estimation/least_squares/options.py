"""When a descent ends, and how it is damped."""

from __future__ import annotations

from dataclasses import dataclass, field

from vslam_ref.estimation.least_squares.damping import Damping, Nielsen


@dataclass(frozen=True)
class Options:
    """Thresholds of :func:`~vslam_ref.estimation.least_squares.descend.descend`; none of them has a unit.

    Parameters
    ----------
    gradient : float
        End when every column of J is nearly at a right angle to r: largest cosine at most this.
    step : float
        End when a step is at most this share of x, both in the metric D; 0 never ends for it.
    cost : float
        End when actual and promised decrease are both at most this share of the cost.
    max_iterations : int
        Steps tried at most.
    damping : Damping
        Nielsen's rule by default.
    least_gain : float
        Share of the promised decrease that a step must bring.
    rounding : float
        A promise of at most this share of the cost may drown in the residuals' rounding: the cost cannot
        judge such a step any more.

    Raises
    ------
    ValueError
        If a threshold is outside [0, 1), or ``max_iterations`` is negative.
    """

    gradient: float = 1e-10
    step: float = 1e-10
    cost: float = 1e-14
    max_iterations: int = 1000
    damping: Damping = field(default_factory=Nielsen)
    least_gain: float = 1e-4
    rounding: float = 1e-12

    def __post_init__(self) -> None:
        """Refuse thresholds that mean nothing."""
        for name in ("gradient", "step", "cost", "least_gain", "rounding"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(f"{name}={getattr(self, name)}: a threshold must lie in [0, 1)")
        if self.max_iterations < 0:
            raise ValueError(f"max_iterations={self.max_iterations}: must be >= 0")
