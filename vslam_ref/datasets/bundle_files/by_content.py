"""Bundle files of any known format: the reader chosen by the file's first bytes, the writer by its name."""

from __future__ import annotations

from pathlib import Path

from vslam_ref.datasets.bundle_files.bal import read_bal, require_bal, write_bal
from vslam_ref.datasets.bundle_files.bundler import read_bundler
from vslam_ref.datasets.bundle_files.colmap import (
    BINARY_FILES,
    TEXT_FILES,
    read_colmap,
    require_colmap,
    require_free,
    write_colmap,
)
from vslam_ref.datasets.bundle_files.libmv import ORDERS, SPACES, read_libmv
from vslam_ref.datasets.bundle_files.loading import counted
from vslam_ref.datasets.bundle_files.ply import write_ply
from vslam_ref.datasets.bundle_files.record import BundleFile
from vslam_ref.datasets.text import FormatError, read_bytes
from vslam_ref.support.errors import InputError
from vslam_ref.support.files import require_parent

READERS = {"bal": read_bal, "bundler": read_bundler, "libmv": read_libmv, "colmap": read_colmap}
RIGHT = "expected BAL (three counts), Bundler (# Bundle file v0.3), libmv (vP…), or a folder of COLMAP's"
ALONE = "BAL, Bundler and libmv are single files"
FOLDERS = f"a folder must hold a COLMAP model, {', '.join(BINARY_FILES)} or the same with .txt"
BAL_SUFFIXES = (".txt", ".gz", ".bz2")


def detect(path: Path | str) -> str:
    """Find the format by the first bytes: "bal", "bundler", "libmv", or "colmap" for a folder.

    Raises
    ------
    FormatError
        If there is no such file, or it is none of these.
    """
    path = Path(path)
    if path.is_dir():
        if not any((path / name).exists() for name in (*BINARY_FILES, *TEXT_FILES)):
            raise FormatError(path, None, f"{_of_folder(path)}; {FOLDERS}; {ALONE}")
        return "colmap"
    if not path.exists():
        raise FormatError(path, None, "no such file or folder")
    if path.name in (*BINARY_FILES, *TEXT_FILES):
        raise FormatError(path, None, f"one file of a COLMAP model; give its folder, {str(path.parent)!r}")
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
    """What a folder holds that is no COLMAP model, in words."""
    inside = [entry for entry in sorted(path.iterdir()) if entry.is_dir()]
    for entry in inside:
        if any((entry / name).exists() for name in (BINARY_FILES[0], TEXT_FILES[0])):
            return f"a folder with a COLMAP model inside: give {str(entry)!r}"
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


def output_format(path: Path) -> str:
    """Format of a file or folder that is to be written, by its name: "ply", "bal" or "colmap".

    Raises
    ------
    InputError
        On another suffix.
    """
    if path.is_dir() or path.suffix == "":
        return "colmap"
    if path.suffix == ".ply":
        return "ply"
    if path.suffix in BAL_SUFFIXES:
        return "bal"
    right = ".ply, .txt, .txt.gz, .txt.bz2 (BAL), or none (a COLMAP folder)"
    raise InputError(f"{path}: suffix {path.suffix!r} is of no format that is written; use {right}")


def require_target(path: Path | str, *, binary: bool = False) -> Path:
    """Check that a file or folder can be written at ``path``, by its name and what is there.

    Raises
    ------
    InputError
        On a suffix of no format, a folder that is missing or holds other things.
    """
    path = Path(path)
    kind = output_format(path)
    if binary and kind != "colmap":
        raise InputError(f"--binary is a form of COLMAP's model: {path} is not a folder's name")
    if kind != "colmap":
        return require_parent(path)
    if not path.is_dir():
        require_parent(path)
    require_free(path, binary=binary)
    return path


def require_sayable(path: Path, file: BundleFile, *, binary: bool = False) -> tuple[str, ...]:
    """Refuse what the format of ``path`` cannot say, before any work; what is to be told of the writing.

    Parameters
    ----------
    path : Path
    file : BundleFile
        What is to be adjusted, with the freedom it has.
    binary : bool
        COLMAP's binary form.

    Raises
    ------
    ValueError
        With what it cannot say.
    """
    kind = output_format(path)
    try:
        if kind == "bal":
            require_bal(file.problem)
        elif kind == "colmap":
            require_colmap(path, file, binary=binary)
    except ValueError as error:
        other = "; a COLMAP folder can (a name without a suffix)" if kind == "bal" else ""
        raise InputError(f"{path} cannot be written: {error}{other}") from None
    blanks = sum(len(name.split()) > 1 for name in file.view_names)
    if kind == "colmap" and not binary and blanks:
        cut = "COLMAP's own reader of text cuts a name at its first blank"
        return (f"{counted(blanks, 'image name')} with blanks in {path}: {cut}; --binary keeps it whole",)
    return ()


def write_bundle(path: Path | str, file: BundleFile, *, binary: bool = False) -> None:
    """Write a file in the format that its name says.

    ``.ply`` is for viewers, ``.txt`` (and ``.gz``, ``.bz2``) is BAL, a name without a suffix a COLMAP folder,
    in its text form unless ``binary``.

    Raises
    ------
    ValueError
        On another suffix, or what the format cannot say.
    """
    path = Path(path)
    kind = output_format(path)
    if kind == "ply":
        write_ply(path, file)
    elif kind == "colmap":
        write_colmap(path, file, binary=binary)
    else:
        write_bal(path, file)
