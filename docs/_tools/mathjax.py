"""Fetch MathJax with npm, so that the book's formulas are drawn without any network.

    python docs/_tools/mathjax.py docs/_build/mathjax

The files are never committed. Without npm the book is built all the same, with a warning, and a
browser then asks the network for MathJax.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

PACKAGE = "mathjax@3.2.2"
# The one file that draws, and the TeX extensions that it loads when a formula asks for them.
WANTED = ("package/es5/tex-svg.js", "package/es5/input/tex/extensions/", "package/LICENSE")


def fetch(target: Path) -> bool:
    """Put MathJax into ``target/mathjax``; returns whether it is there."""
    if (target / "mathjax" / "tex-svg.js").is_file():
        return True
    npm = shutil.which("npm")
    if npm is None:
        return False
    with tempfile.TemporaryDirectory() as folder:
        command = [npm, "pack", PACKAGE, "--silent", "--pack-destination", folder]
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300, check=False
        )
        archives = list(Path(folder).glob("*.tgz"))
        if done.returncode or not archives:
            print(f"npm pack {PACKAGE} failed: {done.stderr.strip()[-300:]}", file=sys.stderr)
            return False
        _unpack(archives[0], target)
    return True


def _unpack(archive: Path, target: Path) -> None:
    """Write the wanted files, then rename: an interrupted fetch leaves nothing that looks whole."""
    partial = target / "mathjax.partial"
    shutil.rmtree(partial, ignore_errors=True)
    with tarfile.open(archive) as tar:
        for member in tar.getmembers():
            if member.isfile() and member.name.startswith(WANTED):
                path = partial / member.name.removeprefix("package/").removeprefix("es5/")
                path.parent.mkdir(parents=True, exist_ok=True)
                source = tar.extractfile(member)
                assert source is not None
                path.write_bytes(source.read())
    partial.rename(target / "mathjax")


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    if not fetch(folder):
        print(
            "warning: no npm, so the book's formulas need the network when they are read",
            file=sys.stderr,
        )
