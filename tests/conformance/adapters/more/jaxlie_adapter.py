"""jaxlie in double precision under the vectors.

vslam-ref verify --module tests/conformance/adapters/more/jaxlie_adapter.py
"""

from __future__ import annotations

from typing import Any

import jax
import jaxlie
import numpy as np
from positional import asked

jax.config.update("jax_enable_x64", True)


def se3(T: Any) -> jaxlie.SE3:
    """A motion of a matrix."""
    return jaxlie.SE3.from_matrix(np.asarray(T))


TABLE = {
    "so3.exp": lambda phi: np.asarray(jaxlie.SO3.exp(phi).as_matrix()),
    "so3.log": lambda R: np.asarray(jaxlie.SO3.from_matrix(R).log()),
    "so3.left_jacobian_inverse": lambda phi: np.asarray(jaxlie.SO3.exp(phi).inverse().jlog()),
    "se3.exp": lambda xi: np.asarray(jaxlie.SE3.exp(xi).as_matrix()),
    "se3.log": lambda T: np.asarray(se3(T).log()),
    "se3.inverse": lambda T: np.asarray(se3(T).inverse().as_matrix()),
    "se3.adjoint": lambda T: np.asarray(se3(T).adjoint()),
    "se3.left_jacobian_inverse": lambda xi: np.asarray(jaxlie.SE3.exp(-xi).jlog()),
    "quaternion.from_rotation": lambda R: np.asarray(jaxlie.SO3.from_matrix(R).wxyz),
}

answer = asked(TABLE)
