"""Every ``vslam-ref`` line of the README runs as it is shown: no data set, an empty home, one folder."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import vslam_ref
from vslam_ref import cli

pytestmark = pytest.mark.skipif(os.name != "posix", reason="runs lines in a POSIX shell")

ROOT = Path(__file__).resolve().parents[2]
FIRST = "vslam-ref sample all --out samples"
SLOW = ("vslam-ref reproduce ", "vslam-ref bench")
"""Beginnings of lines that take more than 20 s; ``.ci/run`` runs them, too."""
MAKES = {
    "run iekf-slam": "out/robot/report.html",
    "run ptam": "out/desk/report.html",
    "run orbslam": "out/orb/report.html",
    "ba": "scene.ply",
    "posegraph": "rounds.svg",
    "calibrate": "camera.yaml",
    "grid": "out/office/report.html",
    "reproduce": "out/index.html",
}
"""Beginning of a line -> what the line leaves."""


def readme_lines() -> list[str]:
    """Lines of the README's code blocks that begin with the program, without their comments."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.findall(r"^ {4}(?:\.venv/bin/)?(vslam-ref [^\n]+)$", text, re.MULTILINE)
    return [line.partition("  #")[0].strip() for line in found]


LINES = readme_lines()
CASES = [pytest.param(x, marks=pytest.mark.slow if x.startswith(SLOW) else ()) for x in LINES]


class Shell:
    """A shell in an empty folder, whose programs ``vslam-ref`` and ``python`` are those of this test."""

    def __init__(self, folder: Path) -> None:
        self.folder, home, programs = folder / "work", folder / "home", folder / "bin"
        self.said: dict[str, str] = {}
        for one in (self.folder, home, programs):
            one.mkdir()
        for name, more in (("python", ""), ("vslam-ref", " -m vslam_ref")):
            (programs / name).write_text(f'#!/bin/sh\nexec "{sys.executable}"{more} "$@"\n')
            (programs / name).chmod(0o755)
        left_out = {"VSLAM_REF_DATA", "VSLAM_REF_QUICK"}
        self.environment = {key: value for key, value in os.environ.items() if key not in left_out} | {
            "HOME": str(home),
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": str(Path(vslam_ref.__file__).parents[1]),
        }

    def run(self, line: str) -> str:
        """Run a line, once; its output, which fails the test together with its status if that is not 0."""
        if line in self.said:
            return self.said[line]
        done = subprocess.run(
            line, shell=True, cwd=self.folder, env=self.environment, capture_output=True, text=True
        )
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        self.said[line] = done.stdout
        return done.stdout


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> Shell:
    """A shell in which the samples have been made."""
    shell = Shell(tmp_path_factory.mktemp("readme"))
    assert "adapter" in shell.run(FIRST)
    return shell


def test_the_readme_begins_with_the_samples_and_shows_every_kind_of_work() -> None:
    shown = [line.split()[1] for line in LINES]
    assert FIRST in LINES
    needs = [k for k, line in enumerate(LINES) if "samples/" in line]
    assert LINES.index(FIRST) < min(needs)
    assert {"list", "reproduce", "run", "ba", "calibrate", "evaluate", "grid", "verify", "bench"} <= set(
        shown
    )


@pytest.mark.parametrize("line", CASES)
def test_a_line_runs_as_shown(shell: Shell, line: str) -> None:
    """``bench`` with ``--quick``: the whole takes minutes."""
    said = shell.run(f"{line} --quick" if line == "vslam-ref bench" else line)
    assert said
    made = next((left for begins, left in MAKES.items() if line.startswith(f"vslam-ref {begins} ")), None)
    assert made is None or (shell.folder / made).stat().st_size > 0


def test_the_lines_in_the_samples_run_as_shown(shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process; those that show a mistake end with 1, and say so in their README.txt."""
    monkeypatch.chdir(shell.folder)
    monkeypatch.setenv("PATH", shell.environment["PATH"])
    monkeypatch.delenv("VSLAM_REF_DATA", raising=False)
    texts = sorted((shell.folder / "samples").glob("*/README.txt"))
    said = "\n".join(path.read_text() for path in texts)
    lines = [line.strip() for line in said.splitlines()]
    lines = [line for line in lines if line.startswith("vslam-ref ") and line not in LINES]
    assert len(lines) >= 7
    for line in lines:
        again = line.replace("--out out/office", "--out out/office2").replace("--out adjusted", "--out adj")
        assert cli.main(shlex.split(again)[1:]) == ("--wrong" in line), again
