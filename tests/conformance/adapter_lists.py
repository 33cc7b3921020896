"""What each adapter is known to answer otherwise, from ``adapter_deviations.json``; and what it answers now.

python tests/conformance/adapter_lists.py opencv        # the regimes that fail now, as lines of the list
"""

from __future__ import annotations

import functools
import importlib.metadata
import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from vslam_ref.conformance import vectors_format
from vslam_ref.conformance.conventions import Convention, read
from vslam_ref.conformance.program import Asked, InProcess, Program
from vslam_ref.conformance.runner import Outcome, Report, run
from vslam_ref.conformance.vectors_format import VectorFile

LISTS: dict[str, Any] = json.loads((Path(__file__).parent / "adapter_deviations.json").read_text("utf-8"))
NAMES = [name for name in LISTS if name != "about"]
HERE = Path(__file__).parent / "adapters"
SHIPPED = Path(str(importlib.util.find_spec("vslam_ref.conformance.adapters").origin)).parent  # type: ignore[union-attr]
WORK = tempfile.TemporaryDirectory(prefix="adapter-")
COMPILERS = ("g++", "clang++")
CONVENTIONS = {
    "scipy": HERE / "scipy_convention.json",
    "gtsam": HERE / "gtsam_convention.json",
    "gtsam_usual": HERE / "gtsam_convention.json",
    "node": SHIPPED / "node" / "convention.json",
}


class Listed(NamedTuple):
    """Deviations: ids that must fail, and regimes that may fail by rounding, with the most tolerances."""

    exact: set[str]
    within: dict[str, float]


@functools.cache
def answers(compiler: str) -> bool:
    """Whether a compiler can say its version: rustup leaves a command that only asks for a toolchain."""
    found = shutil.which(compiler)
    return found is not None and subprocess.run([found, "--version"], capture_output=True).returncode == 0


def missing(name: str) -> str:
    """Why an adapter cannot be asked here; empty if it can."""
    needs = {"gtsam": "gtsam", "gtsam_usual": "gtsam", "filterpy": "filterpy"}
    if name in needs and importlib.util.find_spec(needs[name]) is None:
        return f"{needs[name]} is not installed"
    if name == "evo" and shutil.which("evo_ape") is None:
        return "the command evo_ape is not installed"
    if name == "node" and shutil.which("node") is None:
        return "node is not installed"
    if name == "cpp" and compiler() is None:
        return "neither g++ nor clang++ is installed"
    if name == "rust" and not answers("rustc"):
        return "rustc is not installed, or has no toolchain of its user's"
    if name == "octave" and shutil.which("octave-cli") is None:
        return "GNU Octave is not installed"
    return ""


def need(name: str) -> None:
    """Skip where the tool is absent."""
    reason = missing(name)
    if reason:
        pytest.skip(reason)


def other_version(name: str) -> str:
    """Why a list may not hold here: it was made with another version of the library."""
    for package, version in LISTS[name]["version"].items():
        try:
            found = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            return f"{package} is not installed under this name"
        if found.split(".")[:2] != version.split("."):
            return f"listed for {package} {version}, here is {found}"
    return ""


def compiler() -> str | None:
    """A C++ compiler, or none."""
    return next((name for name in COMPILERS if shutil.which(name)), None)


@functools.cache
def compiled(source: str) -> str:
    """Compile a C++ program once, all warnings on and none allowed."""
    folder = Path(tempfile.mkdtemp(dir=WORK.name))
    (folder / "adapter.cpp").write_text(source, encoding="utf-8")
    command = compiler()
    assert command is not None
    options = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Werror", "-o", "adapter", "adapter.cpp"]
    done = subprocess.run([command, *options], cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return str(folder / "adapter")


@functools.cache
def compiled_rust(source: str) -> str:
    """Compile a Rust program once, no warning allowed."""
    folder = Path(tempfile.mkdtemp(dir=WORK.name))
    (folder / "adapter.rs").write_text(source, encoding="utf-8")
    command = ["rustc", "--deny", "warnings", "-o", "adapter", "adapter.rs"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return str(folder / "adapter")


def octave(source: str) -> Program:
    """A program in Octave, from its text."""
    folder = Path(tempfile.mkdtemp(dir=WORK.name))
    (folder / "adapter.m").write_text(source, encoding="utf-8")
    return Program(f"octave-cli --quiet --eval \"addpath('{folder}'); adapter\"", 60.0)


def module_file(name: str) -> Path:
    """File of an adapter in Python."""
    return HERE / f"{name if name.endswith('_usual') else f'{name}_adapter'}.py"


def asked(name: str) -> Asked:
    """The adapter, ready to answer."""
    if name == "cpp":
        return Program(compiled((SHIPPED / "cpp" / "adapter.cpp").read_text("utf-8")), 60.0)
    if name == "rust":
        return Program(compiled_rust((SHIPPED / "rust" / "adapter.rs").read_text("utf-8")), 60.0)
    if name == "octave":
        return octave((SHIPPED / "octave" / "adapter.m").read_text("utf-8"))
    if name == "node":
        return Program(f"node '{SHIPPED / 'node' / 'adapter.mjs'}'", 60.0)
    return InProcess(str(module_file(name)))


def convention(name: str) -> Convention:
    """What the adapter declares."""
    return read(CONVENTIONS[name]) if name in CONVENTIONS else Convention()


def chosen(every: int = 1, topics: set[str] | None = None) -> list[VectorFile]:
    """Vectors, every so manieth case of a file."""
    files = [vectors_format.load(name) for name in vectors_format.names()]
    kept = [f for f in files if topics is None or Path(f.name).stem in topics]
    return [file._replace(cases=file.cases[::every]) for file in kept]


def verified(name: str, files: list[VectorFile], declared: Convention | None = None) -> Report:
    """Ask an adapter, and be silent about the warnings of its library."""
    program = asked(name)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return run(program, files, convention(name) if declared is None else declared, names=False)
    finally:
        program.close()


def listed(name: str) -> Listed:
    """The list of an adapter."""
    rows = LISTS[name]["deviations"]
    exact = {
        f"{row['regime']}-{number}" for row in rows if "cases" in row for number in _numbers(row["cases"])
    }
    return Listed(exact, {row["regime"]: row["within"] for row in rows if "within" in row})


def _numbers(text: str) -> Iterator[str]:
    """01, 02, 03, 05 of "01-03,05"."""
    for part in filter(None, text.split(",")):
        first, _, last = part.partition("-")
        yield from (f"{k:02d}" for k in range(int(first), int(last or first) + 1))


def regime(identity: str) -> str:
    """The id without its number."""
    return identity.rpartition("-")[0]


def is_wrong(outcome: Outcome) -> bool:
    """Whether an answer deviates; one that only loses digits is told by the vectors themselves."""
    lost = outcome.difference is not None and outcome.difference.verdict == "lost digits"
    return outcome.status in ("failed", "error") and not lost


def ratio(outcome: Outcome) -> float:
    """How many tolerances an answer is off."""
    if outcome.difference is None or not outcome.difference.allowed:
        return float("inf")
    return outcome.difference.size / outcome.difference.allowed


def main(name: str) -> None:
    """Print what fails now."""
    report = verified(name, chosen())
    failed: dict[str, list[Outcome]] = {}
    for o in report.outcomes:
        if is_wrong(o):
            failed.setdefault(regime(o.case.id), []).append(o)
    print({status: report.count(status) for status in ("passed", "failed", "error", "unsupported")})  # type: ignore[arg-type]
    print(json.dumps(sorted({o.case.topic for o in report.outcomes if o.status == "passed"})))
    known = {row["regime"]: row["why"] for row in LISTS[name]["deviations"]}
    for stem, outcomes in failed.items():
        cases = ",".join(o.case.id.rpartition("-")[2] for o in outcomes)
        why = known.get(stem, outcomes[0].cause)
        print(json.dumps({"regime": stem, "cases": cases, "worst": max(map(ratio, outcomes)), "why": why}))


if __name__ == "__main__":
    main(sys.argv[1])
