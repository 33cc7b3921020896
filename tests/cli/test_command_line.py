"""The program as a whole: help, versions, exit statuses, no traceback for bad input."""

from __future__ import annotations

import argparse
import importlib.util
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import vslam_ref
from vslam_ref import cli
from vslam_ref.chapters import CHAPTERS
from vslam_ref.commands import bench
from vslam_ref.commands import list as list_command

TOYS = str(Path(__file__).resolve().parents[1] / "experiments")
PROGRAM = "import sys, toy_experiment; from vslam_ref.cli import main; sys.exit(main())"
posix = pytest.mark.skipif(os.name != "posix", reason="signals and pipes of POSIX")


def environment(**more: str) -> dict[str, str]:
    path = os.pathsep.join([TOYS, str(Path(vslam_ref.__file__).parents[1])])
    return {**os.environ, "PYTHONPATH": path, "TOY_REGISTER": "1", **more}


def one_line(capsys) -> str:
    """Return the error line; anything beside it on stderr, or a traceback, fails."""
    lines = capsys.readouterr().err.strip().split("\n")
    assert len(lines) == 1, lines
    assert lines[0].startswith("vslam-ref: error: ")
    return lines[0]


def test_the_module_runs_like_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "vslam_ref", "--version"], capture_output=True, text=True, env=environment()
    )
    assert (done.returncode, done.stdout) == (0, f"vslam-ref {vslam_ref.__version__}\n")


@pytest.mark.parametrize("command", cli.COMMANDS)
def test_every_command_has_help_with_an_example_and_writes_json(command, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main([command, "--help"])
    shown = capsys.readouterr().out
    assert end.value.code == 0
    assert "example" in shown
    assert f"vslam-ref {command}" in shown
    assert "--json FILE" in shown
    assert all(ord(letter) < 128 for letter in shown)


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit):
        cli.main(["--help"])
    shown = capsys.readouterr().out
    assert all(f"  {name} " in shown for name in cli.COMMANDS)


def test_help_imports_no_numbers():
    code = (
        "import sys\nfrom vslam_ref import cli\n"
        "try:\n    cli.main(['reproduce', '--help'])\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('numpy', 'scipy', 'matplotlib', 'numba', 'joblib') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment()
    )
    assert done.stdout.strip().endswith("\n[]")


@pytest.mark.parametrize("arguments", [[], ["reprodce"], ["list", "--jsn", "x"], ["reproduce", "--runs"]])
def test_a_command_line_that_cannot_be_read_is_told_in_one_line(arguments, capsys):
    assert cli.main(arguments) == 2
    assert "--help" in one_line(capsys)


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (ValueError("log.txt:7: two\nlines"), "log.txt:7: two lines"),
        (FileNotFoundError(2, "No such file or directory", "log.txt"), "No such file or directory: log.txt"),
        (OSError("odd"), "odd"),
        (ValueError(), "ValueError"),
    ],
)
def test_bad_input_found_anywhere_is_one_line_and_status_2(error, line, capsys, monkeypatch):
    def fail(options: argparse.Namespace) -> int:
        raise error

    monkeypatch.setattr(list_command, "run", fail)
    assert cli.main(["list"]) == 2
    assert one_line(capsys) == f"vslam-ref: error: {line}"


@pytest.mark.parametrize("error", [TypeError("a bug"), np.linalg.LinAlgError("singular")])
def test_errors_that_are_not_the_users_are_not_hidden(error, monkeypatch):
    def fail(options: argparse.Namespace) -> int:
        raise error

    monkeypatch.setattr(list_command, "run", fail)
    with pytest.raises(type(error)):
        cli.main(["list"])


def test_a_misspelt_backend_is_an_error_before_the_work():
    done = subprocess.run(
        [sys.executable, "-m", "vslam_ref", "list"],
        capture_output=True, text=True, env=environment(VSLAM_REF_BACKEND="nunba"),
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (2, "")
    assert "VSLAM_REF_BACKEND='nunba': must be one of auto, numpy, numba" in done.stderr


def test_a_folder_without_data_sets_is_named(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("VSLAM_REF_DATA", str(tmp_path))
    assert cli.main(["list"]) == 0
    assert capsys.readouterr().out.endswith(f"none; VSLAM_REF_DATA is {tmp_path}\n")


def test_debugging_shows_the_traceback_of_bad_input(monkeypatch):
    monkeypatch.setenv("VSLAM_REF_DEBUG", "1")
    with pytest.raises(ValueError, match="unknown data set"):
        cli.main(["data", "nothing"])


@posix
def test_a_reader_that_goes_away_ends_the_program_quietly():
    command = f"'{sys.executable}' -m vslam_ref data | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, env=environment())
    assert done.stderr == ""
    assert done.returncode in (0, 141)  # 0 where all of it fitted into the pipe


@posix
def test_a_closed_pipe_gives_status_141():
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as closed:
        done = subprocess.run(
            [sys.executable, "-m", "vslam_ref", "data"],
            stdout=closed,
            stderr=subprocess.PIPE,
            env=environment(),
        )
    assert (done.returncode, done.stderr) == (141, b"")


@posix
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_ends_with_status_130_one_line_and_no_half_result(tmp_path, jobs):
    command = [
        sys.executable,
        "-c",
        PROGRAM,
        "reproduce",
        "toy",
        "--out",
        str(tmp_path / "out"),
        "--jobs",
        jobs,
    ]
    started = tmp_path / "started"
    program = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # a background job of a shell starts with SIGINT ignored, and hands that down
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        env=environment(TOY_HANG=str(started)),
    )
    deadline = time.monotonic() + 60
    while not started.exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(program.pid, signal.SIGINT)  # what a terminal does: the whole group hears it
    _, errors = program.communicate(timeout=60)
    assert program.returncode == 130
    lines = [line for line in errors.strip().split("\n") if line and not line.startswith("[1/1] toy")]
    assert lines == ["vslam-ref: interrupted; no file is half-written"]
    assert list((tmp_path / "out").iterdir()) == []


MODULES = [*(c.module for c in CHAPTERS if c.has_code), *(row[2] for row in list_command.FILTERS)]


@pytest.mark.parametrize("module", MODULES)
def test_every_module_that_is_listed_is_there(module):
    assert importlib.util.find_spec(module) is not None


@pytest.mark.parametrize("module", bench.SUITES.values())
def test_every_suite_that_is_offered_is_there(module):
    assert importlib.util.find_spec(module) is not None
