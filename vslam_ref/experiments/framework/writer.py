"""One experiment's folder: ``figure.svg``, ``figure.png``, ``result.json``, ``runs.npz``."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vslam_ref.experiments.framework.claims import Claim, check_distinct
from vslam_ref.support import files
from vslam_ref.support.config import assumptions, config_to_dict
from vslam_ref.support.json_text import to_json
from vslam_ref.support.provenance import versions

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vslam_ref.experiments.framework.driver import Study
    from vslam_ref.experiments.framework.experiment import Experiment
    from vslam_ref.plot.saving import Figure

FILES = ("figure.svg", "figure.png", "result.json", "runs.npz")
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time a zip file can state


def document(
    experiment: Experiment[Any], study: Study[Any], claims: Sequence[Claim], seconds: float, quick: bool
) -> dict[str, Any]:
    """Return the content of ``result.json``, keys in their written order."""
    check_distinct(claims)
    return {
        "experiment": experiment.id,
        "title": experiment.title,
        "source": experiment.source,
        "seed": study.seed,
        "runs": experiment.sample(study),
        "quick": quick,
        "config": config_to_dict(study.config),
        "assumptions": assumptions(study.config, experiment.default()),
        "claims": [claim.to_dict() for claim in claims],
        "series": experiment.series(study),
        "arrays": described(experiment.arrays(study), experiment.about),
        "seconds": seconds,
        "versions": versions(),
    }


def described(arrays: Mapping[str, NDArray[Any]], about: Mapping[str, str]) -> dict[str, str]:
    """Return what each array of ``runs.npz`` is, by its key.

    Raises
    ------
    ValueError
        If nothing is said about an array.

    Examples
    --------
    >>> described({"nees/ekf/low": np.zeros((50, 9))}, {"nees": "NEES of the pose, (runs, time)"})
    {'nees/ekf/low': 'NEES of the pose, (runs, time); shape (50, 9)'}
    """
    first = {key: re.split(r"[/.]", key)[0] for key in arrays}
    unknown = [key for key, word in first.items() if word not in about]
    if unknown:
        raise ValueError(f"'about' must say what these arrays are: {', '.join(unknown)}")
    return {key: f"{about[first[key]]}; shape {np.shape(a)}" for key, a in arrays.items()}


def write_folder(
    folder: Path, content: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], figure: Figure
) -> None:
    """Write the four files into a temporary folder and let it replace ``folder``."""
    from vslam_ref.plot.saving import save_figure

    with files.new_folder(folder) as temporary:
        (temporary / "result.json").write_text(to_json(content), encoding="utf-8", newline="\n")
        write_npz(temporary / "runs.npz", arrays)
        save_figure(figure, temporary, content["experiment"])


def write_npz(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays as ``np.load`` reads them; equal arrays give equal bytes, whatever the clock says."""
    with zipfile.ZipFile(path, "w", compression=zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=_EPOCH)
            member.compress_type = zipfile.ZIP_DEFLATED
            member.external_attr = 0o644 << 16
            with archive.open(member, "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asarray(array), allow_pickle=False)
