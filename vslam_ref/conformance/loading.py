"""Finding the module that a user names: by its dotted name, by a file, or in the folder one stands in."""

from __future__ import annotations

import importlib
import importlib.util
import sys
import traceback
from pathlib import Path
from types import ModuleType

from vslam_ref.conformance.replies import raised


def load_module(name: str) -> ModuleType:
    """Import a module by its dotted name, or from a file ``*.py``, which may import from its folder.

    A file or package in the folder one stands in comes before an installed module of the same name.

    Raises
    ------
    ImportError
        With one line: no such module or file, or whatever happened while it was imported.
    """
    try:
        return _found(name)
    except ModuleNotFoundError as error:
        if error.name is not None and (name == error.name or name.startswith(f"{error.name}.")):
            raise ImportError(
                f"No module named {name!r} is installed or stands in {Path.cwd()}; a file ends in .py"
            ) from None
        raise ImportError(_told(error)) from None
    except (Exception, SystemExit) as error:  # whatever a user's module does
        raise ImportError(_told(error)) from None


def _found(name: str) -> ModuleType:
    if name.endswith(".py"):
        if not Path(name).is_file():
            raise FileNotFoundError(f"no such file: {name}")
        return _from_file(Path(name).resolve())
    if name.isidentifier() and Path(f"{name}.py").is_file():
        return _from_file(Path(f"{name}.py").resolve())
    if Path(name.partition(".")[0]).is_dir():
        _search_first(Path.cwd())
    return importlib.import_module(name)


def _from_file(path: Path) -> ModuleType:
    """The module of a file; one that is imported already is not imported again."""
    _search_first(path.parent)
    before = sys.modules.get(path.stem)
    if before is not None and getattr(before, "__file__", None) == str(path):
        return before
    name = path.stem if before is None else f"{path.stem}_given"  # the other keeps its name
    found = importlib.util.spec_from_file_location(name, path)
    if found is None or found.loader is None:
        raise ImportError(f"{path} cannot be read as a module")
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module
    try:
        found.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _search_first(folder: Path) -> None:
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))


def _told(error: BaseException) -> str:
    """The error, and the line of the innermost file that it comes from."""
    if isinstance(error, SyntaxError) or error.__traceback__ is None:
        return raised(error)
    if isinstance(error, FileNotFoundError) and error.errno is None:
        return str(error)  # our own
    places = [(f.filename, f.lineno) for f in traceback.extract_tb(error.__traceback__)]
    outside = [(file, line) for file, line in places if not file.startswith("<") and file != __file__]
    file, line = outside[-1] if outside else ("", 0)
    return raised(error) + (f" ({Path(file).name}, line {line})" if file else "")
