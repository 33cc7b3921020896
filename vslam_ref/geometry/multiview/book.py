"""Points from cameras and cameras from points, one at a time, as the chapter derives them.

::

    two rows a ray      N_b [R t] (X, 1)' = 0          N_b: two vectors across the bearing b
    a point             stack the rows of all views    the smallest singular vector is (X, 1)
    a camera            stack the rows of all points   the smallest singular vector is [R t]
    from three points   d_1, d_2, d_3 by two conics    then the motion of one triangle onto the other

Points, centres and translations share any unit; bearings are unit vectors.  The fast
forms do the same for many points, or problems, at once.  A test asserts that they agree.
"""

from __future__ import annotations

import numpy as np

from vslam_ref.arrays import Array


def across(b: Array) -> Array:
    """N_b (2, 3): two unit vectors across a bearing b (3,), the null space of its row."""
    return np.asarray(np.linalg.svd(b[None])[2][1:])


def hat(t: Array) -> Array:
    """Matrix (3, 3) of t x, for t (3,): hat(t) a = t x a."""
    return np.array([[0, -t[2], t[1]], [t[2], 0, -t[0]], [-t[1], t[0], 0]])


def essential(R_b_a: Array, t_b_a: Array) -> Array:
    """E (3, 3) of R_b_a (3, 3), t_b_a (3,), with b_b' E b_a = 0 for the bearings of one point."""
    return np.asarray(hat(t_b_a) @ R_b_a)  # eq-essential


def midpoint(p_a: Array, b_a: Array, p_b: Array, b_b: Array) -> Array:
    """Middle (3,) of the shortest segment between two rays; world frame.

    Centres ``p_a (3,)``, ``p_b (3,)``; unit bearings ``b_a (3,)``, ``b_b (3,)``.
    """
    P_a, P_b = np.eye(3) - np.outer(b_a, b_a), np.eye(3) - np.outer(b_b, b_b)
    return np.asarray(np.linalg.solve(P_a + P_b, P_a @ p_a + P_b @ p_b))  # eq-midpoint


def triangulate(R: list[Array], t: list[Array], b: list[Array]) -> Array:
    """Point X_world (3,) by linear equations, from a list over views of R_cam_world, t_cam_world and bearing.

    Each ``R (3, 3)``, ``t (3,)``; each bearing ``b (3,)`` in its camera's frame.
    """
    rows = [across(b_i) @ np.column_stack([R_i, t_i]) for R_i, t_i, b_i in zip(R, t, b, strict=True)]
    X = np.linalg.svd(np.concatenate(rows))[2][-1]  # eq-triangulation-linear
    return np.asarray(X[:3] / X[3])


def nearest_rotation(M: Array) -> Array:
    """Rotation (3, 3) nearest to a matrix M (3, 3)."""
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt)


def resect(b: Array, X: Array) -> tuple[Array, Array]:
    """R_cam_world and t_cam_world from six or more points X (N, 3) seen along b (N, 3), in no plane."""
    rows = [np.kron(across(b_j), np.append(X_j, 1.0)) for b_j, X_j in zip(b, X, strict=True)]
    # row k of across(b) times [R t] times (X, 1): the twelve numbers of [R t], row by row
    P = np.linalg.svd(np.concatenate(rows))[2][-1].reshape(3, 4)  # eq-resection-dlt
    R = nearest_rotation(P[:, :3] * np.sign(np.linalg.det(P[:, :3])))
    N = np.concatenate([across(b_j) for b_j in b])
    right = np.concatenate([-across(b_j) @ R @ X_j for b_j, X_j in zip(b, X, strict=True)])
    return R, np.linalg.lstsq(N, right, rcond=None)[0]


def p3p(b: Array, X: Array) -> list[tuple[Array, Array]]:
    """All (R_cam_world, t_cam_world) from which the points X (3, 3) are seen along the bearings b (3, 3)."""
    pairs = ((0, 1), (0, 2), (1, 2))
    a = [np.sum((X[i] - X[j]) ** 2) for i, j in pairs]
    M = [np.zeros((3, 3)) for _ in pairs]
    for M_ij, (i, j) in zip(M, pairs, strict=True):  # d' M_ij d = a_ij: the law of cosines
        M_ij[i, i] = M_ij[j, j] = 1.0  # eq-p3p-distances
        M_ij[i, j] = M_ij[j, i] = -b[i] @ b[j]
    D_1, D_2 = a[2] * M[0] - a[0] * M[2], a[2] * M[1] - a[1] * M[2]  # eq-p3p-conics
    A, B = 0.8 * D_1 + 0.6 * D_2, 0.8 * D_2 - 0.6 * D_1  # two members of the pencil, a right angle apart
    distances = []
    for lam in np.linalg.eigvals(np.linalg.solve(A, B)):
        if abs(lam.imag) > 1e-9 * abs(lam):
            continue
        sigma, v = np.linalg.eigh(B - lam.real * A)
        if sigma[0] < 0 < sigma[2]:  # this member is two real lines, and they hold every solution
            root = np.sqrt([sigma[2], -sigma[0]])
            for sign in (1.0, -1.0):
                line = root[0] * v[:, 2] + sign * root[1] * v[:, 0]  # eq-p3p-lines
                distances += meet(line, A)
            break
    poses = []
    for d in distances:
        length = np.sqrt(sum(a) / sum(d @ M_ij @ d for M_ij in M))
        d = d * length * np.sign(d.sum())
        if (d > 0).all():
            F_cam, F_world = triad(d[:, None] * b), triad(X)
            R = F_cam @ F_world.T
            poses.append((R, d[0] * b[0] - R @ X[0]))
    return poses


def meet(line: Array, A: Array) -> list[Array]:
    """Real points x (3,) on line (3,) and conic A (3, 3): line' x = 0 and x' A x = 0."""
    p, q = across(line / np.linalg.norm(line))
    s = np.roots([p @ A @ p, 2 * p @ A @ q, q @ A @ q])
    return [s_k.real * p + q for s_k in s if abs(s_k.imag) <= 1e-9 * abs(s_k)]


def triad(X: Array) -> Array:
    """Right-handed frame (3, 3) of a triangle X (3, 3), one corner per row; its axes are the columns."""
    x = X[1] - X[0]
    z = np.cross(x, X[2] - X[0])
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])
