"""``vslam-ref warm-cache``: compile the Numba twins once, so that later runs start at full speed."""

from __future__ import annotations

import argparse
import time

from vslam_ref.commands.options import add_json, json_target, write_json

HELP = "compile the accelerated kernels now and keep them on disk"
EPILOG = "example: vslam-ref warm-cache"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of this command."""
    add_json(parser)


def run(options: argparse.Namespace) -> int:
    """Compile, or say why there is nothing to compile."""
    from vslam_ref import _kernels

    target = json_target(options)
    backend = _kernels.backend()
    start = time.perf_counter()
    if backend == "numba":
        import vslam_ref.filters.carleman_ekf
        import vslam_ref.filters.ekf_slam  # noqa: F401  (importing declares the twins)

        _kernels.warm()
        seconds = time.perf_counter() - start
        print(f"{len(_kernels.REGISTRY)} kernels ready after {seconds:.1f} s")
    else:
        seconds = 0.0
        print("nothing to compile: the NumPy backend is in use (pip install 'vslam-ref[fast]' for Numba)")
    write_json(target, {"backend": backend, "kernels": len(_kernels.REGISTRY), "seconds": seconds})
    return 0
