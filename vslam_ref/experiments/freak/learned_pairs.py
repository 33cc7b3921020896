"""Learn the table of FREAK's pairs and write it as a module: ``make freak-table``.

    python -m vslam_ref.experiments.freak.learned_pairs           # write features/freak/pair_table.py
    python -m vslam_ref.experiments.freak.learned_pairs --check   # exit status 1 if it would be another one

The pictures are rendered scenes alone, so that it needs no data; their bytes are part of the table's
provenance.  The same seeds give the same table, byte for byte, with and without Numba.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vslam_ref.experiments.orb.learned_table import SCENES, rendered_pictures, write_or_check
from vslam_ref.features.freak import learning
from vslam_ref.features.levels import Bytes
from vslam_ref.features.orb import OrbSettings

SCENE_SEEDS, PER_SCENE = (101, 102, 103), 4
PER_PICTURE = OrbSettings(features=400)
TARGET = Path(learning.__file__).with_name("pair_table.py")
COMMAND = "python -m vslam_ref.experiments.freak.learned_pairs"


def pictures() -> Iterator[Bytes]:
    """Yield the rendered pictures from which is learned."""
    yield from rendered_pictures(SCENE_SEEDS, PER_SCENE)


def table() -> str:
    """Return the text of the module."""
    digest, found = hashlib.sha256(), []
    for image in pictures():
        digest.update(image.tobytes())
        found.append(learning.patches(image, PER_PICTURE))
    mean = np.concatenate(found)
    learned = learning.learn(mean)
    rows = learned.pairs.reshape(32, 32)
    return HEAD.format(
        command=COMMAND,
        pictures=len(found),
        scenes=", ".join(SCENES),
        seeds=", ".join(map(str, SCENE_SEEDS)),
        digest=digest.hexdigest()[:32],
        points=len(mean),
        limit=learned.limit,
        off=float(np.abs(learned.mean - 0.5).max()),
        numbers="\n".join("  ".join(f"{i} {j}" for i, j in row.reshape(16, 2)) for row in rows),
        crc=hashlib.sha256(learned.pairs.astype("<i8").tobytes()).hexdigest()[:32],
    )


HEAD = '''"""Which fields are compared: 512 pairs of the pattern's 43, counted from the outermost inwards.

Learned, not drawn and not taken over: written by
``{command}``.

* {pictures} pictures: rendered scenes {scenes} with seeds {seeds}.
  Their grey levels: SHA-256 {digest}.
* {points} key points, 903 candidates.  Largest correlation of two comparisons: below {limit:.2f};
  largest distance of a comparison's mean from one half: {off:.3f}.
* The pairs as 64-bit whole numbers, low byte first: SHA-256 {crc}.
"""

from __future__ import annotations

import numpy as np

_NUMBERS = """
{numbers}
"""

PAIRS = np.array(_NUMBERS.split(), np.int64).reshape(512, 2)
"""Fields (first, second); the first pair gives bit 0 of byte 0."""
'''


def main(arguments: list[str] | None = None) -> int:
    """Write the table, or compare it with the one that is there."""
    return write_or_check(__doc__ or "", TARGET, table, arguments)


if __name__ == "__main__":
    sys.exit(main())
