"""Build the book into ``docs/_build/html``: ``make docs``.

    python docs/_tools/make_site.py docs/_build

The site is built aside and takes its place by renaming: an interrupted build leaves a finished book alone.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

PROGRESS = re.compile(r"^(?P<what>[a-z][\w ]+)\.\.\. \[ *(?P<share>\d+)%\]")
SETTINGS = re.compile(r"myst(-nb)? v")  # all of them, on two lines of a thousand characters
ESCAPE = re.compile(r"\x1b\[[\d;]*[A-Za-z]")


def condensed(lines: Iterable[str]) -> Iterator[str]:
    """Sphinx's lines, of the hundreds that count pages only one for every tenth.

    >>> list(condensed(["reading sources... [  1%] a", "reading sources... [  2%] b", "done"]))
    ['reading sources:   0 %', 'done']
    """
    shown = None
    for line in lines:
        line = ESCAPE.sub("", line.rstrip())
        match = PROGRESS.match(line)
        if match is None:
            if line and not SETTINGS.match(line):
                yield line
            continue
        now = match["what"], int(match["share"]) // 10
        if now != shown:
            shown = now
            yield f"{match['what']}: {10 * now[1]:3d} %"


def sphinx(source: Path, target: Path, doctrees: Path) -> int:
    """Run Sphinx on all cores, warnings as errors; returns its exit status."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-E", "-j", "auto", "-b", "html"]
    began = time.monotonic()
    running = subprocess.Popen(
        [*command, "-d", str(doctrees), str(source), str(target)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
    )
    assert running.stdout is not None
    for line in condensed(running.stdout):
        print(f"{time.monotonic() - began:5.0f} s  {line}", flush=True)
    return running.wait()


def swap(fresh: Path, place: Path) -> None:
    """Put a finished folder in the place of an older one."""
    old = place.with_name(f"{place.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if place.exists():
        place.rename(old)
    fresh.rename(place)
    shutil.rmtree(old, ignore_errors=True)


def main(arguments: list[str]) -> int:
    """Command line."""
    build = Path(arguments[0])
    fresh = build / "html.partial"
    shutil.rmtree(fresh, ignore_errors=True)
    status = sphinx(build / "source", fresh, build / "doctrees")
    if status == 0:
        swap(fresh, build / "html")
        print(f"the book: {build / 'html' / 'index.html'}")
    return status


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
