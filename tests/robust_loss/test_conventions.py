"""The same losses in other libraries: each asked for its own numbers where its wheel is installed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from vslam_ref.estimation.robust import LOSSES, Cauchy, Huber, Loss, Tukey
from vslam_ref.estimation.robust.conventions import cost_factor, ptam_score, scipy_loss, squared_form

X = np.array([0.0, 0.3, 1.0, 2.9, 3.1, 8.0])
C = 3.0
RNG = np.random.default_rng(7)


@pytest.mark.parametrize("cls", list(LOSSES.values()))
def test_the_form_in_the_square_has_the_right_derivatives(cls: type[Loss]) -> None:
    loss, s = cls(C), np.array([0.01, 1.0, 5.0, 20.0])
    value, first, second = squared_form(loss, s)
    h = 1e-5
    up, down = squared_form(loss, s + h), squared_form(loss, s - h)
    # central differences: h^2 truncation, rounding 1e-16 / h
    np.testing.assert_allclose(first, (up.rho - down.rho) / (2 * h), atol=1e-9)
    np.testing.assert_allclose(second, (up.first - down.first) / (2 * h), atol=1e-9)
    np.testing.assert_allclose(value, 2 * loss.cost(np.sqrt(s)), rtol=1e-15)
    with pytest.raises(ValueError, match="must be >= 0"):
        squared_form(loss, -1.0)


LINE = np.stack([np.ones(40), np.linspace(-1, 1, 40)], axis=1)
DATA = LINE @ [1.0, 2.0] + RNG.normal(0, 0.1, 40)
DATA[::7] += 5.0


@pytest.mark.parametrize(("name", "ours"), [("huber", Huber(0.2)), ("cauchy", Cauchy(0.2))])
def test_scipys_own_losses_are_ours_with_c_as_f_scale(name: str, ours: Loss) -> None:
    def residual(b: np.ndarray) -> np.ndarray:
        return LINE @ b - DATA

    theirs = least_squares(
        residual, [0.0, 0.0], loss=name, f_scale=ours.c, xtol=1e-15, ftol=1e-15, gtol=1e-12
    )
    # their cost is our sum of rho: the factor 2 of rho(z) and their half cancel
    assert theirs.cost == pytest.approx(ours.cost(theirs.fun).sum(), rel=1e-12)
    given = least_squares(residual, theirs.x, loss=scipy_loss(ours), f_scale=1.0)
    assert given.cost == pytest.approx(theirs.cost, rel=1e-12)
    np.testing.assert_allclose(LINE.T @ ours.influence(theirs.fun), 0.0, atol=1e-6)


def test_scipy_minimises_our_tukey() -> None:
    loss = Tukey(0.6)

    def residual(b: np.ndarray) -> np.ndarray:
        return LINE @ b - DATA

    found = least_squares(residual, [1.0, 2.0], loss=scipy_loss(loss), xtol=1e-15, ftol=1e-15, gtol=1e-12)
    assert found.cost == pytest.approx(loss.cost(found.fun).sum(), rel=1e-12)
    np.testing.assert_allclose(LINE.T @ loss.influence(found.fun), 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [("tukey", "Tukey"), ("huber", "Huber"), ("cauchy", "Cauchy"), ("geman-mcclure", "GemanMcClure")],
)
def test_gtsam(ours: str, theirs: str) -> None:
    gtsam = pytest.importorskip("gtsam", reason="GTSAM's wheel is not installed")
    m, loss = getattr(gtsam.noiseModel.mEstimator, theirs).Create(C), LOSSES[ours](C)
    factor = cost_factor("gtsam", ours, C)
    np.testing.assert_allclose([m.loss(x) for x in X], factor * loss.cost(X), rtol=1e-14)
    np.testing.assert_allclose([m.weight(x) for x in X], loss.weight(X), rtol=1e-14, atol=1e-16)


def test_gtsams_factors_cost_the_loss_of_the_norm() -> None:
    gtsam = pytest.importorskip("gtsam", reason="GTSAM's wheel is not installed")
    noise = gtsam.noiseModel.Robust.Create(
        gtsam.noiseModel.mEstimator.Tukey.Create(C), gtsam.noiseModel.Isotropic.Sigma(2, 0.5)
    )
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    graph.add(gtsam.PriorFactorPoint2(1, np.array([0.0, 0.0]), noise))
    values.insert(1, np.array([0.6, 0.8]))
    # the norm 1 is 2 in units of sigma; one loss for the vector, and no further half
    assert graph.error(values) == pytest.approx(Tukey(C).cost(2.0).item(), rel=1e-14)


@pytest.mark.parametrize(("ours", "theirs"), [("huber", "HuberLoss"), ("cauchy", "CauchyLoss")])
def test_ceres(ours: str, theirs: str) -> None:
    pyceres = pytest.importorskip("pyceres", reason="the wheel of Ceres' Python binding is not installed")
    evaluate, loss = getattr(pyceres, theirs)(C).evaluate, LOSSES[ours](C)
    s = np.array([0.0, 0.25, 1.0, 8.375, 9.625, 64.0])  # the binding rounds its argument to float32
    found = np.array([evaluate(one) for one in s])
    np.testing.assert_allclose(found.T, squared_form(loss, s), rtol=1e-13, atol=1e-16)
    np.testing.assert_allclose(found[:, 0], cost_factor("ceres", ours, C) * loss.cost(np.sqrt(s)), rtol=1e-13)


@pytest.mark.parametrize("c", [2.0, 4.0])
def test_opencv_reweights_with_our_huber_in_pixels_and_keeps_the_line_of_least_distances(c: float) -> None:
    """Of twenty starts it keeps the one with the least *sum of distances*: near Huber's line, not on it."""
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed")
    rng = np.random.default_rng(3)
    t = np.linspace(-100, 100, 60)
    points = np.stack([t, 0.2 * t + 5 + rng.normal(0, 1.0, 60)], axis=1).astype(np.float32)
    points[::9, 1] += 40.0

    def distances(line: np.ndarray) -> np.ndarray:
        return (points[:, 1] - line[0]) * np.cos(line[1]) - points[:, 0] * np.sin(line[1])

    def line(kind: int) -> np.ndarray:
        vx, vy, x0, y0 = cv2.fitLine(points, kind, c, 1e-7, 1e-7).ravel().astype(float)
        return np.array([y0 - x0 * vy / vx, np.arctan(vy / vx)])

    best = least_squares(distances, [5.0, 0.2], loss=scipy_loss(Huber(c)), xtol=1e-14).x
    huber, plain = line(cv2.DIST_HUBER), line(cv2.DIST_L2)
    cost = {n: Huber(c).cost(distances(q)).sum() for n, q in (("best", best), ("cv", huber), ("l2", plain))}
    assert cost["best"] <= cost["cv"] < 1.005 * cost["best"] < cost["l2"]
    assert np.abs(distances(huber)).sum() < np.abs(distances(best)).sum()


def test_ptams_scores() -> None:
    """Formulas of PTAM's M-estimators, written down from their meaning: a share of the cut, not a cost."""
    e2, cut2 = X**2, C**2
    inside = np.minimum(e2 / cut2, 1.0)
    np.testing.assert_allclose(ptam_score("tukey", e2, cut2), 1 - (1 - inside) ** 3, atol=1e-15)
    np.testing.assert_allclose(ptam_score("cauchy", e2, cut2), np.log(1 + e2 / cut2), rtol=1e-14)
    np.testing.assert_allclose(ptam_score("l2", e2, cut2), e2, rtol=1e-14)
    assert cost_factor("ptam", "tukey", C) == pytest.approx(6 / C**2)
    with pytest.raises(ValueError, match="PTAM has no loss 'geman-mcclure'"):
        ptam_score("geman-mcclure", e2, cut2)


def test_unknown_libraries_and_losses_are_refused() -> None:
    with pytest.raises(ValueError, match="opencv has no loss 'tukey'"):
        cost_factor("opencv", "tukey", 1.0)
    with pytest.raises(ValueError, match="unknown library"):
        cost_factor("eigen", "tukey", 1.0)  # type: ignore[arg-type]
