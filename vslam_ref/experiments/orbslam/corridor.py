"""A real corridor, walked twice: pictures, and which of them show one place."""

from __future__ import annotations

from typing import NamedTuple

from vslam_ref.arrays import BoolArray
from vslam_ref.datasets import catalogue
from vslam_ref.datasets.pictures import read_grey
from vslam_ref.datasets.text import FormatError
from vslam_ref.experiments.orbslam.lookalikes import PictureFeatures, features

NAME = "rtabmap_loop_samples"
FIRST_ROUND = 40
"""Pictures before the walk comes back."""


class Corridor(NamedTuple):
    """Features of the pictures in the order of time, and pairs (K, K) of a picture and an earlier one."""

    given: list[PictureFeatures]
    same: BoolArray


def load() -> Corridor:
    """Read the pictures and the truth.

    Raises
    ------
    ValueError
        If the data set is not there, or its pictures and its truth are not equally many.
    """
    folder = catalogue.require(NAME)
    same = read_grey(folder / "samples_GT.bmp") > 127
    names = sorted((folder / "samples").glob("*.jpg"), key=lambda path: (len(path.stem), path.stem))
    if same.shape != (len(names), len(names)):
        raise FormatError(
            folder, None, f"{len(names)} pictures and a truth of {same.shape}; expected as many"
        )
    return Corridor([features(read_grey(path)) for path in names], same)
