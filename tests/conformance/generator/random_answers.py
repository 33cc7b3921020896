"""Filters whose errors must fit their covariance: judged by bands."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import exact_ekf
from generator.building import Topic, tolerance
from generator.exact_arrays import big, inverse, jacobian, stack
from generator.exact_quantiles import normal_quantile

FALSE_ALARM = 1e-4


def _around(mean: float, variance: float, samples: int) -> dict[str, float]:
    """Two-sided band of a mean of many independent samples (central limit)."""
    half = float(normal_quantile(1 - mpf(FALSE_ALARM) / 2)) * (variance / samples) ** 0.5
    return {"low": mean - half, "high": mean + half}


def runs(topic: Topic) -> None:
    """NEES of predictions whose noise is so small that the motion is linear within it.

    For Gaussian errors NEES is chi-squared with 3: mean 3, E q^2 = 15, Var q = 6, Var q^2 = E q^4 - 15^2 with
    E q^4 = 3 * 5 * 7 * 9 = 945.  Curvature adds (ds sigma_theta / sigma_x)^2 sigma_theta^2 < 1e-5.
    """
    samples = 20000
    inputs = {
        **{"N": samples, "x": [1.0, -2.0, 0.7], "P": np.diag([4e-6, 1e-6, 2.25e-6])},
        **{"control": [6.0, 0.4], "cov_u": np.diag([4e-6, 1e-6]), "wheelbase": 1.5, "dt": 0.5},
    }
    wrong = {name: _inflated(inputs, name) for name in ("gtpg", "no-process-noise")}
    bands = {
        "mean": (_around(3.0, 6.0, samples), wrong),
        "mean_square": (_around(15.0, 720.0, samples), {"uniform-noise": _uniform(inputs)}),
    }
    for measure, (band, mistakes) in bands.items():
        rule = {"output": "nees", "measure": measure, "samples": samples, **band, "false_alarm": FALSE_ALARM}
        oracle, none = "moments of chi-squared with 3 degrees of freedom", tolerance(0.0, "a band")
        topic.group(
            "consistency.runs",
            "eq-nees-moments",
            oracle,
            none,
            [{"inputs": inputs, "expected": {"nees": []}}],
            flags=("statistical", measure),
            statistic={**rule, "mistakes": mistakes},
        )


def _uniform(inputs: dict[str, Any]) -> dict[str, float]:
    """Band of E q^2 where all five noises are uniform.

    The whitened error is B w with B B^T = I and w of unit variance and fourth cumulant 9/5 - 3; so E q^2 is
    15 - 6/5 sum h_k^2, h the diagonal of B^T B.  The variance is below that of Gaussian noise.
    """
    x, P, control, cov_u = (big(inputs[k]) for k in ("x", "P", "control", "cov_u"))
    sizes = mpf(inputs["wheelbase"]), mpf(inputs["dt"])
    inc = exact_ekf.increment(control, *sizes)
    F = jacobian(lambda y: exact_ekf.moved(y, inc), x)
    G = jacobian(lambda u: exact_ekf.moved(x, exact_ekf.increment(u, *sizes)), control)
    roots = [[mpmath.sqrt(v) for v in np.diag(C)] for C in (P, cov_u)]  # both are diagonal
    J = np.concatenate([F * stack(roots[0]), G * stack(roots[1])], 1)
    h = np.diag(J.T @ inverse(J @ J.T) @ J)
    return _around(15.0 - 1.2 * float(sum(h**2)), 720.0, int(inputs["N"]))


def _inflated(inputs: dict[str, Any], wrong: str) -> dict[str, float]:
    """Band of the mean NEES of errors of the right covariance C, measured with a wrong one W.

    With A = W^-1 C it is a sum of chi-squared variables: mean tr A, variance 2 tr A^2.
    """
    x, P, control, cov_u = (big(inputs[k]) for k in ("x", "P", "control", "cov_u"))
    args = x, P, control, cov_u, mpf(inputs["wheelbase"]), mpf(inputs["dt"])
    C, W = exact_ekf.predict(*args)[1], exact_ekf.predict(*args, wrong=wrong)[1]
    A = inverse(W) @ C
    return _around(float(np.trace(A)), float(2 * np.trace(A @ A)), int(inputs["N"]))
