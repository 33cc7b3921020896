"""The verdict on a user's own runs: honest, bold and shy filters, its false-alarm rate, and damaged files."""

from __future__ import annotations

import json
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom, chi2

from vslam_ref.cli import main
from vslam_ref.conformance.nees_files import Runs, read
from vslam_ref.conformance.nees_runs import independent_steps, judge

Array = NDArray[np.float64]


def tracked(rng: np.random.Generator, runs: int, steps: int, *, q: float = 1.0, r: float = 1.0) -> Runs:
    """Kalman filters that follow a thing of constant velocity, and believe in q and r times its noises."""
    F, H = np.array([[1.0, 0.5], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q, R = np.array([[0.02, 0.01], [0.01, 0.04]]), 0.3
    P = np.broadcast_to(np.eye(2), (runs, 2, 2)).copy()
    truth = rng.standard_normal((runs, 2))
    mean = np.zeros((runs, 2))
    errors, covariances = [], []
    for _ in range(steps):
        truth = truth @ F.T + rng.standard_normal((runs, 2)) @ np.linalg.cholesky(Q).T
        mean, P = mean @ F.T, F @ P @ F.T + q * Q
        z = truth[:, 0] + R**0.5 * rng.standard_normal(runs)
        S = P[:, 0, 0] + r * R
        K = P[:, :, 0] / S[:, None]
        mean = mean + K * (z - mean[:, 0])[:, None]
        P = P - K[:, :, None] * (H @ P)
        P = (P + P.swapaxes(1, 2)) / 2
        errors.append(truth - mean)
        covariances.append(P)
    return Runs(np.arange(float(steps)), np.stack(errors, 1), np.stack(covariances, 1))


def correlated(rng: np.random.Generator, runs: int, steps: int, keep: float, d: int = 3) -> Array:
    """Gaussian errors of unit covariance, each step ``keep`` times the last."""
    e = rng.standard_normal((runs, steps, d))
    for t in range(1, steps):
        e[:, t] = keep * e[:, t - 1] + (1 - keep**2) ** 0.5 * e[:, t]
    return e


def claimed(error: Array, scale: float = 1.0) -> Runs:
    M, T, d = error.shape
    return Runs(np.arange(float(T)), error, np.broadcast_to(scale * np.eye(d), (M, T, d, d)))


def test_an_honest_filter_is_called_consistent_and_dishonest_ones_by_their_fault() -> None:
    rng = np.random.default_rng(17)
    assert judge(tracked(rng, 60, 40)).verdict == "consistent"
    assert judge(tracked(rng, 60, 40, q=0.2, r=0.5)).verdict == "overconfident"
    assert judge(tracked(rng, 60, 40, q=3.0, r=3.0)).verdict == "underconfident"


def test_a_filter_that_is_shy_at_first_and_bold_at_the_end_is_not_honest_on_average() -> None:
    error = correlated(np.random.default_rng(2), 80, 60, 0.8)
    error *= np.linspace(0.55, 1.32, 60)[:, None]
    found = judge(claimed(error))
    assert found.verdict == "mixed"
    assert abs(found.mean - 3) < 0.3


@pytest.mark.parametrize("keep", [0.0, 0.9, 1.0])
def test_honest_filters_are_seldom_accused_whatever_the_correlation(keep: float) -> None:
    """Among 300 studies of 30 runs.  The nominal rate is 5 %; the study allows 6.5 % (see the module).

    The bound is the 1 - 1e-4 quantile of a binomial count at 6.5 %: one seed in 1e4 fails by chance.
    """
    rng = np.random.default_rng(3)
    words = Counter(judge(claimed(correlated(rng, 30, 12, keep))).verdict for _ in range(300))
    assert 300 - words["consistent"] <= binom.ppf(1 - 1e-4, 300, 0.065)


def test_bands_of_single_steps_would_accuse_honest_filters() -> None:
    """Why steps are not counted as trials: with M T d degrees of freedom most honest studies fail."""
    rng = np.random.default_rng(4)
    low, high = chi2.ppf([0.025, 0.975], 30 * 12 * 3) / (30 * 12)
    means = [float((correlated(rng, 30, 12, 0.98) ** 2).sum(-1).mean()) for _ in range(100)]
    assert np.mean([not low < m < high for m in means]) > 0.4


def test_a_covariance_too_small_by_a_half_is_found_with_few_runs() -> None:
    """With 20 runs and fully dependent steps: 60 dof, whose band ends at 1.5; a factor 2 is far beyond."""
    rng = np.random.default_rng(5)
    words = Counter(judge(claimed(correlated(rng, 20, 6, 1.0), 0.5)).verdict for _ in range(40))
    assert words["overconfident"] >= 36


@pytest.mark.parametrize(("keep", "steps"), [(0.0, 30.0), (1.0, 1.0)])
def test_independent_steps_are_counted(keep: float, steps: float) -> None:
    found = [independent_steps(correlated(np.random.default_rng(s), 100, 30, keep)) for s in range(5)]
    # theta is a mean of 4950 squares, each with a relative spread of 2^0.5: 2 %, and the clip at both ends
    assert np.mean(found) == pytest.approx(steps, rel=0.1)


def test_independent_steps_of_a_known_correlation() -> None:
    """For w_t = k w_(t-1) + ...: theta = d sum over s, t of k^(2 |s - t|)."""
    k, T = 0.8, 25
    theta = sum(k ** (2 * abs(s - t)) for s in range(T) for t in range(T))
    found = [independent_steps(correlated(np.random.default_rng(s), 150, T, k)) for s in range(8)]
    assert np.mean(found) == pytest.approx(T**2 / theta, rel=0.06)


def test_one_step_is_the_chi_squared_band_of_chapter_17() -> None:
    error = np.random.default_rng(6).standard_normal((50, 1, 3))
    (window,) = judge(claimed(error)).windows
    assert [window.low, window.high] == pytest.approx(chi2.ppf([0.025, 0.975], 150) / 50)
    assert window.independent_steps == 1.0


def test_the_verdict_does_not_depend_on_units() -> None:
    runs = tracked(np.random.default_rng(7), 40, 30)
    scale = np.array([1e6, 1e-5])
    other = Runs(runs.steps, runs.error * scale, runs.covariance * np.outer(scale, scale))
    a, b = judge(runs), judge(other)
    assert [w.mean for w in a.windows] == pytest.approx([w.mean for w in b.windows])
    assert [w.high for w in a.windows] == pytest.approx([w.high for w in b.windows])


def test_a_covariance_that_is_none_is_a_verdict() -> None:
    runs = tracked(np.random.default_rng(8), 20, 10)
    runs.covariance[3, 4] = [[1.0, 2.0], [2.0, 1.0]]
    found = judge(runs)
    assert (found.verdict, found.invalid, found.consistent) == ("invalid covariance", 1, False)


def test_too_few_runs_are_refused() -> None:
    with pytest.raises(ValueError, match="9 runs: need 10"):
        judge(claimed(np.zeros((9, 2, 1))))


# -- files -------------------------------------------------------------------------------------------


def table(runs: Runs) -> str:
    M, T, d = runs.error.shape
    head = ["run", "step", *(f"e{i}" for i in range(1, d + 1)), *("P" for _ in range(d * d))]
    lines = [",".join(head)]
    for m in range(M):
        for t in range(T):
            numbers = [m, runs.steps[t], *runs.error[m, t], *runs.covariance[m, t].ravel()]
            lines.append(",".join(repr(float(v)) for v in numbers))
    return "\n".join(lines) + "\n"


def arrays(runs: Runs) -> dict[str, Any]:
    M, T, d = runs.error.shape
    return {
        "run": np.repeat(np.arange(M), T),
        "step": np.tile(runs.steps, M),
        "error": runs.error.reshape(-1, d),
        "covariance": runs.covariance.reshape(-1, d, d),
    }


def test_both_formats_read_the_same_runs_in_any_order(tmp_path: Path) -> None:
    runs = tracked(np.random.default_rng(9), 12, 5)
    lines = table(runs).splitlines()
    shuffled = [lines[0], "# a remark", *np.random.default_rng(1).permutation(lines[1:]).tolist(), ""]
    (tmp_path / "a.csv").write_text("\n".join(shuffled))
    order = np.random.default_rng(2).permutation(60)
    np.savez(tmp_path / "a.npz", **{name: value[order] for name, value in arrays(runs).items()})
    for name in ("a.csv", "a.npz"):
        for dof in (2, None):
            found = read(tmp_path / name, dof)
            for mine, theirs in zip(found, runs, strict=True):
                np.testing.assert_array_equal(mine, theirs)


def test_the_command_tells_the_verdict_by_its_status(tmp_path: Path, capsys: Any) -> None:
    rng = np.random.default_rng(17)
    (tmp_path / "good.csv").write_text(table(tracked(rng, 40, 12)))
    (tmp_path / "bad.csv").write_text(table(tracked(rng, 40, 12, q=0.1, r=0.2)))
    page, found = tmp_path / "page.html", tmp_path / "found.json"
    good = ["verify", "--nees", str(tmp_path / "good.csv"), "--dof", "2"]
    assert main([*good, "--report", str(page), "--json", str(found)]) == 0
    assert "<svg" in page.read_text()
    assert json.loads(found.read_text())["verdict"] == "consistent"
    bad = ["verify", "--nees", str(tmp_path / "bad.csv"), "--dof", "2"]
    assert main([*bad, "--report", str(tmp_path / "f.png")]) == 1
    assert (tmp_path / "f.png").read_bytes().startswith(b"\x89PNG")
    assert "overconfident: errors are larger than the covariance says" in capsys.readouterr().out


DAMAGES = {
    "empty": (lambda lines: [], "no line of numbers"),
    "short line": (lambda lines: [*lines[:4], lines[4].rpartition(",")[0]], ":5: 7 columns; need 8"),
    "word": (lambda lines: [*lines[:3], lines[3].replace("0.0", "zero", 1)], "is not a number"),
    "not finite": (lambda lines: [*lines[:2], ",".join(["nan"] * 8)], ":3: a number is not finite"),
    "twice": (lambda lines: [*lines, lines[-1]], "is twice or more"),
    "a step missing": (lambda lines: lines[:-1], "is not there"),
    "few runs": (lambda lines: lines[:11], "2 runs: need 10"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_tables_are_told_in_one_line(damage: str, tmp_path: Path, capsys: Any) -> None:
    change, message = DAMAGES[damage]
    lines = table(tracked(np.random.default_rng(10), 12, 5)).splitlines()
    path = tmp_path / "runs.csv"
    path.write_text("\n".join(change(lines)))
    out = tmp_path / "out.json"
    assert main(["verify", "--nees", str(path), "--dof", "2", "--json", str(out)]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1
    assert not out.exists()


def test_damaged_archives_are_told_in_one_line(tmp_path: Path, capsys: Any) -> None:
    good = arrays(tracked(np.random.default_rng(11), 12, 5))
    cases = {
        "no array 'step'": {name: value for name, value in good.items() if name != "step"},
        "need (N,), (N,), (N, d) and (N, d, d)": {**good, "covariance": good["covariance"][:, 0]},
        "'error' is not an array of numbers": {**good, "error": np.array([{"a": 1}] * 60, dtype=object)},
        "'run' is not an array of numbers": {**good, "run": good["run"].astype(str)},
        "'error' has a number that is not finite": {**good, "error": good["error"] * np.inf},
    }
    for message, content in cases.items():
        np.savez(tmp_path / "runs.npz", **content)
        assert main(["verify", "--nees", str(tmp_path / "runs.npz")]) == 2
        assert message in capsys.readouterr().err
    np.savez(tmp_path / "runs.npz", **good)
    whole = (tmp_path / "runs.npz").read_bytes()
    for damaged in (b"", whole[: len(whole) // 2], b"rubbish"):
        (tmp_path / "runs.npz").write_bytes(damaged)
        assert main(["verify", "--nees", str(tmp_path / "runs.npz")]) == 2
        assert capsys.readouterr().err.count("\n") == 1


def test_a_header_that_promises_too_much_allocates_nothing(tmp_path: Path, capsys: Any) -> None:
    good = arrays(tracked(np.random.default_rng(12), 12, 5))
    np.savez(tmp_path / "whole.npz", **good)
    with zipfile.ZipFile(tmp_path / "whole.npz") as old, zipfile.ZipFile(tmp_path / "big.npz", "w") as new:
        for info in old.infolist():
            content = old.read(info)
            if info.filename == "run.npy":
                content = content.replace(b"(60,), }         ", b"(60000000000,), }")
                assert b"60000000000" in content
            new.writestr(info.filename, content)
    assert main(["verify", "--nees", str(tmp_path / "big.npz")]) == 2
    assert "'run' is not an array of numbers" in capsys.readouterr().err


def test_bad_use_is_told(tmp_path: Path, capsys: Any) -> None:
    path = tmp_path / "runs.csv"
    path.write_text(table(tracked(np.random.default_rng(13), 12, 5)))
    for arguments, message in (
        (["--nees", str(tmp_path / "none.csv")], "No such file"),
        (["--nees", str(path), "--dof", "3"], "8 columns; need 14"),
        (["--nees", str(path), "--dof", "0"], "need the length of the error"),
        (["--nees", str(path), "--report", str(tmp_path / "r.pdf")], "ends in .html, .png or .svg"),
    ):
        assert main(["verify", *arguments]) == 2
        assert message in capsys.readouterr().err
