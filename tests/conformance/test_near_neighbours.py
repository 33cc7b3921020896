"""Wrong programs beside those that have a name: what is said of them is true of them, too."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from wrong_programs import judge, vectors

from vslam_ref.conformance.adapters import itself
from vslam_ref.conformance.adapters.table import plain


def right(function: str, given: dict[str, Any]) -> Any:
    return itself.answer(function, plain(given))


def named(function: str, answering: Any) -> str:
    fate = judge(function, answering)
    assert not fate.slips
    return fate.name


def test_a_logarithm_that_copies_is_not_told_of_its_exponential() -> None:
    name = named("se2.log", lambda x: x)
    assert "copy the translation" in name or "unchanged" in name
    assert "your exponential" not in name


def test_an_index_that_stops_short_is_no_unit_length() -> None:
    """An index that is scaled and cut may hit the same landmark; it is no direction."""

    def update(ids: Any, **given: Any) -> Any:
        return right("ekf.update", {**given, "ids": [min(int(i), 1) for i in ids]})

    assert "unit length" not in named("ekf.update", update)


@pytest.mark.parametrize("function", ["noise.gaussian"])
def test_one_statistic_is_no_proof(function: str) -> None:
    """A normal distribution beside zero has the mean of the uniform one on (0, sigma), which it is not."""

    def beside(N: int, sigma: float) -> Any:
        return np.random.default_rng(5).normal(sigma / 2, sigma, int(N))

    assert not named(function, beside).startswith("positive-uniform")


def test_quarters_are_no_single_precision() -> None:
    name = named("so3.exp", lambda phi: np.round(4 * np.asarray(right("so3.exp", {"phi": phi}))) / 4)
    assert "single precision" not in name


def test_a_sensor_counted_twice_is_no_process_noise() -> None:
    def update(cov_z: Any, **given: Any) -> Any:
        found = right("ekf.update", {**given, "cov_z": 2 * np.asarray(cov_z)})
        return {**found, "x": np.asarray(found["x"]) * 1.001}

    assert "process noise" not in named("ekf.update", update)


@pytest.mark.parametrize("number", [0, 1])
def test_the_same_index_always_is_no_forgotten_check(number: int) -> None:
    name = named("mapping.match_on_line", lambda **_: {"number": number, "kept": True})
    notes = vectors("mapping.match_on_line").notes
    assert not any(note in name for note in notes)


def test_a_half_for_everything_is_no_rule_for_blanks() -> None:
    assert "blank-is-half" not in named("vocabulary.score", lambda **_: {"score": 0.5})


# -- covariances are symmetric ---------------------------------------------------------------------


def skew(P: Any) -> Any:
    """A millionth of the largest entry above the diagonal, taken away below it."""
    size = 1e-6 * np.abs(P).max()
    return np.asarray(P) + size * (np.triu(np.ones_like(P), 1) - np.tril(np.ones_like(P), -1))


def uneven(P: Any) -> Any:
    """Every entry off by another per cent."""
    return P * (1 + 0.01 * np.sin(np.arange(P.size))).reshape(P.shape)


@pytest.mark.parametrize("function", ["ekf.update", "range_bearing.update", "ekf.predict"])
@pytest.mark.parametrize(
    ("change", "told"),
    [
        (skew, "not symmetric: a skew part is added"),
        (lambda P: np.triu(P) + np.tril(0.9 * np.asarray(P), -1), "the upper triangle is right"),
        (lambda P: np.tril(P) + np.triu(0.9 * np.asarray(P), 1), "the lower triangle is right"),
        (
            lambda P: np.asarray(P) * (1 + 0.01 * np.sin(np.arange(np.size(P)))).reshape(np.shape(P)),
            "P is not symmetric",
        ),
    ],
    ids=["skew", "upper", "lower", "no formula"],
)
def test_a_covariance_that_is_not_symmetric_is_told(function: str, change: Any, told: str) -> None:
    def answering(**given: Any) -> Any:
        found = right(function, given)
        return {**found, "P": change(np.array(found["P"], dtype=float))}

    name = named(function, answering)
    assert told in name
    assert "not symmetric" in name


def test_rows_without_their_columns_have_a_name() -> None:
    def update(**given: Any) -> Any:
        found = right("ekf.update", given)
        P = np.array(given["P"], dtype=float)
        rows = [0, 1, 2, *(3 + 2 * int(i) + k for i in given["ids"] for k in (0, 1))]
        P[rows] = np.array(found["P"])[rows]
        return {**found, "P": P}

    assert "rows-only" in named("ekf.update", update)


def test_answers_to_points_that_leave_the_pose_open_are_told() -> None:
    def pnp(**given: Any) -> Any:
        try:
            return right("multiview.pnp", given)
        except ValueError:
            return np.eye(4)

    name = named("multiview.pnp", pnp)
    assert "answers what must be refused (5 of 5 such cases)" in name
