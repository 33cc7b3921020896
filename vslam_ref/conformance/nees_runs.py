r"""Is a filter honest?  A two-sided verdict on its simulated runs.

The NEES of a run, averaged over a window of T steps, has the mean d if the filter is honest.  How far the
mean over M runs may stray depends on how many of the steps are independent: the mean is chi-squared with M d
degrees of freedom, over M, if all steps repeat the first, and with M T d if all are independent.  Neither
is true.  With the errors whitened by the filter's own covariance, w, jointly Gaussian, the variance of a
run's average is

    2 theta / T^2,   theta = sum over steps s, t of |E w_s w_t^T|^2,

and for two *different* runs E (w . w')^2 = theta, the products over all steps at once.  So theta is the
average of these squares over pairs of runs, and the mean over runs is compared with chi-squared of
M d^2 T^2/theta degrees of freedom.  A filter that is too bold by a factor has w too large by its root: theta
is divided by the square of the level.

Intervals over whole runs need no such assumption, but NEES is lopsided, and with few runs they miss too often
on one side: with 10 runs and strongly correlated steps Student's, meant to miss by 0.5 % on each, missed by
3 % on the lower one.  So the bootstrap over whole runs says how *large* the fault is, and the band decides.

Three windows, the first, the middle and the last third of the steps, share the false-alarm rate equally
(Bonferroni): a filter that is bold at first and shy at the end is not honest on average.  In simulations with
any correlation of steps, 5 % were 2 to 8 % with 10 runs, and 2 to 6.5 % with 30 and more.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.conformance.nees_files import Runs
from vslam_ref.metrics import consistency

Word = Literal["consistent", "overconfident", "underconfident", "mixed", "invalid covariance"]

FALSE_ALARM = 0.05
"""Of the whole verdict, two-sided."""
FEWEST_RUNS = 10
NAMES = ("first third", "middle third", "last third")
MEANINGS: dict[Word, str] = {
    "consistent": "errors and covariances fit",
    "overconfident": "errors are larger than the covariance says: it is too small",
    "underconfident": "errors are smaller than the covariance says: it is too large",
    "mixed": "the covariance is too small at one time and too large at another",
    "invalid covariance": "a covariance is not symmetric and positive definite",
}


class Window(NamedTuple):
    """Mean NEES of some steps, and where an honest filter's lies.

    Attributes
    ----------
    name : str
    first, last : int
        Steps, by their place.
    mean, low, high : float
        Mean over runs and steps, and the band.
    independent_steps : float
        As many independent steps a run has: 1 to the window's length.
    """

    name: str
    first: int
    last: int
    mean: float
    low: float
    high: float
    independent_steps: float

    @property
    def side(self) -> int:
        """1 above the band, -1 below, 0 inside."""
        return int(self.mean > self.high) - int(self.mean < self.low)


class Judgement(NamedTuple):
    """Verdict on a filter's runs.

    Attributes
    ----------
    verdict : str
    runs, steps, dof : int
    windows : list of Window
        Empty where a covariance is invalid.
    mean : float
        Mean NEES over all; NaN where a covariance is invalid.
    interval : tuple of float
        95 % of it, bootstrapped over whole runs.
    curve : ndarray, shape (T,)
        Mean over runs at every step.
    invalid : int
        Covariances that are not symmetric and positive definite.
    false_alarm : float
        How often an honest filter gets another verdict than "consistent".
    """

    verdict: Word
    runs: int
    steps: int
    dof: int
    windows: list[Window]
    mean: float
    interval: tuple[float, float]
    curve: Array
    invalid: int
    false_alarm: float

    @property
    def consistent(self) -> bool:
        """Whether the filter is honest, as far as these runs show."""
        return self.verdict == "consistent"

    def numbers(self) -> dict[str, Any]:
        """Content of ``--json``."""
        return {
            "verdict": self.verdict,
            "runs": self.runs,
            "steps": self.steps,
            "dof": self.dof,
            "false_alarm": self.false_alarm,
            "mean_nees": self.mean,
            "mean_nees_95": list(self.interval),
            "invalid_covariances": self.invalid,
            "windows": [window._asdict() for window in self.windows],
        }


def judge(runs: Runs, false_alarm: float = FALSE_ALARM, seed: int = 0) -> Judgement:
    """Judge a filter by its runs.

    Parameters
    ----------
    runs : Runs
        At least :data:`FEWEST_RUNS` runs, independent of each other.
    false_alarm : float
        Of the whole verdict.
    seed : int
        Of the bootstrap.

    Raises
    ------
    ValueError
        If there are too few runs, or ``false_alarm`` is not between 0 and 1.

    Examples
    --------
    >>> error = np.random.default_rng(2).standard_normal((40, 5, 2))
    >>> for scale in (1.0, 0.5, 2.0):
    ...     print(judge(Runs(np.arange(5.0), error, np.tile(scale * np.eye(2), (40, 5, 1, 1)))).verdict)
    consistent
    overconfident
    underconfident
    """
    M, T, d = runs.error.shape
    if M < FEWEST_RUNS:
        raise ValueError(f"{M} runs: need {FEWEST_RUNS} at least to distinguish a fault from chance")
    if not 0 < false_alarm < 1:
        raise ValueError(f"false alarm rate {false_alarm!r}: must lie between 0 and 1")
    squares = consistency.nees(runs.error, runs.covariance)
    if squares.invalid_count:
        none = float("nan")
        empty = np.full(T, none)
        bad = squares.invalid_count
        return Judgement("invalid covariance", M, T, d, [], none, (none, none), empty, bad, false_alarm)
    white = np.linalg.solve(np.linalg.cholesky(runs.covariance), runs.error[..., None])[..., 0]
    parts = _thirds(T)
    windows = [_window(name, white[:, at], at, false_alarm / len(parts)) for name, at in parts]
    sides = {window.side for window in windows} - {0}
    word: Word = "consistent"
    if sides:
        word = "mixed" if len(sides) == 2 else "overconfident" if sides == {1} else "underconfident"
    value, rng = squares.value, np.random.default_rng(seed)
    interval = consistency.bootstrap_interval(value, consistency.window_mean, rng)
    curve = value.mean(axis=0)
    return Judgement(word, M, T, d, windows, float(value.mean()), interval, curve, 0, false_alarm)


def _thirds(T: int) -> list[tuple[str, slice]]:
    """Three windows of nearly equal length; fewer where there are fewer steps."""
    if T < 3:
        return [(f"step {t + 1}", slice(t, t + 1)) for t in range(T)]
    edges = [round(k * T / 3) for k in range(4)]
    return [(name, slice(edges[k], edges[k + 1])) for k, name in enumerate(NAMES)]


def _window(name: str, white: Array, at: slice, false_alarm: float) -> Window:
    """Mean of |w|^2 over runs and steps, and its band."""
    M, _, d = white.shape
    mean = float((white**2).sum(axis=-1).mean())
    steps = independent_steps(white)
    low, high = _band(M * d * steps, d, false_alarm)
    return Window(name, at.start, at.stop - 1, mean, low, high, steps)


def _band(dof: float, d: int, false_alarm: float) -> tuple[float, float]:
    """Two-sided band of d times chi-squared over its degrees of freedom, which need not be whole."""
    from scipy.special import gammaincinv

    low, high = (float(2 * gammaincinv(dof / 2, p)) for p in (false_alarm / 2, 1 - false_alarm / 2))
    return d * low / dof, d * high / dof


def independent_steps(white: Array) -> float:
    """As many independent steps as a run has, by the correlation of the errors in time.

    Parameters
    ----------
    white : ndarray, shape (M, T, d)
        Errors whitened by their covariance.

    Returns
    -------
    float
        d T^2 / theta, between 1 and T.
    """
    M, T, d = white.shape
    flat = white.reshape(M, T * d)
    products = flat @ flat.T
    level = np.trace(products) / (M * T * d)
    if level == 0:
        return 1.0
    squares = (products / level) ** 2
    theta = (squares.sum() - np.trace(squares)) / (M * (M - 1))
    return float(np.clip(d * T**2 / max(theta, d), 1.0, T))
