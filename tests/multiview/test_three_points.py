"""P3P: all solutions and nothing else.  Oracle: one quartic by a resultant, its roots at forty digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from vslam_ref.geometry import se3, so3
from vslam_ref.geometry.multiview import p3p


def unit(X: np.ndarray) -> np.ndarray:
    return X / np.linalg.norm(X, axis=-1, keepdims=True)


def problems(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bearings, points and the poses that made them."""
    rng = np.random.default_rng(seed)
    T = se3.random(rng, (count,), spread=3.0)
    X_cam = rng.normal(size=(count, 3, 3)) + [0, 0, 4]
    X_cam[..., 2] = np.abs(X_cam[..., 2]) + 0.3
    return unit(X_cam), se3.act(se3.inverse(T)[:, None], X_cam), T


def distances_by_the_quartic(b: np.ndarray, X: np.ndarray) -> list[list[float]]:
    """Grunert's way: with u = d2/d1, v = d3/d1 two quadratics in v; their resultant is a quartic in u."""
    with mpmath.workdps(40):
        B, Y = mpmath.matrix(b.tolist()), mpmath.matrix(X.tolist())
        c = {(i, j): sum(B[i, k] * B[j, k] for k in range(3)) for i, j in ((0, 1), (0, 2), (1, 2))}
        for i, j in c:  # the bearings' rounding must not matter: exact cosines of the given vectors
            c[i, j] /= mpmath.sqrt(sum(B[i, k] ** 2 for k in range(3)) * sum(B[j, k] ** 2 for k in range(3)))
        a = {(i, j): sum((Y[i, k] - Y[j, k]) ** 2 for k in range(3)) for i, j in c}
        one = [mpmath.mpf(1), -2 * c[0, 1], mpmath.mpf(1)]  # 1 - 2 u c12 + u^2, rising
        k1, k2 = a[0, 2] / a[0, 1], a[1, 2] / a[0, 1]
        p1, p0 = [-2 * c[0, 2]], add([mpmath.mpf(1)], one, -k1)
        q1, q0 = [mpmath.mpf(0), -2 * c[1, 2]], add([0, 0, mpmath.mpf(1)], one, -k2)
        f, g = add(p0, q0, -1), add(p1, q1, -1)
        quartic = add(add(mul(f, f), mul(p1, mul(f, g)), -1), mul(p0, mul(g, g)), 1)
        found = []
        for u in mpmath.polyroots(quartic[::-1], maxsteps=500, extraprec=400):
            if abs(mpmath.im(u)) > 1e-25 or mpmath.re(u) <= 0:
                continue
            u = mpmath.re(u)
            v = -value(f, u) / value(g, u)
            d1 = mpmath.sqrt(a[0, 1] / value(one, u))
            if v > 0:
                found.append([float(d1), float(u * d1), float(v * d1)])
    return sorted(found)


def add(p: list, q: list, factor) -> list:
    n = max(len(p), len(q))
    return [(p[k] if k < len(p) else 0) + factor * (q[k] if k < len(q) else 0) for k in range(n)]


def mul(p: list, q: list) -> list:
    out = [mpmath.mpf(0)] * (len(p) + len(q) - 1)
    for i, x in enumerate(p):
        for j, y in enumerate(q):
            out[i + j] += x * y
    return out


def value(p: list, u):
    return sum(x * u**k for k, x in enumerate(p))


def test_the_pose_that_made_the_picture_is_among_the_answers() -> None:
    b, X, T = problems(2000, 0)
    found = p3p(b, X)
    error = np.abs(found.T_cam_world - T[:, None]).max(axis=(2, 3))
    nearest = np.where(found.valid, error, np.inf).min(axis=1)
    # eps times coordinates of 10, divided by the sharpness of the solution, which falls to 1e-5 in 2000 draws
    assert nearest.max() < 1e-8
    assert np.median(nearest) < 1e-13
    assert set(found.reason) == {""}


def test_narrow_views_lose_digits_and_not_answers() -> None:
    """All within 0.01 radians: 1e-16 / 0.01^2 in the equations, over a sharpness of 1e-2 and less."""
    rng = np.random.default_rng(9)
    T = se3.random(rng, (1000,))
    X_cam = np.array([0.0, 0.0, 1.0]) + 0.01 * rng.uniform(-1, 1, (1000, 3, 3))
    found = p3p(unit(X_cam), se3.act(se3.inverse(T)[:, None], X_cam))
    error = np.where(found.valid, np.abs(found.T_cam_world - T[:, None]).max(axis=(2, 3)), np.inf).min(axis=1)
    assert np.median(error) < 1e-10
    assert error.max() < 1e-4


def test_every_answer_is_one() -> None:
    b, X, _ = problems(2000, 1)
    found = p3p(b, X)
    X_cam = se3.act(found.T_cam_world[:, :, None], X[:, None])
    assert np.abs(unit(X_cam) - b[:, None])[found.valid].max() < 1e-9  # on the rays, and in front
    R = found.T_cam_world[..., :3, :3]
    np.testing.assert_allclose(R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-14)
    assert (np.linalg.det(R) > 0).all()
    np.testing.assert_array_equal(
        found.T_cam_world[~found.valid], np.broadcast_to(np.eye(4), ((~found.valid).sum(), 4, 4))
    )


@pytest.mark.parametrize("related", [True, False])
def test_no_answer_is_missing_and_none_is_counted_twice(related: bool) -> None:
    """Also where bearings and triangle have nothing to do with each other, and mostly nothing fits."""
    b, X, _ = problems(60, 2)
    if not related:
        b = unit(np.random.default_rng(2).normal(size=b.shape))
    found = p3p(b, X)
    counts = set()
    for n in range(len(b)):
        centre = -np.einsum("sji,sj->si", found.T_cam_world[n, :, :3, :3], found.T_cam_world[n, :, :3, 3])
        mine = sorted(np.linalg.norm(X[n] - c, axis=1).tolist() for c in centre[found.valid[n]])
        wanted = distances_by_the_quartic(b[n], X[n])
        assert len(mine) == len(wanted)
        np.testing.assert_allclose(mine, wanted, rtol=1e-8)
        assert found.reason[n] == ("" if wanted else "no real solution")
        counts.add(len(mine))
    assert counts >= ({1, 2, 4} if related else {0, 1, 2})


def test_four_known_answers() -> None:
    """Equal sides 2 sqrt 3 seen under equal angles with the cosine 5/8: four triangles of legs 4 and 1."""
    X = 2 * np.array([[np.cos(a), np.sin(a), 0.0] for a in 2 * np.pi / 3 * np.arange(3)])
    d = np.sqrt(16 - 4)  # the centre stands above the middle at this height, all legs 4
    T = se3.from_rt(so3.exp([np.pi, 0, 0]), [0.0, 0.0, d])
    b = unit(se3.act(T, X))
    assert b[0] @ b[1] == pytest.approx(5 / 8)
    found = p3p(b[None], X[None])
    centre = -np.einsum("sji,sj->si", found.T_cam_world[0, :, :3, :3], found.T_cam_world[0, :, :3, 3])
    legs = sorted(tuple(np.linalg.norm(X - c, axis=1).round(9).tolist()) for c in centre)
    assert found.valid.all()
    assert legs == [(1.0, 4.0, 4.0), (4.0, 1.0, 4.0), (4.0, 4.0, 1.0), (4.0, 4.0, 4.0)]


def test_opencv_has_the_same_answers() -> None:
    cv2 = pytest.importorskip("cv2")
    b, X, _ = problems(200, 3)
    found = p3p(b, X)
    compared = 0
    for n in range(200):
        xn = b[n, :, :2] / b[n, :, 2:]
        _, rotations, translations = cv2.solveP3P(
            X[n][:, None], xn[:, None], np.eye(3), None, flags=cv2.SOLVEPNP_AP3P
        )
        for rotation, t in zip(rotations, translations, strict=True):
            T = se3.from_rt(so3.exp(rotation.ravel()), t.ravel())
            X_cam = se3.act(T, X[n])
            if np.abs(unit(X_cam) - b[n]).max() < 1e-6:  # OpenCV returns some that are not
                mine = found.T_cam_world[n][found.valid[n]]
                assert np.abs(mine - T).max(axis=(1, 2)).min() < 1e-4
                compared += 1
    assert compared > 300


def test_on_the_danger_cylinder_the_answer_is_blunt_and_says_so() -> None:
    """The centre on the upright cylinder through the three points: a double solution, half of the digits."""
    angles = np.array([0.3, 2.0, 4.4])
    X = np.stack([np.cos(angles), np.sin(angles), 0 * angles], 1)
    on, off = (se3.from_rt(so3.exp([2.6, 0.1, 0.2]), np.zeros(3)) for _ in range(2))
    on[:3, 3] = -on[:3, :3] @ [np.cos(1.0), np.sin(1.0), 3.0]
    off[:3, 3] = -off[:3, :3] @ [0.2 * np.cos(1.0), 0.2 * np.sin(1.0), 3.0]
    for T, least, most, digits in ((on, 0.0, 1e-6, 1e-6), (off, 1e-3, 1.0, 1e-12)):
        found = p3p(unit(se3.act(T, X))[None], X[None])
        error = np.where(found.valid[0], np.abs(found.T_cam_world[0] - T).max(axis=(1, 2)), np.inf)
        assert error.min() < digits
        assert least <= found.sharpness[0, np.argmin(error)] < most


TRIANGLE = np.array([[0.0, 0.0, 4.0], [1.0, 0.0, 5.0], [0.0, 2.0, 6.0]])


@pytest.mark.parametrize(
    ("X", "b", "words"),
    [
        (np.array([[0, 0, 4], [1, 1, 5], [2, 2, 6.0]]), None, "the points lie on one line"),
        (TRIANGLE[[0, 1, 1]], None, "two points are the same"),
        (TRIANGLE, unit(TRIANGLE)[[0, 1, 1]], "two bearings are the same"),
    ],
)
def test_hopeless_problems_are_named(X: np.ndarray, b: np.ndarray | None, words: str) -> None:
    b = unit(X) if b is None else b
    fine, Y, _ = problems(1, 4)
    found = p3p(np.stack([b, fine[0]]), np.stack([X, Y[0]]))
    assert found.reason == (words, "")  # and the neighbour in the batch does not suffer
    assert not found.valid[0].any()
    assert np.isfinite(found.T_cam_world).all()


@pytest.mark.parametrize(
    ("b", "X", "words"),
    [
        (unit(TRIANGLE), TRIANGLE, "need"),
        (unit(TRIANGLE)[None], np.full((1, 3, 3), np.nan), "must be finite"),
        (TRIANGLE[None], TRIANGLE[None], "must be unit vectors"),
        (unit(TRIANGLE)[None, :2], TRIANGLE[None], "need"),
    ],
)
def test_bad_input_is_refused(b: np.ndarray, X: np.ndarray, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        p3p(b, X)
