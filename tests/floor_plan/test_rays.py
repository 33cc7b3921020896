"""Ray casting against closed forms, brute force and a second formulation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vslam_ref.worlds.floor_plan import cast
from vslam_ref.worlds.floor_plan.rays import disc_ranges, segment_ranges

EPS = float(np.finfo(float).eps)


def test_a_square_room_has_the_secants_ranges() -> None:
    """From the middle of a square of half side a the range is a / max(|cos|, |sin|), corners included."""
    a = 2.5
    corners = a * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    walls = np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1)
    angles = np.concatenate([np.linspace(-np.pi, np.pi, 721), np.pi / 4 + np.pi / 2 * np.arange(4)])
    expected = a / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    np.testing.assert_allclose(cast([0, 0], angles, walls, []).range, expected, rtol=8 * EPS)


def test_a_disc_is_met_at_the_smaller_root() -> None:
    """|t d - c| = r by the quadratic formula, in exact integers: 3-4-5 triangles."""
    # disc at (5, 0) of radius 3: the ray at angle asin(3/5) touches it at distance 4
    touch = np.arcsin(3 / 5)
    inside = touch - 1e-9
    assert disc_ranges([0, 0], [0.0], [[5, 0, 3]]) == pytest.approx(2.0, rel=4 * EPS)
    # near the tangent the range is 4 + O(sqrt(8 * 1e-9 * 4)): 5 cos - sqrt(9 - 25 sin^2)
    close = 5 * np.cos(inside) - np.sqrt(9 - 25 * np.sin(inside) ** 2)
    assert disc_ranges([0, 0], [inside], [[5, 0, 3]])[0, 0] == pytest.approx(close, rel=1e-10)
    assert np.isinf(disc_ranges([0, 0], [touch + 1e-9], [[5, 0, 3]])).all()
    assert np.isinf(disc_ranges([0, 0], [np.pi], [[5, 0, 3]])).all(), "behind the ray"
    assert disc_ranges([0, 0], [1.0], [[0.1, 0, 3]]) == 0.0, "from inside"


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_hits_lie_on_what_they_hit_and_nothing_is_before(seed: int) -> None:
    """The point at the range lies on the primitive; shortened rays touch none, by distances, not by rays."""
    rng = np.random.default_rng(seed)
    origin = rng.uniform(-1, 1, 2)
    segments = rng.uniform(-5, 5, (6, 4))
    discs = np.column_stack([rng.uniform(-5, 5, (4, 2)), rng.uniform(0.1, 0.5, 4)])
    discs = discs[np.hypot(*(discs[:, :2] - origin).T) > discs[:, 2]]
    angles = rng.uniform(-np.pi, np.pi, 12)
    hits = cast(origin, angles, segments, discs)
    for t, which, angle in zip(hits.range, hits.which, angles, strict=True):
        way = np.array([np.cos(angle), np.sin(angle)])
        if which < 0:
            assert np.isinf(t)
            continue
        gap = distances(origin + t * way, segments, discs)
        assert gap[which] < 1e-12 * (1 + t) ** 2 / sharpness(segments, discs, which, way)
        before = origin + np.linspace(0, 1, 50)[:-1, None] * t * way
        # sides of a thin thing may be jumped over by 49 places, so this only bounds the discs' insides
        assert all((distances(p, segments, discs)[len(segments) :] > -1e-9).all() for p in before)


def distances(p: np.ndarray, segments: np.ndarray, discs: np.ndarray) -> np.ndarray:
    """Distance from each segment (complex division), and signed distance from each disc's rim."""
    a, b = (segments[:, i] + 1j * segments[:, i + 1] for i in (0, 2))
    z = (p[0] + 1j * p[1] - a) / (b - a)
    to_segment = np.abs(z - np.clip(z.real, 0, 1)) * np.abs(b - a)
    return np.concatenate([to_segment, np.hypot(*(discs[:, :2] - p).T) - discs[:, 2]])


def sharpness(segments: np.ndarray, discs: np.ndarray, which: int, way: np.ndarray) -> float:
    """Sine of the angle between ray and segment: grazing rays amplify rounding; for a rim, a bound."""
    if which >= len(segments):
        return 1e-3
    e = segments[which, 2:] - segments[which, :2]
    return max(abs(way[0] * e[1] - way[1] * e[0]) / np.hypot(*e), 1e-9)


def test_no_ray_slips_through_a_shared_end() -> None:
    """A closed polygon seen from inside: every ray meets it, those aimed at its corners too."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        n = int(rng.integers(3, 9))
        angle = np.sort(rng.uniform(0, 2 * np.pi, n)) if n > 4 else 2 * np.pi * np.arange(n) / n
        corners = np.stack([np.cos(angle), np.sin(angle)], 1) * rng.uniform(0.5, 9, (n, 1))
        gaps = np.diff(np.append(angle, angle[0] + 2 * np.pi))
        if gaps.max() > 3.0:
            continue  # the origin may lie outside
        walls = np.concatenate([corners, np.roll(corners, -1, axis=0)], axis=1)
        aimed = np.arctan2(corners[:, 1], corners[:, 0])
        assert np.isfinite(cast([0, 0], aimed, walls, []).range).all()


def test_a_ray_along_a_segment_meets_its_nearer_end() -> None:
    assert segment_ranges([0, 0], [0.0], [[3, 0, 1, 0]]) == 1.0
    assert np.isinf(segment_ranges([0, 0], [0.0], [[-3, 0, -1, 0]])).all()
    assert segment_ranges([0, 0], [0.0], [[-3, 0, 1, 0]]) == 0.0


def test_nothing_to_meet() -> None:
    hits = cast([0, 0], [0.0, 1.0], np.zeros((0, 4)), np.zeros((0, 3)))
    assert np.isinf(hits.range).all()
    assert (hits.which == -1).all()
