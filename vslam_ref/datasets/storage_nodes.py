"""Files of OpenCV's FileStorage as trees of nodes: YAML, XML or JSON, plain or packed by gzip.

Which of them a file is, its content says, not its name::

    1f 8b           gzip, with one of the others inside
    <               XML: <opencv_storage> with an element for each entry
    { or [          JSON
    anything else   YAML; OpenCV reads 'key:value' without a blank, so its files may have such lines

All four become the nodes of :mod:`.yaml_nodes`.  Nothing is constructed or executed, XML may declare no
entities, and what is unpacked is bounded.
"""

from __future__ import annotations

import re
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from vslam_ref.datasets.text import FormatError, decoded, read_bytes
from vslam_ref.datasets.yaml_nodes import MAX_BYTES, Node, parse_yaml, plain_text

GZIP = b"\x1f\x8b"
DEEPEST = 32
"""Elements inside of each other; OpenCV's own files have five."""
ROOT = "opencv_storage"
GLUED_KEY = re.compile(r"^([ \t]*[A-Za-z_][\w.]*):(?=[^\s:/])", re.MULTILINE)


def read_storage(path: Path) -> Node:
    """Parse a file; its one document is the top of the tree.

    Raises
    ------
    FormatError
        Where it cannot be read: no file, not text, too long, nested too deeply, or against the grammar.
    """
    return parse_storage(path, storage_bytes(path))


def storage_bytes(path: Path) -> bytes:
    """Bytes of a file, unpacked where it is packed, whatever its name.

    Raises
    ------
    FormatError
        On a missing file, a damaged archive, or more than ``MAX_BYTES``.
    """
    data = read_bytes(path, MAX_BYTES)
    if not data.startswith(GZIP):
        return data
    unpack = zlib.decompressobj(31)
    try:
        data = unpack.decompress(data, MAX_BYTES + 1)
    except zlib.error as error:
        raise FormatError(path, None, f"damaged gzip file ({error}); fetch it again") from None
    if len(data) > MAX_BYTES:
        raise FormatError(path, None, f"more than {MAX_BYTES} bytes unpacked; is this the right file?")
    if not unpack.eof:
        raise FormatError(path, None, "damaged gzip file (its end is missing); fetch it again")
    return data


def parse_storage(path: Path, data: bytes) -> Node:
    """Parse a file's bytes, as :func:`read_storage`."""
    start = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1]
    if start == b"<":
        return _xml(path, data)
    if start in (b"{", b"["):
        # between JSON's words a tab is a blank, and YAML's grammar, which knows the rest, has none
        return parse_yaml(path, decoded(path, data).replace("\t", " "))
    text = plain_text(path, data)
    return parse_yaml(path, GLUED_KEY.sub(r"\1: ", text) if data.lstrip().startswith(b"%YAML") else text)


@dataclass
class Element:
    """An element while its content is being read: where it begins, its children, and its words."""

    name: str
    line: int
    binary: bool
    children: list[tuple[str, int, Any]]
    words: str = ""


def _xml(path: Path, data: bytes) -> Node:
    """The tree of an XML file."""
    from xml.parsers import expat

    parser = expat.ParserCreate()
    open_ones = [Element("", 1, False, [])]

    def begin(name: str, attributes: dict[str, str]) -> None:
        if len(open_ones) > DEEPEST:
            raise FormatError(path, parser.CurrentLineNumber, "nested too deeply; is this the right file?")
        binary = attributes.get("type_id") == "binary"
        open_ones.append(Element(name, parser.CurrentLineNumber, binary, []))

    def end(name: str) -> None:
        done = open_ones.pop()
        open_ones[-1].children.append((name, done.line, _content(done)))

    def said(text: str) -> None:
        open_ones[-1].words += text

    def refuse(*_: Any) -> None:
        what = "declares a document type; expected plain elements, as OpenCV writes them"
        raise FormatError(path, parser.CurrentLineNumber, what)

    parser.StartElementHandler, parser.EndElementHandler = begin, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = said, refuse
    parser.buffer_text = True
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        what = f"{expat.ErrorString(error.code)}; expected XML"
        raise FormatError(path, error.lineno, what) from None
    except FormatError:
        raise
    except (ValueError, LookupError) as error:  # an encoding that Python does not know
        raise FormatError(path, None, f"{error}; expected XML in UTF-8") from None
    name, line, raw = open_ones[0].children[0]
    if name != ROOT:
        raise FormatError(path, line, f"<{name}>; expected <{ROOT}>, as OpenCV writes it")
    if raw.id != "mapping":
        raise FormatError(path, line, f"<{ROOT}> holds no entries")
    return Node(path, "the file", raw)


def _content(done: Element) -> Any:
    """A node like the YAML parser's: entries, a list (elements called ``_``, or several words), or a word."""
    if done.children:
        if all(name == "_" for name, _, _ in done.children):
            return _raw("sequence", [value for _, _, value in done.children], done.line)
        entries = [(_raw("scalar", name, line), value) for name, line, value in done.children]
        return _raw("mapping", entries, done.line)
    if done.binary:
        return _raw("scalar", done.words, done.line)
    words: list[Any] = []
    for match in re.finditer(r'"((?:[^"\\]|\\.)*)"|\S+', done.words):
        word = match[0] if match[1] is None else re.sub(r"\\(.)", r"\1", match[1])
        line = done.line + done.words.count("\n", 0, match.start()) if len(words) < 64 else done.line
        words.append(_raw("scalar", word, line))
    if len(words) == 1 and done.name != "data":
        return words[0]
    return _raw("sequence", words, done.line)


def _raw(kind: str, value: Any, line: int) -> SimpleNamespace:
    """What :class:`Node` asks of the YAML parser's nodes."""
    return SimpleNamespace(id=kind, value=value, start_mark=SimpleNamespace(line=line - 1))
