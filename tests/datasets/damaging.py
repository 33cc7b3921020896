"""Damaging files, reproducibly: bytes, words and lines deleted, doubled, exchanged, replaced by nasty ones.

``mutate(data, rng)`` answers with the damaged bytes and the names of what was done to them.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

_NUMBERS_AS_TEXT = """
nan NaN -nan inf -inf Infinity 1e308 -1e308 1e999 1e-320 1e16 0 -0 -1 1 2 3 0.5 255 256 1_000 0x10 1e 1e+ --1
2147483647 2147483648 -2147483649 4294967295 9223372036854775807 9223372036854775808 18446744073709551615
+ - . 1.2.3 1,5 +5 007 1d5 2001-01-01
"""
_SIGNS = """
# // % ; , ,, : [ ] [[ { } {} [] *a | > true null ~ = .. ../../x %s \\ '' "" !!binary
"""
WORDS = (
    *_NUMBERS_AS_TEXT.split(),
    *_SIGNS.split(),
    *("1" * 40, "9" * 400, "1" * 20000, "a b", "# x", "&a 1", "<<: *a", "- 1", "? ", "\t", "\r", "\n\n"),
    *("٣", "½", "é", "\u2028", "\u200b7", "\ufeff1", "漢字", "\x0c", "\x0b", "\x1b[31m", "\x00", "\x7f"),
    *("!!python/object/apply:os.getpid []", "b1 =", "(lines 1 to 999999)", "(lines 9 to 1)"),
)
"""What takes the place of a word: each once broke some reader."""

NUMBERS = tuple(
    [struct.pack(f"{order}f", v) for order in "<>" for v in (np.nan, np.inf, -np.inf, 1e30, -1.0, 0.0, 1e-40)]
    + [struct.pack(f"{order}i", v) for order in "<>" for v in (-1, 0, 1, 2**31 - 1, -(2**31), 2**24, 65536)]
)
"""Four bytes each, for binary files."""

TOKEN = re.compile(rb"[^\s,\[\]{}:=()]+")


class Mutated(NamedTuple):
    data: bytes
    steps: tuple[str, ...]


def mutate(data: bytes, rng: np.random.Generator, *, binary: bool = False) -> Mutated:
    """Damage a file by one to four steps.

    Parameters
    ----------
    data : bytes
        The whole file.
    rng : Generator
    binary : bool
        For files that are no text: words of four bytes are replaced instead of words of text.
    """
    names = list(BYTES) + list(BINARY) * 4 if binary else list(BYTES) + list(TOKENS) * 2 + list(LINES)
    steps: list[str] = []
    for _ in range(min(4, int(rng.geometric(0.6)))):
        name = names[rng.integers(len(names))]
        data = STEPS[name](data, rng)
        steps.append(name)
    return Mutated(data, tuple(steps))


def _at(data: bytes, rng: np.random.Generator) -> int:
    return int(rng.integers(len(data) + 1))


def _span(data: bytes, rng: np.random.Generator) -> tuple[int, int]:
    """A part of the file, mostly short."""
    start = _at(data, rng)
    return start, min(len(data), start + int(min(1e6, rng.pareto(0.7) * 4)) + 1)


def _noise(rng: np.random.Generator, count: int) -> bytes:
    return rng.integers(0, 256, count, dtype=np.uint8).tobytes()


# --- bytes -----------------------------------------------------------------------------------------


def flip_bit(data: bytes, rng: np.random.Generator) -> bytes:
    if not data:
        return data
    out, at = bytearray(data), int(rng.integers(len(data)))
    out[at] ^= 1 << int(rng.integers(8))
    return bytes(out)


def replace_byte(data: bytes, rng: np.random.Generator) -> bytes:
    start = _at(data, rng)
    return data[:start] + _noise(rng, 1) + data[start + 1 :]


def insert_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    start = _at(data, rng)
    return data[:start] + _noise(rng, int(rng.integers(1, 20))) + data[start:]


def insert_nuls(data: bytes, rng: np.random.Generator) -> bytes:
    start = _at(data, rng)
    return data[:start] + bytes(int(rng.integers(1, 9))) + data[start:]


def delete_span(data: bytes, rng: np.random.Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:start] + data[stop:]


def double_span(data: bytes, rng: np.random.Generator) -> bytes:
    start, stop = _span(data, rng)
    return data[:stop] + data[start:stop] + data[stop:]


def move_span(data: bytes, rng: np.random.Generator) -> bytes:
    start, stop = _span(data, rng)
    rest = data[:start] + data[stop:]
    at = _at(rest, rng)
    return rest[:at] + data[start:stop] + rest[at:]


def truncate(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: _at(data, rng)]


def behead(data: bytes, rng: np.random.Generator) -> bytes:
    return data[_at(data, rng) :]


def append(data: bytes, rng: np.random.Generator) -> bytes:
    tails = (data, b"\n", b"\0", b"1\n", b"x", _noise(rng, 8), b"\n" * 1000, b" 0" * 500)
    return data + tails[rng.integers(len(tails))]


def empty(data: bytes, rng: np.random.Generator) -> bytes:
    return (b"", b"\n", b" ", b"\0", b"#", b"\xef\xbb\xbf")[rng.integers(6)]


# --- words -----------------------------------------------------------------------------------------


def _tokens(data: bytes) -> list[tuple[int, int]]:
    return [match.span() for match in TOKEN.finditer(data)]


def _nasty(rng: np.random.Generator) -> bytes:
    return WORDS[rng.integers(len(WORDS))].encode()


def _on_token(data: bytes, rng: np.random.Generator, new: Callable[[bytes], bytes]) -> bytes:
    tokens = _tokens(data)
    if not tokens:
        return data
    start, stop = tokens[rng.integers(len(tokens))]
    return data[:start] + new(data[start:stop]) + data[stop:]


def replace_token(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_token(data, rng, lambda _: _nasty(rng))


def insert_token(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_token(data, rng, lambda word: word + b" " + _nasty(rng))


def delete_token(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_token(data, rng, lambda _: b"")


def double_token(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_token(data, rng, lambda word: word + b" " + word)


def glue_token(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_token(data, rng, lambda word: word + _nasty(rng))


def negate_token(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_token(data, rng, lambda word: word[1:] if word.startswith(b"-") else b"-" + word)


def scale_token(data: bytes, rng: np.random.Generator) -> bytes:
    tail = (b"e9", b"e300", b"e-300", b"0", b".5", b"000000000")[rng.integers(6)]
    return _on_token(data, rng, lambda word: word + tail)


def copy_token(data: bytes, rng: np.random.Generator) -> bytes:
    tokens = _tokens(data)
    if not tokens:
        return data
    start, stop = tokens[rng.integers(len(tokens))]
    return _on_token(data, rng, lambda _: data[start:stop])


def change_separator(data: bytes, rng: np.random.Generator) -> bytes:
    places = [match.start() for match in re.finditer(rb"[ ,\n]", data)]
    if not places:
        return data
    at = places[rng.integers(len(places))]
    return data[:at] + (b"\t", b",", b";", b"  ", b"\n", b"", b"\r", b" ")[rng.integers(8)] + data[at + 1 :]


# --- lines -----------------------------------------------------------------------------------------


def _on_lines(data: bytes, change: Callable[[list[bytes]], list[bytes]]) -> bytes:
    return b"\n".join(change(data.split(b"\n")))


def delete_line(data: bytes, rng: np.random.Generator) -> bytes:
    k = int(rng.integers(data.count(b"\n") + 1))
    return _on_lines(data, lambda lines: lines[:k] + lines[k + 1 :])


def double_line(data: bytes, rng: np.random.Generator) -> bytes:
    k = int(rng.integers(data.count(b"\n") + 1))
    return _on_lines(data, lambda lines: [*lines[: k + 1], *lines[k:]])


def copy_line(data: bytes, rng: np.random.Generator) -> bytes:
    k, j = rng.integers(data.count(b"\n") + 1, size=2)
    return _on_lines(data, lambda lines: [*lines[:k], lines[j], *lines[k:]])


def swap_lines(data: bytes, rng: np.random.Generator) -> bytes:
    k, j = rng.integers(data.count(b"\n") + 1, size=2)

    def change(lines: list[bytes]) -> list[bytes]:
        lines[k], lines[j] = lines[j], lines[k]
        return lines

    return _on_lines(data, change)


def join_lines(data: bytes, rng: np.random.Generator) -> bytes:
    k = int(rng.integers(data.count(b"\n") + 1))
    return _on_lines(data, lambda lines: [*lines[:k], b" ".join(lines[k : k + 2]), *lines[k + 2 :]])


def insert_line(data: bytes, rng: np.random.Generator) -> bytes:
    k = int(rng.integers(data.count(b"\n") + 1))
    new = (b"", b"# a comment", b"   \t", b"0 " * 5000, b"x" * 10000, _nasty(rng), b"1 2 3")[rng.integers(7)]
    return _on_lines(data, lambda lines: [*lines[:k], new, *lines[k:]])


def indent_line(data: bytes, rng: np.random.Generator) -> bytes:
    k = int(rng.integers(data.count(b"\n") + 1))
    blank = (b" ", b"\t", b"  ", b" " * 60)[rng.integers(4)]
    return _on_lines(data, lambda lines: [*lines[:k], blank + lines[k], *lines[k + 1 :]])


def change_line_ends(data: bytes, rng: np.random.Generator) -> bytes:
    return data.replace(b"\n", (b"\r\n", b"\r", b"\n\n", b" \n", b"\x85\n", b"\n\r")[rng.integers(6)])


def change_encoding(data: bytes, rng: np.random.Generator) -> bytes:
    text = data.decode("latin-1")
    return (b"\xef\xbb\xbf" + data, text.encode("utf-16"), text.encode("utf-8-sig"))[rng.integers(3)]


def reverse_lines(data: bytes, rng: np.random.Generator) -> bytes:
    return _on_lines(data, lambda lines: lines[::-1])


# --- binary ----------------------------------------------------------------------------------------


def replace_number(data: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(max(1, len(data) - 3)))
    return data[:at] + NUMBERS[rng.integers(len(NUMBERS))] + data[at + 4 :]


def replace_aligned_number(data: bytes, rng: np.random.Generator) -> bytes:
    start = int(rng.integers(2)) * 2
    at = start + 4 * int(rng.integers(max(1, (len(data) - start) // 4)))
    return data[:at] + NUMBERS[rng.integers(len(NUMBERS))] + data[at + 4 :]


def swap_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    at = 4 * int(rng.integers(max(1, len(data) // 4)))
    return data[:at] + data[at : at + 4][::-1] + data[at + 4 :]


Step = Callable[[bytes, np.random.Generator], bytes]
BYTES: dict[str, Step] = {
    step.__name__: step
    for step in (
        *(flip_bit, replace_byte, insert_bytes, insert_nuls, delete_span, double_span, move_span, truncate),
        *(behead, append, empty),
    )
}
TOKENS: dict[str, Step] = {
    step.__name__: step
    for step in (
        *(replace_token, insert_token, delete_token, double_token, glue_token, negate_token, scale_token),
        *(copy_token, change_separator),
    )
}
LINES: dict[str, Step] = {
    step.__name__: step
    for step in (
        *(delete_line, double_line, copy_line, swap_lines, join_lines, insert_line, indent_line),
        *(change_line_ends, change_encoding, reverse_lines),
    )
}
BINARY: dict[str, Step] = {
    step.__name__: step for step in (replace_number, replace_aligned_number, swap_bytes)
}
STEPS: dict[str, Step] = BYTES | TOKENS | LINES | BINARY
