"""``vslam-ref warm-cache``: compile the Numba twins once, so that later runs start at full speed."""

from __future__ import annotations

import argparse
import importlib
import time

from vslam_ref.commands.options import add_json, json_target, write_json

HELP = "compile the accelerated kernels now and keep them on disk"
EPILOG = "example: vslam-ref warm-cache"

WITH_TWINS = (
    *("vslam_ref.features", "vslam_ref.features.freak", "vslam_ref.estimation.bundle", "vslam_ref.grids"),
    *("vslam_ref.filters.ekf_slam", "vslam_ref.filters.carleman_ekf"),
    *("vslam_ref.systems.ptam", "vslam_ref.systems.orbslam", "vslam_ref.worlds.rendered"),
)
"""Importing them declares all twins."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Compile, or say why there is nothing to compile."""
    from vslam_ref import _kernels

    target = json_target(options)
    backend = _kernels.backend()
    start = time.perf_counter()
    ready, aside = 0, list[str]()
    if backend == "numba":
        for module in WITH_TWINS:
            importlib.import_module(module)
        aside = _kernels.set_aside()
        ready = len(_kernels.REGISTRY) - len(aside)
        _kernels.warm()
        seconds = time.perf_counter() - start
        print(f"{ready} kernels ready after {seconds:.1f} s")
        if aside:
            names = ", ".join(aside)
            print(f"set aside, since their code changed ('make twins' tests them again): {names}")
    else:
        seconds = 0.0
        print("nothing to compile: the NumPy backend is in use (pip install 'vslam-ref[fast]' for Numba)")
    write_json(target, {"backend": backend, "kernels": ready, "set_aside": aside, "seconds": seconds})
    return 0
