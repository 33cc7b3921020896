"""Record what FREAK of OpenCV's contrib modules says at our key points.

    python3 -m venv DIR && DIR/bin/pip install opencv-contrib-python-headless scipy numba
    PYTHONPATH=$PWD DIR/bin/python tests/freak/record_contrib.py

It writes ``tests/freak/contrib.npz``: for each picture of ``freak_pairs`` the key points (pixels of their
octave, octave) and contrib's descriptors, and of the pictures a checksum.  The contrib wheel must not be
installed beside the other one: give it an environment of its own.  Its key points have the size 7 x scale:
then both patterns have the same reach of 22 pixels times scale.
"""

from __future__ import annotations

import sys
import zlib
from pathlib import Path

import cv2
import freak_pairs
import numpy as np

TARGET = Path(__file__).with_name("contrib.npz")


def theirs(image: np.ndarray, points: freak_pairs.KeyPoints) -> np.ndarray:
    """Contrib's descriptors (n, 64), in our order."""
    given = [
        cv2.KeyPoint(float(u), float(v), float(7 * s), -1.0, 0.0, 0, k)
        for k, ((u, v), s) in enumerate(zip(points.uv, points.scale, strict=True))
    ]
    found, bits = cv2.xfeatures2d.FREAK_create().compute(image, given)
    if [k.class_id for k in found] != list(range(len(given))):
        raise SystemExit(f"contrib described {len(found)} of {len(given)} key points")
    return bits


def main() -> int:
    if not hasattr(cv2, "xfeatures2d"):
        print("record_contrib: this OpenCV has no contrib modules", file=sys.stderr)
        return 2
    pictures: dict[str, np.ndarray] = {}
    list(freak_pairs.pairs(pictures))
    names = sorted(pictures)
    points = [freak_pairs.points_of(name, pictures[name]) for name in names]
    np.savez_compressed(
        TARGET,
        version=np.array(cv2.__version__),
        name=np.array(names),
        crc=np.array([zlib.crc32(pictures[name].tobytes()) for name in names], np.uint32),
        count=np.array([len(p.octave) for p in points]),
        xy=np.concatenate([p.xy for p in points]),
        octave=np.concatenate([p.octave for p in points]),
        descriptor=np.concatenate([theirs(pictures[n], p) for n, p in zip(names, points, strict=True)]),
    )
    print(f"wrote {TARGET.name}: {TARGET.stat().st_size} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
