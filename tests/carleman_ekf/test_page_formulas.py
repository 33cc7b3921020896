"""The matrices that chapter 16 prints are the ones that the package computes with.

The page is read, not copied: each labelled matrix is parsed from its LaTeX and compared with the package's
matrices, entry by entry, as polynomials.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from vslam_ref.filters.carleman_ekf import lift

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "chapters" / "16_carleman_ekf.md").read_text(encoding="utf-8")
Z, ZI = sp.symbols("z1:12"), sp.symbols("zi1:7")
u1, u2, u3 = U = sp.symbols("u1 u2 u3")
XI, ETA = NEW = sp.symbols("xi eta")
MONOMIALS = (1, u1, u2, u3, u2 * u2, u2 * u3, u3 * u3, u1 * u2, u1 * u3)


def formula(label: str) -> str:
    """LaTeX between the dollars before a label."""
    (found,) = re.findall(r"\$\$\n((?:(?!\$\$).)*?)\$\$ \(" + label + r"\)", PAGE, re.DOTALL)
    return str(found)


def entry(tex: str) -> sp.Expr:
    """One entry: sums of products of numbers, z, z_i, u, and the new landmark's two coordinates."""
    for old, new in (
        (r"x_{\mathrm{new}}", "xi"), (r"y_{\mathrm{new}}", "eta"), (r"\xi", "xi"), (r"\eta", "eta"),
        (r"\cdot", "0"), ("^2", "**2"),
    ):  # fmt: skip
        tex = tex.replace(old, f" {new} " if new.isalpha() else new)
    tex = re.sub(r"z_\{i(\d)\}", r" zi\1 ", tex)
    tex = re.sub(r"([zu])_\{?(\d+)\}?", r" \1\2 ", tex)
    names = {str(s): s for s in (*Z, *ZI, *U, *NEW)}
    tokens = re.findall(r"\*\*2|[a-z]+\d*|\d+|[-+()]", tex)
    text = ""
    for token in tokens:
        juxtaposed = text and text[-1] not in "+-(" and token not in ("+", "-", ")", "**2")
        text += ("*" if juxtaposed else "") + token
    return sp.sympify(text, locals=names)


def matrix(label: str, number: int = 0) -> sp.Matrix:
    """One of the matrices of a labelled formula."""
    bodies = re.findall(r"\\begin\{(?:bmatrix|array)\}(?:\{[c|]+\})?(.*?)\\end\{", formula(label), re.DOTALL)
    rows = [row for row in bodies[number].split(r"\\") if row.strip()]
    return sp.Matrix([[entry(cell) for cell in row.split("&")] for row in rows])


def polynomial(matrices: np.ndarray) -> sp.Matrix:
    total = sp.zeros(*matrices[0].shape)
    for monomial, M in zip(MONOMIALS, matrices, strict=True):
        total += monomial * sp.Matrix(M.astype(int))
    return total


def placement() -> tuple[sp.Matrix, sp.Matrix]:
    """G_3 and G_new of the package as polynomials, found by putting unit vectors in."""
    G = [lift.placement_matrices(np.zeros(11), np.array(m))[0] for m in ([0.0, 0.0], [1.0, 0.0], [0.0, 1.0])]
    one, x, y = (sp.Matrix(M.astype(int)) for M in (G[0], G[1] - G[0], G[2] - G[0]))
    G_new = sp.zeros(6, 2)
    for z, e in zip(Z, np.eye(11), strict=True):
        G_new += z * sp.Matrix(lift.placement_matrices(e, np.zeros(2))[1].astype(int))
    return one + XI * x + ETA * y, G_new


VEHICLE = polynomial(lift.VEHICLE_MATRICES) * sp.Matrix(Z)
LANDMARK = polynomial(lift.LANDMARK_MATRICES) * sp.Matrix(ZI)
G_3, G_NEW = placement()
SEEN = sp.Matrix(lift.measurement_matrix([0], 1).astype(int)) * sp.Matrix([*Z, *ZI])

WANTED = {
    ("eq-b7", 0): VEHICLE[:4, :],
    ("eq-b9", 0): VEHICLE[:4, :].jacobian(Z[:4]),
    ("eq-b11", 0): VEHICLE[:4, :].jacobian(U),
    ("eq-b16", 0): VEHICLE,
    ("eq-jacobian-control-vehicle", 0): VEHICLE.jacobian(U),
    ("eq-b18", 0): LANDMARK,
    ("eq-b19", 0): LANDMARK.jacobian(U),
    ("eq-b22", 0): SEEN,
    ("eq-b26", 0): G_3 * sp.Matrix(Z),
    ("eq-jacobians-placement", 0): G_3,
    ("eq-jacobians-placement", 1): G_NEW,
}


@pytest.mark.parametrize(("label", "number"), list(WANTED), ids=[f"{label}-{n}" for label, n in WANTED])
def test_the_printed_matrix_is_the_computed_one(label: str, number: int) -> None:
    assert sp.expand(matrix(label, number) - WANTED[label, number]) == sp.zeros(*WANTED[label, number].shape)


def test_the_printed_reduction_reads_what_the_filter_measures() -> None:
    T = matrix("eq-reduction-matrix")
    assert T.shape == (7, 17)
    assert T[:5, :] * sp.Matrix([*Z, *ZI]) == sp.Matrix([*Z[:4], Z[4] + Z[5]])
    assert T[5:, :] * sp.Matrix([*Z, *ZI]) == SEEN
