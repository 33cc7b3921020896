"""Damaged files: every reader answers with a valid record or with one line; none is left out."""

from __future__ import annotations

import contextlib
import importlib
import inspect
import pkgutil
import time
from pathlib import Path
from typing import Any

import damaging
import fuzz_readers
import numpy as np
import pytest
from fuzz_readers import damage, fuzz, judge, message_wrong, scratch
from reader_samples import BLOCKS, SAMPLES, Sample, reader
from sequence_samples import put

import vslam_ref.datasets
from vslam_ref.datasets.text import FormatError

COUNT = 200
"""Files a reader here; ``make fuzz`` takes 10,000."""


def readers_of_the_package() -> set[str]:
    """Public functions called ``read…`` or ``detect`` that are given a file or a folder."""
    found = set()
    for info in pkgutil.walk_packages(vslam_ref.datasets.__path__, "vslam_ref.datasets."):
        module = importlib.import_module(info.name)
        for name, value in vars(module).items():
            if not inspect.isfunction(value) or value.__module__ != info.name:
                continue
            first = next(iter(inspect.signature(value).parameters), "")
            if (name == "detect" or name.split("_")[0] == "read") and first in ("path", "folder"):
                found.add(f"{info.name.removeprefix('vslam_ref.datasets.')}:{name}")
    return found


def test_every_reader_has_a_sample() -> None:
    found = readers_of_the_package()
    missing = sorted(found - set(SAMPLES) - set(BLOCKS))
    assert not missing, f"add rows to tests/datasets/reader_samples.py: {missing}"
    gone = sorted((set(SAMPLES) | set(BLOCKS)) - found)
    assert not gone, f"no longer there: {gone}"


@pytest.mark.parametrize("name", SAMPLES)
def test_the_sample_itself_is_read(name: str, tmp_path: Path) -> None:
    for k, sample in enumerate(SAMPLES[name]):
        folder = tmp_path / str(k)
        folder.mkdir()
        put(folder, sample.files)
        assert judge(name, sample, folder) == ("record", "")


@pytest.mark.parametrize("name", SAMPLES)
def test_damaged_files_give_a_record_or_one_line(name: str) -> None:
    with scratch() as root:
        tally = fuzz(name, range(COUNT), 0, root)
    assert tally.defects == []
    assert tally.records + tally.refused == COUNT
    if not name.endswith(("detect", "read_grey", "read_channels", "read_picture", "read_folder")):
        assert tally.refused > COUNT / 5  # the damage is real (the last one opens no picture)
    if not name.endswith("read_bal"):
        assert tally.records > 0  # and not always deadly


YAML = ("euroc", "kalibr", "opencv_storage", "orbslam", "camera_info", "storage_nodes", "cameras")
"""Readers that parse YAML, among others."""


def swollen(data: bytes, size: int) -> list[bytes]:
    """A file of about ``size`` bytes in which one thing comes again and again."""
    lines = data.split(b"\n")
    k = len(lines) // 2
    words = (lines[k] + b"\n", b"x", b"1", b" ", b"\n", b"0 ", b"1\n", b"[", b"- ", b"a: b\n")
    blobs = [word * (size // len(word)) for word in words]
    inside = [b"\n".join([*lines[:k], blob, *lines[k:]]) for blob in blobs]
    word = b"x" * (size // 4)
    glued = [b"\n".join([*lines[:j], word + line, *lines[j + 1 :]]) for j, line in enumerate(lines)]
    return [data * (size // len(data)), *inside, *(data + blob for blob in blobs), *glued]


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in SAMPLES if not all(s.binary for s in SAMPLES[n])])
def test_a_large_file_takes_time_in_proportion(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that takes the square of a size takes minutes for a megabyte; all is 1 second at most here.

    YAML's parser takes some 5 microseconds a byte, so these readers get less to read.
    """
    monkeypatch.setattr(fuzz_readers, "LIMIT", 60.0)
    monkeypatch.setattr(fuzz_readers, "PROCESSOR", 5.0)
    size = 2**17 if name.split(":")[0].endswith(YAML) else 2**19
    for sample in SAMPLES[name]:
        with scratch() as root:
            put(root, sample.files)
            for file in [] if sample.binary else sample.files:
                for data in swollen(sample.files[file], size):
                    (root / file).write_bytes(data)
                    assert judge(name, sample, root)[0] != "defect", (file, data[:100])
                (root / file).write_bytes(sample.files[file])


# --- the judge itself: it must see every kind of defect ---------------------------------------------


def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: Any, check: Any = None) -> tuple[str, str]:
    (tmp_path / "a.txt").write_text("1 2 3\n")
    monkeypatch.setattr(fuzz_readers, "reader", lambda name: read)
    return judge("toy", Sample({"a.txt": b"1 2 3\n"}, check=check), tmp_path)


def raising(error: BaseException) -> Any:
    def read(path: Path) -> None:
        raise error

    return read


def test_other_exceptions_are_defects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for error in (
        IndexError("out"),
        ValueError("x"),
        RecursionError("deep"),
        MemoryError(),
        OverflowError("o"),
    ):
        verdict, told = toy(tmp_path, monkeypatch, raising(error))
        assert verdict == "defect"
        assert told.startswith(type(error).__name__)


class RawError(FormatError):
    """An error whose message nobody made readable."""

    def __init__(self, message: str) -> None:
        ValueError.__init__(self, message)


def test_bad_messages_are_defects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.txt"
    for what, words in (
        ("two\nlines", "line ends"),
        ("bell \x07", "control characters"),
        ("x" * 2000, "message of 20"),
    ):
        verdict, told = toy(tmp_path, monkeypatch, raising(RawError(f"{path}:1: {what}")))
        assert verdict == "defect"
        assert words in told
    assert toy(tmp_path, monkeypatch, raising(FormatError(Path("b"), 1, "wrong")))[0] == "defect"
    assert toy(tmp_path, monkeypatch, raising(FormatError(path, 1, "fine"))) == ("refused", "")
    assert message_wrong(f"{path}: fine", tmp_path) == ""


def test_numbers_that_are_not_finite_are_defects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = {"deep": [(1.0, np.array([0.0, np.nan]))]}
    verdict, told = toy(tmp_path, monkeypatch, lambda path: bad)
    assert (verdict, told) == ("defect", "record.deep.0.1 has numbers that are not finite")
    assert toy(tmp_path, monkeypatch, lambda path: {"deep": [(1.0, np.array([0, 1]))]}) == ("record", "")
    assert toy(tmp_path, monkeypatch, lambda path: 1.0, lambda record: "wrong")[0] == "defect"


def test_warnings_are_defects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    verdict, told = toy(tmp_path, monkeypatch, lambda path: float(np.log(np.array([0.0]))[0] * 0 == 0))
    assert verdict == "defect"
    assert "divide by zero" in told


def test_a_reader_that_hangs_is_a_defect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def hang(path: Path) -> None:
        while True:
            with contextlib.suppress(Exception):  # as a careless reader might
                time.sleep(0.01)

    monkeypatch.setattr(fuzz_readers, "LIMIT", 0.1)
    assert toy(tmp_path, monkeypatch, hang) == ("defect", "took more than 0.1 s")


def test_a_reader_that_computes_too_long_is_a_defect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def slow(path: Path) -> None:
        begin = time.process_time()
        while time.process_time() < begin + 0.05:
            pass

    monkeypatch.setattr(fuzz_readers, "PROCESSOR", 0.02)
    verdict, told = toy(tmp_path, monkeypatch, slow)
    assert verdict == "defect"
    assert told.endswith("s of the processor")


# --- the mutations -----------------------------------------------------------------------------------


def test_a_file_is_made_from_its_number_alone() -> None:
    name = "trajectories.reading:read_tum"
    assert damage(name, 17, 0)[2] == damage(name, 17, 0)[2]
    files = {damage(name, k, seed)[2] for k in range(50) for seed in (0, 1)}
    assert len(files) > 90


def test_every_step_works_on_every_file() -> None:
    rng = np.random.default_rng(0)
    for step in damaging.STEPS.values():
        for data in (b"", b"\n", b"x", b"1 2 3\n4 5 6\n", bytes(range(256))):
            for _ in range(20):
                assert isinstance(step(data, rng), bytes)
        changed = [step(b"1 2 -3\n4 5 6\n7 8 9\n", rng) != b"1 2 -3\n4 5 6\n7 8 9\n" for _ in range(100)]
        assert sum(changed) > 40, step.__name__


def test_a_reader_is_found_by_its_name() -> None:
    assert reader("nist:read_problem").__module__ == "vslam_ref.datasets.nist"
