"""Files and folders that appear whole or not at all.

Everything is written under a temporary name beside its destination and renamed.  The temporary name
names the process that owns it, so a later run can remove what a killed one left.
"""

from __future__ import annotations

import bz2
import gzip
import os
import re
import shutil
import socket
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from vslam_ref.support.errors import InputError

STALE_SECONDS = 3600.0
"""Age at which a temporary of another machine, or of an unknown process, counts as abandoned."""

_MARK = re.compile(r"^\.(?P<name>.+)\.(?P<kind>tmp|old)-(?P<host>[^.]*)-(?P<pid>\d+)-[0-9a-f]{8}$")


def require_folder(path: str | os.PathLike[str]) -> Path:
    """Make a folder if needed and check that files can be made in it, before long work begins.

    Raises
    ------
    InputError
        If it is a file, cannot be made, or cannot be written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = _temporary(folder / "probe", "tmp")
        probe.touch()
        probe.unlink()
    except FileExistsError:
        raise InputError(f"output folder {str(folder)!r} is a file: give a folder") from None
    except NotADirectoryError:
        raise InputError(f"output folder {str(folder)!r}: a part of that path is a file") from None
    except OSError as error:
        raise InputError(f"output folder {str(folder)!r} cannot be written: {error.strerror}") from None
    return folder


def require_new_folder(path: str | os.PathLike[str], mark: str) -> Path:
    """Check that a folder can take the place of ``path``, before long work begins.

    Parameters
    ----------
    path : str or path
        Is new, empty, or holds an earlier result.  Its parent is made.
    mark : str
        Name of a file that every result has.

    Raises
    ------
    InputError
        If it is a file, holds other things, or cannot be written.
    """
    folder = Path(path)
    require_folder(folder.parent)
    if folder.is_file():
        raise InputError(f"output folder {str(folder)!r} is a file: give a folder")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / mark).is_file():
        raise InputError(f"output folder {str(folder)!r} holds other things: give a new or empty one")
    return folder


def require_parent(path: str | os.PathLike[str]) -> Path:
    """Check that a file can be written at ``path``, before long work begins.

    Raises
    ------
    InputError
        If the folder it lies in is missing or cannot be written, or ``path`` is itself a folder.
    """
    target = Path(path)
    if target.is_dir():
        raise InputError(f"{str(target)!r} is a folder: give the name of a file")
    if target.parent.exists() and not target.parent.is_dir():
        raise InputError(f"folder {str(target.parent)!r} of file {str(target)!r} is a file: give a folder")
    if not target.parent.is_dir():
        raise InputError(
            f"folder {str(target.parent)!r} of file {str(target)!r} does not exist: make it first"
        )
    require_folder(target.parent)
    return target


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step: readers see the old content or the new, never a part."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file in one step, as :func:`write_text` does; ``.gz`` and ``.bz2`` are packed."""
    if path.suffix == ".gz":
        data = gzip.compress(data, mtime=0)
    elif path.suffix == ".bz2":
        data = bz2.compress(data)
    temporary = _temporary(path, "tmp")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_together(folder: Path, content: Mapping[str, bytes]) -> None:
    """Write several files into a folder that exists.

    All are written under temporary names before the first takes its place.
    """
    temporary = {name: _temporary(folder / name, "tmp") for name in content}
    try:
        for name, data in content.items():
            temporary[name].write_bytes(data)
        for name, path in temporary.items():
            os.replace(path, folder / name)
    finally:
        for path in temporary.values():
            path.unlink(missing_ok=True)


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield a path of the same name in a temporary folder; the file takes its place when the block succeeds.

    For writers that look at the name.  If the block raises, ``path`` stays as it was.
    """
    temporary = _temporary(path, "tmp")
    temporary.mkdir()
    try:
        yield temporary / path.name
        os.replace(temporary / path.name, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield an empty temporary folder that takes the place of ``path`` when the block succeeds.

    If the block raises, ``path`` stays as it was and the temporary is removed.
    """
    temporary, old = _temporary(path, "tmp"), _temporary(path, "old")
    temporary.mkdir()
    try:
        yield temporary
        if path.exists():
            path.rename(old)
        temporary.rename(path)
    except BaseException:
        if old.exists() and not path.exists():
            old.rename(path)
        raise
    finally:
        for left in (temporary, old):
            shutil.rmtree(left, ignore_errors=True)


def clean(folder: Path) -> None:
    """Remove what killed runs left in ``folder``; a result they had moved aside is put back."""
    for left in sorted(folder.glob(".*")):
        mark = _MARK.match(left.name)
        if not mark or not _abandoned(left, mark["host"], int(mark["pid"])):
            continue
        home = folder / mark["name"]
        if mark["kind"] == "old" and not home.exists():
            left.rename(home)
        elif left.is_dir():
            shutil.rmtree(left, ignore_errors=True)
        else:
            left.unlink(missing_ok=True)


def _temporary(path: Path, kind: str) -> Path:
    return path.with_name(f".{path.name}.{kind}-{_host()}-{os.getpid()}-{uuid.uuid4().hex[:8]}")


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9]", "", socket.gethostname())


def _abandoned(left: Path, host: str, pid: int) -> bool:
    if os.name == "posix" and host == _host():
        try:
            os.kill(pid, 0)  # signal 0 only asks whether the process exists
        except ProcessLookupError:
            return True
        except PermissionError:
            pass  # it exists, under another user
    try:
        return time.time() - left.stat().st_mtime > STALE_SECONDS
    except FileNotFoundError:
        return False
