"""Which program made a result: versions, git commit, platform, backend."""

from __future__ import annotations

import filecmp
import importlib.metadata
import json
import platform
import subprocess
from pathlib import Path
from typing import Any
from urllib.parse import urlparse
from urllib.request import url2pathname

import vslam_ref
from vslam_ref import _kernels

PACKAGE = Path(vslam_ref.__file__).parent


def versions() -> dict[str, Any]:
    """Return the versions of everything that can change a number; None for what is absent."""
    commit, dirty = git_state()
    backend = _kernels.backend()
    aside = _kernels.set_aside() if backend == "numba" else []
    return {
        "vslam_ref": vslam_ref.__version__,
        "git_commit": commit,
        "git_dirty": dirty,
        "python": platform.python_version(),
        "numpy": _version("numpy"),
        "scipy": _version("scipy"),
        "numba": _version("numba"),
        "matplotlib": _version("matplotlib"),
        "platform": platform.platform(),
        "backend": backend,
        **({"twins_set_aside": aside} if aside else {}),  # NumPy ran in their place
    }


def _version(distribution: str) -> str | None:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return None


def git_state() -> tuple[str | None, bool | None]:
    """Return the commit this package's code comes from, and whether it was changed since.

    Three cases are distinguished: the code runs from a clone; it was installed from a repository's
    address; it was installed from a clone whose files still are the same.  Otherwise
    ``(None, None)``: no commit is better than a wrong one.
    """
    if (PACKAGE.parent / ".git").exists():
        return _clone_state(PACKAGE.parent)
    origin = _installed_from()
    if "vcs_info" in origin:
        return origin["vcs_info"].get("commit_id"), False
    address = urlparse(origin.get("url", ""))
    clone = Path(url2pathname(address.path))
    if address.scheme == "file" and (clone / ".git").exists() and _same_sources(clone / PACKAGE.name):
        return _clone_state(clone)
    return None, None


def _installed_from() -> dict[str, Any]:
    """Return the installer's record of where the package came from (PEP 610), or an empty one."""
    try:
        text = importlib.metadata.distribution("vslam-ref").read_text("direct_url.json")
    except importlib.metadata.PackageNotFoundError:
        return {}
    return json.loads(text) if text else {}


def _same_sources(other: Path) -> bool:
    files = [path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py")]
    return all((other / f).is_file() and filecmp.cmp(PACKAGE / f, other / f, shallow=False) for f in files)


def _clone_state(clone: Path) -> tuple[str | None, bool | None]:
    commit = _git(clone, "rev-parse", "HEAD")
    if commit is None:
        return None, None
    return commit.strip(), bool(_git(clone, "status", "--porcelain", "--", PACKAGE.name))


def _git(clone: Path, *arguments: str) -> str | None:
    command = ["git", "--no-optional-locks", "-C", str(clone), *arguments]
    try:
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None
