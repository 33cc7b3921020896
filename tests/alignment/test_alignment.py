"""Alignment of point sets: exact, optimal, never a mirror, and honest where the points do not decide."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from vslam_ref.geometry.alignment import Alignment, align, align_triples

EPS = float(np.finfo(float).eps)
SEEDS = st.integers(0, 2**32 - 1)


def random_rotation(rng: np.random.Generator, d: int) -> np.ndarray:
    Q, _ = np.linalg.qr(rng.normal(size=(d, d)))
    Q[:, 0] *= np.linalg.det(Q)
    return Q


def cost(x: np.ndarray, y: np.ndarray, s: float, R: np.ndarray, t: np.ndarray, w: np.ndarray) -> float:
    return float(w @ np.sum((s * x @ R.T + t - y) ** 2, axis=1) / w.sum())


def small_turn(phi: np.ndarray) -> np.ndarray:
    """Rotation by a vector of 1 (plane) or 3 angles."""
    if len(phi) == 1:
        return np.array([[np.cos(phi[0]), -np.sin(phi[0])], [np.sin(phi[0]), np.cos(phi[0])]])
    return Rotation.from_rotvec(phi).as_matrix()


@given(SEEDS, st.sampled_from([2, 3]), st.floats(-3, 3), st.booleans())
def test_an_exact_similarity_is_recovered(seed: int, d: int, log_scale: float, with_scale: bool) -> None:
    rng = np.random.default_rng(seed)
    s = 10.0**log_scale if with_scale else 1.0
    R, t, x = random_rotation(rng, d), 10 * rng.normal(size=d), rng.normal(size=(20, d)) + 5
    found = align(x, s * x @ R.T + t, with_scale=with_scale)
    # 20 normal points: singular values of C differ by less than 30; target entries below 100 s + 40, whose
    # rounding relative to the spread s is at most (100 + 40/s) eps
    bound = 30 * 10 * (100 + 40 / s) * EPS
    assert abs(found.scale / s - 1) < bound
    assert np.abs(found.R_target_source - R).max() < bound
    assert np.abs(found.act(x) - (s * x @ R.T + t)).max() < 20 * bound * s
    assert found.unique
    assert found.scale_known


@given(SEEDS, st.sampled_from([2, 3]), st.booleans(), st.booleans())
def test_every_change_of_the_answer_costs_more(seed: int, d: int, with_scale: bool, weighted: bool) -> None:
    """Noise as large as the signal: far from the exact case, only optimality is left to test."""
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=(12, d)), rng.normal(size=(12, d))
    w = rng.uniform(0.1, 3, 12) if weighted else np.ones(12)
    found = align(x, y, with_scale=with_scale, weights=w if weighted else None)
    R, t, s = found.R_target_source, found.t_target_source, found.scale
    best = cost(x, y, s, R, t, w)
    assert found.rmse**2 == pytest.approx(best, rel=1e-12)
    for size in (1e-3, 0.1, 2.0):
        turn = small_turn(size * rng.normal(size=d * (d - 1) // 2))
        changed = [(s, turn @ R, None), (s, R, t + size * rng.normal(size=d))]
        if with_scale:
            changed += [(s * (1 + size), R, None), (s / (1 + size), R, None)]
        for s2, R2, t2 in changed:
            centre = (w @ y - s2 * R2 @ (w @ x)) / w.sum() if t2 is None else t2
            assert cost(x, y, s2, R2, centre, w) >= best * (1 - 1e-12)


@pytest.mark.parametrize("weighted", [False, True])
def test_the_rotation_is_that_of_scipy(weighted: bool) -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        x, R = rng.normal(size=(15, 3)), random_rotation(rng, 3)
        y = x @ R.T + 0.3 * rng.normal(size=x.shape)
        w = rng.uniform(0.1, 2, 15) if weighted else np.ones(15)
        p, q = x - w @ x / w.sum(), y - w @ y / w.sum()
        oracle, _ = Rotation.align_vectors(q, p, weights=w)
        found = align(x, y, weights=w if weighted else None)
        # two decompositions of C, whose singular values differ by less than 100 here
        assert np.abs(found.R_target_source - oracle.as_matrix()).max() < 100 * 20 * EPS


def test_the_scale_is_that_of_a_numeric_minimiser() -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=(15, 3))
    y = 2.3 * x @ random_rotation(rng, 3).T + 0.3 * rng.normal(size=x.shape)
    found = align(x, y, with_scale=True)

    def f(v: np.ndarray) -> float:
        R = small_turn(v[1:4]) @ found.R_target_source
        return cost(x, y, v[0], R, v[4:], np.ones(15))

    start = np.concatenate([[2.0, 0.1, -0.1, 0.1], found.t_target_source + 0.1])
    numeric = minimize(f, start, method="BFGS", options={"gtol": 1e-9})
    # the minimum of a function known to eps is known to sqrt(eps), finite differences included
    assert numeric.x[0] == pytest.approx(found.scale, abs=1e-5)
    assert np.abs(numeric.x[1:4]).max() < 1e-5


@pytest.mark.parametrize("d", [2, 3])
def test_a_mirror_image_still_gets_a_rotation(d: int) -> None:
    """The sign matrix S is what keeps det R = 1; without it the answer is the mirror itself."""
    rng = np.random.default_rng(3)
    x = rng.normal(size=(30, d)) * np.arange(1, d + 1)
    mirror = np.diag([-1.0] + [1.0] * (d - 1))
    found = align(x, x @ mirror, with_scale=True)
    assert np.linalg.det(found.R_target_source) == pytest.approx(1.0, abs=1e-14)
    assert found.unique
    p = x - x.mean(0)
    U, D, Vt = np.linalg.svd((p @ mirror).T @ p)
    assert np.linalg.det(U @ Vt) < 0  # what forgets S returns a mirror, with no error left
    assert np.abs(p @ (U @ Vt).T - p @ mirror).max() < 1e-12
    # and the scale must lose the turned direction, too
    assert found.scale == pytest.approx((D[:-1].sum() - D[-1]) / D.sum(), rel=1e-12)
    assert found.rmse > 0.1


def test_noise_moves_the_answer_as_much_as_theory_says() -> None:
    """Isotropic points of variance 1 in each of 3 directions, noise sigma, N pairs: the standard deviations
    are sigma/sqrt(N) of t, sigma/sqrt(2 N) of each angle, sigma/sqrt(3 N) of the scale."""
    rng = np.random.default_rng(4)
    n, sigma, runs = 200, 0.01, 400
    got = []
    for _ in range(runs):
        x = rng.normal(size=(n, 3))
        x = (x - x.mean(0)) @ np.linalg.inv(np.linalg.cholesky(np.cov(x.T, bias=True))).T
        found = align(x, x + sigma * rng.normal(size=x.shape), with_scale=True)
        phi = Rotation.from_matrix(found.R_target_source).as_rotvec()
        got.append([*found.t_target_source, *phi, found.scale - 1])
    theory = sigma / np.sqrt(n * np.array([1, 1, 1, 2, 2, 2, 3.0]))
    squares = np.sum((np.array(got) / theory) ** 2, axis=0) / runs
    # chi-square of 400 degrees over 400 has the deviation 0.071; five of them, 7 numbers: false alarm 1e-5
    assert np.abs(squares - 1).max() < 5 * np.sqrt(2 / runs)


def test_weights_count_as_repetitions() -> None:
    rng = np.random.default_rng(5)
    x, y = rng.normal(size=(6, 3)), rng.normal(size=(6, 3))
    counts = np.array([1, 3, 0, 2, 1, 4])
    a = align(x, y, with_scale=True, weights=counts * 1e300)
    b = align(np.repeat(x, counts, 0), np.repeat(y, counts, 0), with_scale=True)
    for name in ("scale", "R_target_source", "t_target_source", "rmse"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-12, atol=1e-13)


LINE = np.linspace(0, 5, 9)[:, None] * [1.0, 2.0, -1.0] + [7.0, 0.0, 1.0]


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_points_on_a_line_are_flagged_and_still_aligned(offset: float) -> None:
    rng = np.random.default_rng(6)
    R = random_rotation(rng, 3)
    found = align(LINE + offset, 2 * LINE @ R.T, with_scale=True)
    assert "on one line" in found.reason
    assert not found.unique
    assert found.scale_known
    assert found.scale == pytest.approx(2.0, rel=1e-9)
    assert np.linalg.det(found.R_target_source) == pytest.approx(1.0, abs=1e-14)
    # coordinates of 1e6 are rounded to 1e-10
    assert found.rmse < 1e-13 * (1 + 10 * offset)


def test_a_hair_beside_the_line_is_enough() -> None:
    bent = LINE + 1e-4 * np.sin(np.arange(9))[:, None] * [0, 1.0, 2.0]
    R = random_rotation(np.random.default_rng(7), 3)
    found = align(bent, bent @ R.T)
    assert found.unique
    # singular values of C differ by 1e10 here: a turn about the line is known to 1e-16 * 1e10
    assert np.abs(found.R_target_source - R).max() < 1e-5


def test_a_line_in_the_plane_is_enough() -> None:
    found = align([[0, 0], [1, 0]], [[5, 5], [5, 6]])
    assert found.unique
    np.testing.assert_allclose(found.R_target_source, [[0, -1], [1, 0]], atol=1e-15)


@pytest.mark.parametrize("place", [0.0, 1e6 + 1 / 3])
@pytest.mark.parametrize(
    ("still", "word"), [("source", "source lie"), ("target", "target lie"), ("both", "and")]
)
def test_points_at_one_place_are_flagged(place: float, still: str, word: str) -> None:
    rng = np.random.default_rng(8)
    at, moving = np.full((7, 3), place), rng.normal(size=(7, 3))
    pair = {"source": (at, moving), "target": (moving, at), "both": (at, at + 1)}[still]
    found = align(*pair, with_scale=True)
    assert word in found.reason
    assert not found.scale_known
    assert found.scale == 1.0
    np.testing.assert_array_equal(found.R_target_source, np.eye(3))
    np.testing.assert_allclose(found.act(pair[0]).mean(0), pair[1].mean(0), atol=1e-9)


def test_an_ambiguous_mirror_image_is_flagged() -> None:
    """The octahedron mirrored at the origin: turned by half about any axis it fits equally badly."""
    corners = np.vstack([np.eye(3), -np.eye(3)])
    found = align(corners, -corners)
    assert "mirror image" in found.reason
    square = np.array([[1.0, 0], [0, 1], [-1, 0], [0, -1]])
    assert not align(square, square * [1, -1]).unique


def test_uncorrelated_sets_are_flagged() -> None:
    """The target has no linear relation to the source: C vanishes though both sets move."""
    x = np.array([[1.0, 0], [-1, 0], [0, 0], [0, 0]])
    y = np.array([[0.0, 0], [0, 0], [0, 1], [0, -1]])
    assert "uncorrelated" in align(x, y).reason


def test_the_inverse_problem_has_the_inverse_motion() -> None:
    rng = np.random.default_rng(9)
    x, y = rng.normal(size=(8, 3)), rng.normal(size=(8, 3))
    there, back = align(x, y), align(y, x)
    np.testing.assert_allclose(back.act(there.act(x)), x, atol=1e-12)


@pytest.mark.parametrize(
    ("source", "target", "weights", "words"),
    [
        (np.zeros((3, 3)), np.zeros((4, 3)), None, r"\(3, 3\) and target \(4, 3\): need"),
        (np.zeros((3, 4)), np.zeros((3, 4)), None, "need"),
        (np.zeros((0, 3)), np.zeros((0, 3)), None, "N >= 1"),
        (np.zeros(3), np.zeros(3), None, "need"),
        ([[0, 0], [np.nan, 1]], [[0, 0], [1, 1]], None, "source point 1 is .*nan.*: need finite"),
        ([[0, 0], [1, 1]], [[0, 0], [1, np.inf]], None, "target point 1"),
        ([[0, 0], [1e200, 1]], [[0, 0], [1, 1]], None, "source point 1 .* below 1e"),
        ([[0, 0], [1, 1]], [[0, 0], [1, 1]], [1, 2, 3], "one for each pair"),
        ([[0, 0], [1, 1]], [[0, 0], [1, 1]], [1, -1], "not negative"),
        ([[0, 0], [1, 1]], [[0, 0], [1, 1]], [0, 0], "one of them positive"),
        ([[0, 0], [1, 1]], [[0, 0], [1, 1]], [1, np.nan], "finite"),
    ],
)
def test_wrong_input_is_told(source: object, target: object, weights: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        align(source, target, weights=weights)  # type: ignore[arg-type]


def test_a_transposed_rotation_would_be_noticed() -> None:
    """U and V exchanged give R^T, and an error that these tests see."""
    rng = np.random.default_rng(10)
    x, R = rng.normal(size=(20, 3)), random_rotation(rng, 3)
    found = align(x, x @ R.T)
    wrong = Alignment(1.0, found.R_target_source.T, found.t_target_source, 0.0, "", True)
    assert np.abs(found.act(x) - x @ R.T).max() < 1e-13
    assert np.abs(wrong.act(x) - x @ R.T).max() > 0.1


def test_triangles_at_once_are_triangles_one_by_one() -> None:
    """Noisy triangles: nothing fits exactly, so only the smallest cost is the answer of both."""
    rng = np.random.default_rng(11)
    x = rng.normal(size=(4, 5, 3, 3)) + 3
    y = 2.5 * x @ random_rotation(rng, 3).T + 0.3 * rng.normal(size=x.shape) - 7
    found = align_triples(x, y)
    assert found.valid.all()
    for k in np.ndindex(4, 5):
        one = align(x[k], y[k], with_scale=True)
        S = found.S_target_source[k]
        # the same decomposition, of triangles whose sides differ by less than a hundred
        np.testing.assert_allclose(S[:3, :3], one.scale * one.R_target_source, rtol=0, atol=1e4 * EPS)
        np.testing.assert_allclose(S[:3, 3], one.t_target_source, rtol=0, atol=1e5 * EPS)
        assert np.linalg.det(S[:3, :3]) > 0
        np.testing.assert_array_equal(S[3], [0, 0, 0, 1])


def test_triangles_that_determine_nothing_are_named() -> None:
    rng = np.random.default_rng(12)
    good, line, place = rng.normal(size=(3, 3)), LINE[:3], np.full((3, 3), 1e6 + 1 / 3)
    nan = np.where(np.eye(3) > 0, np.nan, good)
    hair = LINE[[0, 3, 7]] + 1e-3 * np.array([[0, 0, 0], [1.0, 0, 0], [0, 0, 0]])
    source = np.array([good, line, good, place, good, nan, hair])
    target = np.array([good, good, line, good, place, good, hair])
    found = align_triples(source, target)
    assert found.reason.tolist() == ["", "one line", "one line", "one place", "one place", "not finite", ""]
    np.testing.assert_array_equal(found.S_target_source[1:6], np.broadcast_to(np.eye(4), (5, 4, 4)))
    with pytest.raises(ValueError, match="need the same shape"):
        align_triples(source, target[:3])
