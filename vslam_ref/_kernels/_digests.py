"""Whether a NumPy function and its Numba twin are still the two that were tested to be equal.

``digests.json`` is written by ``make twins`` after the equality tests have passed.  For each pair it names
the files of the package that the NumPy function and the kernel reach by imports, and for each file two
digests: of its bytes, and of what Python reads in it, without comments and docstrings.
"""

from __future__ import annotations

import ast
import hashlib
import json
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parents[1]
FILE = Path(__file__).with_name("digests.json")


def of_bytes(source: bytes) -> str:
    """Digest of a file, line ends of any system taken as one."""
    return hashlib.sha256(source.replace(b"\r\n", b"\n")).hexdigest()[:32]


def of_code(source: bytes) -> str:
    """Digest of the code in a file: comments, docstrings and layout do not count.

    Empty fields are left out, so that all versions of Python agree.
    """
    return of_bytes(repr(_plain(ast.parse(source))).encode())


def _plain(part: Any) -> Any:
    if isinstance(part, list):
        return [_plain(item) for item in part if not _is_bare_string(item)]
    if isinstance(part, ast.AST):
        fields = [(name, _plain(value)) for name, value in ast.iter_fields(part) if value is not None]
        return type(part).__name__, [field for field in fields if field[1] != []]
    return part


def _is_bare_string(part: Any) -> bool:
    """Whether a statement is a string alone: a docstring of whatever stands before it."""
    return (
        isinstance(part, ast.Expr)
        and isinstance(part.value, ast.Constant)
        and isinstance(part.value.value, str)
    )


def stored() -> dict[str, Any]:
    """Return what ``make twins`` wrote: ``pairs`` (twin -> files) and ``files`` (file -> two digests)."""
    try:
        return json.loads(FILE.read_bytes())  # type: ignore[no-any-return]
    except OSError:
        return {"pairs": {}, "files": {}}


def changed_files(twin: str) -> list[str]:
    """Files of a pair whose code is not the tested one; its kernel's file if the pair was never tested.

    Without sources (a package that is zipped, or compiled files only) nothing has changed.
    """
    if not Path(__file__).is_file():
        return []
    record = stored()
    if twin not in record["pairs"]:
        return [f"_kernels/{twin.partition(':')[0]}.py"]
    return [name for name in record["pairs"][twin] if _has_changed(PACKAGE / name, *record["files"][name])]


def _has_changed(path: Path, of_its_bytes: str, of_its_code: str) -> bool:
    try:
        source = path.read_bytes()
    except OSError:
        return False  # no source of this one
    if of_bytes(source) == of_its_bytes:
        return False
    try:
        return of_code(source) != of_its_code
    except (SyntaxError, ValueError):
        return True
