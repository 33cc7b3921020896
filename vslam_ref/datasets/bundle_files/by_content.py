"""Bundle files of any known format: the reader chosen by the file's first bytes, the writer by its name."""

from __future__ import annotations

from pathlib import Path

from vslam_ref.datasets.bundle_files.bal import read_bal, write_bal
from vslam_ref.datasets.bundle_files.bundler import read_bundler
from vslam_ref.datasets.bundle_files.colmap import FILES as COLMAP_FILES
from vslam_ref.datasets.bundle_files.colmap import read_colmap, write_colmap
from vslam_ref.datasets.bundle_files.libmv import ORDERS, SPACES, read_libmv
from vslam_ref.datasets.bundle_files.ply import write_ply
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.text import FormatError, read_bytes

READERS = {"bal": read_bal, "bundler": read_bundler, "libmv": read_libmv, "colmap": read_colmap}
RIGHT = "expected BAL (three counts), Bundler (# Bundle file v0.3), libmv (vP…), or a folder of COLMAP's text"
ALONE = "BAL, Bundler and libmv are single files"
FOLDERS = f"a folder must hold COLMAP's text model, {', '.join(COLMAP_FILES)}"


def detect(path: Path | str) -> str:
    """Find the format by the first bytes: "bal", "bundler", "libmv", or "colmap" for a folder.

    Raises
    ------
    FormatError
        If there is no such file, or it is none of these.
    """
    path = Path(path)
    if path.is_dir():
        if not any((path / name).exists() for name in COLMAP_FILES):
            raise FormatError(path, None, f"{_of_folder(path)}; {FOLDERS}; {ALONE}")
        return "colmap"
    if not path.exists():
        raise FormatError(path, None, "no such file or folder")
    head = read_bytes(path, 256, whole=False)
    if head[:1] in ORDERS and head[1:2] in SPACES:
        return "libmv"
    start = head.lstrip()
    if start.startswith(b"# Bundle file"):
        return "bundler"
    if start[:1].isdigit():
        return "bal"
    shown = head[:24].decode("ascii", "backslashreplace") if head else "nothing"
    raise FormatError(path, None, f"begins with {shown!r}; {RIGHT}")


def _of_folder(path: Path) -> str:
    """What a folder holds that is not COLMAP's text, in words."""
    if (path / "cameras.bin").exists():
        return "a COLMAP model in its binary form (colmap model_converter --output_type TXT makes the text)"
    names = sorted(entry.name for entry in path.iterdir())
    shown = ", ".join(names[:3]) + (", …" if len(names) > 3 else "")
    return f"a folder with {shown}" if names else "an empty folder"


def read_bundle(path: Path | str, *, max_bytes: int | None = None) -> BundleFile:
    """Read a bundle adjustment problem of any format that is known.

    Parameters
    ----------
    path : Path or str
        A file, or the folder of a COLMAP model.
    max_bytes : int, optional
        Limit of the unpacked size of a file; see :func:`.loading.load`.

    Raises
    ------
    FormatError
        Where the file is of no known format, or not as its format says.
    """
    return READERS[detect(path)](path, max_bytes=max_bytes)


def write_bundle(path: Path | str, file: BundleFile) -> None:
    """Write a file in the format that its name says.

    ``.ply`` is for viewers, ``.txt`` (and ``.gz``, ``.bz2``) is BAL, a name without a suffix a COLMAP folder.

    Raises
    ------
    ValueError
        On another suffix, or what the format cannot say.
    """
    path = Path(path)
    if path.suffix == ".ply":
        write_ply(path, file)
    elif path.suffix == "" or path.is_dir():
        write_colmap(path, file)
    elif path.suffix in (".txt", ".gz", ".bz2"):
        write_bal(path, file)
    else:
        right = ".ply, .txt, .txt.gz, .txt.bz2 (BAL), or none (a COLMAP folder)"
        raise ValueError(f"{path}: suffix {path.suffix!r} is of no format that is written; use {right}")
