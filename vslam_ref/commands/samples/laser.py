"""A laser log in CARMEN's format."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vslam_ref.arrays import Array
from vslam_ref.commands.samples import Made
from vslam_ref.datasets import carmen
from vslam_ref.support.files import write_text
from vslam_ref.worlds.floor_plan import (
    CrowdConfig,
    FloorPlanConfig,
    LaserConfig,
    Recording,
    RobotConfig,
    simulate,
)
from vslam_ref.worlds.floor_plan.robot import drive

BEAMS = 181
CONFIG = FloorPlanConfig(
    crowd=CrowdConfig(density=0.03),
    laser=LaserConfig(beams=BEAMS, field_of_view=float(np.pi), max_range=20.0),
    robot=RobotConfig(scan_period=0.25),
)

README = f"""\
A robot drives through an office of 14 m x 10 m: five rooms, a corridor, doors that open, people who walk.
Its laser has {BEAMS} beams over half a circle and 1.5 cm of noise; of one beam in a hundred nothing comes
back (81.91).

format: CARMEN log, lines 'FLASER n r_1 ... r_n x y theta odom_x odom_y odom_theta time host time'
true:   x y theta of every line is the laser's true pose; odom_* is what noisy wheels say.
        walls.csv    segments of everything that never moves: ax_m, ay_m, bx_m, by_m
        people.csv   time_s, person, x_m, y_m of the middle of everybody at every scan"""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Write the log, the walls and the people."""
    recording = simulate(CONFIG, rng)
    wheels = drive(recording.T_world_robot[0], recording.odometry.increment)
    carmen.write(folder / "office.log", recording.T_world_robot, wheels, recording.ranges, recording.times)
    fixed = recording.segments[0][recording.segment_owner == 0]
    _write_csv(folder / "walls.csv", "ax_m,ay_m,bx_m,by_m", fixed.tolist())
    _write_csv(folder / "people.csv", "time_s,person,x_m,y_m", _people(recording))
    known = {
        "scans": len(recording.times),
        "people": recording.people.shape[1],
        "seconds": float(recording.times[-1]),
        "wheels_end_off_m": float(np.hypot(*(wheels[-1] - recording.T_world_robot[-1])[:2])),
    }
    command = "vslam-ref grid samples/laser/office.log --out out/office"
    return Made(README, (command, f"{command} --resolution 0.05 --set video_frames=0"), known)


def _people(recording: Recording) -> list[list[float]]:
    return [
        [time, person, *place]
        for time, places in zip(recording.times.tolist(), recording.people.tolist(), strict=True)
        for person, place in enumerate(places)
    ]


def _write_csv(path: Path, head: str, rows: list[list[float]] | Array) -> None:
    lines = [head, *(",".join(map(repr, row)) for row in rows)]
    write_text(path, "\n".join(lines) + "\n")
