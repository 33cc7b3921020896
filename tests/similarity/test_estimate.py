"""The similarity of two keyframes: exact, the same as the book's, and better than the closed form of all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vslam_ref.estimation.robust import tuned
from vslam_ref.estimation.similarity import (
    LIMIT,
    PointMatches,
    agreeing,
    book,
    both_images,
    estimate_similarity,
    refine_similarity,
    squared,
)
from vslam_ref.estimation.similarity.estimate import distance_spread
from vslam_ref.geometry import sim3, so3
from vslam_ref.geometry.alignment import align, align_triples
from vslam_ref.geometry.drawing import different_numbers
from vslam_ref.worlds.keyframe_pair import make_keyframe_pair

EPS = float(np.finfo(float).eps)


def turned(S: np.ndarray, true: np.ndarray) -> float:
    """Degrees between the rotations of two similarities."""
    return float(np.rad2deg(np.linalg.norm(so3.log_of_rotation(sim3.rotation(S) @ sim3.rotation(true).T))))


def closed_form(matches: PointMatches) -> np.ndarray:
    found = align(matches.X_a, matches.X_b, with_scale=True)
    return sim3.from_srt(found.scale, found.R_target_source, found.t_target_source)


def best_sample(matches: PointMatches, rng: np.random.Generator, draws: int = 300) -> np.ndarray:
    rows = different_numbers(rng, draws, len(matches), 3)
    tried = align_triples(matches.X_a[rows], matches.X_b[rows]).S_target_source
    return tried[np.argmin(np.minimum(squared(tried, matches), LIMIT).mean((-2, -1)))]


@pytest.mark.parametrize("wrong", [0.0, 0.5, 0.7])
def test_exact_points_give_the_exact_similarity_and_name_the_wrong_matches(wrong: float) -> None:
    pair = make_keyframe_pair(np.random.default_rng(1), wrong=wrong, depth_noise=0.0, sigma_px=0.0)
    found = estimate_similarity(pair.matches, np.random.default_rng(2))
    assert found.reason == ""
    # pixels below 1e3 are rounded to 1e-13, and 60 matches or more at 500 pixels a radian fix the answer:
    # 1e-13 / 500 times the depth of 9 and a condition of some ten
    np.testing.assert_allclose(found.S_b_a, pair.S_b_a, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(found.inliers, pair.right)


def test_the_fast_form_is_the_books() -> None:
    pair = make_keyframe_pair(np.random.default_rng(4), count=40, wrong=0.3)
    m = replace(pair.matches, sigma_a=1.2 ** (np.arange(40) % 4), sigma_b=1.2 ** (np.arange(40) % 3))
    rows = different_numbers(np.random.default_rng(9), 25, 40, 3)
    S, refined, members = book.similarity(m, rows, LIMIT, tuned("huber").c)
    triples = align_triples(m.X_a[rows], m.X_b[rows])
    assert triples.valid.all()
    costs = np.minimum(squared(triples.S_target_source, m), LIMIT).mean((-2, -1))
    # a quaternion and a decomposition: some eps times the condition of a triangle, below 1e3, times 10 m
    np.testing.assert_allclose(triples.S_target_source[np.argmin(costs)], S, rtol=0, atol=1e-11)
    np.testing.assert_allclose(costs.min(), book.cost(S, m, LIMIT), rtol=1e-9)
    assert np.flatnonzero(agreeing(S, m)).tolist() == members
    fast = refine_similarity(m.only(np.array(members)), S)
    assert fast.converged
    # both minimise one sum: the gradient's cosine below 1e-10 is a step of 1e-10 of some metres, times the
    # condition of the scale
    np.testing.assert_allclose(fast.x, refined, rtol=0, atol=1e-7)


def test_no_change_of_the_answer_costs_less() -> None:
    pair = make_keyframe_pair(np.random.default_rng(5), wrong=0.0)
    found = refine_similarity(pair.matches, closed_form(pair.matches))
    rng = np.random.default_rng(6)

    spread, c = distance_spread(closed_form(pair.matches), pair.matches), tuned("huber").c

    def cost(S: np.ndarray) -> float:
        m = pair.matches
        uv = both_images(S, m.X_a, m.X_b, camera=m.camera)
        images = (uv - np.concatenate([m.uv_b, m.uv_a], 1)).ravel()  # sigma is 1
        there = np.linalg.norm(sim3.act(S, m.X_a), axis=1) / np.linalg.norm(m.X_b, axis=1)
        r = np.abs(np.concatenate([images, np.log(there) / spread]))
        return float(np.where(r <= c, r * r / 2, c * r - c * c / 2).sum())

    least = cost(found.x)
    for size in (1e-3, 1e-2, 0.1):
        for _ in range(20):
            step = size * rng.standard_normal(7)
            assert cost(sim3.perturb(found.x, step)) > least


def test_the_closed_form_of_all_that_agree_is_worse_than_reprojection() -> None:
    """60 % wrong matches, depths known to 5 %.  Distances in space are mostly errors in depth, and pull at
    the rotation with the lever arm of the depth: medians over twelve pairs."""
    rows = []
    for seed in range(12):
        pair = make_keyframe_pair(np.random.default_rng(seed), wrong=0.6, depth_noise=0.05)
        sample = best_sample(pair.matches, np.random.default_rng(100 + seed))
        found = estimate_similarity(pair.matches, np.random.default_rng(100 + seed))
        again = closed_form(pair.matches.only(agreeing(sample, pair.matches)))
        rows.append([turned(S, pair.S_b_a) for S in (sample, again, found.S_b_a)])
    one, all_of_them, refined = np.median(rows, axis=0)
    print(f"sample {one:.2f}, closed form of all {all_of_them:.2f}, by reprojection {refined:.2f} degrees")
    assert all_of_them > 1.2 * one
    assert refined < 0.5 * one
    # in each single pair, by a sign test of 12: at least 11 has a null rate of 3e-3
    assert sum(row[2] < row[1] for row in rows) >= 11


def test_where_both_cameras_stand_at_one_place_the_distances_tell_the_scale() -> None:
    """Images alone leave the scale as the sample had it; 60 distances of 5 % each know it to 0.9 %."""
    off = []
    for seed in range(12):
        pair = make_keyframe_pair(np.random.default_rng(seed), count=100, wrong=0.4, depth_noise=0.05)
        S, m = sim3.from_srt(1.35, np.eye(3), np.zeros(3)), pair.matches
        # the same rays from b as from a: b stands where a does, turned by nothing, in another unit
        m = replace(
            m,
            X_b=1.35
            * m.X_a
            * (np.linalg.norm(m.X_b, axis=1) / np.linalg.norm(sim3.act(pair.S_b_a, m.X_a), axis=1))[:, None],
            uv_b=m.uv_a,
        )
        m = m.only(pair.right)
        found = refine_similarity(m, sim3.perturb(S, [0, 0, 0, 0, 0, 0, 0.15]))
        off.append(np.log(sim3.scale(found.x) / 1.35))
    # two noises of 5 %, 60 matches: 0.05 sqrt(2) / sqrt(60) = 0.009; four of them, twelve times: 8e-4
    assert np.abs(off).max() < 4 * 0.05 * np.sqrt(2 / 60)


def test_honest_matches_agree_as_often_as_chi_square_says() -> None:
    """Exact points and noisy pixels: each squared error is chi-square of two degrees: 0.99 are below 9.21."""
    rng, n = np.random.default_rng(50), 4000
    pair = make_keyframe_pair(rng, count=n, wrong=0.0, depth_noise=0.0, sigma_px=0.0)
    m, sigma = pair.matches, 1.2 ** (np.arange(n) % 8)
    noisy = [uv + sigma[:, None] * rng.standard_normal((n, 2)) for uv in (m.uv_a, m.uv_b)]
    m = replace(m, uv_a=noisy[0], uv_b=noisy[1], sigma_a=sigma, sigma_b=sigma)
    share = agreeing(pair.S_b_a, m).mean()
    # four deviations of a binomial share, two-sided: false alarm 6e-5
    assert abs(share - 0.99**2) < 4 * np.sqrt(0.98 * 0.02 / n)


def test_octaves_widen_the_limit() -> None:
    pair = make_keyframe_pair(np.random.default_rng(7), count=20, wrong=0.0, depth_noise=0.0, sigma_px=0.0)
    uv = pair.matches.uv_b.copy()
    uv[:, 0] += 4.0
    fine = replace(pair.matches, uv_b=uv, sigma_a=np.array(1.0), sigma_b=np.array(1.0))
    assert not agreeing(pair.S_b_a, fine).any()  # 16 > 9.21
    coarse = replace(fine, sigma_b=np.array(1.44))
    assert agreeing(pair.S_b_a, coarse).all()  # 16 / 2.07 = 7.7
    other = replace(fine, sigma_a=np.array(1.44))
    assert not agreeing(pair.S_b_a, other).any()  # the other keyframe's octave is no excuse


def test_a_match_must_agree_both_ways() -> None:
    """A point behind one camera, or right in one picture only, is no inlier."""
    pair = make_keyframe_pair(np.random.default_rng(8), count=20, wrong=0.0, depth_noise=0.0, sigma_px=0.0)
    X_b, uv_a = pair.matches.X_b.copy(), pair.matches.uv_a.copy()
    X_b[0] = -X_b[0]
    uv_a[1] += 5.0
    m = replace(pair.matches, X_b=X_b, uv_a=uv_a)
    assert np.flatnonzero(~agreeing(pair.S_b_a, m)).tolist() == [0, 1]
    images = both_images(pair.S_b_a, m.X_a, m.X_b, camera=m.camera)
    assert np.isnan(images[0]).tolist() == [False, False, True, True]


def test_what_determines_nothing_is_told() -> None:
    pair = make_keyframe_pair(np.random.default_rng(9), count=30, wrong=0.0)
    m, rng = pair.matches, np.random.default_rng(0)
    assert estimate_similarity(m.only(np.arange(2)), rng).reason == "2 matches: a similarity needs 3"
    line = m.X_a[0] + np.linspace(0, 1, 30)[:, None] * [1.0, 0.5, 0.2]
    found = estimate_similarity(replace(m, X_a=line), rng)
    assert found.reason == "all 300 samples lie on one line or at one place"
    assert not found.inliers.any()
    order = rng.permutation(30)
    mixed = replace(m, X_b=m.X_b[order], uv_b=rng.uniform(0, 480, (30, 2)))
    assert "agree with the best of 300 samples, need 6" in estimate_similarity(mixed, rng).reason
    for words, change in (
        ("X_b has shape", {"X_b": m.X_b[:5]}),
        (r"uv_a\[3\] is", {"uv_a": np.where(np.arange(30)[:, None] == 3, np.nan, m.uv_a)}),
        ("sigma_b must be", {"sigma_b": np.array(0.0)}),
    ):
        with pytest.raises(ValueError, match=words):
            replace(m, **change)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="at least 1 draw"):
        estimate_similarity(m, rng, draws=0)


def test_the_same_seed_gives_the_same_bytes() -> None:
    pair = make_keyframe_pair(np.random.default_rng(10))
    a, b = (estimate_similarity(pair.matches, np.random.default_rng(1)) for _ in range(2))
    assert a.S_b_a.tobytes() == b.S_b_a.tobytes()
