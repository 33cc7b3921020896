"""Cameras of every model, mild and strong, and points all over their fields."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vslam_ref.geometry.cameras import Camera, Fisheye, Fov, Pinhole, Radtan, Rational

SENSOR = {"fx": 458.654, "fy": 457.296, "cx": 367.215, "cy": 248.375}
CAMERAS: dict[str, Camera] = {
    "pinhole": Pinhole(**SENSOR),
    "fov": Fov(**SENSOR, omega=0.9332),
    "fov, pinhole limit": Fov(**SENSOR, omega=0.0),
    "fov, 170 degrees": Fov(**SENSOR, omega=2.967),
    "radtan, euroc": Radtan(**SENSOR, k1=-0.28340811, k2=0.07395907, p1=0.00019359, p2=1.76187114e-05),
    "radtan, left01-14": Radtan(**SENSOR, k1=-0.26637, k2=-0.03859, p1=0.00178, p2=-0.00028, k3=0.23839),
    "radtan, turns back": Radtan(**SENSOR, k1=-0.35, k2=0.02, p1=2e-3, p2=-3e-3),
    "radtan, radial only": Radtan(**SENSOR, k1=-0.2, k2=0.0, p1=0.0, p2=0.0),
    "rational": Rational(**SENSOR, k1=0.9, k2=0.2, p1=1e-3, p2=-5e-4, k3=0.01, k4=1.2, k5=0.5, k6=0.05),
    "fisheye": Fisheye(**SENSOR, k1=-0.0137, k2=0.0207, k3=-0.0127, k4=0.0025),
    "fisheye, equidistant": Fisheye(**SENSOR, k1=0.0, k2=0.0, k3=0.0, k4=0.0),
    "fisheye, turns back": Fisheye(**SENSOR, k1=-0.1, k2=0.0, k3=0.0, k4=0.0),
}


def points_in_the_field(
    camera: Camera, share: float, rng: np.random.Generator, count: int = 400
) -> np.ndarray:
    """Points (count, 3) of depth-like size 0.3 to 30 whose angle off the axis is below share * max_angle."""
    # at most 89.4 degrees for the models through the plane z = 1
    widest = share * min(camera.max_angle, np.pi if isinstance(camera, Fisheye) else 1.56)
    theta, around = rng.uniform(0, widest, count), rng.uniform(-np.pi, np.pi, count)
    theta[:5] = [0.0, 1e-12, 1e-8, 1e-4, widest]
    bearing = np.stack([np.sin(theta) * np.cos(around), np.sin(theta) * np.sin(around), np.cos(theta)], -1)
    return bearing * np.exp(rng.uniform(np.log(0.3), np.log(30), (count, 1)))


FieldPoints = Callable[..., np.ndarray]


def named(*beginnings: str) -> list[str]:
    return [name for name in CAMERAS if name.startswith(beginnings)]


@pytest.fixture
def cameras() -> dict[str, Camera]:
    return CAMERAS


@pytest.fixture
def field_points() -> FieldPoints:
    return points_in_the_field


@pytest.fixture(params=CAMERAS)
def camera(request: pytest.FixtureRequest) -> Camera:
    return CAMERAS[request.param]


@pytest.fixture(params=named("pinhole", "radtan", "rational"))
def polynomial_camera(request: pytest.FixtureRequest) -> Camera:
    return CAMERAS[request.param]


@pytest.fixture(params=named("pinhole", "radtan", "rational", "fisheye"))
def opencv_camera(request: pytest.FixtureRequest) -> Camera:
    return CAMERAS[request.param]


@pytest.fixture(params=named("fov"))
def fov_camera(request: pytest.FixtureRequest) -> Camera:
    return CAMERAS[request.param]
