"""A vehicle log in MRCLAM's layout."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from vslam_ref.commands.samples import Made
from vslam_ref.datasets import mrclam, noise
from vslam_ref.systems.slam_log import simulated
from vslam_ref.worlds.figure_eight import EightConfig, drive, scatter

SECONDS = 120.0
LANDMARKS = 15
"""As many as MRCLAM has."""

README = f"""\
A robot drives eights for {SECONDS:g} s among {LANDMARKS} landmarks and sees those ahead of it, by range and
bearing.

format: MRCLAM (UTIAS multi-robot localisation and mapping), one robot; each file names its columns
true:   Robot1_Groundtruth.dat and Landmark_Groundtruth.dat, exact; truth.json has gains, offsets, delay and
        noises of the log. They are those that the library found in the real MRCLAM logs, and what
        'vslam-ref run' takes by default: a consistent filter has a mean NEES near 3 here."""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Write the log of robot 1."""
    calibration = noise.calibration("mrclam")
    world = drive(EightConfig(seconds=SECONDS), scatter(LANDMARKS, rng))
    log, truth = simulated.log(world, calibration, rng)
    mrclam.write(folder, 1, log, truth)
    known = {
        "robot": 1,
        "landmarks": len(truth.ids),
        "sightings": sum(len(s.ids) for s in log.sightings),
        "calibration": dataclasses.asdict(calibration),
    }
    commands = (
        "vslam-ref run iekf-slam samples/robot --out out/robot",
        "vslam-ref run ekf-slam samples/robot --no-batch --set calibration.turn_gain=1",
    )
    return Made(README, commands, known)
