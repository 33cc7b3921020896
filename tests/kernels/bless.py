"""Test that the Numba twins equal their NumPy functions, then store which code was tested: ``make twins``.

    python tests/kernels/bless.py              # test, then write vslam_ref/_kernels/digests.json
    python tests/kernels/bless.py --check      # exit status 1 when the stored digests are out of date

A pair consists of the files of the package that its NumPy function and its kernel reach by imports.
"""

from __future__ import annotations

import ast
import functools
import importlib
import json
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("geometry", "filters", "metrics", "worlds", "estimation", "features", "grids", "systems")
CHOOSER = "vslam_ref._kernels"  # which of the two forms runs is no part of either


def file_of(module: str) -> Path | None:
    """Source of a module or package, or None for a name that is neither."""
    path = ROOT.joinpath(*module.split("."))
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)


@functools.cache
def imports(module: str) -> tuple[tuple[str, str | None, str], ...]:
    """All imports of a module within the package, anywhere in it: module, name, name here."""
    path = file_of(module)
    assert path is not None, module
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    found: list[tuple[str, str | None, str]] = []
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found += [(alias.name, None, alias.asname or alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package.rsplit(".", node.level - 1)[0] + "." if node.level else ""
            source = (base + (node.module or "")).rstrip(".")
            found += [(source, alias.name, alias.asname or alias.name) for alias in node.names]
    return tuple(entry for entry in found if entry[0].partition(".")[0] == "vslam_ref")


def home(module: str, name: str | None) -> str:
    """Module that defines a name; a package's ``__init__`` may take it from another."""
    if name is None:
        return module
    if file_of(f"{module}.{name}"):
        return f"{module}.{name}"
    path = file_of(module)
    if path is not None and path.name == "__init__.py":
        for source, original, here in imports(module):
            if here == name:
                return home(source, original)
    return module


def reached(module: str) -> set[str]:
    """Return the module and all modules that it reaches by imports."""
    seen, waiting = set(), [module]
    while waiting:
        at = waiting.pop()
        if at not in seen and at != CHOOSER:
            seen.add(at)
            waiting += [home(source, name) for source, name, _ in imports(at)]
    return seen


def pairs() -> Iterator[tuple[str, list[str]]]:
    """Every twin, and the files of its pair."""
    from vslam_ref import _kernels

    for room in ROOMS:
        if file_of(f"vslam_ref.{room}"):
            package = importlib.import_module(f"vslam_ref.{room}")
            for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
                importlib.import_module(info.name)
    for function, twin in sorted(_kernels.REGISTRY.values(), key=lambda pair: pair[1]):
        modules = reached(function.__module__) | reached(f"{CHOOSER}.{twin.partition(':')[0]}")
        files = {file_of(module) for module in modules}
        yield twin, sorted(path.relative_to(ROOT / "vslam_ref").as_posix() for path in files if path)


def current() -> dict[str, Any]:
    """What ``digests.json`` has to say about the sources as they are."""
    from vslam_ref._kernels import _digests

    files = dict(pairs())
    sources = {
        name: (ROOT / "vslam_ref" / name).read_bytes() for name in sorted(set().union(*files.values()))
    }
    digests = {name: [_digests.of_bytes(text), _digests.of_code(text)] for name, text in sources.items()}
    return {"pairs": files, "files": digests}


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """One line for every pair that came, went or reaches other files, and for every file that changed."""
    lines = []
    for name in sorted(old["pairs"].keys() | new["pairs"].keys()):
        before, after = (set(record["pairs"].get(name, ())) for record in (old, new))
        parts = [f"+ {file}" for file in sorted(after - before)] + [
            f"- {file}" for file in sorted(before - after)
        ]
        if parts:
            lines.append(f"{name}: {'new' if not before else 'gone' if not after else ', '.join(parts)}")
    for name in sorted(old["files"].keys() & new["files"].keys()):
        (bytes_before, code_before), (bytes_after, code_after) = old["files"][name], new["files"][name]
        if bytes_before != bytes_after:
            lines.append(f"{name}: {'text only' if code_before == code_after else 'code changed'}")
    return lines


def main(arguments: list[str]) -> int:
    """Command line."""
    sys.path.insert(0, str(ROOT))
    from vslam_ref._kernels import _digests

    if arguments not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    new = current()
    lines = differences(_digests.stored(), new)
    if arguments:
        print("\n".join(lines) or "the digests are up to date")
        return 1 if lines else 0
    tests = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        str(ROOT / "tests/kernels/test_twins.py"),
    ]
    if subprocess.run(tests, cwd=ROOT, check=False).returncode:
        print("a twin differs from its NumPy function: the digests stay as they were", file=sys.stderr)
        return 1
    if lines:
        _digests.FILE.write_text(json.dumps(new, indent=1) + "\n", encoding="utf-8", newline="\n")
    print("\n".join(lines) or "nothing has changed")
    print(f"{len(new['pairs'])} pairs, {len(new['files'])} files: {_digests.FILE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
