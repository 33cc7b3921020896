"""A program that answers conformance vectors."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import vslam_ref.conformance.adapters
from vslam_ref.commands.samples import Made
from vslam_ref.support.files import write_bytes

SOURCE = Path(vslam_ref.conformance.adapters.__path__[0])
FILES = ("my_slam_adapter.py", "convention.json")
OTHERS = (
    "cpp/adapter.cpp",
    "node/adapter.mjs",
    "node/convention.json",
    "octave/adapter.m",
    "rust/adapter.rs",
)
"""Adapters to start from in other languages."""

README = """\
A small library of rotations, motions and a pinhole camera, and the adapter that lets the vectors ask it. It
needs Python only, nothing installed. Files to start from in C++, JavaScript, Rust, and MATLAB or Octave lie
in the folders beside it; docs/adapters.md says what to replace in them.

format: one request a line on standard input, one reply a line on standard output, JSON (docs/adapters.md)
        convention.json   what the library means by its answers: its rotations come before its translations
true:   every answer is right. With '--wrong' the library takes the Jacobian for small angles with the sign of
        the right one, and 'vslam-ref verify' names that mistake (status 1); without convention.json,
        motions fail: their tangent vectors are read in the wrong order."""


def make(folder: Path, rng: np.random.Generator) -> Made:
    """Copy the program; nothing in it is random."""
    for name in FILES:
        write_bytes(folder / name, (SOURCE / "python" / name).read_bytes())
    for name in OTHERS:
        (folder / name).parent.mkdir(exist_ok=True)
        write_bytes(folder / name, (SOURCE / name).read_bytes())
    program = "python samples/adapter/my_slam_adapter.py"
    declared = "--convention samples/adapter/convention.json"
    commands = tuple(f'vslam-ref verify --program "{p}" {declared}' for p in (program, f"{program} --wrong"))
    return Made(README, commands, {"mistake": "right-jacobian", "where": "the length of phi is below 0.1"})
