"""The project's text: nothing of one machine in it, no leftovers, and a README that says what is true."""

from __future__ import annotations

import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from vslam_ref.chapters import CHAPTERS

ROOT = Path(__file__).resolve().parents[2]
BINARY = {".png", ".jpg", ".npz", ".gz", ".bz2", ".pdf", ".woff2"}

# Written in pieces, so that this file does not contain what it looks for.
FOLDERS = r"(?:home|Users|root|work|tmp|private|mnt)"
MACHINE_PATH = re.compile(
    r"(?<![\w.~}/-])/" + FOLDERS + r"/\w" + r"|\b[A-Z]:\\{1,2}(?:Users|Windows|Program)\b"
)
LEFTOVER = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|XX" + r"X)\b|^(?:<{7}|>{7}) ", re.MULTILINE)
PICTURE = re.compile(r'"image/png": "[^"]*"')  # base64 inside a notebook
NEIGHBOUR = "../" + "shared"


def project_files() -> list[Path]:
    """Files that are, or would be, under version control; all files of the tree when git is absent."""
    try:
        done = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT, capture_output=True, check=True,
        )  # fmt: skip
        paths = [ROOT / name for name in done.stdout.decode().split("\0") if name]
    except (OSError, subprocess.CalledProcessError):
        made = {".venv", "_build", "out", "__pycache__", ".git"}
        paths = [path for path in ROOT.rglob("*") if not made & set(path.relative_to(ROOT).parts)]
    return sorted(path for path in paths if path.is_file() and path.suffix not in BINARY)


def offences(pattern: re.Pattern[str]) -> list[str]:
    found = []
    for path in project_files():
        text = PICTURE.sub("", path.read_text(encoding="utf-8"))
        found += [f"{path.relative_to(ROOT)}: {match[0]!r}" for match in pattern.finditer(text)]
    return found


def test_the_search_finds_what_it_looks_for() -> None:
    assert MACHINE_PATH.search("open('/" + "home/ann/data')")
    assert MACHINE_PATH.search("see C:" + "\\Users\\ann")
    assert not MACHINE_PATH.search("docs/_build/x and https://example.org/home/x")
    assert LEFTOVER.search("# TO" + "DO: later")
    assert len(project_files()) > 20


def test_no_path_of_one_machine() -> None:
    assert offences(MACHINE_PATH) == []


def test_nothing_unfinished_is_left() -> None:
    assert offences(LEFTOVER) == []


def test_only_two_files_know_the_neighbouring_data_folder() -> None:
    telling = [path for path in project_files() if NEIGHBOUR in path.read_text(encoding="utf-8")]
    assert {str(path.relative_to(ROOT)) for path in telling} <= {".ci/run", "CONTRIBUTING.md"}


def test_the_make_targets_of_the_texts_exist() -> None:
    targets = set(re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for name in ("README.md", "CONTRIBUTING.md", "docs/index.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        code = re.findall(r"^ {4}[^\n]*$|`[^`\n]+`|^```.*?^```", text, re.MULTILINE | re.DOTALL)
        named = set(re.findall(r"\bmake ([a-z][\w-]*)", "\n".join(code)))
        assert named <= targets, f"{name} names make targets that do not exist: {named - targets}"
    assert {"reproduce", "test", "lint", "notebooks", "docs", "bench", "clean"} <= targets


def test_the_chapter_table_of_the_readme_is_the_packages() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d\d) \| ([^|]+) \| `([^`]+)` \| (\w+) \|$", text, re.MULTILINE)
    told = [(int(number), title.strip(), room, state) for number, title, room, state in rows]
    assert told == [(c.number, c.title, c.room, c.state) for c in CHAPTERS]


def test_the_pages_of_the_chapter_table_are_those_that_there_are() -> None:
    pages = sorted(path.stem for path in (ROOT / "docs" / "chapters").glob("[0-9][0-9]_*.md"))
    assert [c.page for c in CHAPTERS if c.page] == pages
    assert all(c.page.startswith(f"{c.number:02d}_") and c.has_code for c in CHAPTERS if c.page)
    assert [c.number for c in CHAPTERS] == list(range(1, 25))


def test_the_licences_and_the_version_agree() -> None:
    version = re.search(r'__version__ = "([^"]+)"', (ROOT / "vslam_ref" / "__init__.py").read_text())
    assert version is not None
    assert f"version: {version[1]}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## {version[1]}" in (ROOT / "CHANGELOG.md").read_text()


def test_the_wheel_holds_the_package_only(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="the build backend comes with the test extra")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names if ".dist-info/" not in name} == {"vslam_ref"}
    assert "vslam_ref/py.typed" in names
    assert any(name.endswith("licenses/LICENSE-TEXT") for name in names)
