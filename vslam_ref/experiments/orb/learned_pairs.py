"""Learn the table of ORB's pairs and write it as a module: ``make pair-table``.

    python -m vslam_ref.experiments.orb.learned_pairs           # write features/orb/pair_table.py
    python -m vslam_ref.experiments.orb.learned_pairs --check   # exit status 1 if it would be another one

Pictures: rendered scenes, and those of three data sets that may be passed on (CC BY 4.0, MIT, BSD).  They
must be found, and their bytes are part of the table's provenance.  The same seed and the same pictures give
the same table, byte for byte, with and without Numba.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.experiments.orb.learned_table import SCENES, rendered_pictures, write_or_check
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb import OrbSettings, learning

SEED, CANDIDATES = 2011, 40_000
SCENE_SEEDS, PER_SCENE = (101, 102), 2
SETS = {
    "tum_fr3_office_1hz": "rgb/*.png",
    "slambook2": "loop_images/*.png",
    "dbow2_demo": "*.png",
}
PER_PICTURE = OrbSettings(features=160)
TARGET = Path(learning.__file__).with_name("pair_table.py")
COMMAND = "python -m vslam_ref.experiments.orb.learned_pairs"


def pictures() -> Iterator[Bytes]:
    """Yield the pictures from which is learned, rendered ones first."""
    yield from rendered_pictures(SCENE_SEEDS, PER_SCENE)
    for folder, pattern in SETS.items():
        for path in sorted(catalogue.require(folder).glob(pattern)):
            yield read_grey(path)


def table() -> str:
    """Return the text of the module."""
    digest, found = hashlib.sha256(), []
    for image in pictures():
        digest.update(image.tobytes())
        found.append(learning.patches(image, PER_PICTURE))
    patch = np.concatenate(found)
    learned = learning.learn(patch, learning.drawn(CANDIDATES, np.random.default_rng(SEED)))
    rows = learned.pairs.reshape(64, 16)
    lines = ["  ".join(" ".join(map(str, pair)) for pair in row.reshape(4, 4)) for row in rows]
    off = float(np.abs(learned.mean - 0.5).max())
    return HEAD.format(
        command=COMMAND,
        seed=SEED,
        candidates=CANDIDATES,
        pictures=len(found),
        scenes=", ".join(SCENES),
        seeds=" and ".join(map(str, SCENE_SEEDS)),
        sets=", ".join(SETS),
        digest=digest.hexdigest()[:32],
        patches=len(patch),
        limit=learned.limit,
        off=off,
        numbers="\n".join(lines),
    )


HEAD = '''"""Which pixels are compared: 256 pairs of offsets from the centre of a patch.

Learned, not drawn: written by ``{command}``, seed {seed}.

* {pictures} pictures: rendered scenes {scenes} with seeds {seeds};
  sets {sets}.
  Their grey levels: SHA-256 {digest}.
* {patches} patches, {candidates} candidates.  Largest correlation of two tests: below {limit:.2f};
  largest distance of a test's mean from one half: {off:.3f}.
"""

from __future__ import annotations

import numpy as np

_NUMBERS = """
{numbers}
"""

PAIRS = np.array(_NUMBERS.split(), np.int64).reshape(256, 4)
"""Offsets (x, y, x, y), pixels; the first pair gives bit 0 of byte 0."""
'''


def main(arguments: list[str] | None = None) -> int:
    """Write the table, or compare it with the one that is there."""
    return write_or_check(__doc__ or "", TARGET, table, arguments)


if __name__ == "__main__":
    sys.exit(main())
