"""A small library in plain Python, and the adapter that lets the conformance vectors ask it.

    vslam-ref verify --program "python my_slam_adapter.py" --convention convention.json

Replace sections 1 and 2 by your own program, and section 3 by your own table.
"""

import json
import math
import sys

WRONG = "--wrong" in sys.argv  # the mistake of a small-angle branch, to see it found

# --- 1. the library: matrices are lists of rows, angles radians, tangents of motions rotation first


def rotation(phi):
    """Rotation matrix of a rotation vector: I + a hat(phi) + b hat(phi)^2."""
    a, b, _ = weights(math.hypot(*phi))
    return polynomial(phi, a, b)


def left_jacobian(phi):
    """Left Jacobian of the rotation: I + b hat(phi) + c hat(phi)^2."""
    angle = math.hypot(*phi)
    _, b, c = weights(angle)
    return polynomial(phi, -b if WRONG and angle < 0.1 else b, c)


def motion(xi):
    """Rigid motion (4, 4) of a tangent vector, rotation first."""
    phi, rho = xi[:3], xi[3:]
    t = apply(left_jacobian(phi), rho)
    return [[*row, x] for row, x in zip(rotation(phi), t)] + [[0.0, 0.0, 0.0, 1.0]]


def move(T, x):
    """Point T x."""
    return [dot(row[:3], x) + row[3] for row in T[:3]]


def pixel(params, X):
    """Pixel of a point in the camera's frame, z ahead; pinhole."""
    fx, fy, cx, cy = params
    if not X[2] > 0.0:
        raise ValueError("the point is not in front of the camera")
    return [fx * X[0] / X[2] + cx, fy * X[1] / X[2] + cy]


# --- 2. its arithmetic


def weights(x):
    """Sin x / x, (1 - cos x) / x^2 and (x - sin x) / x^3, without cancellation."""
    if x < 0.5:
        a = b = c = 0.0
        for k in range(9, -1, -1):  # x^18 / 21! < 1e-25
            sign, y = (-1) ** k, x ** (2 * k)
            a += sign * y / math.factorial(2 * k + 1)
            b += sign * y / math.factorial(2 * k + 2)
            c += sign * y / math.factorial(2 * k + 3)
        return a, b, c
    return math.sin(x) / x, 2.0 * (math.sin(x / 2) / x) ** 2, (x - math.sin(x)) / x**3


def polynomial(phi, p, q):
    """I + p hat(phi) + q hat(phi)^2."""
    x, y, z = phi
    W = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    WW = [[dot(row, column) for column in zip(*W)] for row in W]
    return [[(i == j) + p * W[i][j] + q * WW[i][j] for j in range(3)] for i in range(3)]


def apply(M, x):
    """M x."""
    return [dot(row, x) for row in M]


def dot(a, b):
    """Sum of products."""
    return sum(s * t for s, t in zip(a, b))


# --- 3. the adapter: names of the catalogue -> the library ('vslam-ref vectors list' shows all)


def project(model, params, X_cam):
    """A camera of another model is not supported."""
    if model != "pinhole":
        raise NotImplementedError(model)
    return {"uv": pixel(params, X_cam), "valid": True}


TABLE = {
    "so3.exp": lambda phi: rotation(phi),
    "so3.left_jacobian": lambda phi: left_jacobian(phi),
    "se3.exp": lambda xi: motion(xi),
    "se3.act": lambda T, x: move(T, x),
    "camera.project": project,
}


def answer(function, inputs):
    """Answer one question."""
    if function not in TABLE:
        raise NotImplementedError(function)
    return TABLE[function](**inputs)


def main():
    """Answer requests, one a line, until the input ends."""
    for line in sys.stdin:
        request = json.loads(line)
        reply = {"id": request["id"]}
        try:
            reply["value"] = answer(request["function"], request["inputs"])
        except NotImplementedError:
            reply["unsupported"] = True
        except (ValueError, ArithmeticError) as error:
            reply["error"] = str(error)
        print(json.dumps(reply), flush=True)


if __name__ == "__main__":
    main()
