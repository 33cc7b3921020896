"""Tables of numbers: what is read, and what a damaged file is told."""

from __future__ import annotations

import bz2
import gzip
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from vslam_ref.datasets import text

NAMES = ("time", "range")


def table(tmp_path: Path, content: bytes | str, name: str = "t.dat") -> Path:
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def test_plain_and_gzipped_text_give_the_same_numbers_and_line_numbers(tmp_path: Path) -> None:
    content = "# head\n\n1 2.5\r\n\t3   -4e-1 \n"
    plain = text.read_columns(table(tmp_path, content), NAMES)
    packed = text.read_columns(table(tmp_path, gzip.compress(content.encode()), "t.dat.gz"), NAMES)
    assert plain.values.tolist() == packed.values.tolist() == [[1.0, 2.5], [3.0, -0.4]]
    assert plain.lines.tolist() == [3, 4]


@pytest.mark.parametrize(
    ("content", "line", "words"),
    [
        ("1 2\n3\n", 2, "1 columns; expected 2: time, range"),
        ("1 2 3\n", 1, "3 columns; expected 2"),
        ("1 2\n\n# x\n3 abc\n", 4, "range is 'abc'; expected a number"),
        ("1 nan\n", 1, "range is 'nan'; expected a finite number"),
        ("inf 1\n", 1, "time is 'inf'; expected a finite number"),
        ("", None, "no data"),
        ("# only a comment\n", None, "no data"),
        (b"1 2\n3 \xff\n", 2, "not a text file"),
    ],
)
def test_a_damaged_table_is_refused_with_its_line(
    tmp_path: Path, content: bytes | str, line: int | None, words: str
) -> None:
    path = table(tmp_path, content)
    with pytest.raises(text.FormatError) as caught:
        text.read_columns(path, NAMES)
    message = str(caught.value)
    assert message.startswith(f"{path}:{line}: " if line else f"{path}: ")
    assert words in message
    assert "\n" not in message


def test_a_small_archive_that_unpacks_to_much_is_refused(tmp_path: Path) -> None:
    path = table(tmp_path, gzip.compress(b"0 0\n" * 5000), "bomb.dat.gz")
    with pytest.raises(text.FormatError, match="more than 1000 bytes unpacked"):
        list(text.read_lines(path, max_bytes=1000))


@pytest.mark.parametrize("damage", [lambda b: b[:-9], lambda b: b"no gzip", lambda b: b[:12] + b"\0" * 30])
def test_a_broken_archive_is_refused(tmp_path: Path, damage: object) -> None:
    whole = gzip.compress(b"1 2\n" * 500)
    path = table(tmp_path, damage(whole), "t.dat.gz")  # type: ignore[operator]
    with pytest.raises(text.FormatError, match="damaged gzip file"):
        list(text.read_lines(path))


def test_a_message_is_one_line_that_a_person_reads_whatever_the_file_holds() -> None:
    path = Path("a.txt")
    raw = f"word is 'a\nb\x00\x1b[31m\u2028', {'x' * 20000}; expected a number"
    told = f"a.txt:3: word is 'a\\nb\\x00\\x1b[31m\\u2028', {'x' * 40}…xxxx; expected a number"
    assert str(text.FormatError(path, 3, raw)) == told
    many = str(text.FormatError(path, None, "1 " * 1000 + "; expected fewer"))
    assert len(many) < 420
    assert many.startswith("a.txt: 1 1 1")
    assert many.endswith("1 ; expected fewer")
    assert str(text.FormatError(Path("a\nb"), None, "é fine")) == "a\\nb: é fine"


@pytest.mark.parametrize("word", ["1_000", "١٢", "", "0x10", "1e", "½"])
def test_what_only_python_takes_for_a_number_is_none(word: str) -> None:
    with pytest.raises(text.FormatError, match="expected a number"):
        text.number(Path("a"), 1, word, "x")


def test_bzip2_is_unpacked_too(tmp_path: Path) -> None:
    path = table(tmp_path, bz2.compress(b"1 2\n3 4\n"), "t.dat.bz2")
    assert text.read_columns(path, NAMES).values.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    bomb = table(tmp_path, 500 * bz2.compress(b"0 0\n" * 2**18), "bomb.bz2")
    tracemalloc.start()
    try:
        with pytest.raises(text.FormatError, match="more than 1000000 bytes unpacked"):
            text.read_bytes(bomb, max_bytes=1_000_000)
        assert tracemalloc.get_traced_memory()[1] < 2**23
    finally:
        tracemalloc.stop()


def test_an_integer_that_no_double_holds_is_refused(tmp_path: Path) -> None:
    rows = text.read_columns(table(tmp_path, "1 0\n1e16 0\n"), NAMES)
    with pytest.raises(text.FormatError, match=r":2: time is 1e\+16; expected an integer below 9e15"):
        text.require_integers(rows, 0, "time")


def test_times_that_go_back_are_refused_at_their_line(tmp_path: Path) -> None:
    rows = text.read_columns(table(tmp_path, "1 0\n2 0\n# c\n2 0\n1.5 0\n"), NAMES)
    with pytest.raises(text.FormatError, match=r"t\.dat:5: time 1\.500 s after 2\.000 s"):
        text.require_order(rows, 0)
    with pytest.raises(text.FormatError, match=r"t\.dat:4: "):
        text.require_order(rows, 0, strict=True)


def test_a_fraction_is_no_identity(tmp_path: Path) -> None:
    rows = text.read_columns(table(tmp_path, "1 0\n2 1.5\n"), NAMES)
    assert text.require_integers(rows, 0, "id").dtype == np.int64
    with pytest.raises(text.FormatError, match=r":2: id is 1\.5; expected an integer"):
        text.require_integers(rows, 1, "id")


def test_a_file_may_be_plain_or_packed_but_must_be_there(tmp_path: Path) -> None:
    packed = table(tmp_path, b"", "a.dat.gz")
    assert text.existing(tmp_path, "a.dat") == packed
    with pytest.raises(text.FormatError, match=r"b\.dat: no such file, plain or with \.gz"):
        text.existing(tmp_path, "b.dat")
