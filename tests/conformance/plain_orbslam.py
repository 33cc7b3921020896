"""Chapter 14 in plain NumPy, and its known mistakes on demand: array sums, complex numbers, unpacked bits."""

from __future__ import annotations

from typing import Any

import numpy as np
import plain_views

Array = Any
GAUSS = np.array([18, 34, 49, 54, 49, 34, 18])


# --- direction and descriptor


def moments(image: Array, wrong: str | None = None) -> Array:
    y, x = np.mgrid[-15:16, -15:16]
    inside = np.rint(np.hypot(x, y) - (0.499 if wrong == "disc-too-small" else 0)) <= 15
    if wrong == "disc-too-small":
        inside = np.hypot(x, y) <= 15
    if wrong == "square-window":
        inside[:] = True
    if wrong == "about-the-corner":
        x, y = x + 15, y + 15
    m = np.array([np.sum(image * inside * x), np.sum(image * inside * y)])
    if wrong == "y-up":
        m[1] *= -1
    return m[::-1] if wrong == "moments-exchanged" else m


def angle(image: Array, wrong: str | None = None) -> float:
    m10, m01 = moments(image, wrong)
    if wrong == "one-half-only":
        return float(np.arctan(m01 / m10))
    return float(np.arctan2(m10, m01) if wrong == "arguments-exchanged" else np.angle(m10 + 1j * m01))


def smooth(image: Array, wrong: str | None = None) -> Array:
    mode: Any = {"border-repeated": "edge", "border-twice": "symmetric"}.get(wrong or "", "reflect")
    g = np.ones(7) if wrong == "all-alike" else GAUSS
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(image, 3, mode=mode), (7, 7))
    mean = np.einsum("yxji,j,i->yx", windows, g, g) / g.sum() ** 2
    return np.floor(mean + (0.0 if wrong == "rounded-down" else 0.5))


def descriptor(image: Array, pairs: Array, angle: float, wrong: str | None = None) -> Array:
    grey = image if wrong == "not-smoothed" else smooth(image)
    turn = np.exp(1j * {"steered-back": -angle, "not-steered": 0.0}.get(wrong or "", angle))
    x, y = (1, 0) if wrong == "rows-for-columns" else (0, 1)
    place = pairs.reshape(-1, 2, 2)
    at = turn * (place[..., x] + 1j * place[..., y])
    whole = np.trunc if wrong == "offsets-cut" else np.rint
    a, b = grey[22 + whole(at.imag).astype(int), 22 + whole(at.real).astype(int)].T
    bits = {"brighter": a > b, "equal-counts": a <= b}.get(wrong or "", a < b)
    value = 2 ** (np.arange(7, -1, -1) if wrong == "bit-order" else np.arange(8))
    return bits.reshape(-1, 8) @ value


def hamming(a: Array, b: Array, wrong: str | None = None) -> int:
    if wrong == "bytes-counted":
        return int(np.sum(a != b))
    if wrong == "sum-of-differences":
        return int(np.abs(a - b).sum())
    different = np.unpackbits(a.astype(np.uint8)) != np.unpackbits(b.astype(np.uint8))
    return int(np.sum(~different if wrong == "bits-in-common" else different))


# --- words


def idf(picture: Array, word: Array, pictures: int, words: int, wrong: str | None = None) -> Array:
    count = np.zeros((pictures, words))
    np.add.at(count, (picture.astype(int), word.astype(int)), 1)
    having, often = (count > 0).sum(0), count.sum(0)
    with np.errstate(divide="ignore"):
        weight = {
            "idf-inverted": np.log(having) - np.log(pictures),
            "occurrences-counted": np.log(pictures) - np.log(often),
            "occurrences-only": np.log(len(word)) - np.log(often),
            "base-two": np.log2(pictures / having),
            "smoothed": np.log(pictures / (1 + having)),
        }.get(wrong or "", np.log(pictures / having))
    return np.where(having > 0, weight, np.log(pictures) if wrong == "unseen-once" else 0.0)


def bag(weight: Array, word: Array, wrong: str | None = None) -> Array:
    count = np.bincount(word.astype(int), minlength=len(weight))
    count = np.minimum(count, 1) if wrong == "once-each" else count
    value = count * (1.0 if wrong == "idf-forgotten" else weight)
    if not value.any() or wrong == "not-normalised":
        return value
    if wrong == "over-all-features":
        return value / len(word)
    return value / np.linalg.norm(value, 2 if wrong == "unit-length" else 1)


def score(v: Array, w: Array, wrong: str | None = None) -> float:
    half = np.abs(v - w).sum() / 2
    if wrong in ("product", "larger-of-two"):
        return float(v @ w if wrong == "product" else np.maximum(v, w).sum())
    if wrong in ("distance", "norm-not-halved"):
        return float(half if wrong == "distance" else 1 - 2 * half)
    return float(1 - half) if wrong == "blank-is-half" or (v.any() and w.any()) else 0.0


def descend(children: Array, descriptor: Array, feature: Array, wrong: str | None = None) -> list[int]:
    parent = np.repeat(np.arange(len(children)), children.astype(int))  # of nodes 1, 2, ...
    bits = (
        (lambda a: a) if wrong == "bytes-counted" else (lambda a: np.unpackbits(a.astype(np.uint8), axis=-1))
    )
    found = []
    for one in feature:
        far, at = (bits(descriptor) != bits(one)).sum(1), 0
        far = -far if wrong == "farthest" else far
        while children[at]:
            below = 1 + np.flatnonzero(parent == at)
            if wrong == "nearest-of-all":
                below = np.flatnonzero(children == 0)
            nearest = below[far[below] == far[below].min()]
            at = int(nearest[-1 if wrong == "last-of-equals" else 0])
            if wrong == "one-level":
                break
        found.append(at)
    return found


# --- loops


def three_points(source: Array, target: Array, wrong: str | None = None) -> Array:
    if wrong == "not-centred":
        U, _, Vt = np.linalg.svd(target.T @ source)
        R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
        s = np.trace(R.T @ target.T @ source) / np.sum(source**2)
    else:
        found = plain_views.align(source, target, True, wrong)
        R, s = found["R"], found["scale"]
    a, b = (target, source) if wrong == "target-to-source" else (source, target)
    p = source - source.mean(0)
    if wrong == "mirrored":
        n = np.linalg.svd(p)[2][2]
        R = plain_views.align(source, target, True)["R"] @ (np.eye(3) - 2 * np.outer(n, n))
    R = R.T if wrong == "rotation-transposed" else R
    s = {"scale-forgotten": 1.0, "scale-inverted": 1 / s}.get(wrong or "", s)
    S = np.eye(4)
    S[:3, :3] = s * R
    S[:3, 3] = b.mean(0) - (1.0 if wrong == "translation-not-scaled" else s) * R @ a.mean(0)
    return S


def essential_edges(
    shared: Array, parent: Array, loops: Array, theta_min: float, wrong: str | None = None
) -> Array:
    n = len(shared)
    wanted = shared > theta_min if wrong == "more-than" else shared >= theta_min
    wanted = {"all-covisible": shared > 0, "tree-only": np.zeros((n, n), bool)}.get(wrong or "", wanted)
    tree = np.stack([np.arange(1, n), parent[1:].astype(int)], 1)
    if wrong == "least-weight":
        tree = _prim(shared)
    if wrong != "no-tree":
        wanted[tuple(tree.T)] = True
    if wrong != "loops-forgotten" and len(loops):
        wanted[tuple(loops.astype(int).T)] = True
    return np.argwhere(np.triu(wanted | wanted.T, 1))


def _prim(shared: Array) -> Array:
    """Tree of least weight, grown from the first; of equal weights the smaller pair."""
    inside, tree = [0], []
    while len(inside) < len(shared):
        reach = [(shared[i, j], min(i, j), max(i, j), j)
                 for i in inside for j in range(len(shared)) if j not in inside]  # fmt: skip
        _, i, j, new = min(reach)
        inside.append(new)
        tree.append((i, j))
    return np.array(tree)


PROGRAM = {
    "orb.moments": moments,
    "orb.angle": angle,
    "orb.smooth": smooth,
    "orb.descriptor": descriptor,
    "orb.hamming": hamming,
    "vocabulary.idf": idf,
    "vocabulary.bag": bag,
    "vocabulary.score": score,
    "vocabulary.descend": descend,
    "loops.three_points": three_points,
    "loops.essential_edges": essential_edges,
}
