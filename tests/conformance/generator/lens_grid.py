"""Cameras at every distance from the axis, on it, and with a lens of nearly no effect."""

from __future__ import annotations

from typing import Any

import numpy as np

from generator.angles import losing
from generator.building import Topic, lost_digits, tolerance
from generator.draws import digits
from generator.lens_slopes import SLOPES, in_intrinsics, in_pixel_case, in_point
from generator.lenses import EQUATIONS, camera
from vslam_ref.arrays import Array

RADII = (1e-14, 1e-9, 1e-6, 3e-4, 2e-3, 0.02, 0.4)
"""Tangents of the angle off the axis: log-spaced up to where every lens has an image."""
OMEGAS = (0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 5e-3, 0.0099, 0.0101, 0.02, 0.05, 0.1, 0.3)
STOPPED = "an iteration that stops at 1e-8 of the plane z = 1"


def stopping(rule: dict[str, Any], model: str) -> dict[str, Any]:
    """Tolerance of an inverse that most programs find by iteration, stopped early."""
    if model in ("pinhole", "fov"):
        return rule
    return {**rule, "lost_digits": lost_digits(1e-8, STOPPED)}


def every_radius(topic: Topic, rng: np.random.Generator, model: str, made: Any) -> None:
    """Pixels, bearings and Jacobians on the axis and at log-spaced distances from it.

    ``made`` has the makers of pixels and bearings, their tolerances, and the inverse's equation.
    """
    slopes = tolerance(1e-13, "closed forms of some fifty operations", float32=1e-4)
    back = tolerance(1e-13, "the inverse of a Jacobian of condition below 30", float32=1e-3)
    some = [(_camera(rng, model), _point(r, k)) for k, r in enumerate(RADII)]
    axis = [(_camera(rng, model), np.array([0.0, 0.0, z])) for z in (1.0, 3.7)]
    for flag, rows in (("any_radius", some), ("on_axis", axis)):
        flags = (model, flag)
        cases = [_bare(made.pixel(model, k, X)) for k, X in rows]
        if flag != "on_axis":
            topic.group("camera.project", EQUATIONS[model], made.definition, made.fine, cases, flags=flags)
        cases = [_bare(made.bearing(model, k, X)) for k, X in rows]
        topic.group("camera.unproject", made.inverse, made.newton, made.rule, cases, flags=flags)
        cases = [_bare(in_point(model, k, X)) for k, X in rows]
        topic.group("camera.jacobian_point", "eq-jacobian-point", SLOPES, slopes, cases, flags=flags)
        cases = [_bare(in_intrinsics(model, k, X)) for k, X in rows]
        topic.group(
            "camera.jacobian_intrinsics", "eq-jacobian-intrinsics", SLOPES, slopes, cases, flags=flags
        )
        cases = [_bare(in_pixel_case(model, k, X)) for k, X in rows]
        topic.group("camera.jacobian_ray", "eq-jacobian-ray", SLOPES, back, cases, flags=flags)


def narrow(topic: Topic, rng: np.random.Generator, model: str, made: Any) -> None:
    """A lens of long focal length: a field of two degrees, where nearly all is axis."""
    params = _camera(rng, model)
    params[:2] = digits(20 * params[:2], 6)
    flags, X = (model, "narrow"), _point(0.015, 2)
    case = _bare(made.pixel(model, params, X))
    topic.group("camera.project", EQUATIONS[model], made.definition, made.fine, [case], flags=flags)
    case = _bare(made.bearing(model, params, X))
    topic.group("camera.unproject", made.inverse, made.newton, made.rule, [case], flags=flags)


def every_omega(topic: Topic, rng: np.random.Generator, made: Any) -> None:
    """The FOV lens from no effect to a strong one, and its ray's Jacobian there."""
    fine = tolerance(1e-13, "series of even order in omega")
    flags, why = ("fov", "any_omega"), "arctan(r T)/omega, differentiated, loses eps f/omega, f in pixels"
    for k, omega in enumerate(OMEGAS):
        params, X = _camera(rng, "fov"), _point((0.4, 0.05, 1.0)[k % 3], k)
        params[4] = omega
        case = [_bare(made.pixel("fov", params, X))]
        topic.group("camera.project", EQUATIONS["fov"], made.definition, made.fine, case, flags=flags)
        case = [_bare(made.bearing("fov", params, X))]
        topic.group("camera.unproject", "eq-fov-inverse", made.definition, fine, case, flags=flags)
        rule = losing(fine, omega / params[0], 1, why)
        case = [{**_bare(in_intrinsics("fov", params, X)), "tolerance": rule}]
        topic.group("camera.jacobian_intrinsics", "eq-fov-omega", SLOPES, fine, case, flags=flags)
        case = [_bare(in_point("fov", params, X))]
        topic.group("camera.jacobian_point", "eq-fov-jacobian", SLOPES, fine, case, flags=flags)
        case = [_bare(in_pixel_case("fov", params, X))]
        topic.group("camera.jacobian_ray", "eq-jacobian-ray", SLOPES, fine, case, flags=flags)


def _camera(rng: np.random.Generator, model: str) -> Array:
    return digits(camera(rng, model), 6)


def _point(r: float, k: int) -> Array:
    """Point at this distance from the axis: on an axis of the picture, or between them."""
    way = ((1.0, 0.0), (0.0, -1.0), (0.6, 0.8), (-0.8, 0.6))[k % 4]
    return digits(np.array([r * way[0], r * way[1], 1.0]) * (1.0, 2.5, 6.0)[k % 3])


def _bare(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if key != "mistakes"}
