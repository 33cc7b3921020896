"""What all five groups have in common: names, axioms, brackets, Jacobians, interpolation, chance."""

from __future__ import annotations

import inspect
from itertools import pairwise
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from vslam_ref.geometry import se2, se3, sim3, so2, so3
from vslam_ref.testing import assert_group_axioms, check_jacobian

EPS = float(np.finfo(float).eps)
GROUPS: dict[str, ModuleType] = {m.__name__.rpartition(".")[2]: m for m in (so2, se2, so3, se3, sim3)}
API = {
    "DOF", "identity", "matrix", "compose", "inverse", "between", "act", "exp", "log", "hat", "vee", "ad",
    "adjoint", "left_jacobian", "left_jacobian_inverse", "perturb", "interpolate", "random", "nearest",
}  # fmt: skip
WITH_JACOBIANS = {f"{name}_with_jacobians" for name in ("act", "compose", "between", "inverse", "log")}
AXIS = np.array([0.36, -0.48, 0.8])
ANGLES = (0.0, 1e-9, 0.3, 1 - EPS, 1 + EPS, -2.0, np.pi - 1e-7, np.pi)
everyone = pytest.mark.parametrize("name", GROUPS)


def tangents(name: str) -> np.ndarray:
    """Tangent vectors of all kinds, shape (N, DOF) or, for SO(2), (N,)."""
    rng = np.random.default_rng(7)
    turns = np.array([angle * AXIS for angle in ANGLES])
    rho = rng.normal(0, 3, (len(ANGLES), 3))
    sigma = np.array([0.0, -1e-9, 0.9, 0.0, 1e-9, -1.5, 0.4, 0.0])[:, None]
    return {
        "so2": np.array(ANGLES),
        "se2": np.column_stack([rho[:, :2], ANGLES]),
        "so3": turns,
        "se3": np.hstack([rho, turns]),
        "sim3": np.hstack([rho, turns, sigma]),
    }[name]


def columns(group: Any) -> Any:
    """SO(2) with tangent vectors of one number, as the generic checks want them; others as they are."""
    if group is not so2:
        return group
    same = {name: getattr(so2, name) for name in API - {"exp", "log"}}
    return SimpleNamespace(
        **same, exp=lambda xi: so2.exp(np.asarray(xi)[..., 0]), log=lambda R: so2.log(R)[..., None]
    )


@everyone
def test_all_groups_offer_the_same_names(name: str) -> None:
    group = GROUPS[name]
    wanted = API | (WITH_JACOBIANS if name != "so2" else set())
    assert wanted <= set(vars(group))
    for function in wanted - {"DOF"}:
        arguments = list(inspect.signature(getattr(group, function)).parameters)
        model = list(inspect.signature(getattr(se3, function)).parameters)
        extra = {"project"} if name != "se2" else set()  # pose vectors are never off the group
        extra |= {"sim3": {"log_scale"}, "so2": {"spread"}, "so3": {"spread"}}.get(name, set())
        assert len(set(arguments) - extra) == len(set(model) - extra - {"project"}), function


@everyone
def test_group_axioms(name: str) -> None:
    group = GROUPS[name]
    samples = group.exp(tangents(name))
    random = group.random(np.random.default_rng(3), (4,))
    assert assert_group_axioms(columns(group), np.concatenate([samples, random])) <= 1


@everyone
def test_exp_is_the_matrix_exponential_of_hat(name: str) -> None:
    """SciPy's exponential: some eps times the norm, here below 20."""
    group = GROUPS[name]
    for xi in tangents(name):
        np.testing.assert_allclose(group.matrix(group.exp(xi)), expm(group.hat(xi)), rtol=0, atol=2e-14 * 20)


@everyone
def test_vee_undoes_hat(name: str) -> None:
    group, xi = GROUPS[name], tangents(name)
    # the mean of three equal numbers, in Sim(3), may be an ulp off
    np.testing.assert_allclose(group.vee(group.hat(xi)), xi, rtol=2 * EPS, atol=0)


@everyone
def test_ad_is_the_bracket_of_matrices(name: str) -> None:
    group, xi = GROUPS[name], tangents(name)
    for a, b in zip(xi, xi[::-1], strict=True):
        A, B = group.hat(a), group.hat(b)
        found = group.ad(a) @ np.atleast_1d(b)
        np.testing.assert_allclose(
            np.atleast_1d(group.vee(A @ B - B @ A)),
            found,
            rtol=0,
            atol=32 * EPS * (1 + np.abs(xi).max() ** 2),
        )


@everyone
def test_adjoint_of_exp_is_the_exponential_of_ad(name: str) -> None:
    group = GROUPS[name]
    for xi in tangents(name):
        Ad = expm(group.ad(xi))
        np.testing.assert_allclose(group.adjoint(group.exp(xi)), Ad, rtol=0, atol=1e-13 * np.linalg.norm(Ad))


@everyone
def test_left_jacobian_is_left_and_the_derivative_of_exp(name: str) -> None:
    """Exp(xi + d) = Exp(J d) Exp(xi); the right Jacobian, J(-xi), is refused where turns do not commute."""
    group = columns(GROUPS[name])
    xi = np.atleast_2d(tangents(name).T).T[5]

    def moved(v: np.ndarray) -> np.ndarray:
        return group.log(group.compose(group.exp(v), group.inverse(group.exp(xi))))

    J = GROUPS[name].left_jacobian(xi if name != "so2" else xi[0])
    check_jacobian(moved, xi, J, roundings=400)  # products of translations up to 10
    if name != "so2":
        with pytest.raises(AssertionError, match="Jacobian entry"):
            check_jacobian(moved, xi, GROUPS[name].left_jacobian(-xi), roundings=400)


@everyone
def test_left_jacobian_inverse_is_one(name: str) -> None:
    group, xi = GROUPS[name], tangents(name)
    J = group.left_jacobian(xi)
    off = np.abs(J @ group.left_jacobian_inverse(xi) - np.eye(group.DOF)).max((-2, -1))
    assert (off <= 16 * EPS * np.linalg.cond(J)).all()


@everyone
def test_act_is_the_homogeneous_product_and_composes(name: str) -> None:
    group = GROUPS[name]
    rng = np.random.default_rng(5)
    a, b = group.random(rng, (6,)), group.random(rng, (6,))
    n = 2 if name in ("so2", "se2") else 3
    x = rng.normal(size=(6, n))
    M = group.matrix(a)
    homogeneous = np.concatenate([x, np.ones((6, 1))], -1)[:, : M.shape[-1]]
    expected = np.einsum("nij,nj->ni", M, homogeneous)[:, :n]
    np.testing.assert_allclose(group.act(a, x), expected, rtol=0, atol=16 * EPS * 10)
    twice = group.act(a, group.act(b, x))
    np.testing.assert_allclose(group.act(group.compose(a, b), x), twice, rtol=0, atol=32 * EPS * 100)


@everyone
def test_perturbation_is_from_the_left(name: str) -> None:
    group = GROUPS[name]
    a = group.random(np.random.default_rng(6))
    xi = tangents(name)[2]
    left = group.matrix(group.exp(xi)) @ group.matrix(a)
    np.testing.assert_allclose(group.matrix(group.perturb(a, xi)), left, rtol=0, atol=64 * EPS * 10)


@everyone
def test_interpolation_is_constant_velocity_from_end_to_end(name: str) -> None:
    group = GROUPS[name]
    rng = np.random.default_rng(8)
    a, b = group.random(rng), group.random(rng)
    close = {"rtol": 0, "atol": 256 * EPS * 10}
    M = [group.matrix(group.interpolate(a, b, f)) for f in (0.0, 0.25, 0.5, 0.75, 1.0)]
    np.testing.assert_allclose(M[0], group.matrix(a), **close)
    np.testing.assert_allclose(M[4], group.matrix(b), **close)
    step = np.linalg.solve(M[0], M[1])
    for before, after in pairwise(M):
        np.testing.assert_allclose(np.linalg.solve(before, after), step, **close)
    # the same curve from the left: Exp(f Log(b a^-1)) a
    whole = group.log(group.compose(b, group.inverse(a)))
    np.testing.assert_allclose(group.matrix(group.perturb(a, whole / 4)), M[1], **close)


@everyone
def test_nearest_of_an_element_is_itself_and_noise_is_taken_off(name: str) -> None:
    group = GROUPS[name]
    rng = np.random.default_rng(9)
    a = group.random(rng, (5,))
    M = group.matrix(a)
    np.testing.assert_allclose(group.matrix(group.nearest(M)), M, rtol=0, atol=32 * EPS * np.abs(M).max())
    n = 2 if name in ("so2", "se2") else 3
    noisy = M.copy()
    noisy[:, :n, :n] += 0.1 * rng.normal(size=(5, n, n))
    best = group.matrix(group.nearest(noisy))
    distance = np.linalg.norm(best - noisy, axis=(1, 2))
    for _ in range(200):  # no element nearby is nearer
        step = 1e-3 * rng.normal(size=group.DOF)
        other = group.matrix(group.perturb(group.nearest(noisy), step[0] if name == "so2" else step))
        assert (np.linalg.norm(other - noisy, axis=(1, 2)) >= distance - 1e-15).all()


@everyone
def test_random_elements_are_uniform_and_belong_to_the_generator(name: str) -> None:
    """Mean of M rotation matrices: its entries have variance 1/d / M; 5 sigma, 5e-6 false alarms."""
    group = GROUPS[name]
    M = 20000
    T = group.matrix(group.random(np.random.default_rng(11), (M,)))
    d = 2 if name in ("so2", "se2") else 3
    R = T[:, :d, :d] / (np.linalg.norm(T[:, :d, :d], axis=(1, 2), keepdims=True) / np.sqrt(d))
    assert np.abs(np.linalg.det(R) - 1).max() < 16 * EPS
    assert np.abs(R.mean(0)).max() < 5 / np.sqrt(d * M)
    again = group.random(np.random.default_rng(11), (M,))
    assert np.array_equal(group.matrix(again), T)
    if T.shape[-1] > d:
        assert np.abs(T[:, :d, d].std(0) - 1).max() < 5 / np.sqrt(2 * M)


@everyone
@pytest.mark.parametrize("batch", [(), (1,), (3, 1, 2)])
def test_batches_are_the_single_results(name: str, batch: tuple[int, ...]) -> None:
    group = GROUPS[name]
    rng = np.random.default_rng(3)
    a, b = group.random(rng, batch), group.random(rng, batch)
    xi, f = group.log(a), rng.uniform(size=batch)
    x = rng.normal(size=(*batch, 2 if name in ("so2", "se2") else 3))
    cases: dict[str, tuple[np.ndarray, ...]] = {
        "matrix": (a,), "compose": (a, b), "inverse": (a,), "between": (a, b), "act": (a, x), "exp": (xi,),
        "log": (a,), "hat": (xi,), "vee": (group.hat(xi),), "ad": (xi,), "adjoint": (a,),
        "left_jacobian": (xi,), "left_jacobian_inverse": (xi,),
        "perturb": (a, xi), "interpolate": (a, b, f),
        "nearest": (group.matrix(a),),
    }  # fmt: skip
    assert set(cases) | {"identity", "random", "DOF"} == API
    for function, arguments in cases.items():
        many = getattr(group, function)(*arguments)
        assert many.shape[: len(batch)] == batch, function
        for i in np.ndindex(batch):
            one = getattr(group, function)(*(v[i] for v in arguments))
            # vectorised and scalar sines, sums in another order
            assert np.abs(many[i] - one).max() <= 256 * EPS, function
    assert group.identity(batch).shape == (*batch, *group.identity().shape)


@everyone
def test_one_element_moves_many_points(name: str) -> None:
    group = GROUPS[name]
    rng = np.random.default_rng(4)
    a, x = group.random(rng), rng.normal(size=(7, 2 if name in ("so2", "se2") else 3))
    assert group.act(a, x).shape == x.shape
    np.testing.assert_allclose(group.act(a, x)[3], group.act(a, x[3]), rtol=0, atol=8 * EPS * 10)


@pytest.mark.parametrize("name", ["so3", "se3", "sim3"])
@pytest.mark.parametrize("function", ["exp", "log", "adjoint", "left_jacobian", "act", "inverse"])
def test_a_wrong_shape_is_told(name: str, function: str) -> None:
    arguments = (np.zeros((2, 5)),) * (2 if function == "act" else 1)
    with pytest.raises(ValueError, match=r"has shape \(2, 5\): need \(\.\.\., \d"):
        getattr(GROUPS[name], function)(*arguments)
