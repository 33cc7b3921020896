"""Vehicle models: B4, and the front wheel's model."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
from mpmath import mpf

from generator import ekf_others
from generator.building import Topic, tolerance
from generator.draws import log_uniform
from generator.exact_arrays import Big, big, doubles, stack
from generator.exact_ekf import increment, moved, rotation, wrapped

TOPIC, CHAPTER = "vehicle", 15
DEFINITION = "definition, 50 digits"

NOTES = {
    "track-width": (
        "you put the track width where the wheelbase belongs, as B6 is printed: the car turns too fast",
        "theta + v dt tan(steering)/track",
    ),
    "front-wheel": (
        "your vehicle is Bailey's: speed and place of the front wheel; another convention than B4's",
        "x + v dt cos(theta + steering), theta + v dt sin(steering)/wheelbase",
    ),
    "sine-for-tangent": (
        "you turn by the sine of the steering angle at the rear axle's speed, where B4 has the tangent",
        "theta + v dt sin(steering)/wheelbase",
    ),
    "turn-first": (
        "your car turns before it drives: its place moves along the new heading",
        "x + v dt cos(theta + v dt tan(steering)/wheelbase)",
    ),
    "ahead-then-turn": (
        "you go ahead and turn then; between two poses with a constant yaw rate lies an arc",
        "x + v dt cos(theta)",
    ),
    "turn-then-ahead": (
        "you turn first and go ahead along the new heading",
        "x + v dt cos(theta + omega dt)",
    ),
    "exact-arc": (
        "your car drives along the arc; B4 drives along the tangent, then turns",
        "x + L/tan(steering) (sin(theta + turn) - sin(theta))",
    ),
    "half-turn-first": (
        "your car drives along the heading in the middle of the step; B4 along the old one",
        "x + v dt cos(theta + turn/2)",
    ),
    "heading-not-wrapped": ("your heading leaves (-pi, pi]", "theta + turn, not wrapped"),
    "sin-cos-swapped": ("sine and cosine of the heading are swapped", "x + v dt sin(theta)"),
    "transposed-rotation": (
        "you turn the wrong way between the axes of the vehicle and those of the world",
        "R for R^T, R^T for R",
    ),
    "not-turned": (
        "you take the relative place for one in global axes, as B20 is printed",
        "landmark - position, position + z",
    ),
    "sine-of-the-ratio": (
        "your yaw is the sine of the steering angle over the wheelbase: a misplaced bracket",
        "theta + V dt sin(G/wheelbase)",
    ),
    "rear-axle": (
        "your vehicle is that of the rear axle, B4; the front wheel's was asked for",
        "theta + V dt tan(G)/wheelbase",
    ),
}

Model = Callable[[Big, Big, Any, Any], Big]


def rear(x: Big, control: Big, wheelbase: Any, dt: Any) -> Big:
    """B4, its heading not wrapped."""
    return moved(x, increment(control, wheelbase, dt))


def front(x: Big, control: Big, wheelbase: Any, dt: Any) -> Big:
    """The front wheel's model, its heading not wrapped."""
    step, along = control[0] * dt, x[2] + control[1]
    turn = step * mpmath.sin(control[1]) / wheelbase
    return stack([x[0] + step * mpmath.cos(along), x[1] + step * mpmath.sin(along), x[2] + turn])


def build(rng: np.random.Generator) -> Topic:
    """All groups of vehicle models."""
    topic = Topic(CHAPTER, TOPIC, NOTES)
    rule = tolerance(1e-14, "a dozen operations on numbers of the pose's size", absolute=1e-14)
    regimes: dict[str, tuple[int, Callable[[], list[Any]]]] = {
        "": (20, lambda: _inputs(rng, speed=(0.5, 15.0), steering=(0.05, 0.6))),
        "reverse": (15, lambda: _inputs(rng, speed=(-5.0, -0.3), steering=(0.05, 0.6))),
        "sharp_turn": (15, lambda: _inputs(rng, speed=(0.5, 3.0), steering=(0.9, 1.4))),
        "near_pi": (20, lambda: _across_pi(rng)),
        "straight": (10, lambda: _inputs(rng, speed=(0.5, 15.0), steering=(0.0, 0.0))),
        "standing": (5, lambda: _inputs(rng, speed=(0.0, 0.0), steering=(0.05, 0.6))),
        "small_angle": (15, lambda: _inputs(rng, speed=(0.5, 15.0), steering=(1e-9, 1e-5))),
    }
    for flag, (count, draw) in regimes.items():
        flags = (flag,) if flag else ()
        cases = [_rear(draw()) for _ in range(count)]
        topic.group("vehicle.ackermann", "eq-b4", DEFINITION, rule, cases, flags=flags)
        if flag in ("", "reverse", "near_pi", "straight"):
            cases = [_front(draw()) for _ in range(min(count, 15))]
            topic.group("vehicle.front_wheel", "eq-b4", DEFINITION, rule, cases, flags=flags)
    _sightings(topic, rng, rule)
    cases = [_other_convention(regimes[""][1]()) for _ in range(5)]
    topic.group("vehicle.ackermann", "eq-b4", DEFINITION, rule, cases, flags=("convention",))
    ekf_others.yaw_rates(topic, rng)
    return topic


def _sightings(topic: Topic, rng: np.random.Generator, rule: dict[str, Any]) -> None:
    """A landmark seen, and one placed."""
    seen, placed = [], []
    for _ in range(12):
        x = np.round([*rng.uniform(-20, 20, 2), rng.uniform(-3.1, 3.1)], 3)
        other = np.round(rng.uniform(-20, 20, 2), 3)
        pose, point, R = big(x), big(other), rotation(mpf(x[2]))
        d = point - pose[:2]
        wrong = {"transposed-rotation": R @ d, "not-turned": d}
        seen.append(_case({"x": x, "landmark": other}, R.T @ d, wrong, "z"))
        wrong = {"transposed-rotation": pose[:2] + R.T @ point, "not-turned": pose[:2] + point}
        placed.append(_case({"x": x, "z": other}, pose[:2] + R @ point, wrong, "landmark"))
    topic.group("vehicle.relative", "eq-b21", DEFINITION, rule, seen)
    topic.group("vehicle.place", "eq-b25", DEFINITION, rule, placed)


def _inputs(rng: np.random.Generator, speed: tuple[float, float], steering: tuple[float, float]) -> list[Any]:
    """Pose, control, wheelbase, track width, duration."""
    x = [*np.round(rng.uniform(-20, 20, 2), 3), round(rng.uniform(-2.5, 2.5), 4)]
    low, high = steering
    angle = log_uniform(rng, low, high) * rng.choice([-1, 1]) if high > 0 else 0.0
    control = [round(rng.uniform(speed[0], speed[1]), 3), float(f"{angle:.4g}")]
    wheelbase = round(rng.uniform(0.8, 3.5), 2)
    dt = float(rng.choice([0.1, 0.025, 0.5]))
    return [np.array(x), np.array(control), wheelbase, round(0.55 * wheelbase, 2), dt]


def _across_pi(rng: np.random.Generator) -> list[Any]:
    """The turn takes the heading past pi, or past minus pi."""
    x, control, wheelbase, track, _ = _inputs(rng, (2.0, 6.0), (0.3, 0.7))
    side = float(np.sign(control[1]))
    x[2] = round(side * (np.pi - rng.uniform(0.001, 0.02)), 4)
    return [x, control, wheelbase, track, 0.1]


def _rear(inputs: list[Any]) -> dict[str, Any]:
    """A case of B4, with what the wrong formulas give where they give something else."""
    x, control, wheelbase, track, dt = inputs
    args = big(x), big(control), mpf(wheelbase), mpf(dt)
    plain = rear(*args)
    wrong = {
        "track-width": wrapped(rear(args[0], args[1], mpf(track), args[3])),
        "front-wheel": wrapped(front(*args)),
        **{name: wrapped(value) for name, value in _variants(*args).items()},
        "heading-not-wrapped": plain,
    }
    names = ("x", "control", "wheelbase", "track", "dt")
    return _case(dict(zip(names, inputs, strict=True)), wrapped(plain), wrong)


def _variants(x: Big, control: Big, wheelbase: Any, dt: Any) -> dict[str, Big]:
    ds, turn = increment(control, wheelbase, dt)
    c, s = mpmath.cos, mpmath.sin
    arc = moved(x, stack([ds, turn]))
    if turn != 0:
        radius = ds / turn
        ahead = [x[0] + radius * (s(x[2] + turn) - s(x[2])), x[1] - radius * (c(x[2] + turn) - c(x[2]))]
        arc = stack([*ahead, x[2] + turn])
    return {
        "sine-for-tangent": moved(x, stack([ds, ds * s(control[1]) / wheelbase])),
        "turn-first": stack([x[0] + ds * c(x[2] + turn), x[1] + ds * s(x[2] + turn), x[2] + turn]),
        "exact-arc": arc,
        "half-turn-first": stack(
            [x[0] + ds * c(x[2] + turn / 2), x[1] + ds * s(x[2] + turn / 2), x[2] + turn]
        ),
        "sin-cos-swapped": stack([x[0] + ds * s(x[2]), x[1] + ds * c(x[2]), x[2] + turn]),
    }


def _front(inputs: list[Any]) -> dict[str, Any]:
    """A case of the front wheel's model."""
    x, control, wheelbase, _, dt = inputs
    args = big(x), big(control), mpf(wheelbase), mpf(dt)
    value = front(*args)
    ratio = value.copy()
    ratio[2] = args[0][2] + args[1][0] * args[3] * mpmath.sin(args[1][1] / args[2])
    wrong = {"sine-of-the-ratio": wrapped(ratio), "rear-axle": wrapped(rear(*args))}
    wrong["heading-not-wrapped"] = value
    return _case({"x": x, "control": control, "wheelbase": wheelbase, "dt": dt}, wrapped(value), wrong)


def _other_convention(inputs: list[Any]) -> dict[str, Any]:
    """The front wheel's answer is told, and passes."""
    case = _rear(inputs)
    mistakes = {"front-wheel": case["mistakes"]["front-wheel"]}
    return {**case, "mistakes": mistakes, "result": "convention"}


def _case(inputs: dict[str, Any], right: Big, wrong: dict[str, Big], name: str = "x") -> dict[str, Any]:
    """A case; a wrong formula that gives nearly the right value, or another's, is none of its mistakes."""
    apart, known = {}, [right]
    for note, value in wrong.items():
        if all(max(abs(v) for v in value - other) > 1e-9 for other in known):
            apart[note] = {name: doubles(value)}
            known.append(value)
    case = {"inputs": inputs, "expected": {name: doubles(right)}}
    return {**case, "mistakes": apart} if apart else case
