"""The generator itself: files are as it makes them, and other libraries agree with a sample of numbers."""

from __future__ import annotations

import importlib
import re

import numpy as np
import pytest
from generator.writing import SEED
from scipy.stats import chi2

from vslam_ref.conformance import vectors_format as form

QUICK = ("so2", "scale", "noise", "format")
LONG = (
    *("multiview", "so3", "se2", "se3", "sim3", "quaternion", "camera", "loss", "least_squares", "bundle"),
    "trajectory",
)


def committed(topic: str) -> tuple[str, str]:
    """Text of a topic's file, and of what the generator makes now."""
    module = importlib.import_module(f"generator.{topic}")
    name = f"{module.CHAPTER:02d}/{module.TOPIC}.json"
    made = module.build(np.random.default_rng([SEED, module.CHAPTER, *module.TOPIC.encode()])).text()
    return (form.folder() / name).read_text(encoding="utf-8"), made


NUMBER = re.compile(r"-?\d+\.?\d*(?:e[-+]?\d+)?")


def assert_same(there: str, made: str) -> None:
    """Equal but for last digits: inputs are drawn with NumPy's sine and logarithm; machines differ."""
    assert NUMBER.sub("n", there) == NUMBER.sub("n", made)
    a, b = (np.array([float(n) for n in NUMBER.findall(text)]) for text in (there, made))
    assert np.allclose(a, b, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize("topic", QUICK)
def test_committed_vectors_are_what_the_generator_makes(topic: str) -> None:
    assert_same(*committed(topic))


@pytest.mark.slow
@pytest.mark.parametrize("topic", LONG)
def test_all_committed_vectors_are_what_the_generator_makes(topic: str) -> None:
    assert_same(*committed(topic))


def test_opencv_projects_the_same_pixels() -> None:
    """Three of the lenses, in another library's code; 1e-12 of a pixel of some hundreds."""
    cv2 = pytest.importorskip("cv2")
    seen = 0
    for case in form.load("03/camera.json").cases:
        model, flags = case.inputs["model"], set(case.flags)
        if (
            case.function != "camera.project"
            or case.result != "valid"
            or flags & {"on_axis", "at_90", "beyond_90"}
        ):
            continue
        params, X = np.array(case.inputs["params"]), np.array(case.inputs["X_cam"])[None, None]
        K = np.array([[params[0], 0, params[2]], [0, params[1], params[3]], [0, 0, 1]])
        still = np.zeros(3)
        if model == "fisheye":
            uv, _ = cv2.fisheye.projectPoints(X, still, still, K, params[4:])
        elif model in ("pinhole", "radtan", "rational"):
            uv, _ = cv2.projectPoints(X, still, still, K, params[4:] if model != "pinhole" else None)
        else:
            continue
        assert np.abs(uv.ravel() - case.expected["uv"]).max() < 1e-9, case.id
        seen += 1
    assert seen > 60


def test_the_band_of_squared_noise_has_its_false_alarm_rate() -> None:
    """N times the mean square over sigma^2 is exactly chi-squared with N degrees of freedom."""
    groups = [
        c for c in form.load("04/noise.json").cases if c.statistic and c.statistic["measure"] == "mean_square"
    ]
    assert len(groups) == 2
    for case in groups:
        rule = case.statistic
        assert rule is not None
        unit = case.inputs["sigma"] ** 2 / rule["samples"]
        rate = chi2.cdf(rule["low"] / unit, rule["samples"]) + chi2.sf(rule["high"] / unit, rule["samples"])
        assert 0.5e-4 < rate < rule["false_alarm"]


def test_published_constants_of_the_scales() -> None:
    """Sixteen digits as in tables: 1/Phi^-1(3/4), and 1/sqrt(2 ln 2)."""
    one = {"scale.mad": 1.482602218505602, "scale.norm": 0.8493218002880191}
    for case in form.load("04/scale.json").cases:
        e = np.array(case.inputs["errors"])
        median = np.median(np.abs(e) if e.ndim == 1 else np.linalg.norm(e, axis=1))
        assert case.expected["sigma"] == pytest.approx(one[case.function] * median, rel=1e-15)
