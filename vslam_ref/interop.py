r"""Between the conventions of this package and those of other libraries.

Three choices make a tangent vector: the **order** of its blocks, the **side** on which the perturbation
acts, and the **unit** of the rotation.  Ours: translation first, left, radians (see
``docs/conventions.md``).

=========================  ======  ========  ======  =====================================================
name                       group   order     side    remark
=========================  ======  ========  ======  =====================================================
``vslam_ref.se3``          SE(3)   rho phi   left
``gtsam.Pose3``            SE(3)   phi rho   right   usually holds T_world_cam: use ``of_inverse``
``g2o.VertexSE3``          SE(3)   rho phi   right   phi is half: the vector part of a quaternion
``g2o.VertexSE3Expmap``    SE(3)   phi rho   left    g2o's bundle adjustment
``sophus.SE3``             SE(3)   rho phi   left    as DSO and LSD-SLAM use it
``sophus.Manifold<SE3>``   SE(3)   rho phi   right   Sophus' own manifold for Ceres
``manif.SE3``              SE(3)   rho phi   right
``ceres.Quaternion+R3``    SE(3)   phi rho   split   phi is half; t + rho, so rho is not turned
``vslam_ref.se2``          SE(2)   rho phi   left
``gtsam.Pose2``            SE(2)   rho phi   right
``g2o.VertexSE2``          SE(2)   rho phi   split   (x, y, theta) + update
``manif.SE2``              SE(2)   rho phi   right
``vslam_ref.sim3``         Sim(3)  rho phi   left    then sigma, in all of them
``gtsam.Similarity3``      Sim(3)  phi rho   right   another layout: :func:`similarity_from_gtsam`
``g2o.VertexSim3Expmap``   Sim(3)  phi rho   left
``sophus.Sim3``            Sim(3)  rho phi   left
=========================  ======  ========  ======  =====================================================

The information matrix of an ``EDGE_SE3:QUAT`` line of a .g2o file is that of ``g2o.VertexSE3``, at the
measurement: an information of 400 there is one of 100 per square radian.

The room knows no group: what it needs of one is the adjoint matrix, which is an argument.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vslam_ref.arrays import Array, as_array, transpose

BLOCKS = {"SE2": {"rho": 2, "phi": 1}, "SE3": {"rho": 3, "phi": 3}, "Sim3": {"rho": 3, "phi": 3, "sigma": 1}}
"""Length of each block of a tangent vector, in our order."""


class TangentConvention(NamedTuple):
    """How a library writes a small change of a pose.

    ``side`` is ``left`` (Exp(xi) T), ``right`` (T Exp(xi)) or ``split`` (R from the left, rho added to t).
    ``angle_unit`` is what one radian counts: 0.5 where phi is the vector part of a quaternion.
    """

    group: str
    order: tuple[str, ...] = ("rho", "phi")
    side: str = "left"
    angle_unit: float = 1.0


_TURN_FIRST = ("phi", "rho")
CONVENTIONS = {
    "vslam_ref.se3": TangentConvention("SE3"),
    "gtsam.Pose3": TangentConvention("SE3", _TURN_FIRST, "right"),
    "g2o.VertexSE3": TangentConvention("SE3", side="right", angle_unit=0.5),
    "g2o.VertexSE3Expmap": TangentConvention("SE3", _TURN_FIRST),
    "sophus.SE3": TangentConvention("SE3"),
    "sophus.Manifold<SE3>": TangentConvention("SE3", side="right"),
    "manif.SE3": TangentConvention("SE3", side="right"),
    "ceres.Quaternion+R3": TangentConvention("SE3", _TURN_FIRST, "split", 0.5),
    "vslam_ref.se2": TangentConvention("SE2"),
    "gtsam.Pose2": TangentConvention("SE2", side="right"),
    "g2o.VertexSE2": TangentConvention("SE2", side="split"),
    "manif.SE2": TangentConvention("SE2", side="right"),
    "vslam_ref.sim3": TangentConvention("Sim3", ("rho", "phi", "sigma")),
    "gtsam.Similarity3": TangentConvention("Sim3", (*_TURN_FIRST, "sigma"), "right"),
    "g2o.VertexSim3Expmap": TangentConvention("Sim3", (*_TURN_FIRST, "sigma")),
    "sophus.Sim3": TangentConvention("Sim3", ("rho", "phi", "sigma")),
}


def _convention(name: str) -> TangentConvention:
    if name not in CONVENTIONS:
        raise ValueError(f"convention {name!r} is unknown; there are: {', '.join(CONVENTIONS)}")
    return CONVENTIONS[name]


def _inverse(M: Array) -> Array:
    return np.asarray(np.linalg.inv(M))


def _from_left(convention: TangentConvention, Ad: Array) -> Array:
    """Matrix that takes our left perturbation of T to the convention's, Ad that of T."""
    sizes = BLOCKS[convention.group]
    n, turn = sum(sizes.values()), slice(sizes["rho"], sizes["rho"] + sizes["phi"])
    M = np.broadcast_to(np.eye(n), Ad.shape).copy()
    if convention.side == "right":  # Exp(xi) T = T Exp(Ad^-1 xi)
        M = _inverse(Ad)
    elif convention.side == "split":  # t changes by rho + phi x t (+ sigma t): hat(t) R stands in Ad
        r = sizes["rho"]
        M[..., :r, r:] = -Ad[..., :r, r:] @ _inverse(Ad[..., r:, r:])
    M[..., turn, :] *= convention.angle_unit
    starts = dict(zip(sizes, np.cumsum([0, *sizes.values()]), strict=False))
    rows = np.concatenate([starts[block] + np.arange(sizes[block]) for block in convention.order])
    return np.asarray(M[..., rows, :])


def tangent_matrix(source: str, target: str, adjoint: ArrayLike, *, of_inverse: bool = False) -> Array:
    """Matrix M with xi_target = M xi_source for small changes of one pose T.

    Parameters
    ----------
    source, target : str
        Names of :data:`CONVENTIONS`, of one group.
    adjoint : array_like, shape (..., n, n)
        Adjoint of T in *our* order, for example ``se3.adjoint(T)``.
    of_inverse : bool
        The target holds T^-1 where the source holds T: ``T_world_cam`` for ``T_cam_world``.

    Returns
    -------
    ndarray, shape (..., n, n)

    Raises
    ------
    ValueError
        If a name is unknown, the groups differ, or the adjoint has another size.

    Notes
    -----
    Between conventions with an exponential (all but ``split`` and those with half angles) M is right for
    changes of any size; else to first order.  Covariances, information matrices and Jacobians are converted
    with :func:`convert_covariance`, :func:`convert_information` and :func:`convert_jacobian`.

    A right perturbation of the inverse is the left one of T with the other sign, whatever T is:

    Examples
    --------
    >>> Ad = [[0, -1, 5], [1, 0, 7], [0, 0, 1]]
    >>> tangent_matrix("vslam_ref.se2", "gtsam.Pose2", Ad, of_inverse=True) + 0.0
    array([[-1.,  0.,  0.],
           [ 0., -1.,  0.],
           [ 0.,  0., -1.]])
    """
    first, second = _convention(source), _convention(target)
    n = sum(BLOCKS[first.group].values())
    Ad = as_array("adjoint", adjoint)
    if first.group != second.group:
        raise ValueError(f"{source} is of {first.group}, {target} of {second.group}: need one group")
    if Ad.shape[-2:] != (n, n):
        raise ValueError(f"adjoint has shape {Ad.shape}: {first.group} needs (..., {n}, {n})")
    back = _inverse(_from_left(first, Ad))
    if not of_inverse:
        return np.asarray(_from_left(second, Ad) @ back)
    Ad_inverse = _inverse(Ad)  # (Exp(xi) T)^-1 = T^-1 Exp(-xi) = Exp(-Ad^-1 xi) T^-1
    return np.asarray(-_from_left(second, Ad_inverse) @ Ad_inverse @ back)


def convert_covariance(cov: ArrayLike, M: ArrayLike) -> Array:
    """Covariance in the target's tangent vectors and units: M cov M^T.

    ``cov (..., n, n)``, ``M (..., n, n)``.
    """
    M = as_array("M", M)
    return np.asarray(M @ as_array("cov", cov) @ transpose(M))


def convert_information(information: ArrayLike, M: ArrayLike) -> Array:
    """Information matrix (inverse covariance) in the target's vectors and units: M^-T L M^-1.

    ``information (..., n, n)``, ``M (..., n, n)``.
    """
    back = _inverse(as_array("M", M))
    return np.asarray(transpose(back) @ as_array("information", information) @ back)


def convert_jacobian(J: ArrayLike, M: ArrayLike) -> Array:
    """Jacobian whose columns are the target's tangent directions and units: J M^-1.

    ``J (..., m, n)``, ``M (..., n, n)``.
    """
    return np.asarray(as_array("J", J) @ _inverse(as_array("M", M)))


def similarity_from_gtsam(M: ArrayLike) -> Array:
    """Our matrix [[s R, t], [0, 1]] from GTSAM's [[R, t'], [0, 1/s]], shape (..., 4, 4), metres.

    Both map points alike once the last coordinate is divided out, X -> s (R X + t'): so t = s t'.
    """
    M = np.asarray(M, dtype=np.float64)
    return np.asarray(M / M[..., 3:, 3:])


def similarity_to_gtsam(S: ArrayLike) -> Array:
    """GTSAM's matrix [[R, t'], [0, 1/s]] from ours, shape (..., 4, 4), metres."""
    S = np.asarray(S, dtype=np.float64)
    s = np.linalg.norm(S[..., :3, :3], axis=(-2, -1)) / np.sqrt(3.0)
    return np.asarray(S / s[..., None, None])


def quaternion_to_wxyz(q: ArrayLike, order: str, *, product: str = "hamilton") -> Array:
    """Our quaternion (w first, Hamilton's product) from another library's.

    Parameters
    ----------
    q : array_like, shape (..., 4)
    order : {"wxyz", "xyzw"}
        Order in memory.  xyzw: Eigen's and Sophus' memory, ROS, SciPy's default, the TUM and .g2o files.
        wxyz: Eigen's constructor, Ceres' ``QuaternionManifold``, COLMAP's text files, EuRoC's ground truth.
    product : {"hamilton", "jpl"}
        ``jpl``: the product with i j = -k (JPL; much of the MSCKF literature), where the same four numbers
        stand for the transposed matrix.

    Returns
    -------
    ndarray, shape (..., 4)

    Raises
    ------
    ValueError
        If the shape, the order or the product is none of these.

    Examples
    --------
    >>> quaternion_to_wxyz([0.0, 0.6, 0.0, 0.8], "xyzw").tolist()
    [0.8, 0.0, 0.6, 0.0]
    """
    q = as_array("quaternion", q, 4)
    if order not in ("wxyz", "xyzw") or product not in ("hamilton", "jpl"):
        raise ValueError(f"order={order!r}, product={product!r}: need wxyz or xyzw, and hamilton or jpl")
    q = np.roll(q, 1, axis=-1) if order == "xyzw" else q.copy()
    if product == "jpl":
        q[..., 1:] *= -1.0
    return q


def quaternion_from_wxyz(q: ArrayLike, order: str, *, product: str = "hamilton") -> Array:
    """Undo :func:`quaternion_to_wxyz`, shape (..., 4), same arguments."""
    ours = quaternion_to_wxyz(q, "wxyz", product=product)  # conjugation is its own inverse
    quaternion_to_wxyz(ours, order)  # only to check the order's name
    return np.roll(ours, -1, axis=-1) if order == "xyzw" else ours


_AXES = {
    "opengl": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),  # x right, y up, z behind: also Bundler, BAL, Blender
    "ros-body": ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),  # x ahead, y left, z up
    "ned": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),  # x ahead, y right, z down
}


def camera_axes(name: str) -> Array:
    """Rotation R_theirs_ours from our camera axes (x right, y down, z ahead) to others, shape (3, 3).

    All of these are right-handed.  A left-handed frame (x right, y up, z ahead, as in some game engines)
    cannot be reached by a rotation: mirror one axis of all data first.

    Parameters
    ----------
    name : {"opengl", "ros-body", "ned"}

    Examples
    --------
    >>> (camera_axes("ros-body") @ [0.0, 0.0, 5.0]).tolist()  # 5 m ahead
    [5.0, 0.0, 0.0]
    """
    if name not in _AXES:
        raise ValueError(f"axes {name!r} are unknown; there are: {', '.join(_AXES)}")
    return np.array(_AXES[name], dtype=np.float64)
