"""Grade an answer to an exercise with the tests that check the published solution.

    python docs/_tools/grade.py 16_name mine.py

Exit status: 0 solved, 1 not solved, 2 no such exercise or file.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import book

TESTS = book.ROOT / "tests"
DECLARED = re.compile(r'^EXERCISE = "([^"]+)"', re.MULTILINE)


def exercises() -> dict[str, list[Path]]:
    """Name of every exercise and the test modules that declare it."""
    found: dict[str, list[Path]] = {}
    for path in sorted(TESTS.rglob("test_exercise*.py")):
        if match := DECLARED.search(path.read_text(encoding="utf-8")):
            found.setdefault(match[1], []).append(path)
    return found


def main(arguments: list[str]) -> int:
    """Command line."""
    if len(arguments) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    name, answer = arguments[0], Path(arguments[1]).resolve()
    known = exercises()
    if name not in known:
        print(f"no exercise {name!r}; there are: {', '.join(known) or 'none yet'}", file=sys.stderr)
        return 2
    if not answer.is_file():
        print(f"no such file: {answer}", file=sys.stderr)
        return 2
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--student", str(answer)]
    return subprocess.run([*command, *map(str, known[name])], cwd=book.ROOT, check=False).returncode


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
