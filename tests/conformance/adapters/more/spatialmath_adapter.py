"""spatialmath-python under the vectors.

vslam-ref verify --module tests/conformance/adapters/more/spatialmath_adapter.py
"""

from __future__ import annotations

from typing import Any

from positional import asked
from spatialmath import base


def se2_log(x: Any) -> Any:
    """Through a matrix, as its classes do."""
    return base.trlog2(base.transl2(x[:2]) @ base.trot2(x[2]), twist=True)


TABLE = {
    "so2.exp": base.rot2,
    "so2.wrap": base.wrap_mpi_pi,
    "se2.exp": lambda xi: base.tr2xyt(base.trexp2(xi)),
    "se2.log": se2_log,
    "so3.exp": base.trexp,
    "so3.log": lambda R: base.trlog(R, twist=True),
    "se3.exp": base.trexp,
    "se3.log": lambda T: base.trlog(T, twist=True),
    "se3.inverse": base.trinv,
    "se3.adjoint": base.tr2adjoint,
    "so3.left_jacobian_inverse": lambda phi: base.rotvelxform(phi, inverse=True, representation="exp"),
    "so3.left_jacobian": lambda phi: base.rotvelxform(phi, representation="exp"),
    "quaternion.from_rotation": base.r2q,
    "quaternion.to_rotation": base.q2r,
}

answer = asked(TABLE)
