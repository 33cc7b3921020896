"""The table of the real data sets the project knows, ``known.toml``; none of them is part of the project."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import NamedTuple

LICENCE_CLASSES = {
    "A": "redistributable (public domain, BSD, MIT, Apache, CC BY)",
    "B": "CC BY-NC-SA 3.0: attribution, non-commercial, share alike",
    "C": "GPL-2 data",
    "D": "open research data without a licence text: cite it",
    "E": "non-commercial research only",
}


class DataSet(NamedTuple):
    """One data set.

    Parameters
    ----------
    name : str
        Its folder.
    what : str
        Content and use.
    licence : str
        Key of ``LICENCE_CLASSES``; where files differ, the strictest.
    source : str
        Where a user gets it.
    files : tuple of str
        Paths inside the folder that must exist for the set to count as found.
    """

    name: str
    what: str
    licence: str
    source: str
    files: tuple[str, ...]


_TABLE = tomllib.loads((files(__package__) / "known.toml").read_text(encoding="utf-8"))
DATA_SETS = tuple(DataSet(**{**row, "files": tuple(row["files"])}) for row in _TABLE["data_set"])
