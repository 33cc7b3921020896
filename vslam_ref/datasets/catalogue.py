"""Where the known data sets are on this machine.

A set is a folder of its name inside one of the folders that ``VSLAM_REF_DATA`` lists (separated like
``PATH``), with the files that the table of :mod:`vslam_ref.datasets.known` names in it.
"""

from __future__ import annotations

import os
from pathlib import Path

from vslam_ref.datasets.known import DATA_SETS, DataSet
from vslam_ref.support.errors import suggestion

VARIABLE = "VSLAM_REF_DATA"


def get(name: str) -> DataSet:
    """Return the data set called ``name``.

    Raises
    ------
    ValueError
        If there is none, with the nearest name.
    """
    by_name = {data_set.name: data_set for data_set in DATA_SETS}
    if name not in by_name:
        raise ValueError(f"unknown data set {name!r}{suggestion(name, by_name)}; known: {', '.join(by_name)}")
    return by_name[name]


def search_path() -> list[Path]:
    """Return the folders of ``VSLAM_REF_DATA`` in order; empty if it is not set."""
    return [Path(part).expanduser() for part in os.environ.get(VARIABLE, "").split(os.pathsep) if part]


def find(name: str) -> Path | None:
    """Return the folder of a data set, or None where it is missing or incomplete.

    Raises
    ------
    ValueError
        If no data set has that name.
    """
    data_set = get(name)
    folders = (root / name for root in search_path())
    return next((f for f in folders if all((f / file).exists() for file in data_set.files)), None)


def require(name: str) -> Path:
    """Return the folder of a data set.

    Raises
    ------
    ValueError
        If it is not found, with where to get it.
    """
    folder = find(name)
    if folder is None:
        data_set = get(name)
        raise ValueError(
            f"data set {name!r} not found in {VARIABLE} ({os.environ.get(VARIABLE) or 'not set'}): "
            f"needs {name}/ with {', '.join(data_set.files)}; get it from {data_set.source}"
        )
    return folder
