"""Every (NumPy function, Numba twin) pair on the same inputs: the NumPy function is the truth.

``INPUTS`` has one row per entry of ``_kernels.REGISTRY``: a twin without its row fails the build.  The
functions work in place, so each gets its own copy, laid out as in the filters: views into larger
arrays, covariances broadcast over the batch and read-only.

Tolerance: both compute the same sums in another order.  With inner products of at most N = 40 terms of
size ``size`` (the largest number of the inputs and results, squared where products meet) they differ by 2 N
eps size^2; where S is inverted, cond(S) < 100 multiplies it.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import vslam_ref
from vslam_ref import _kernels
from vslam_ref.filters.block_covariance import State
from vslam_ref.filters.vehicle import Increment
from vslam_ref.grids.beam_marks import BeamsInCells
from vslam_ref.grids.static_dynamic import Layers, Rules

from . import (
    rows_bundle,
    rows_features,
    rows_freak,
    rows_orb,
    rows_orbslam,
    rows_pose,
    rows_posegraph,
    rows_rendered,
    rows_visual_map,
    rows_vocabulary,
)

pytest.importorskip("numba", reason="the twins need numba (extra `fast`)")

EPS = float(np.finfo(float).eps)
TOLERANCE = 2 * 40 * EPS * 100
Rng = np.random.Generator


def everything_imported() -> None:
    """Twins are declared where their functions are defined: import all numeric rooms."""
    for room in ("geometry", "filters", "metrics", "worlds", "estimation", "features", "grids", "systems"):
        try:
            package = importlib.import_module(f"vslam_ref.{room}")
        except ModuleNotFoundError:
            continue
        for info in pkgutil.walk_packages(package.__path__, f"vslam_ref.{room}."):
            importlib.import_module(info.name)


everything_imported()


@pytest.fixture(autouse=True)
def _twins_run_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """These tests decide whether a changed pair may be used: here it is."""
    monkeypatch.setattr("vslam_ref._kernels._digests.changed_files", lambda twin: [])


# --- inputs -------------------------------------------------------------------------------------------


def room_for(a: np.ndarray) -> np.ndarray:
    """The same numbers as a view into a larger array, as a filter with spare capacity holds them."""
    big = np.full(
        tuple(n + 3 * (i > 0) for i, n in enumerate(a.shape)),
        np.nan if a.dtype.kind in "fc" else 99 if a.dtype.kind == "u" else -1,
        dtype=a.dtype,
    )
    view = big[tuple(slice(0, n) for n in a.shape)]
    view[...] = a
    return view


def covariance(rng: Rng, B: int, n: int) -> np.ndarray:
    L = rng.normal(size=(B, n, n)) / np.sqrt(n)
    return L @ L.swapaxes(1, 2) + 0.1 * np.eye(n)


def given_cov(rng: Rng, B: int, n: int) -> np.ndarray:
    """A read-only broadcast view, as made from one covariance for all runs."""
    return np.broadcast_to(0.1 * covariance(rng, 1, n)[0], (B, n, n))


def blocks(rng: Rng, B: int, p: int, M: int) -> State:
    """Means and blocks of one positive definite covariance."""
    P = covariance(rng, B, p + M)
    parts = (rng.normal(size=(B, p)), rng.normal(size=(B, M)), P[:, :p, :p], P[:, :p, p:], P[:, p:, p:])
    return State(*(room_for(part) for part in parts))


def seen(rng: Rng, B: int, M: int, b: int, m: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """columns (m,), z (B, m, 2), cov_z (m, 2, 2)."""
    columns = b * rng.permutation(M // b)[:m]
    return columns, rng.normal(size=(B, m, 2)), np.broadcast_to(np.array([[0.5, 0.1], [0.1, 0.4]]), (m, 2, 2))


def for_ekf_predict(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    state = blocks(rng, B, 3, 2 * n)
    state.x_p[:, 2] = rng.uniform(-np.pi, np.pi, B)
    return state, Increment(rng.normal(size=B), rng.uniform(-3, 3, B), given_cov(rng, B, 2))


def for_ekf_update(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return blocks(rng, B, 3, 2 * n), *seen(rng, B, 2 * n, 2, min(3, n)), rng.choice([np.inf, 4.0])


def reduced_state(rng: Rng, B: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x_p (B, 4), P_a (B, 8, 8) and the frame (c, tau, D, e), with |c| and |e| near 1."""
    x_p, theta = rng.normal(size=(B, 4)), rng.uniform(-3, 3, B)
    x_p[:, 2], x_p[:, 3] = np.sin(theta), np.cos(theta)
    turn = np.exp(1j * rng.uniform(-3, 3, (2, B)))
    shift = rng.normal(size=(2, B)) + 1j * rng.normal(size=(2, B))
    return x_p, covariance(rng, B, 8), np.stack([turn[0], shift[0], shift[1], turn[1]], 1)


def for_reduced_predict(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """n controls at once."""
    ds, m = rng.normal(size=(B, n)), np.exp(1j * rng.uniform(-3, 3, (B, n)))
    control = np.stack([ds, m.real, m.imag, (ds * m).real, (ds * m).imag], -1)
    return (*reduced_state(rng, B), control, np.broadcast_to(given_cov(rng, 1, 5), (B, n, 5, 5)))


def for_reduced_predict_first_order(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    cov = np.broadcast_to(given_cov(rng, 1, 2), (B, n, 2, 2))
    return (*reduced_state(rng, B), rng.normal(size=(B, n)), rng.uniform(-3, 3, (B, n)), cov)


def for_reduced_apply(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    b = 2 + 2 * (n % 2)
    _, P_a, frame = reduced_state(rng, B)
    return blocks(rng, B, 4, b * n), b, P_a, frame


def for_reduced_update(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    b, m = 2 + 2 * (n % 2), min(3, n)
    _, P_a, frame = reduced_state(rng, B)
    gate = rng.choice([np.inf, 4.0])
    return blocks(rng, B, 4, b * n), b, P_a, frame, *seen(rng, B, b * n, b, m), gate


def for_grid(rng: Rng, B: int, n: int) -> BeamsInCells:
    """Beams in a map of 40 x 50 cells: start, ends (some on lines and corners) and hits."""
    start = rng.choice([rng.uniform(15, 25, 2), np.array([20.0, 20.0]), np.array([20.5, 20.0])])
    ends = rng.uniform(2, 38, (8 * n, 2))
    ends[::2] = np.round(ends[::2] * 2) / 2
    return BeamsInCells(start, ends, rng.random(8 * n) < 0.7)


def for_apply_plain(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    return rng.uniform(-3, 3, 2000), 50, for_grid(rng, B, n), np.array([-0.8, 1.4]), 6.0


def for_apply_scan(rng: Rng, B: int, n: int) -> tuple[Any, ...]:
    """All states; cells never or long not seen; hits that settle; walls that reach 0 or 1 cell; grazing."""
    s, d = rng.uniform(-3, 3, (2, 2000))
    times = (rng.choice(t, 2000) for t in ([-np.inf, 7.0, 9.5], [-np.inf, 8.0, 9.5], [0.0, 5.0, 9.0]))
    steps = rng.uniform(-2, 2, (2, 3, 3))
    settle, graze = rng.choice([3.0, np.inf]), int(rng.choice([0, 2]))
    lifetime, in_line = rng.choice([-1.0, 1.0]), rng.choice([0.5, settle])
    rules = Rules(*steps, 6.0, 3.0, lifetime, settle, in_line, 1.0, n % 2, graze)
    return Layers(s, d, *times), 50, for_grid(rng, B, n), rules, 10.0


INPUTS: dict[str, list[Callable[[Rng, int, int], tuple[Any, ...]]]] = {
    "slam:ekf_predict_in_place": [for_ekf_predict],
    "slam:ekf_update_in_place": [for_ekf_update],
    "reduced:reduced_predict_in_place": [for_reduced_predict],
    "reduced:reduced_predict_first_order_in_place": [for_reduced_predict_first_order],
    "reduced:reduced_apply_in_place": [for_reduced_apply],
    "grids:apply_plain": [for_apply_plain],
    "grids:apply_scan": [for_apply_scan],
    "reduced:reduced_update_in_place": [for_reduced_update],
    **rows_bundle.ROWS,
    **rows_features.ROWS,
    **rows_freak.ROWS,
    **rows_orb.ROWS,
    **rows_orbslam.ROWS,
    **rows_pose.ROWS,
    **rows_posegraph.ROWS,
    **rows_rendered.ROWS,
    **rows_visual_map.ROWS,
    **rows_vocabulary.ROWS,
}


# --- the registry -------------------------------------------------------------------------------------


def test_every_twin_has_its_inputs() -> None:
    assert {twin for _, twin in _kernels.REGISTRY.values()} == set(INPUTS)


def test_every_public_function_of_the_kernels_is_a_twin() -> None:
    twins = {twin for _, twin in _kernels.REGISTRY.values()}
    for info in pkgutil.iter_modules(_kernels.__path__):
        if info.name.startswith("_"):
            continue
        module = importlib.import_module(f"{_kernels.__name__}.{info.name}")
        for name, thing in vars(module).items():
            own = getattr(thing, "__module__", None) == module.__name__
            if own and callable(thing) and not name.startswith("_"):
                assert f"{info.name}:{name}" in twins, f"{info.name}.{name} is the twin of nothing"


@pytest.mark.parametrize("name", sorted(_kernels.REGISTRY))
def test_twins_have_the_signature_of_their_function(name: str) -> None:
    function, twin = _kernels.REGISTRY[name]
    kernel = _kernels._load(twin)
    mine = list(inspect.signature(function).parameters)
    assert list(inspect.signature(getattr(kernel, "py_func", kernel)).parameters) == mine


# --- the numbers --------------------------------------------------------------------------------------

CASES = [(twin, build) for twin, builders in INPUTS.items() for build in builders]


def copies(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Copies of what may be written to, with its strides; read-only views stay as they are."""

    def copy(a: Any) -> Any:
        if isinstance(a, tuple):  # a NamedTuple
            return type(a)(*map(copy, a))
        return room_for(a) if isinstance(a, np.ndarray) and a.flags.writeable else a

    return tuple(map(copy, arguments))


def fields(arguments: tuple[Any, ...]) -> list[Any]:
    """Arguments, NamedTuples field by field."""
    return [part for a in arguments for part in (a if isinstance(a, tuple) else (a,))]


def outputs(twin: str, result: Any) -> list[np.ndarray]:
    """Arrays that are returned, flags as numbers, without what means nothing."""
    if result is None:
        return []
    arrays = list(result) if isinstance(result, tuple) else [result]
    return rows_bundle.meant(twin, [a.astype(float) if a.dtype.kind in "bui" else a for a in arrays])


@pytest.mark.parametrize(("B", "n"), [(1, 1), (2, 5), (3, 2), (5, 10)])
@pytest.mark.parametrize(("twin", "build"), CASES, ids=[f"{t}-{b.__name__}" for t, b in CASES])
def test_twin_does_what_numpy_does(twin: str, build: Callable[..., tuple[Any, ...]], B: int, n: int) -> None:
    (function,) = (f for f, t in _kernels.REGISTRY.values() if t == twin)
    arguments = build(np.random.default_rng(10 * B + n), B, n)
    with _kernels.use_backend("numpy"):  # functions call one another: NumPy all the way down
        expected = copies(arguments)
        returned = outputs(twin, function(*expected))
    found = copies(arguments)
    also = outputs(twin, _kernels._load(twin)(*found))
    assert len(returned) == len(also)
    changed = 0
    for before, a, b in zip(
        [*fields(arguments), *[None] * len(also)],
        [*fields(expected), *returned],
        [*fields(found), *also],
        strict=True,
    ):
        if not isinstance(a, np.ndarray):
            continue
        assert a.shape == b.shape
        changed += before is not None and not np.array_equal(before, a)
        assert np.array_equal(np.isinf(a), np.isinf(b))  # a time may be infinite: never
        a, b = (np.where(np.isinf(x), 0.0, x) for x in (a, b))
        assert np.isfinite(b).all()
        size = max(1.0, np.abs(a).max(initial=0.0))
        assert np.abs(a - b).max(initial=0.0) <= TOLERANCE * size**2
    assert changed > 0 or also, "an in-place function that changes nothing was not tested"


@pytest.mark.parametrize("n", [150, 151])
@pytest.mark.parametrize("build", [for_ekf_update, for_reduced_update])
def test_a_map_wider_than_a_tile(build: Callable[..., tuple[Any, ...]], n: int) -> None:
    """The update kernels take P_mm tile by tile of 256 columns: here there are two or three."""
    (twin,) = (t for t, builders in INPUTS.items() if build in builders)
    test_twin_does_what_numpy_does(twin, build, 1, n)


def nudged(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Move the first array by a millionth; of bytes, every other one by 1."""
    first = fields(arguments)[0]
    if first.dtype.kind in "fc":
        first[...] += 1e-6
        return arguments
    changed = first.copy()
    changed[::2] ^= 1
    return changed, *arguments[1:]


@pytest.mark.parametrize(("twin", "build"), CASES, ids=[f"{t}-{b.__name__}" for t, b in CASES])
def test_comparison_sees_a_millionth(twin: str, build: Callable[..., tuple[Any, ...]]) -> None:
    """The tolerance has teeth: perturbing one input by 1e-6 shows, in at least one output."""
    (function,) = (f for f, t in _kernels.REGISTRY.values() if t == twin)
    arguments = build(np.random.default_rng(0), 2, 3)
    with _kernels.use_backend("numpy"):
        a, b = copies(arguments), nudged(copies(arguments))
        r, s = outputs(twin, function(*a)), outputs(twin, function(*b))
    pairs = [
        (np.nan_to_num(1.0 * u), np.nan_to_num(1.0 * v))
        for u, v in zip([*fields(a), *r], [*fields(b), *s], strict=True)
        if isinstance(u, np.ndarray)
        and (u.dtype.kind in "fc" or (u.dtype.kind in "bu" and u.flags.writeable))
    ]
    far = [np.inf if u.shape != v.shape else np.abs(u - v).max(initial=0.0) for u, v in pairs]
    assert max(far) > TOLERANCE * 100


# --- choosing -----------------------------------------------------------------------------------------


def test_backend_is_chosen_and_restored() -> None:
    before = _kernels.backend()
    with _kernels.use_backend("numpy") as name:
        assert name == _kernels.backend() == "numpy"
        with _kernels.use_backend("auto") as inner:
            assert inner == "numba"
        assert _kernels.backend() == "numpy"
    assert _kernels.backend() == before


def test_unknown_backend_is_refused() -> None:
    with pytest.raises(ValueError, match="VSLAM_REF_BACKEND='fortran'"), _kernels.use_backend("fortran"):
        pass


def test_a_filter_gives_the_same_on_both_backends() -> None:
    """End to end, 40 steps with 4 landmarks: 40 times the tolerance of one."""
    from vslam_ref.filters import carleman_ekf, ekf_slam
    from vslam_ref.filters.vehicle import Increment

    def run(slam: Any) -> Any:
        rng = np.random.default_rng(0)
        for k in range(40):
            slam.predict(
                Increment(np.full(2, 0.1), rng.normal(0.1, 0.01, 2), 1e-4 * np.eye(2) * np.ones((2, 1, 1)))
            )
            if k % 4 == 0:
                slam.update([0, 1, 2 + (k > 20)], rng.normal([[1, 2]], 0.1, (2, 3, 2)), 0.01 * np.eye(2))
        return slam.pose()

    for make in (ekf_slam.EkfSlam, ekf_slam.AnchoredEkf, carleman_ekf.ReducedCarlemanEkf):
        results = []
        for name in ("numpy", "numba"):
            with _kernels.use_backend(name):
                results.append(run(make(np.zeros((2, 3)), 0.1 * np.eye(3))))
        for a, b in zip(*results, strict=True):
            assert np.abs(a - b).max() < 40 * TOLERANCE


def test_package_has_no_numba_import_of_its_own() -> None:
    """Numba is imported at the first accelerated call only."""
    assert "numba" not in vars(vslam_ref)
    assert "numba" not in vars(_kernels)
