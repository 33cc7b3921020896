"""Other public setups: what their two experiments share.

::

    Drive (increments, sightings) --errors_of--> Errors per run --common_claims--> verdicts

The starts are ``zero``, P0 = 0 as published, and ``high``, the high P0 of seed B.  At ``zero`` the anchored
EKF *is* the EKF: what either study shows there, P0 cannot explain.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.arrays import Array
from vslam_ref.experiments.framework import Claim, judged
from vslam_ref.experiments.iekf.rules import APART, MARKED, MUCH
from vslam_ref.filters.carleman_ekf import ReducedCarlemanEkf, carleman_ekf
from vslam_ref.filters.ekf_slam import AnchoredEkf, EkfSlam
from vslam_ref.filters.estimates import SlamFilter
from vslam_ref.metrics.consistency import bootstrap_interval, nees, pose_error
from vslam_ref.worlds.drive import Drive, follow

FILTERS = ("ekf", "iekf", "ekf-anchored")
STARTS = ("zero", "high")
SETTLE = 10
"""Records at the start without a NEES: from P0 = 0 the covariance of the first is singular."""
LONGER = 1.01
"""A heading vector this long makes the IEKF predict steps 1 % too long; at B's setting it ends at 1.02."""
LEAST_RUNS = 50
"""Runs that a question asks for: B's number."""
SAME = 1e-9
"""Metres and radians; two filters that differ by less are one."""


class Errors(NamedTuple):
    """Errors (M, R) of heading (rad) and position (m), and NEES per freedom of pose, heading, position.

    The first :data:`SETTLE` columns of a NEES are NaN.  ``stretch`` is the length of the IEKF's heading
    vector (z3, z4), which should be 1; the other filters have an angle, and 1.
    """

    heading: Array
    position: Array
    nees: Array
    nees_heading: Array
    nees_position: Array
    stretch: Array


def make_filter(name: str, mean: Array, cov: Array, capacity: int) -> SlamFilter:
    """Build a filter by its name in the series, started at N(mean (B, 3), cov (3, 3))."""
    if name == "iekf":
        return carleman_ekf(mean, cov, capacity=capacity)
    return AnchoredEkf(mean, cov, capacity) if name == "ekf-anchored" else EkfSlam(mean, cov, capacity)


def errors_of(slam: SlamFilter, drive: Drive, truth: Array, every: int = 1) -> Errors:
    """Take a filter along a drive and keep the errors of every so many poses; ``truth`` is (T + 1, 3)."""
    means, covs, lengths = [], [], []
    for step in follow(slam, drive, every):
        means.append(step.mean)
        covs.append(step.cov)
        lengths.append(_stretch(slam, len(step.mean)))
    T = drive.increments.ds.shape[1]
    error = pose_error(truth[: T + 1 : every, None], np.array(means))
    return _errors(error, np.array(covs), np.array(lengths))


def _stretch(slam: SlamFilter, runs: int) -> Array:
    """Length (runs,) of the heading vector."""
    if isinstance(slam, ReducedCarlemanEkf):
        return np.hypot(slam.blocks.x_p[:, 2], slam.blocks.x_p[:, 3])
    return np.ones(runs)


def _errors(error: Array, cov: Array, stretch: Array) -> Errors:
    """Errors (R, B, 3) in (x, y, theta), covariances and heading vectors (R, B) as :class:`Errors`."""
    parts = {"nees": slice(0, 3), "nees_heading": slice(2, 3), "nees_position": slice(0, 2)}
    squares = {}
    for name, at in parts.items():
        value = nees(error[..., at], cov[..., at, at]).value / (at.stop - at.start)
        value[:SETTLE] = np.nan
        squares[name] = value.T.copy()
    position = np.hypot(error[..., 0], error[..., 1])
    return Errors(error[..., 2].T.copy(), position.T.copy(), stretch=stretch.T.copy(), **squares)


def points(config: object) -> list[tuple[str, str]]:
    """Every filter from every start."""
    return [(name, start) for start in STARTS for name in FILTERS]


def initial(config: object, start: str) -> Array:
    """Variances (3,) of a start pose."""
    return np.array(config.p0_high if start == "high" else (0.0, 0.0, 0.0))  # type: ignore[attr-defined]


ABOUT = {
    "heading": "heading error, radians, by filter and start; (runs, times)",
    "position": "position error, metres, by filter and start; (runs, times)",
    "nees": "NEES of the pose per degree of freedom, NaN at the start, by filter and start; (runs, times)",
    "time": "seconds from the start; (times,)",
}
"""What ``runs.npz`` holds."""


def arrays(time: Array, errors: Mapping[str, Errors]) -> dict[str, NDArray[np.floating]]:
    """Return the per-run curves for ``runs.npz``, in single precision, and the times."""
    curves = {
        f"{kind}/{name}": getattr(e, kind).astype(np.float32)
        for name, e in errors.items()
        for kind in ("heading", "position", "nees")
    }
    return {**curves, "time": time}


def rmse(error: Array) -> float:
    """Root mean square over all runs and times, the published statistic."""
    return float(np.sqrt(np.mean(error**2)))


def last(x: Array) -> Array:
    """Average of each run over the last tenth of the course, (M,)."""
    return np.asarray(x[:, -max(1, x.shape[1] // 10) :].mean(axis=1))


def table(errors: Mapping[str, Errors]) -> dict[str, dict[str, float]]:
    """RMSE (degrees, metres) and NEES per freedom, over the whole course and its last tenth, by key."""
    return {
        key: {
            "rmse_heading_deg": float(np.rad2deg(rmse(e.heading))),
            "rmse_position_m": rmse(e.position),
            "nees_heading": float(e.nees_heading[:, SETTLE:].mean()),
            "nees_position": float(e.nees_position[:, SETTLE:].mean()),
            "nees_pose": float(e.nees[:, SETTLE:].mean()),
            "nees_pose_end": float(last(e.nees).mean()),
            "stretch_end": float(last(e.stretch).mean()),
        }
        for key, e in errors.items()
    }


def series_of(time: Array, errors: Mapping[str, Errors]) -> dict[str, object]:
    """Collect curves over time: RMSE over runs, and mean NEES per freedom; None where there is none."""
    return {
        "time": time,
        "rmse_heading": {k: np.sqrt(np.mean(e.heading**2, axis=0)) for k, e in errors.items()},
        "rmse_position": {k: np.sqrt(np.mean(e.position**2, axis=0)) for k, e in errors.items()},
        "nees": {k: e.nees.mean(axis=0) for k, e in errors.items()},
        "summary": table(errors),
    }


class Question(NamedTuple):
    """A claim on the last tenth of the course: mean of ``first`` over that of ``second`` (or over 1).

    It holds when the 95 % whole-run interval lies ``above`` the bound, or else at or below it.
    """

    id: str
    text: str
    quantity: str
    first: str
    second: str | None
    above: bool
    bound: float

    def rule(self) -> str:
        """Return the rule in words."""
        over = f" over {self.second}" if self.second else ""
        return (
            f"{self.quantity} of {self.first}{over}, means over the last tenth of the course: 95 % whole-run "
            f"interval {'>' if self.above else '<='} {self.bound:g}"
        )


QUESTIONS = (
    Question(
        "zero-ekf-overconfident", "With a known start, P0 = 0, the EKF ends overconfident",
        "nees", "ekf/zero", None, True, MARKED,
    ),
    Question(
        "zero-iekf-better", "With a known start B's IEKF ends more consistent than the EKF",
        "nees", "ekf/zero", "iekf/zero", True, 1.0,
    ),
    Question(
        "high-iekf-much-better", "With B's high P0 the IEKF ends much more consistent than the EKF",
        "nees", "ekf/high", "iekf/high", True, MUCH,
    ),
    Question(
        "high-anchored-not-worse", "With B's high P0 the anchored EKF ends no less consistent than the IEKF",
        "nees", "ekf-anchored/high", "iekf/high", False, APART,
    ),
    Question(
        "zero-iekf-stretches", "The IEKF's heading vector grows, so that it predicts its steps too long",
        "stretch", "iekf/zero", None, True, LONGER,
    ),
)  # fmt: skip
"""What both setups are asked; fixed before the runs."""


def common_claims(
    source: str, errors: Mapping[str, Errors], enough: bool, rng: np.random.Generator
) -> list[Claim]:
    """Judge what both setups are asked.

    Parameters
    ----------
    source : str
    errors : mapping
        "filter/start" -> Errors, the same runs in each.
    enough : bool
        Whether the course and the number of runs allow a verdict.
    rng : Generator
        For intervals over whole runs.
    """
    answers = [answer(q, source, errors, enough, rng) for q in QUESTIONS]
    return [*answers, anchored_is_ekf(source, errors)]


def answer(
    q: Question, source: str, errors: Mapping[str, Errors], enough: bool, rng: np.random.Generator
) -> Claim:
    """Judge one question."""
    a = last(getattr(errors[q.first], q.quantity))
    b = last(getattr(errors[q.second], q.quantity)) if q.second else np.ones(len(a))
    low, high = bootstrap_interval(np.stack([a, b], 1), lambda c: c[:, 0] / c[:, 1], rng)
    holds = low > q.bound if q.above else high <= q.bound
    measured: dict[str, object] = {"value": float(a.mean() / b.mean())}
    if "iekf" in f"{q.first} {q.second}" and q.quantity == "nees":
        start = q.first.partition("/")[2]
        measured["iekf_heading_vector"] = float(last(errors[f"iekf/{start}"].stretch).mean())
    side = ">" if q.above else "<="
    if not enough:
        measured["reason"] = "too few runs, or too short a course"
    elif not holds:
        measured["reason"] = f"the interval is [{low:.4g}, {high:.4g}], not all of it {side} {q.bound:g}"
    return judged(
        q.id, source, q.text, q.rule(), holds if enough else None, _found(q, measured["value"], low, high),
        measured,
        ci=[low, high], least_runs=LEAST_RUNS,
    )  # fmt: skip


def _found(q: Question, value: object, low: float, high: float) -> str:
    """Say what was found."""
    names = {"nees": "NEES per degree of freedom", "stretch": "length of the heading vector"}
    who = _called(q.first) + (f" over that of the {_called(q.second)}" if q.second else "")
    bound = f"more than {q.bound:g}" if q.above else f"at most {q.bound:g}"
    return (
        f"Over the last tenth of the course the {names[q.quantity]} of the {who} is {value:.3g} (95 %: "
        f"{low:.3g} to "
        f"{high:.3g}); the rule asks for {bound}"
    )


def _called(key: str) -> str:
    """Return a series in words."""
    name, _, start = key.partition("/")
    who = {"ekf": "EKF", "iekf": "IEKF", "ekf-anchored": "anchored EKF"}[name]
    return f"{who} ({'start known' if start == 'zero' else 'high P0'})"


def anchored_is_ekf(source: str, errors: Mapping[str, Errors]) -> Claim:
    """With nothing to keep apart, the anchored EKF has no effect."""
    a, b = errors["ekf-anchored/zero"], errors["ekf/zero"]
    gap = float(max(np.abs(a.heading - b.heading).max(), np.abs(a.position - b.position).max()))
    return judged(
        "zero-anchored-is-ekf",
        source,
        "With a known start the anchored EKF is the EKF",
        f"largest difference of heading and position errors over all runs and times <= {SAME:g}",
        gap <= SAME,
        f"The two filters' errors differ by at most {gap:.1e} m or rad, and {SAME:g} is allowed for rounding",
        {"largest": gap},
    )
