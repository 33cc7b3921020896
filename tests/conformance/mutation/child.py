"""The library with one change, in a process of its own, under the vectors."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.util
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from mutation.sites import Mutant, mutated

ROOT = Path(str(importlib.util.find_spec("vslam_ref").origin)).parent  # type: ignore[union-attr]
PRELUDE = "\n\ndef _same(x, *_, **__):\n    return x\n"
ADAPTER = "vslam_ref.conformance.adapters.itself"


class Verdict(NamedTuple):
    """What became of a mutant: killed, and by which case or how."""

    killed: bool
    by: str


class _Changed(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module from a changed text."""

    def __init__(self, name: str, text: str, path: str) -> None:
        self.name, self.text, self.path = name, text, path

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Answer for the one module."""
        if fullname != self.name:
            return None
        package = [str(Path(self.path).parent)] if self.path.endswith("__init__.py") else None
        spec = importlib.util.spec_from_loader(
            fullname, self, origin=self.path, is_package=package is not None
        )
        if spec is not None and package is not None:
            spec.submodule_search_locations = package
        return spec

    def exec_module(self, module: ModuleType) -> None:
        """Run the changed text."""
        exec(compile(self.text, self.path, "exec"), module.__dict__)


def source_of(module: str) -> tuple[str, str]:
    """Text and path of a module of this package, without importing it or what it stands in."""
    stem = ROOT.joinpath(*module.split(".")[1:])
    for path in (stem.with_suffix(".py"), stem / "__init__.py"):
        if path.is_file():
            return path.read_text(encoding="utf-8"), str(path)
    raise ValueError(f"no module {module!r}")


def in_a_child(work: Callable[[], str], seconds: float) -> str:
    """Run in a forked process and return its text, or how it ended.

    The parent must not have imported what is to be changed.
    """
    receive, send = os.pipe()
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.close(receive)
            signal.alarm(max(1, int(seconds)))
            _write(send, work())
            status = 0
        except BaseException as error:  # whatever it is, the mutant did not pass
            _write(send, f"!{type(error).__name__}: {error}"[:4000])
        finally:
            os._exit(status)
    os.close(send)
    text = b""
    while part := os.read(receive, 65536):
        text += part
    os.close(receive)
    _, status = os.waitpid(child, 0)
    return text.decode() if text else f"!ended with status {status}"


def _write(pipe: int, text: str) -> None:
    data = text.encode()
    while data:
        data = data[os.write(pipe, data) :]


def run_mutant(
    mutant: Mutant, names: Sequence[str], seconds: float, change: Callable[[str, int], str] = mutated
) -> Verdict:
    """Ask the vectors of a mutant until one fails."""
    source, path = source_of(mutant.module)
    text = change(source, mutant.number) + PRELUDE

    def work() -> str:
        os.environ["VSLAM_REF_BACKEND"] = "numpy"
        sys.meta_path.insert(0, _Changed(mutant.module, text, path))
        return _first_failure(names)

    began = time.monotonic()
    told = in_a_child(work, seconds)
    if told.startswith("!ended") and time.monotonic() - began >= seconds - 1:
        return Verdict(True, "does not end")
    return Verdict(told != "passed", told.lstrip("!"))


def _first_failure(names: Sequence[str]) -> str:
    """Id of the first case that is not right any more, lost digits included, or "passed"."""
    import numpy as np

    from vslam_ref.conformance.conventions import Convention
    from vslam_ref.conformance.program import InProcess
    from vslam_ref.conformance.runner import ask
    from vslam_ref.conformance.vectors_format import load

    asked = InProcess(importlib.import_module(ADAPTER))
    with np.errstate(all="ignore"):
        for name in names:
            file = load(name)
            for case in file.cases:
                if ask(asked, file, case, Convention(), "float64").status != "passed":
                    return case.id
    return "passed"


def executed(names: Sequence[str]) -> set[tuple[str, int]]:
    """Module and line of everything in the library that the vectors run, found by a tracer in a child.

    A statement over several lines is told by each line on which a part of it begins.
    """

    def work() -> str:
        os.environ["VSLAM_REF_BACKEND"] = "numpy"
        found: set[tuple[str, int]] = set()

        def trace(frame: Any, event: str, argument: Any) -> Any:
            module = frame.f_globals.get("__name__", "")
            if not module.startswith("vslam_ref.") or module.startswith("vslam_ref.conformance"):
                return None
            if event == "line":
                found.add((module, frame.f_lineno))
            return trace

        sys.settrace(trace)
        told = _first_failure(names)
        sys.settrace(None)
        if told != "passed":
            raise AssertionError(f"the library itself fails {told}")
        return "\n".join(f"{module} {line}" for module, line in sorted(found))

    told = in_a_child(work, 600.0)
    if told.startswith("!"):
        raise ValueError(f"the vectors could not be run: {told[1:]}")
    pairs = (line.split() for line in told.splitlines())
    return {(module, int(number)) for module, number in pairs}
