"""Train the vocabulary that comes with the package and write it: ``make vocabulary``.

    python -m vslam_ref.experiments.orb.words           # write datasets/vocabulary_files/orb_words.npz
    python -m vslam_ref.experiments.orb.words --check   # exit status 1 if it would be another one

Pictures: rendered scenes, and those of four data sets that may be passed on (CC BY 4.0, MIT, BSD, Apache).
They must be found, and their bytes are part of the provenance, which is written beside the vocabulary.  The
pictures of ``rtabmap_loop_samples`` are none of them: there recognition is judged.  The same seed, the same
pictures and the same table of ORB's pairs give the same words.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vslam_ref.datasets import catalogue
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.datasets.vocabulary_files.own import packed
from vslam_ref.datasets.vocabulary_files.shipped import PROVENANCE, SHIPPED
from vslam_ref.features.orb import OrbSettings, extract
from vslam_ref.features.orb.pair_table import PAIRS
from vslam_ref.features.vocabulary import Vocabulary, train
from vslam_ref.support.files import write_together
from vslam_ref.worlds.rendered import scene

SEED, BRANCHING, LEVELS = 14, 10, 4
SCENES, SCENE_SEEDS, PER_SCENE = ("desk", "corridor", "building"), (101, 102), 8
SETS = {
    "tum_fr3_office_1hz": ("CC BY 4.0", "rgb/*.png"),
    "slambook2": ("MIT", "loop_images/*.png rgbd5/color/*.png"),
    "dbow2_demo": ("BSD", "*.png"),
    "opencv_samples": ("Apache 2.0", "*.jpg planar/box*.png planar/graf*.png stereo/aloe?.jpg"),
}
"""Folder of each set, its licence, and which of its pictures are taken."""
FEATURES = OrbSettings(features=1000)
COMMAND = "python -m vslam_ref.experiments.orb.words"
Bytes = NDArray[np.uint8]


class PictureSource(NamedTuple):
    """Pictures of one kind: what they are, their licence, and their grey values, each (H, W)."""

    name: str
    licence: str
    pictures: list[Bytes]


def sources() -> Iterator[PictureSource]:
    """Yield the pictures, rendered ones first.

    Raises
    ------
    ValueError
        If a data set is missing, with where to get it.
    """
    for name in SCENES:
        made = [scene(name, seed) for seed in SCENE_SEEDS]
        shown = [one.frame(k * len(one) // PER_SCENE) for one in made for k in range(PER_SCENE)]
        yield PictureSource(f"rendered {name}, seeds {' and '.join(map(str, SCENE_SEEDS))}", "MIT", shown)
    for name, (licence, patterns) in SETS.items():
        folder = catalogue.require(name)
        paths = [path for pattern in patterns.split() for path in sorted(folder.glob(pattern))]
        yield PictureSource(name, licence, [read_grey(path) for path in paths])


def trained(given: list[PictureSource], *, branching: int = BRANCHING, levels: int = LEVELS) -> Vocabulary:
    """Train a vocabulary on pictures, with the seed of the one that is shipped."""
    described = [extract(image, FEATURES).descriptor for source in given for image in source.pictures]
    return train(described, np.random.default_rng(SEED), branching=branching, levels=levels)


def provenance(given: list[PictureSource], made: Vocabulary, content: bytes) -> dict[str, Any]:
    """What the vocabulary was made of."""
    digest = hashlib.sha256()
    for source in given:
        for image in source.pictures:
            digest.update(image.tobytes())
    return {
        "command": COMMAND,
        "seed": SEED,
        "branching": BRANCHING,
        "levels": LEVELS,
        "words": made.words,
        "features_per_picture": FEATURES.features,
        "sources": [{"name": s.name, "licence": s.licence, "pictures": len(s.pictures)} for s in given],
        "pictures_sha256": digest.hexdigest(),
        "pair_table_sha256": hashlib.sha256(PAIRS.astype("<i8").tobytes()).hexdigest(),
        "vocabulary_sha256": hashlib.sha256(content).hexdigest(),
    }


def main(arguments: list[str] | None = None) -> int:
    """Write the vocabulary, or compare it with the one that is there."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing: exit status 1 if it differs")
    check = parser.parse_args(arguments).check
    try:
        given = list(sources())
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    made = trained(given)
    content = packed(made)
    if check:
        same = SHIPPED.read_bytes() == content
        print(f"{SHIPPED.name}: {'the same' if same else 'another vocabulary'}")
        return 0 if same else 1
    told = json.dumps(provenance(given, made, content), indent=2) + "\n"
    write_together(SHIPPED.parent, {SHIPPED.name: content, PROVENANCE.name: told.encode()})
    print(f"wrote {SHIPPED.name}: {made.words} words, {len(content)} bytes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
