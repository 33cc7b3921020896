"""NEES, what its mean may do, and noise that must be Gaussian."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf
from numpy.typing import NDArray
from scipy.stats import chi2, norm

from vslam_ref.conformance.generator import exact_ekf
from vslam_ref.conformance.generator.building import Topic, tolerance
from vslam_ref.conformance.generator.exact_arrays import big, doubles, inverse, jacobian, stack, wrap

TOPIC, CHAPTER = "consistency", 17
Array = NDArray[np.float64]

NOTES = {
    "covariance-for-information": (
        "you multiply by the covariance where its inverse belongs",
        "e^T P e",
    ),
    "root": ("your value is the Mahalanobis distance; NEES is its square", "sqrt(e^T P^-1 e)"),
    "variances-only": (
        "you use the variances only and forget the correlations",
        "sum of e_i^2 / P_ii",
    ),
    "per-dof": ("you divide by the degrees of freedom", "e^T P^-1 e / d"),
    "entries-inverted": ("you invert P by entries", "e^T (1/P_ij) e"),
    "heading-not-wrapped": ("your heading error leaves (-pi, pi]", "truth - estimate"),
    "estimate-minus-truth": ("your error has the other sign: estimate minus truth", "estimate - truth"),
    "one-run": (
        "your band is that of one run; the mean of M runs has M d degrees of freedom",
        "chi2_d quantiles",
    ),
    "not-divided": (
        "your band is that of the sum over runs; divide it by the number of runs",
        "chi2_(M d) quantiles",
    ),
    "whole-tails": (
        "you cut the whole of what is left at each end; a two-sided band cuts half at each",
        "chi2_(M d) at 1 - confidence and confidence, over M",
    ),
    "normal": (
        "your band takes the mean for normal; with few runs chi-squared is lopsided",
        "d -+ z sqrt(2 d/M)",
    ),
    "half-tail": (
        "your bound is the upper edge of the two-sided band",
        "chi2_(M d) at (1 + confidence)/2, over M",
    ),
    "uniform-noise": (
        "your noise is uniform where Gaussian is promised",
        "sigma sqrt(3) times uniform in (-1, 1): the same variance, E x^4 = 9/5 sigma^4",
    ),
    "variance-for-sigma": (
        "you take sigma for a variance, or the variance for sigma",
        "sqrt(sigma) or sigma^2 times a standard normal number",
    ),
    "gtpg": (
        "your predict computes G^T P G: its covariance does not fit its errors",
        "F^T P F + G cov_u G^T",
    ),
    "no-process-noise": ("your predict adds no noise: NEES is too large", "F P F^T"),
}


def build(rng: np.random.Generator) -> Topic:
    """All groups of consistency."""
    topic = Topic(CHAPTER, TOPIC)
    for identity, (meaning, formula) in NOTES.items():
        topic.note(identity, meaning, formula)
    _nees(topic, rng)
    _pose_errors(topic, rng)
    _bands(topic, rng)
    _noise(topic)
    _runs(topic)
    return topic


# -- one value -------------------------------------------------------------------------------------


def _nees(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "inverse by elimination in 50 digits"
    rule = tolerance(1e-12, "condition of P, below 1e3, times a few eps")
    for flag, d in (("one", 1), ("pose", 3), ("rigid", 6), ("nine", 9)):
        cases = [_value(rng, _covariance(rng, d, 1e2)) for _ in range(15)]
        topic.group("consistency.nees", "eq-nees", oracle, rule, cases, flags=(flag,))
    cases = [_value(rng, _scaled(rng, _covariance(rng, 4, 1e2))) for _ in range(12)]
    reason = "the condition of the correlations counts, below 1e3; units are no matter"
    scaled = tolerance(1e-12, reason)
    topic.group("consistency.nees", "eq-nees", oracle, scaled, cases, flags=("mixed_units",))
    cases = [_value(rng, _covariance(rng, 3, 1e8)) for _ in range(10)]
    rule = tolerance(1e-6, "condition of P, 1e8, times eps and a margin of 40", float32=1.0)
    topic.group("consistency.nees", "eq-nees", oracle, rule, cases, flags=("ill_conditioned",))
    bad = [np.diag([1.0, -1.0]), np.ones((2, 2)), np.array([[1.0, 2.0], [2.0, 1.0]])]
    cases = [{"inputs": {"error": [1.0, 2.0], "P": P}, "expected": {}, "result": "invalid"} for P in bad]
    topic.group("consistency.nees", "eq-nees", "Sylvester's criterion", rule, cases, flags=("degenerate",))


def _covariance(rng: np.random.Generator, d: int, condition: float) -> Array:
    Q, _ = np.linalg.qr(rng.standard_normal((d, d)))
    P = Q @ np.diag(np.geomspace(1.0, 1.0 / condition, d)) @ Q.T
    return np.asarray((P + P.T) / 2)


def _scaled(rng: np.random.Generator, P: Array) -> Array:
    scale = 10.0 ** rng.integers(-5, 4, len(P))
    return np.asarray(P * np.outer(scale, scale))


def _value(rng: np.random.Generator, P: Array) -> dict[str, Any]:
    error = np.linalg.cholesky(P) @ rng.standard_normal(len(P))
    e, C = big(error), big(P)
    right = e @ inverse(C) @ e
    wrong = {
        "covariance-for-information": e @ C @ e,
        "root": mpmath.sqrt(right),
        "variances-only": sum(e**2 / np.diag(C)),
        "per-dof": right / len(P),
        "entries-inverted": e @ (1 / C) @ e,
    }
    mistakes = {n: {"value": float(v)} for n, v in wrong.items() if abs(v - right) > mpf("1e-3") * right}
    case: dict[str, Any] = {"inputs": {"error": error, "P": P}, "expected": {"value": float(right)}}
    return {**case, "mistakes": mistakes} if mistakes else case


def _pose_errors(topic: Topic, rng: np.random.Generator) -> None:
    rule = tolerance(1e-14, "a difference; 2 pi is rounded", absolute=2e-15)
    for flag, count in (("", 12), ("near_pi", 15)):
        cases = []
        for _ in range(count):
            truth = np.round([*rng.uniform(-9, 9, 2), rng.uniform(-1, 1)], 4)
            estimate = np.round(truth + rng.normal(0, 0.3, 3), 4)
            if flag:
                side = rng.choice([-1, 1])
                truth[2], estimate[2] = (
                    side * round(rng.uniform(2.9, 3.14), 4),
                    -side * round(rng.uniform(2.9, 3.14), 4),
                )
            cases.append(_error(truth, estimate))
        topic.group(
            "consistency.pose_error",
            "eq-nees",
            "definition, 50 digits",
            rule,
            cases,
            flags=(flag,) if flag else (),
        )


def _error(truth: Array, estimate: Array) -> dict[str, Any]:
    plain = big(truth) - big(estimate)
    right = plain.copy()
    right[2] = wrap(plain[2])
    mistakes = {"estimate-minus-truth": {"error": doubles(-right)}}
    if abs(plain[2]) > mpmath.pi:
        mistakes["heading-not-wrapped"] = {"error": doubles(plain)}
    inputs = {"truth": truth, "estimate": estimate}
    return {"inputs": inputs, "expected": {"error": doubles(right)}, "mistakes": mistakes}


# -- bands -----------------------------------------------------------------------------------------


def quantile(dof: int, probability: Any) -> Any:
    """Quantile of chi-squared: Newton's iteration on the incomplete gamma function, 50 digits."""
    p, half = mpf(probability), mpf(dof) / 2
    x = mpf(float(chi2.ppf(float(p), dof)))
    for _ in range(6):
        density = mpmath.exp((half - 1) * mpmath.log(x / 2) - x / 2 - mpmath.loggamma(half)) / 2
        x -= (mpmath.gammainc(half, 0, x / 2, regularized=True) - p) / density
    assert abs(mpmath.gammainc(half, 0, x / 2, regularized=True) - p) < mpf(10) ** -35
    return x


def _bands(topic: Topic, rng: np.random.Generator) -> None:
    oracle = "Newton's iteration on the incomplete gamma function, 50 digits"
    rule = tolerance(1e-10, "programs differ in their inverse of the incomplete gamma function", float32=1e-4)
    regimes: dict[str, Callable[[], tuple[int, int, float]]] = {
        "": lambda: (
            int(rng.integers(10, 101)),
            int(rng.choice([2, 3, 6])),
            float(rng.choice([0.9, 0.95, 0.99])),
        ),
        "few_runs": lambda: (
            int(rng.integers(1, 4)),
            int(rng.integers(1, 4)),
            float(rng.choice([0.9, 0.95, 0.99])),
        ),
        "many_runs": lambda: (int(rng.integers(300, 1001)), int(rng.choice([2, 3])), 0.95),
        "rare": lambda: (int(rng.integers(10, 101)), 3, 1.0 - 10.0 ** -float(rng.integers(4, 7))),
    }
    for flag, draw in regimes.items():
        rows = [(50, 3, 0.95), *(draw() for _ in range(11))] if not flag else [draw() for _ in range(10)]
        flags = (flag,) if flag else ()
        topic.group("consistency.band", "eq-band", oracle, rule, [_band(*row) for row in rows], flags=flags)
        topic.group("consistency.bound", "eq-band", oracle, rule, [_bound(*row) for row in rows], flags=flags)
    bad = [(0, 3, 0.95), (10, 0, 0.95), (10, 3, 1.5), (10, 3, -0.1)]
    names = ("runs", "dof", "confidence")
    cases = [
        {"inputs": dict(zip(names, row, strict=True)), "expected": {}, "result": "invalid"} for row in bad
    ]
    topic.group("consistency.band", "eq-band", "definition", rule, cases, flags=("degenerate",))


def _band(runs: int, dof: int, confidence: float) -> dict[str, Any]:
    tail = (1 - mpf(confidence)) / 2
    z = mpf(float(norm.isf(float(tail))))
    spread = z * mpmath.sqrt(2 * mpf(dof) / runs)
    values = {
        "": (quantile(runs * dof, tail) / runs, quantile(runs * dof, 1 - tail) / runs),
        "one-run": (quantile(dof, tail), quantile(dof, 1 - tail)),
        "not-divided": (quantile(runs * dof, tail), quantile(runs * dof, 1 - tail)),
        "whole-tails": (quantile(runs * dof, 2 * tail) / runs, quantile(runs * dof, 1 - 2 * tail) / runs),
        "normal": (dof - spread, dof + spread),
    }
    return _edges(runs, dof, confidence, values, ("low", "high"))


def _bound(runs: int, dof: int, confidence: float) -> dict[str, Any]:
    p = mpf(confidence)
    values = {
        "": (quantile(runs * dof, p) / runs,),
        "one-run": (quantile(dof, p),),
        "not-divided": (quantile(runs * dof, p),),
        "half-tail": (quantile(runs * dof, (1 + p) / 2) / runs,),
    }
    return _edges(runs, dof, confidence, values, ("high",))


def _edges(
    runs: int, dof: int, confidence: float, values: dict[str, tuple[Any, ...]], outputs: tuple[str, ...]
) -> dict[str, Any]:
    answers = {n: dict(zip(outputs, map(float, v), strict=True)) for n, v in values.items()}
    right = answers.pop("")
    mistakes = {n: a for n, a in answers.items() if abs(a["high"] - right["high"]) > 1e-3}
    inputs = {"runs": runs, "dof": dof, "confidence": confidence}
    case: dict[str, Any] = {"inputs": inputs, "expected": right}
    return {**case, "mistakes": mistakes} if mistakes else case


# -- distributions ---------------------------------------------------------------------------------

FALSE_ALARM = 1e-4


def _around(mean: float, variance: float, samples: int) -> dict[str, float]:
    """Two-sided band of a mean of many independent samples (central limit)."""
    half = float(norm.isf(FALSE_ALARM / 2)) * (variance / samples) ** 0.5
    return {"low": mean - half, "high": mean + half}


def _noise(topic: Topic) -> None:
    """Moments of N(0, s^2): E x^2 = s^2, E x^4 = 3 s^4, and their variances from E x^8 = 105 s^8."""
    samples = 4000
    for s in (1.0, 0.25):
        uniform = _around(1.8 * s**4, (9.0 - 1.8**2) * s**8, samples)
        bands: dict[str, tuple[dict[str, float], dict[str, Any]]] = {
            "mean": (_around(0.0, s**2, samples), {}),
            "mean_square": (_around(s**2, 2 * s**4, samples), _swapped(s, samples)),
            "mean_fourth": (_around(3 * s**4, 96 * s**8, samples), {"uniform-noise": uniform}),
        }
        for measure, (band, mistakes) in bands.items():
            rule: dict[str, Any] = {"output": "values", "measure": measure, "samples": samples, **band}
            rule["false_alarm"] = FALSE_ALARM
            if mistakes:
                rule["mistakes"] = mistakes
            case = {"inputs": {"N": samples, "sigma": s}, "expected": {"values": []}}
            flags = ("statistical", measure, "unit" if s == 1.0 else "quarter")
            oracle = "moments of the normal distribution"
            topic.group(
                "consistency.noise",
                "eq-nees",
                oracle,
                tolerance(0.0, "a band"),
                [case],
                flags=flags,
                statistic=rule,
            )


def _swapped(s: float, samples: int) -> dict[str, Any]:
    """Bands of the mean square where sigma is taken for a variance."""
    return {} if s == 1.0 else {"variance-for-sigma": _around(s, 2 * s**2, samples)}


def _runs(topic: Topic) -> None:
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
